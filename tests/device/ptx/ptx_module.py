# SPDX-License-Identifier: MIT
"""Parse the PTX text that nvcc writes into variables, functions and statements, each with its line number.

Only the grammar that nvcc uses is read (one statement ends in a semicolon, scopes open and close between statements);
what an instruction means is none of this file's business.
"""
import re
from dataclasses import dataclass, field


class PtxError(Exception):
    """Something in the PTX that cannot be read or translated; `line` counts from 1 in the PTX file."""

    def __init__(self, line, message):
        super().__init__(message)
        self.line = line


@dataclass
class Variable:
    """A declaration: `space` is reg, param, local, shared, global or const; `count` is 1 for what is not an array."""
    line: int
    space: str
    type: str
    name: str
    alignment: int
    count: int
    initial: list = field(default_factory=list)


@dataclass
class Instruction:
    """`@!%p1 opcode.modifier.type operands;` with the operands as text."""
    line: int
    predicate: str  # register name, or '' where the instruction is unconditional
    negated: bool
    opcode: str     # all of it, dots included
    operands: list

    @property
    def text(self):
        guard = f'@{"!" if self.negated else ""}{self.predicate} ' if self.predicate else ''
        return f'{guard}{self.opcode} {", ".join(self.operands)}'.strip()


@dataclass
class Label:
    line: int
    name: str


@dataclass
class BranchTargets:
    """The table of an indexed branch."""
    line: int
    name: str
    labels: list


@dataclass
class Scope:
    """An opening (`opens`) or closing brace inside a function."""
    line: int
    opens: bool


@dataclass
class Function:
    line: int
    name: str
    is_entry: bool
    results: list     # Variables of space param
    parameters: list  # likewise
    body: list        # Variable, Instruction, Label, BranchTargets and Scope in file order


@dataclass
class Module:
    target: str  # such as sm_75
    variables: list
    functions: list


SIZE_OF = dict(pred=1, b8=1, u8=1, s8=1, b16=2, u16=2, s16=2, b32=4, u32=4, s32=4, f32=4, b64=8, u64=8, s64=8, f64=8)

_SPACE = re.compile(r'\s+')
_LABEL = re.compile(r'([\w$]+)\s*:(?!:)')
_DECLARATION = re.compile(
    r'(?:\.(?:visible|weak|extern)\s+)*\.(reg|param|local|shared|global|const)\s+(?:\.align\s+(\d+)\s+)?\.(\w+)\s+'
    r'(?:\.ptr(?:\s+\.(?:global|local|shared|const))?(?:\s+\.align\s+\d+)?\s+)?(.*)', re.S)
_DECLARATOR = re.compile(r'([%\w$]+)\s*(?:<(\d+)>|\[(\d*)\])?\s*(?:=\s*(.*))?$', re.S)
_REST_OF_LINE = re.compile(r'[^\n]*')
_HEADER = re.compile(r'(?:\.(?:visible|weak|extern)\s+)*\.(entry|func)\b')
_IGNORED = re.compile(r'\.(loc|pragma|file|section|version|address_size)\b')


def split_operands(text):
    """Split at the commas that are in no bracket."""
    parts, depth, start = [], 0, 0
    for position, character in enumerate(text):
        if character in '([{':
            depth += 1
        elif character in ')]}':
            depth -= 1
        elif character == ',' and depth == 0:
            parts.append(text[start:position].strip())
            start = position + 1
    tail = text[start:].strip()
    return parts + [tail] if tail else parts


def _blank_comments(text):
    """The text with comments gone and every line break kept."""
    text = re.sub(r'/\*.*?\*/', lambda m: '\n' * m.group().count('\n'), text, flags=re.S)
    return re.sub(r'//[^\n]*', '', text)


