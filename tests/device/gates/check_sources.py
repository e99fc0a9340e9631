#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Refuse what nvcc turns into wrong device code without a word, in the headers named on the command line.

std::countr_zero and std::countr_one: nvcc 13 takes the __builtin_ctz inside libstdc++'s for undefined behaviour and
gives 32 for any argument, or drops the path that calls it. std::popcount, std::countl_zero and std::bit_width are
right, and std::popcount(x & ~(x + 1)) counts trailing ones as well.
"""
import argparse
import re
import sys
from pathlib import Path

TRAPS = re.compile(r'\b(?:std::)?(?:countr_zero|countr_one|__builtin_ctz\w*)\s*\(')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('headers', type=Path, nargs='+', help='headers that device code includes')
    failed = False
    for header in parser.parse_args().headers:
        for number, line in enumerate(header.read_text().splitlines(), 1):
            if trap := TRAPS.search(line.split('//')[0]):
                print(f'{header}:{number}: nvcc miscompiles {trap[0].rstrip("( ")}')
                failed = True
    sys.exit(failed)


if __name__ == '__main__':
    main()
