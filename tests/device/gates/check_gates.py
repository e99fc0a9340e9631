#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Check nvcc's PTX, and what ptxas makes of it, against the limits of each kernel.

For every kernel: no spills and no stack frame (local memory) unless the limits grant so many bytes, at most so many
registers, at least so many fused multiply-adds, no approximate or flushing instruction, no sum or product that ptxas
may fuse, and in kernels whose name ends in _f32 no f64 (`"f64": "loads"` permits loading and converting doubles).
Kernels without limits, and limits without a kernel, fail. Occupancy is printed where the calculator is at hand.
"""
import argparse
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'ptx'))
from ptx_module import Instruction, parse  # noqa: E402

FLOATS = ('f32', 'f64')


@dataclass
class Measured:
    """What PTX and ptxas say of one kernel."""
    fma: int = 0
    f64: int = 0          # instructions with an f64 operand that compute
    f64_loads: int = 0    # f64 loads, moves and conversions
    approximate: int = 0
    unrounded: int = 0    # float add, sub, mul without a rounding: ptxas may fuse them
    registers: int = -1
    stack: int = -1
    spills: int = -1
    shared: int = 0


def reachable(function, functions):
    """The function and all that it calls, directly or not."""
    found, waiting = [], [function.name]
    while waiting:
        name = waiting.pop()
        if name in functions and functions[name] not in found:
            found.append(functions[name])
            waiting += [word for i in functions[name].body if isinstance(i, Instruction) and i.opcode.startswith('call')
                        for word in i.operands]
    return found


def count_instructions(text):
    """Measured by kernel name, from PTX text."""
    functions = {function.name: function for function in parse(text).functions}
    result = {}
    for kernel in functions.values():
        if not kernel.is_entry:
            continue
        m = result[kernel.name] = Measured()
        for item in (i for f in reachable(kernel, functions) for i in f.body if isinstance(i, Instruction)):
            head, *modifiers = item.opcode.split('.')
            if head == 'fma':
                m.fma += 1
            if 'f64' in modifiers:
                if head in ('ld', 'mov', 'cvt'):
                    m.f64_loads += 1
                else:
                    m.f64 += 1
            if {'approx', 'full', 'ftz'} & set(modifiers):
                m.approximate += 1
            if head in ('add', 'sub', 'mul') and modifiers[-1] in FLOATS and 'rn' not in modifiers:
                m.unrounded += 1
    return result


def read_ptxas(report, measured):
    """Add what `ptxas -v` reports to `measured`; a kernel's stack and spills hold those of the functions it calls."""
    kernel = None
    for line in report.splitlines():
        if found := re.search(r"Compiling entry function '(\w+)'", line):
            kernel = measured[found[1]]
            kernel.stack = kernel.spills = 0
        elif kernel and (found := re.search(r'(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill',
                                            line)):
            kernel.stack = max(kernel.stack, int(found[1]))
            kernel.spills += int(found[2]) + int(found[3])
        elif kernel and (found := re.search(r'Used (\d+) registers', line)):
            kernel.registers = int(found[1])
            if found := re.search(r'(\d+) bytes cumulative stack size', line):
                kernel.stack = int(found[1])
            if found := re.search(r'(\d+) bytes smem', line):
                kernel.shared = int(found[1])


def failures(name, m, limits, arch):
    """What is wrong with a kernel, in words."""
    most = limits['registers'][arch]
    if m.registers < 0 or m.stack < 0:
        yield 'ptxas said nothing of it'
    if m.registers > most:
        yield f'{m.registers} registers, at most {most} expected'
    if m.stack > limits.get('stack', 0):
        yield f'{m.stack} bytes of local memory, at most {limits.get("stack", 0)} expected'
    if m.spills > limits.get('spills', 0):
        yield f'{m.spills} bytes of spills, at most {limits.get("spills", 0)} expected'
    if m.fma < limits['fma']:
        yield f'{m.fma} fused multiply-adds, at least {limits["fma"]} expected'
    if m.approximate:
        yield f'{m.approximate} approximate or flushing instructions'
    if m.unrounded:
        yield f'{m.unrounded} sums or products that ptxas may fuse'
    if name.endswith('_f32') and m.f64:
        yield f'{m.f64} f64 instructions in a float kernel'
    if name.endswith('_f32') and m.f64_loads and limits.get('f64') != 'loads':
        yield f'{m.f64_loads} f64 loads or conversions in a float kernel'


def occupancy(program, arch, measured):
    """{kernel: text} by the occupancy calculator."""
    lines = ''.join(f'{name} {m.registers} {m.shared}\n' for name, m in measured.items())
    output = subprocess.run([program, arch.removeprefix('sm_')], input=lines, capture_output=True, text=True,
                            check=True)
    return dict(line.split(None, 1) for line in output.stdout.splitlines())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('ptx', type=Path, nargs='+', help='files that nvcc -ptx wrote')
    parser.add_argument('--arch', required=True, help='such as sm_90')
    parser.add_argument('--limits', type=Path, required=True, help='JSON: limits by kernel')
    parser.add_argument('--ptxas', required=True, help='the assembler')
    parser.add_argument('--occupancy', help='the program made of occupancy.cpp')
    options = parser.parse_args()

    limits = json.loads(options.limits.read_text())
    measured = {}
    for path in options.ptx:
        measured.update(count_instructions(path.read_text()))
        assembled = subprocess.run([options.ptxas, '-v', f'-arch={options.arch}', path, '-o', '/dev/null'],
                                   capture_output=True, text=True)
        if assembled.returncode != 0:
            sys.exit(f'{path}: ptxas: {assembled.stderr}')
        read_ptxas(assembled.stdout + assembled.stderr, measured)

    percent = occupancy(options.occupancy, options.arch, measured) if options.occupancy else {}
    failed = False
    print(f'{options.arch}: {"kernel":<20} {"registers":>9} {"stack":>5} {"spills":>6} {"fma":>5} {"f64":>5}  '
          'occupancy by threads a block')
    for name, m in sorted(measured.items()):
        print(f'{options.arch}: {name:<20} {m.registers:>9} {m.stack:>5} {m.spills:>6} {m.fma:>5} '
              f'{m.f64 + m.f64_loads:>5}  {percent.get(name, "")}')
        wrong = list(failures(name, m, limits[name], options.arch)) if name in limits else ['no limits are set for it']
        for reason in wrong:
            print(f'{options.arch}: {name}: FAILED: {reason}')
        failed = failed or bool(wrong)
    for name in sorted(set(limits) - set(measured)):
        print(f'{options.arch}: {name}: FAILED: limits are set for it, but there is no such kernel')
        failed = True
    sys.exit(failed)


if __name__ == '__main__':
    main()
