# SPDX-License-Identifier: MIT
"""The C++ of one PTX instruction.

Every modifier of an instruction must be one whose effect is modelled: anything else raises PtxError rather than giving
an answer that a GPU might not give. That refuses approximate maths, flushing of subnormals, saturation, and additions
or products without an explicit rounding, which ptxas may fuse.
"""
import re

from ptx_module import PtxError, SIZE_OF, split_operands

FLOATS = ('f32', 'f64')
SPECIAL_REGISTERS = {f'%{ptx}.{axis}': f't.{cpp}.{axis}' for axis in 'xyz' for ptx, cpp in (
    ('tid', 'thread_index'), ('ntid', 'block_size'), ('ctaid', 'block_index'), ('nctaid', 'grid_size'))}
COMPARISONS = dict(eq='==', ne='!=', lt='<', le='<=', gt='>', ge='>=', lo='<', ls='<=', hi='>', hs='>=')
COMBINATIONS = dict(zip(('and', 'or', 'xor'), ('&&', '||', '!=')))
# Caching hints: where a value is kept, not what it is.
CACHING = {'nc', 'weak', 'volatile', 'ca', 'cg', 'cs', 'wb', 'wt', 'L1::no_allocate', 'L1::evict_last', 'L2::128B'}


def identifier(name):
    """A PTX name as a C++ identifier."""
    return re.sub(r'\W', '_', name)


