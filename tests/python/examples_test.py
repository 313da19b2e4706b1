#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Python of docs/analyse.md runs as printed."""
import os
import re
import sys
import types
import unittest
import warnings
from unittest import mock

from rig import ROOT, SCRATCH, clean, decoded, simulate
import numpy as np
import codedexposure

# Their modules must be there before those of matplotlib come and go.
for name in codedexposure.__all__:
    getattr(codedexposure, name)

BLOCKS = re.findall(r"```python\n(.*?)```",
                    (ROOT / "docs/analyse.md").read_text(), re.DOTALL)


def setUpModule():
    simulate("coded.mkv")
    os.chdir(SCRATCH)


def tearDownModule():
    os.chdir(ROOT)
    clean()


class Examples(unittest.TestCase):
    def setUp(self):
        # matplotlib brings 100 MB of packages; what is tested is what it gets.
        self.plot = mock.Mock()
        library = types.ModuleType("matplotlib")
        library.pyplot = self.plot
        modules = {"matplotlib": library, "matplotlib.pyplot": self.plot}
        patch = mock.patch.dict(sys.modules, modules)
        patch.start()
        self.addCleanup(patch.stop)

    def test_recording_to_plot_in_ten_lines(self):
        lines = [line for line in BLOCKS[0].splitlines() if line.strip()]
        self.assertLessEqual(len(lines), 10)
        exec(BLOCKS[0], {})  # pylint: disable=exec-used
        times, means = self.plot.plot.call_args.args
        self.assertTrue(np.allclose(times, np.arange(48) / 100))
        frames = np.frombuffer(decoded("coded.mkv"), np.uint8)
        self.assertEqual(list(means),
                         list(frames.reshape(48, -1).mean(axis=1)))
        self.plot.savefig.assert_called_once()

    def test_all(self):
        self.assertEqual(len(BLOCKS), 5)
        names = {}
        with warnings.catch_warnings():
            for block in BLOCKS:
                exec(block, names)  # pylint: disable=exec-used
        self.assertEqual(names["subframes"].shape, (10, 4, 32, 48))
        self.assertEqual(names["fused"].shape, (10, 4, 64, 96))


if __name__ == "__main__":
    unittest.main()
