#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tests of the translator: what it understands gives what the PTX manual says, and what it does not is refused by line.

Expected values are worked out by hand from the manual (PTX ISA 9.0, section 9.7). $CXX names the compiler to use.
"""
import ctypes
import os
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from ptx_module import PtxError, parse
from translate_ptx import translate

HERE = Path(__file__).resolve().parent


def kernel(body, declarations=''):
    """A module with one entry that stores %rd1..%rd9 of the body at its argument."""
    return f'''.version 9.0
.target sm_75
.address_size 64
{declarations}
.visible .entry k(.param .u64 k_param_0)
{{
	.reg .pred 	%p<10>;
	.reg .b16 	%rs<10>;
	.reg .b32 	%r<10>;
	.reg .f32 	%f<10>;
	.reg .b64 	%rd<20>;
	.reg .f64 	%fd<10>;
	ld.param.u64 %rd10, [k_param_0];
	{body}
	ret;
}}
'''


def f32(x):
    return '0f' + struct.pack('>f', x).hex()


def f64(x):
    return '0d' + struct.pack('>d', x).hex()


class MemoryRange(ctypes.Structure):
    _fields_ = [('begin', ctypes.c_void_p), ('end', ctypes.c_void_p), ('writable', ctypes.c_bool)]


class LaunchRequest(ctypes.Structure):
    _fields_ = [('blocks', ctypes.c_uint), ('threads', ctypes.c_uint), ('arguments', ctypes.c_void_p),
                ('memory', ctypes.c_void_p), ('memory_count', ctypes.c_size_t)]


def run(text):
    """The 64-bit words that the kernel stored at its argument, 40 at most."""
    code, _ = translate(text)
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / 'k.cpp', Path(folder) / 'k.so'
        source.write_text(code)
        subprocess.run([os.environ.get('CXX', 'c++'), '-std=c++20', '-O0', '-w', '-ffp-contract=off', '-shared',
                        '-fPIC', f'-I{HERE.parent.parent}', '-o', library, source], check=True)
        words = (ctypes.c_uint64 * 40)()
        address = ctypes.c_uint64(ctypes.addressof(words))
        arguments = (ctypes.c_void_p * 1)(ctypes.addressof(address))
        memory = MemoryRange(ctypes.addressof(words), ctypes.addressof(words) + ctypes.sizeof(words), True)
        ctypes.CDLL(str(library)).k(ctypes.byref(LaunchRequest(
            1, 1, ctypes.addressof(arguments), ctypes.addressof(memory), 1)))
        return list(words)


# (instructions, register that holds the result, expected bits)
RESULTS = [
    ('prmt.b32 %r1, 0x33221180, 0x77665544, 0x7f80;', '%r1', 0x7700ff80),
    ('lop3.b32 %r1, 0xf0f0f0f0, 0xcccccccc, 0xaaaaaaaa, 150;', '%r1', 0x96969696),
    ('bfe.u32 %r1, 0x12345678, 8, 12;', '%r1', 0x456),
    ('bfe.s32 %r1, 0x00000f00, 8, 4;', '%r1', 0xffffffff),
    ('bfe.s32 %r1, 0x80000000, 28, 12;', '%r1', 0xfffffff8),
    ('bfi.b32 %r1, 0xff, 0x12345678, 8, 8;', '%r1', 0x1234ff78),
    ('shf.l.wrap.b32 %r1, 0x89abcdef, 0x01234567, 36;', '%r1', 0x12345678),
    ('shf.r.wrap.b32 %r1, 0x89abcdef, 0x01234567, 4;', '%r1', 0x789abcde),
    ('shf.l.clamp.b32 %r1, 0x89abcdef, 0x01234567, 40;', '%r1', 0x89abcdef),
    ('shf.r.clamp.b32 %r1, 0x89abcdef, 0x01234567, 40;', '%r1', 0x01234567),
    ('shl.b32 %r1, 1, 32;', '%r1', 0),
    ('shr.s32 %r1, 0x80000000, 40;', '%r1', 0xffffffff),
    ('shr.u64 %rd1, 0x8000000000000000, 63;', '%rd1', 1),
    ('popc.b32 %r1, 0xf0f;', '%r1', 8),
    ('clz.b32 %r1, 0;', '%r1', 32),
    ('brev.b32 %r1, 0x00000013;', '%r1', 0xc8000000),
    ('bfind.u32 %r1, 0x00010000;', '%r1', 16),
    ('bfind.shiftamt.u32 %r1, 0x00010000;', '%r1', 15),
    ('bfind.s32 %r1, -1;', '%r1', 0xffffffff),
    ('mul.hi.s32 %r1, -2, 3;', '%r1', 0xffffffff),
    ('mul.hi.u64 %rd1, 0xffffffffffffffff, 0xffffffffffffffff;', '%rd1', 2**64 - 2),
    ('mul.wide.s32 %rd1, -5, 12;', '%rd1', 2**64 - 60),
    ('mul.wide.u32 %rd1, 0xffffffff, 2;', '%rd1', 0x1fffffffe),
    ('mov.u32 %r2, -3; mad.lo.s32 %r1, %r2, 7, 1;', '%r1', 2**32 - 20),
    ('mad.wide.s32 %rd1, -5, 12, 100;', '%rd1', 40),
    ('div.s32 %r1, -7, 2;', '%r1', 2**32 - 3),
    ('rem.s32 %r1, -7, 2;', '%r1', 2**32 - 1),
    ('min.s32 %r1, -1, 1;', '%r1', 0xffffffff),
    ('min.u32 %r1, -1, 1;', '%r1', 1),
    (f'min.f32 %f1, {f32(0.)}, {f32(-0.)};', '%f1', 0x80000000),
    (f'max.f32 %f1, 0f7fc00000, {f32(1.)};', '%f1', 0x3f800000),
    (f'copysign.f32 %f1, {f32(-0.)}, {f32(1.)};', '%f1', 0xbf800000),
    ('fma.rn.f32 %f1, 0f3f800001, 0f3f800001, 0fbf800002;', '%f1', 0x28800000),
    ('mul.rn.f32 %f1, 0f3f800001, 0f3f800001;', '%f1', 0x3f800002),
    (f'sqrt.rn.f64 %fd1, {f64(2.)};', '%fd1', 0x3ff6a09e667f3bcd),
    (f'rcp.rn.f32 %f1, {f32(3.)};', '%f1', 0x3eaaaaab),
    (f'div.rn.f32 %f1, {f32(1.)}, {f32(0.)};', '%f1', 0x7f800000),
    (f'cvt.rzi.s32.f32 %r1, {f32(-2.7)};', '%r1', 2**32 - 2),
    (f'cvt.rzi.u32.f32 %r1, {f32(-2.7)};', '%r1', 0),
    (f'cvt.rzi.s32.f32 %r1, {f32(3e9)};', '%r1', 0x7fffffff),
    ('cvt.rzi.s32.f32 %r1, 0f7fc00000;', '%r1', 0),
    ('cvt.rzi.s32.f64 %r1, 0d7ff8000000000000;', '%r1', 0x80000000),
    (f'cvt.rni.f32.f32 %f1, {f32(2.5)};', '%f1', 0x40000000),
    (f'cvt.rpi.f32.f32 %f1, {f32(2.5)};', '%f1', 0x40400000),
    ('cvt.rn.f32.u32 %f1, 16777217;', '%f1', 0x4b800000),
    ('cvt.rn.f32.f64 %f1, 0d3ff0000010000000;', '%f1', 0x3f800000),
    ('mov.u32 %r2, -2; cvt.s64.s32 %rd1, %r2;', '%rd1', 2**64 - 2),
    ('mov.u32 %r2, 0x1ff; cvt.s32.s8 %r1, %r2;', '%r1', 0xffffffff),
    ('mov.b64 %rd2, 0x0123456789abcdef; mov.b64 {%r2, %r1}, %rd2;', '%r1', 0x01234567),
    ('mov.u32 %r2, 1; mov.u32 %r3, 2; mov.b64 %rd1, {%r2, %r3};', '%rd1', 0x200000001),
    ('setp.lt.f32 %p1, 0f7fc00000, 0f00000000; selp.u32 %r1, 1, 2, %p1;', '%r1', 2),
    ('setp.geu.f32 %p1, 0f7fc00000, 0f00000000; selp.u32 %r1, 1, 2, %p1;', '%r1', 1),
    ('setp.ne.f32 %p1, 0f7fc00000, 0f00000000; selp.u32 %r1, 1, 2, %p1;', '%r1', 2),
    ('setp.eq.u32 %p1|%p2, 3, 3; selp.u32 %r1, 1, 2, %p2;', '%r1', 2),
    ('setp.gt.s32 %p1, -1, 0; setp.eq.or.u32 %p2, 1, 2, !%p1; selp.u32 %r1, 1, 2, %p2;', '%r1', 1),
    ('setp.gt.u32 %p1, -1, 0; mov.u32 %r1, 5; @%p1 mov.u32 %r1, 6; @!%p1 mov.u32 %r1, 7;', '%r1', 6),
]

REFUSED = [
    ('sin.approx.f32 %f1, %f2;', 'unsupported instruction'),
    ('add.f32 %f1, %f2, %f3;', '.rn is missing'),
    ('add.ftz.rn.f32 %f1, %f2, %f3;', 'modifier .ftz'),
    ('div.full.f32 %f1, %f2, %f3;', 'modifier .full'),
    ('fma.rz.f32 %f1, %f2, %f3, %f4;', 'modifier .rz'),
    ('cvt.f32.f16 %f1, %rs1;', 'unsupported'),
    ('bar.sync 0;', 'unsupported instruction'),
    ('atom.global.add.u32 %r1, [%rd1], 1;', 'unsupported instruction'),
    ('ld.shared.u32 %r1, [%rd1];', 'modifier .shared'),
    ('mov.u32 %r1, %r99;', 'unknown operand %r99'),
    ('{ .param .b64 param0; call.uni vprintf, (param0); }', 'call of vprintf'),
]


class TranslatorTest(unittest.TestCase):
    def test_instructions_give_what_the_manual_says(self):
        # One kernel for all, so that the compiler runs once.
        for start in range(0, len(RESULTS), 30):
            cases = RESULTS[start:start + 30]
            stores = {'%r1': 'st.global.u32', '%rd1': 'st.global.u64', '%f1': 'st.global.f32', '%fd1': 'st.global.f64'}
            body = '\n'.join(f'{code} {stores[register]} [%rd10+{8 * i}], {register};'
                             for i, (code, register, _) in enumerate(cases))
            words = run(kernel(body))
            for (code, register, expected), word in zip(cases, words):
                with self.subTest(code=code):
                    self.assertEqual(hex(word), hex(expected))

    def test_control_local_memory_calls_and_module_variables_work(self):
        declarations = '''.const .align 4 .b32 table[3] = {10, 20, 0x1e};
.func (.param .b32 func_retval0) twice(.param .b32 twice_param_0)
{
	.reg .b32 	%r<3>;
	ld.param.u32 %r1, [twice_param_0];
	add.s32 %r2, %r1, %r1;
	st.param.b32 [func_retval0+0], %r2;
	ret;
}
'''
        words = run(kernel('''.local .align 8 .b8 __local_depot0[16];
	mov.u64 %rd2, __local_depot0;
	cvta.local.u64 %rd3, %rd2;
	st.local.v2.u32 [%rd2+8], {7, 9};
	ld.u32 %r1, [%rd3+12];
	st.global.u32 [%rd10], %r1;
	mov.u64 %rd4, table;
	ld.const.u32 %r2, [table+8];
	ld.const.u32 %r3, [%rd4+4];
	st.global.v2.u32 [%rd10+8], {%r2, %r3};
	{ // callseq 0, 0
	.reg .b32 temp_param_reg;
	.param .b32 param0;
	st.param.b32 [param0+0], %r2;
	.param .b32 retval0;
	call.uni (retval0), twice, (param0);
	ld.param.b32 %r4, [retval0+0];
	} // callseq 0
	st.global.u32 [%rd10+16], %r4;
	mov.u32 %r5, 0;
	mov.u32 %r6, 0;
$again:
	add.s32 %r5, %r5, 1;
	and.b32 %r7, %r5, 1;
	brx.idx %r7, $table;
$table: .branchtargets $even, $odd;
$odd:
	add.s32 %r6, %r6, %r5;
$even:
	setp.lt.u32 %p1, %r5, 9;
	@%p1 bra $again;
	st.global.u32 [%rd10+24], %r6;''', declarations))
        self.assertEqual(words[:4], [9, 20 << 32 | 30, 60, 1 + 3 + 5 + 7 + 9])

    def test_what_is_not_modelled_is_refused_with_its_line(self):
        for code, message in REFUSED:
            text = kernel('\n' + code)
            with self.subTest(code=code), self.assertRaises(PtxError) as caught:
                translate(text)
            self.assertIn(message, str(caught.exception))
            self.assertIn('in k:', str(caught.exception))
            self.assertEqual(text.splitlines()[caught.exception.line - 1].strip(), code)

    def test_types_and_variables_that_are_not_modelled_are_refused(self):
        for declaration in ('.shared .align 4 .b8 s[64];', '.global .texref t;',
                            '.global .align 8 .u64 p[1] = {table};'):
            with self.subTest(declaration=declaration), self.assertRaises(PtxError) as caught:
                translate(kernel('', declaration))
            self.assertEqual(caught.exception.line, 4)

    def test_a_file_that_ends_early_is_refused(self):
        with self.assertRaises(PtxError):
            parse('.visible .entry k(.param .u64 a)\n{ ld.param')

    def test_the_command_names_file_and_line(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'k.ptx'
            path.write_text(kernel('bar.sync 0;'))
            result = subprocess.run([sys.executable, HERE / 'translate_ptx.py', path, '-o', Path(folder) / 'k.cpp'],
                                    capture_output=True, text=True)
            self.assertEqual(result.returncode, 1)
            self.assertIn(f'{path}:14: in k: unsupported instruction: bar.sync 0', result.stderr)
            self.assertFalse((Path(folder) / 'k.cpp').exists())


if __name__ == '__main__':
    unittest.main()