class Translator:
    """Translates the instructions of one function; `names` maps every name in scope to its C++ and its type."""

    def __init__(self, registers, addresses, functions, targets):
        self.registers = registers  # register name -> PTX type
        self.addresses = addresses  # name of a variable or parameter -> C++ expression of its address
        self.functions = functions  # names of the functions that can be called
        self.targets = targets      # name of a .branchtargets table -> labels

    # Operands

    def value(self, operand, type_name, line):
        """A C++ expression of type `type_name` for a register, an immediate or a variable's address."""
        if operand in SPECIAL_REGISTERS:
            return f'get<{type_name}>({SPECIAL_REGISTERS[operand]})'
        if operand.startswith('!'):
            return '!' + self.value(operand[1:], type_name, line)
        if operand in self.registers:
            return f'get<{type_name}>({identifier(operand)})'
        if operand in self.addresses:
            return f'get<{type_name}>(address_of({self.addresses[operand]}))'
        if re.fullmatch(r'0[fF][0-9a-fA-F]{8}', operand):
            return f'get<{type_name}>(u32(0x{operand[2:]}u))'
        if re.fullmatch(r'0[dD][0-9a-fA-F]{16}', operand):
            return f'get<{type_name}>(u64(0x{operand[2:]}ull))'
        if re.fullmatch(r'-?(0[xX][0-9a-fA-F]+|\d+)U?', operand):
            return f'get<{type_name}>(u64(0x{int(operand.rstrip("U"), 0) % 2**64:x}ull))'
        raise PtxError(line, f'unknown operand {operand}')

    def address(self, operand, line):
        """A C++ expression (u64) for `[base+offset]`."""
        match = re.fullmatch(r'\[\s*([%\w$]+)\s*(?:\+\s*(-?\d+))?\s*\]', operand)
        if not match:
            raise PtxError(line, f'unreadable address {operand}')
        base, offset = match[1], int(match[2] or 0)
        return f'({self.value(base, "u64", line)} + u64({offset}))'

    def destination(self, operand, line):
        if operand not in self.registers:
            raise PtxError(line, f'unknown register {operand}')
        return identifier(operand)

    # Instructions

    def statement(self, instruction):
        """The C++ statement for `instruction`, predicate included."""
        head, *modifiers = instruction.opcode.split('.')
        handler = getattr(self, 'op_' + head, None)
        if handler is None:
            raise PtxError(instruction.line, f'unsupported instruction: {instruction.text}')
        code = handler(instruction, modifiers)
        if not instruction.predicate:
            return code
        guard = self.value(instruction.predicate, 'pred', instruction.line)
        return f'if ({"!" if instruction.negated else ""}{guard}) {{ {code} }}'

    def typed(self, instruction, modifiers, allowed=(), required=()):
        """The type that ends the opcode; refuses modifiers that are not modelled."""
        type_name, rest = (modifiers[-1], modifiers[:-1]) if modifiers else ('', [])
        if type_name not in SIZE_OF:
            raise PtxError(instruction.line, f'unsupported type in: {instruction.text}')
        for modifier in rest:
            if modifier not in allowed and modifier not in required:
                raise PtxError(instruction.line, f'unsupported modifier .{modifier} in: {instruction.text}')
        for modifier in required:
            if modifier not in rest:
                raise PtxError(instruction.line, f'.{modifier} is missing in: {instruction.text} '
                               '(without it the result is not determined; is -fmad=false set?)')
        return type_name

    def apply(self, instruction, function, operand_types):
        """`destination = function(operands)`."""
        destination, *operands = instruction.operands
        if len(operands) != len(operand_types):
            raise PtxError(instruction.line, f'{len(operand_types)} source operands expected in: {instruction.text}')
        values = [self.value(o, t, instruction.line) for o, t in zip(operands, operand_types)]
        return f'set({self.destination(destination, instruction.line)}, {function}({", ".join(values)}));'

    def same_type(self, instruction, modifiers, function, arity):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'{function}<{type_name}>', [type_name] * arity)

    def arithmetic(self, instruction, modifiers, function, arity):
        """Float with .rn, or wrapping integer."""
        is_float = modifiers and modifiers[-1] in FLOATS
        type_name = self.typed(instruction, modifiers, required=('rn',) if is_float else ())
        return self.apply(instruction, f'{function}<{type_name}>', [type_name] * arity)

    def op_add(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'add', 2)

    def op_sub(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'sub', 2)

    def op_div(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'div', 2)

    def op_rem(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'rem', 2)

    def op_mul(self, instruction, modifiers, addend=False):
        if modifiers[-1] in FLOATS:
            return self.arithmetic(instruction, modifiers, 'mul', 2)
        part = next((m for m in modifiers if m in ('lo', 'hi', 'wide')), 'lo')
        type_name = self.typed(instruction, modifiers, allowed=('lo', 'hi', 'wide'))
        last = f'{type_name[0]}{8 * 2 * SIZE_OF[type_name]}' if part == 'wide' else type_name
        return self.apply(instruction, f'{"mad" if addend else "mul"}_{part}<{type_name}>',
                          [type_name, type_name] + ([last] if addend else []))

    def op_mad(self, instruction, modifiers):
        if modifiers[-1] in FLOATS:
            raise PtxError(instruction.line, f'unsupported instruction: {instruction.text}')
        return self.op_mul(instruction, modifiers, addend=True)

    def op_fma(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'fma', 3)

    def op_sqrt(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'sqrt', 1)

    def op_rcp(self, instruction, modifiers):
        return self.arithmetic(instruction, modifiers, 'rcp', 1)

    def op_neg(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'neg', 1)

    def op_abs(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'abs', 1)

    def op_min(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'min', 2)

    def op_max(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'max', 2)

    def op_copysign(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'copysign', 2)

    def op_and(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'bit_and', 2)

    def op_or(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'bit_or', 2)

    def op_xor(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'bit_xor', 2)

    def op_not(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'bit_not', 1)

    def op_popc(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'popc', 1)

    def op_clz(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'clz', 1)

    def op_brev(self, instruction, modifiers):
        return self.same_type(instruction, modifiers, 'brev', 1)

    def op_bfind(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers, allowed=('shiftamt',))
        return self.apply(instruction, f'bfind<{type_name}, {str("shiftamt" in modifiers).lower()}>', [type_name])

    def op_shl(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'shl<{type_name}>', [type_name, 'u32'])

    def op_shr(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'shr<{type_name}>', [type_name, 'u32'])

    def op_shf(self, instruction, modifiers):
        self.typed(instruction, modifiers, allowed=('l', 'r', 'wrap', 'clamp'))
        return self.apply(instruction, f'shf_{modifiers[0]}_{modifiers[1]}', ['u32'] * 3)

    def op_prmt(self, instruction, modifiers):
        self.typed(instruction, modifiers)
        return self.apply(instruction, 'prmt', ['u32'] * 3)

    def op_lop3(self, instruction, modifiers):
        self.typed(instruction, modifiers)
        return self.apply(instruction, 'lop3', ['u32'] * 4)

    def op_bfe(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'bfe<{type_name}>', [type_name, 'u32', 'u32'])

    def op_bfi(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'bfi<{type_name}>', [type_name, type_name, 'u32', 'u32'])

    def op_selp(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        return self.apply(instruction, f'selp<{type_name}>', [type_name, type_name, 'pred'])

    def op_setp(self, instruction, modifiers):
        line, operands = instruction.line, instruction.operands
        comparison, *rest = modifiers
        type_name = self.typed(instruction, rest, allowed=COMBINATIONS)
        a, b = (self.value(o, type_name, line) for o in operands[1:3])
        unordered = type_name in FLOATS and comparison.endswith('u') and comparison[:-1] in COMPARISONS
        if type_name in FLOATS and comparison in ('num', 'nan'):
            result = f'{"!" if comparison == "num" else ""}unordered({a}, {b})'
        elif (comparison[:-1] if unordered else comparison) not in COMPARISONS:
            raise PtxError(line, f'unsupported comparison in: {instruction.text}')
        elif unordered:
            result = f'(unordered({a}, {b}) || {a} {COMPARISONS[comparison[:-1]]} {b})'
        elif type_name in FLOATS and comparison == 'ne':  # C++ != holds for NaN, PTX ne does not
            result = f'(!unordered({a}, {b}) && {a} != {b})'
        else:
            result = f'({a} {COMPARISONS[comparison]} {b})'
        targets = [self.destination(o, line) for o in operands[0].split('|')]
        other, combination = None, None
        if len(rest) > 1:
            combination, other = COMBINATIONS[rest[0]], self.value(operands[3], 'pred', line)
        code = f'bool const c = {result}; '
        for target, holds in zip(targets, ('c', '!c')):
            code += f'set({target}, {f"{holds} {combination} {other}" if combination else holds}); '
        return f'{{ {code}}}'

    def op_cvt(self, instruction, modifiers):
        roundings = ('rn', 'rni', 'rzi', 'rmi', 'rpi')
        source = self.typed(instruction, modifiers, allowed=roundings + tuple(SIZE_OF))
        target, rounding = modifiers[-2], next((m for m in modifiers if m in roundings), None)
        if target not in SIZE_OF:
            raise PtxError(instruction.line, f'unsupported type in: {instruction.text}')
        to_integral = rounding in ('rni', 'rzi', 'rmi', 'rpi')
        from_float, to_float = source in FLOATS, target in FLOATS
        if from_float and not to_float and not to_integral:
            raise PtxError(instruction.line, f'conversion without rounding: {instruction.text}')
        function = f'round_to_integral<{source}, rounding::{rounding}>' if to_integral else ''
        value = self.value(instruction.operands[1], source, instruction.line)
        value = f'{function}({value})' if function else value
        destination = self.destination(instruction.operands[0], instruction.line)
        return f'set({destination}, convert<{target}, {source}>({value}));'

    def op_mov(self, instruction, modifiers):
        type_name = self.typed(instruction, modifiers)
        destination, source = instruction.operands
        line = instruction.line
        if destination.startswith('{'):  # one register into its parts, lowest bits first
            parts = split_operands(destination.strip('{}'))
            bits = 8 * SIZE_OF[type_name] // len(parts)
            whole = self.value(source, f'u{8 * SIZE_OF[type_name]}', line)
            stores = ' '.join(f'set({self.destination(p, line)}, u{bits}(whole >> {bits * i}));'
                              for i, p in enumerate(parts) if p != '_')
            return f'{{ u64 const whole = {whole}; {stores} }}'
        if source.startswith('{'):
            parts = split_operands(source.strip('{}'))
            bits = 8 * SIZE_OF[type_name] // len(parts)
            whole = ' | '.join(f'u64({self.value(p, f"u{bits}", line)}) << {bits * i}' for i, p in enumerate(parts))
            return f'set({self.destination(destination, line)}, u{8 * SIZE_OF[type_name]}({whole}));'
        return f'set({self.destination(destination, line)}, {self.value(source, type_name, line)});'

    def op_cvta(self, instruction, modifiers):
        # One flat address space: a global, constant, local or parameter address is its own generic address.
        type_name = self.typed(instruction, modifiers, allowed=('to', 'global', 'const', 'local', 'param'))
        destination = self.destination(instruction.operands[0], instruction.line)
        return f'set({destination}, {self.value(instruction.operands[1], type_name, instruction.line)});'

    def memory(self, instruction, modifiers):
        """(type, registers' text, address' text, space) of a load or store."""
        spaces = {'param', 'global', 'local', 'const'}
        type_name = self.typed(instruction, modifiers, allowed=spaces | CACHING | {'v2', 'v4'})
        is_store = instruction.opcode.startswith('st')
        registers, address = reversed(instruction.operands) if is_store else instruction.operands
        registers = split_operands(registers.strip('{}')) if registers.startswith('{') else [registers]
        return type_name, registers, self.address(address, instruction.line), 'param' in modifiers

    def op_ld(self, instruction, modifiers):
        type_name, registers, address, is_param = self.memory(instruction, modifiers)
        size = SIZE_OF[type_name]
        source = f'unchecked({address})' if is_param else f't.memory->read({address}, {size * len(registers)})'
        loads = ' '.join(f'set({self.destination(r, instruction.line)}, load<{type_name}>(at + {size * i}));'
                         for i, r in enumerate(registers) if r != '_')
        return f'{{ char const* const at = {source}; {loads} }}'

    def op_st(self, instruction, modifiers):
        type_name, registers, address, is_param = self.memory(instruction, modifiers)
        size = SIZE_OF[type_name]
        target = f'unchecked({address})' if is_param else f't.memory->write({address}, {size * len(registers)})'
        stores = ' '.join(f'store<{type_name}>(at + {size * i}, {self.value(r, type_name, instruction.line)});'
                          for i, r in enumerate(registers))
        return f'{{ char* const at = {target}; {stores} }}'

    # Control

    def op_bra(self, instruction, modifiers):
        if modifiers not in ([], ['uni']):
            raise PtxError(instruction.line, f'unsupported modifier in: {instruction.text}')
        return f'goto {identifier(instruction.operands[0])};'

    def op_brx(self, instruction, modifiers):
        index, table = instruction.operands
        if modifiers[0] != 'idx' or table not in self.targets:
            raise PtxError(instruction.line, f'unsupported instruction: {instruction.text}')
        cases = ' '.join(f'case {i}: goto {identifier(label)};' for i, label in enumerate(self.targets[table]))
        return f'switch ({self.value(index, "u32", instruction.line)}) {{ {cases} }} throw_bad_branch();'

    def op_call(self, instruction, modifiers):
        if modifiers not in ([], ['uni']):
            raise PtxError(instruction.line, f'unsupported modifier in: {instruction.text}')
        operands = list(instruction.operands)
        results = split_operands(operands.pop(0).strip('()')) if operands[0].startswith('(') else []
        name = operands.pop(0)
        if name not in self.functions:
            raise PtxError(instruction.line, f'call of {name}, which this file does not define: {instruction.text}')
        arguments = results + (split_operands(operands[0].strip('()')) if operands else [])
        passed = ''.join(f', {self.addresses[a]}' for a in arguments)
        return f'f_{identifier(name)}(t{passed});'

    def op_ret(self, _instruction, _modifiers):
        return 'return;'

    def op_exit(self, instruction, _modifiers):
        raise PtxError(instruction.line, 'unsupported instruction: exit')

    def op_trap(self, _instruction, _modifiers):
        return 'throw_trap();'
