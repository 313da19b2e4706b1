#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Checks from the #include lines which room of lib/, gst/ and app/ uses which.

Usage: include_order.py SOURCE_ROOT
A file of lib/ may include its own room, the rooms that stand above it in ORDER,
and nothing of GStreamer. A file of gst/ may include its own room, common/ and
lib/, but of lib/bench only where BENCH names it; the files of the plugins, which
stand in no room of gst/, use all of it. A file of app/ may include lib/,
gst/common/ and its own hall, but no file of commands/, and of emulation/ only
where EMULATION names it. Nothing else includes app/.
"""

import pathlib
import re
import sys

ORDER = ["base", "schedule", "mapping", "setup", "record", "estimate", "extract", "rectify",
         "fuse", "calibrate", "sync", "dmd", "doctor", "bench", "stats", "advise"]
# The emulated bench: the elements that emulate, and what registers them and the
# simulated DMD.
BENCH = ["gst/sim/", "gst/scene/", "gst/parts.cpp"]
EMULATION = ["app/emulation/", "app/commands/bench.cpp"]
INCLUDE = re.compile(r'\s*#\s*include\s*(["<])([^">]+)[">]')


def target(root, file, name):
    """The file that '#include "NAME"' in FILE means, as lib/..., gst/... or app/..."""
    for folder in (file.parent, root / "lib", root / "gst", root / "app"):
        if (folder / name).is_file():
            return (folder / name).resolve().relative_to(root).as_posix()
    # A header that the build makes.
    return "lib/" + name if name.split("/")[0] in ORDER else None


def fault(file, included):
    """Why FILE must not include INCLUDED, both relative to the root; or None."""
    hall, room = file.split("/")[:2]
    other_hall, other_room = included.split("/")[:2]
    if hall == "lib":
        if other_hall != "lib":
            return "lib/ uses nothing of gst/ and app/"
        if ORDER.index(other_room) > ORDER.index(room):
            return f"{other_room} stands below {room}"
        return None
    if hall == "app":
        if other_hall == "app" and other_room == "commands":
            return "a command is used by nothing but the list of commands"
        if other_hall == "app" and other_room == "emulation" \
                and not file.startswith(tuple(EMULATION)):
            return "only bench uses what is emulated"
        if other_hall == "gst" and other_room != "common":
            return f"the program uses the element of gst/{other_room}, not its code"
        return None
    if other_hall == "app":
        return "gst/ uses nothing of app/"
    if other_hall == "lib":
        if other_room == "advise":
            return "gst/ does not use lib/advise"
        if other_room == "bench" and not file.startswith(tuple(BENCH)):
            return "only what emulates a bench uses lib/bench"
        return None
    is_in_room = file.count("/") > 1
    if is_in_room and other_room not in (room, "common"):
        return f"{other_room} is another element's room"
    return None


def faults_of(root, file):
    name = file.relative_to(root).as_posix()
    for number, line in enumerate(file.read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        quote, included = match.groups()
        why = None
        if quote == "<":
            if name.startswith("lib/") and included.startswith("gst/"):
                why = "lib/ knows nothing of GStreamer"
        elif found := target(root, file, included):
            why = fault(name, found)
        if why:
            yield f"{name}:{number}: includes {included}: {why}"


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    files = [file for hall in ("lib", "gst", "app")
             for file in sorted((root / hall).rglob("*"))
             if file.suffix in (".h", ".cpp")]
    rooms = {file.relative_to(root).parts[1] for file in files
             if file.is_relative_to(root / "lib")} - {"precompiled"}
    faults = [f"lib/{room}: no room of that name is in the order"
              for room in sorted(rooms - set(ORDER))]
    if not faults:
        faults = [text for file in files for text in faults_of(root, file)]
    for text in faults:
        print(text)
    print(f"{len(files)} files, {len(faults)} against the order")
    return 1 if faults or len(files) < 100 else 0


if __name__ == "__main__":
    sys.exit(main())