class _Reader:
    def __init__(self, text):
        self.text = _blank_comments(text)
        self.position = 0

    def skip_space(self):
        match = _SPACE.match(self.text, self.position)
        if match:
            self.position = match.end()

    @property
    def line(self):
        return self.text.count('\n', 0, self.position) + 1

    @property
    def at_end(self):
        self.skip_space()
        return self.position >= len(self.text)

    def starts_with(self, prefix):
        return self.text.startswith(prefix, self.position)

    def match(self, pattern):
        found = pattern.match(self.text, self.position)
        if found:
            self.position = found.end()
        return found

    def until(self, stops):
        """The text up to the first of `stops`, which is left to be read."""
        start = self.position
        while self.position < len(self.text) and self.text[self.position] not in stops:
            self.position += 1
        if self.position == len(self.text):
            raise PtxError(self.text.count('\n', 0, start) + 1, f'file ends before any of {stops!r}')
        return self.text[start:self.position].strip()

    def statement(self):
        text = self.until(';')
        self.position += 1
        return text


def _declarations(text, line):
    match = _DECLARATION.match(text)
    if not match:
        raise PtxError(line, f'unreadable declaration: {text}')
    space, alignment, type_name, names = match.groups()
    if type_name not in SIZE_OF:
        raise PtxError(line, f'unsupported type .{type_name} in: {" ".join(text.split())}')
    variables = []
    for name in split_operands(names):
        declarator = _DECLARATOR.match(name)
        if not declarator:
            raise PtxError(line, f'unreadable declaration: {text}')
        base, numbered, elements, initial = declarator.groups()
        align = int(alignment or SIZE_OF[type_name])
        if numbered:  # .reg .b32 %r<3> declares %r0, %r1, %r2
            variables += [Variable(line, space, type_name, f'{base}{i}', align, 1) for i in range(int(numbered))]
        else:
            values = split_operands(initial.strip().strip('{}')) if initial else []
            variables.append(Variable(line, space, type_name, base, align, int(elements or 1), values))
    return variables


def _parameters(text, line):
    return [variable for item in split_operands(text) for variable in _declarations(item, line)]


def _instruction(text, line):
    match = re.match(r'(?:@(!?)(%\w+)\s+)?([\w.:]+)\s*(.*)$', text, re.S)
    if not match:
        raise PtxError(line, f'unreadable statement: {text}')
    negated, predicate, opcode, operands = match.groups()
    return Instruction(line, predicate or '', negated == '!', opcode, split_operands(' '.join(operands.split())))


def _body(reader):
    """The statements after a function's opening brace, up to and with its closing one."""
    items, depth = [], 1
    while True:
        reader.skip_space()
        line = reader.line
        if reader.starts_with('{') or reader.starts_with('}'):
            opens = reader.starts_with('{')
            reader.position += 1
            depth += 1 if opens else -1
            if depth == 0:
                return items
            items.append(Scope(line, opens))
            continue
        label = reader.match(_LABEL)
        if label:
            reader.skip_space()
            if reader.starts_with('.branchtargets'):
                targets = reader.statement().split(None, 1)[1]
                items.append(BranchTargets(line, label[1], split_operands(targets)))
            else:
                items.append(Label(line, label[1]))
            continue
        text = reader.statement()
        if _IGNORED.match(text):
            continue
        if text.startswith('.'):
            items += _declarations(text, line)
        else:
            items.append(_instruction(text, line))


def _function(reader, line, kind):
    """A definition, or None for a prototype."""
    header = reader.until('{;')
    match = re.match(r'(?:\((.*?)\)\s*)?([\w$]+)\s*(?:\((.*?)\))?', header, re.S)
    results, name, parameters = match.groups()
    prototype = reader.starts_with(';')
    reader.position += 1
    if prototype:
        return None
    return Function(line, name, kind == 'entry', _parameters(results or '', line), _parameters(parameters or '', line),
                    _body(reader))


def parse(text):
    """The module of a PTX file's text."""
    reader, module = _Reader(text), Module('', [], [])
    while not reader.at_end:
        line = reader.line
        header = reader.match(_HEADER)
        if header:
            reader.skip_space()
            function = _function(reader, line, header[1])
            if function:
                module.functions.append(function)
        elif reader.starts_with('.target'):
            module.target = re.split(r'[\s,]+', reader.match(_REST_OF_LINE).group())[1]
        elif reader.match(_IGNORED):
            reader.match(_REST_OF_LINE)
        else:
            module.variables += _declarations(reader.statement(), line)
    return module
