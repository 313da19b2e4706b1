# SPDX-License-Identifier: LGPL-2.1-or-later
"""same_flags.py ROOT PART WHOLE: whether the build folder WHOLE compiles the
sources that both have as PART does, so that nothing is compiled again."""
import json
import os
import pathlib
import sys

ROOT = sys.argv[1]


def commands(build):
    """The command of each object, as if the build folder were in ROOT."""
    up = os.path.relpath(ROOT, build) + '/'
    text = (pathlib.Path(build) / 'compile_commands.json').read_text()
    return {one['output']: one['command'].replace(up, '../')
            for one in json.loads(text)}


part, whole = map(commands, sys.argv[2:4])
both = part.keys() & whole.keys()
other = [name for name in sorted(both) if part[name] != whole[name]]
for name in other:
    print(name, *sorted(set(part[name].split()) ^ set(whole[name].split())))
print(f'{len(part)} objects, {len(both)} also in the other build')
sys.exit(1 if other or len(part) - len(both) > len(part) // 20 else 0)
