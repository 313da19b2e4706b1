#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""pip installs the package into a virtual environment that sees the packages of
the system."""
import importlib.util
import shutil
import subprocess
import sys
import unittest

from rig import BUILD, ROOT, SCRATCH, clean, simulate

for needed in ("ensurepip", "wheel"):
    if not importlib.util.find_spec(needed):
        print(f"skipped: {needed}; apt-get install python3-venv python3-wheel")
        sys.exit(77)

COUNT = """import sys, codedexposure
frames = codedexposure.open("plain.mkv").subframes()
print(sys.prefix in codedexposure.__file__, codedexposure.__version__, len(frames))
"""


def tearDownModule():
    clean()


class Pip(unittest.TestCase):
    def test_install(self):
        simulate("plain.mkv")
        tree, venv = SCRATCH / "tree", SCRATCH / "venv"
        tree.mkdir()
        for name in ("pyproject.toml", "README.md"):
            shutil.copy(ROOT / name, tree)
        shutil.copytree(ROOT / "python", tree / "python")
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages",
                        venv], check=True)
        # Without a network, what builds is that of the system.
        done = subprocess.run(
            [venv / "bin/pip", "install", "--no-build-isolation", tree],
            check=False, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = subprocess.run([venv / "bin/python", "-c", COUNT], cwd=SCRATCH,
                              check=True, capture_output=True, text=True)
        version = subprocess.run([BUILD / "app/codedexposure", "--version"],
                                 check=True, capture_output=True, text=True)
        self.assertEqual(done.stdout.split(),
                         ["True", version.stdout.split()[-1], "48"])


if __name__ == "__main__":
    unittest.main()
