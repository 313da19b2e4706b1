#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""mp4.py A B: whether two MP4 files are the same, but for their dates."""
import re
import sys

# Name, version and flags of the boxes with dates; the muxer also leaves those of
# its first header in the file.
DATED = re.compile(rb'(mvhd|tkhd|mdhd)(\x00...)........', re.DOTALL)


def contents(name):
    with open(name, 'rb') as file:
        return DATED.sub(rb'\1\2', file.read())


if contents(sys.argv[1]) != contents(sys.argv[2]):
    sys.exit(f'{sys.argv[1]} and {sys.argv[2]} differ')
