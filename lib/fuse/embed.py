#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""embed.py FILE SOURCE: writes C++ that has the bytes of FILE."""
import pathlib
import sys

data = pathlib.Path(sys.argv[1]).read_bytes()
lines = [','.join(map(str, data[at:at + 20])) for at in range(0, len(data), 20)]
pathlib.Path(sys.argv[2]).write_text(f'''\
#include <cstddef>
#include <span>
namespace codedexposure::fuse
{{
static const unsigned char bytes[] = {{
{",".join(line + chr(10) for line in lines)}}};
std::span<const std::byte>
refine_weights ()
{{
  return std::as_bytes (std::span (bytes));
}}
}} // namespace codedexposure::fuse
''')
