#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Translate the PTX that `nvcc -ptx` writes into C++ that runs it on the CPU, one thread after another.

Each entry becomes an exported function `void name(launch_request const&)`. Kernels in which threads work together
(barriers, shuffles, shared memory, atomics) are refused, and so is every instruction whose bits the PTX manual does not
determine: see ptx_instructions.py.
"""
import argparse
import sys
from collections import Counter
from pathlib import Path

from ptx_instructions import Translator, identifier
from ptx_module import BranchTargets, Instruction, Label, PtxError, SIZE_OF, Scope, Variable, parse


def cpp_type(variable):
    """The type that holds a register: its bits, whatever they mean."""
    return 'bool' if variable.type == 'pred' else f'u{8 * SIZE_OF[variable.type]}'


def storage(variable):
    return SIZE_OF[variable.type] * variable.count


def signature(function):
    names = ''.join(f', char* p_{identifier(v.name)}' for v in function.results + function.parameters)
    return f'static void f_{identifier(function.name)}([[maybe_unused]] thread& t{names})'


def function_body(function, module_addresses, functions, counts):
    """The C++ lines of one function."""
    variables = [item for item in function.body if isinstance(item, Variable)]
    used = set(' '.join(item.text for item in function.body if isinstance(item, Instruction))
               .replace(',', ' ').replace('{', ' ').replace('}', ' ').replace('[', ' ').replace(']', ' ')
               .replace('+', ' ').replace('!', ' ').replace('@', ' ').replace('|', ' ').split())
    addresses = dict(module_addresses)
    addresses.update({v.name: f'p_{identifier(v.name)}' for v in function.results + function.parameters})
    addresses.update({v.name: f'p_{identifier(v.name)}' for v in variables if v.space == 'param'})
    addresses.update({v.name: f'local_{identifier(v.name)}' for v in variables if v.space == 'local'})
    registers = {v.name: v.type for v in variables if v.space == 'reg'}
    targets = {item.name: item.labels for item in function.body if isinstance(item, BranchTargets)}
    translator = Translator(registers, addresses, functions, targets)

    lines, depth = [signature(function) + ' {'], 0
    for item in function.body:
        if isinstance(item, Scope):
            depth += 1 if item.opens else -1
            lines.append('{' if item.opens else '}')
        elif isinstance(item, Variable):
            if item.space == 'reg':
                if item.name in used:
                    lines.append(f'  {cpp_type(item)} {identifier(item.name)}{{}};')
            elif item.space == 'param':
                lines.append(f'  alignas({item.alignment}) char p_{identifier(item.name)}[{storage(item)}];')
            elif item.space == 'local' and depth == 0:
                name = f'local_{identifier(item.name)}'
                lines.append(f'  alignas({max(item.alignment, 16)}) char {name}[{storage(item)}];')
                lines.append(f'  local_frame const frame_{name}(t, {name}, {storage(item)});')
            else:
                raise PtxError(item.line, f'unsupported .{item.space} variable {item.name}')
        elif isinstance(item, Label):
            lines.append(f'{identifier(item.name)}: t.at_label();')
        elif isinstance(item, Instruction):
            counts[item.opcode] += 1
            lines.append('  ' + translator.statement(item))
    return lines + ['}', '']


def entry_point(function):
    """The exported function of an entry: lays out the parameters as PTX does and runs every thread."""
    offsets, size = [], 0
    for parameter in function.parameters:
        size = -(-size // parameter.alignment) * parameter.alignment
        offsets.append((size, storage(parameter)))
        size += storage(parameter)
    name = identifier(function.name)
    layout = ', '.join(f'{{{offset}, {length}}}' for offset, length in offsets)
    arguments = ''.join(f', parameters + {offset}' for offset, _ in offsets)
    return [f'extern "C" PTX_EXPORT void {name}(patchrt::test::launch_request const& request) {{',
            f'  static constexpr parameter layout[] = {{{layout}}};',
            f'  run(request, layout, {len(offsets)}, module_memory, [](thread& t, char* parameters) {{',
            f'    f_{name}(t{arguments});', '  });', '}', '']


def module_variables(module):
    """(C++ lines, addresses by name) of the variables outside functions."""
    lines, addresses, ranges = [], {}, []
    for variable in module.variables:
        if variable.space not in ('global', 'const'):
            raise PtxError(variable.line, f'unsupported .{variable.space} variable {variable.name}')
        name = f'g_{identifier(variable.name)}'
        for value in variable.initial:
            if not value.rstrip('U').lstrip('-').replace('0x', '').isalnum() or value[0].isalpha():
                raise PtxError(variable.line, f'unsupported initial value {value} of {variable.name}')
        values = ', '.join(variable.initial)
        bits = 8 * SIZE_OF[variable.type]
        lines.append(f'alignas({variable.alignment}) static u{bits} {name}[{variable.count}] = {{{values}}};')
        addresses[variable.name] = f'reinterpret_cast<char*>({name})'
        ranges.append(f'{{{name}, {name} + {variable.count}, {"true" if variable.space == "global" else "false"}}}')
    lines.append(f'static std::vector<patchrt::test::memory_range> const module_memory = {{{", ".join(ranges)}}};')
    return lines + [''], addresses


def translate(text):
    """(C++ text, opcode counts) of a PTX file's text."""
    module = parse(text)
    counts = Counter()
    lines = ['// Made by translate_ptx.py; do not edit.', '#include <device/ptx/ptx_runtime.hpp>', '',
             'using namespace ptx;', '']
    variable_lines, addresses = module_variables(module)
    lines += variable_lines
    functions = {function.name for function in module.functions}
    lines += [signature(function) + ';' for function in module.functions] + ['']
    for function in module.functions:
        try:
            lines += function_body(function, addresses, functions, counts)
        except PtxError as error:
            raise PtxError(error.line, f'in {function.name}: {error}') from error
        if function.is_entry:
            lines += entry_point(function)
    return '\n'.join(lines), counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('ptx', type=Path, help='what nvcc -ptx -fmad=false wrote')
    parser.add_argument('-o', '--output', type=Path, required=True, help='the C++ file to write')
    parser.add_argument('-v', '--verbose', action='store_true', help='list the instructions translated')
    options = parser.parse_args()
    try:
        text, counts = translate(options.ptx.read_text())
    except PtxError as error:
        sys.exit(f'{options.ptx}:{error.line}: {error}')
    except OSError as error:
        sys.exit(str(error))
    options.output.write_text(text)
    if options.verbose:
        for opcode, count in sorted(counts.items()):
            print(f'{count:7d} {opcode}')


if __name__ == '__main__':
    main()
