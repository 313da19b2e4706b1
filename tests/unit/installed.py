#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Installs headers, library and pkg-config file, and decodes with them.

Usage: installed.py BUILD_ROOT EXAMPLE COMPILER [FLAG...]
Compiles EXAMPLE as somebody else would, against an installed tree, with what
pkg-config says and nothing else, and compares what it decodes.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, EXAMPLE, *COMPILER = sys.argv[1:]
WIDTH, HEIGHT = 12, 8
FORBIDDEN = ["/nlohmann/", "/eigen3/", "/gstreamer", "/glib", "CLI11", "/libusb"]


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, **options)


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name)
        run("meson", "install", "-C", BUILD, "--destdir", cls.root, "--quiet",
            "--no-rebuild", "--tags", "devel")
        cls.pc = next(cls.root.rglob("codedexposure.pc"))
        system = run("pkg-config", "--variable", "pc_path", "pkg-config",
                     text=True).stdout.strip()
        cls.environment = dict(
            os.environ, PKG_CONFIG_SYSROOT_DIR=str(cls.root),
            PKG_CONFIG_LIBDIR=f"{cls.pc.parent}:{system}")
        cls.program = cls.root / "decode"
        run(*COMPILER, "-o", cls.program, EXAMPLE, *cls.flags("--cflags", "--libs"))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def flags(cls, *what):
        return run("pkg-config", *what, "codedexposure", env=cls.environment,
                   text=True).stdout.split()

    def decode(self, *arguments, frames=b""):
        return subprocess.run([self.program, *arguments], input=frames,
                              capture_output=True, check=False)

    def test_decodes_what_it_is_given(self):
        frames = bytes(i * 37 % 251 for i in range(2 * WIDTH * HEIGHT))
        done = self.decode("sequential:2x2", str(WIDTH), str(HEIGHT),
                           frames=frames)
        self.assertEqual(done.stderr, b"")
        self.assertEqual(done.returncode, 0)
        expected = bytes(
            frames[(f * HEIGHT + 2 * y + k // 2) * WIDTH + 2 * x + k % 2]
            for f in range(2) for k in range(4)
            for y in range(HEIGHT // 2) for x in range(WIDTH // 2))
        self.assertEqual(done.stdout, expected)

    def test_says_why_it_cannot(self):
        done = self.decode("sequential:2x2", "1", "1")
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"holds no cell", done.stderr)
        self.assertEqual(self.decode("no:2x2").returncode, 1)

    def test_headers_stand_alone(self):
        headers = self.pc.parents[3] / "include/codedexposure"
        if not headers.is_dir():
            headers = next(self.root.rglob("include/codedexposure"))
        names = [h.relative_to(headers).as_posix()
                 for h in sorted(headers.rglob("*.h"))]
        self.assertIn("fuse/fuser.h", names)
        text = "".join(f"#include <{name}>\n" for name in names)
        used = run(*COMPILER, "-M", "-x", "c++", "-", *self.flags("--cflags"),
                   input=text, text=True).stdout
        for part in FORBIDDEN:
            self.assertNotIn(part, used)


if __name__ == "__main__":
    if not shutil.which("pkg-config"):
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
