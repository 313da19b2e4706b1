#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Python of docs/analyse.md runs as printed."""
import json
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


class Names(unittest.TestCase):
    def test_completion_offers_them(self):
        self.assertLessEqual(set(codedexposure.__all__), set(dir(codedexposure)))
        self.assertIn("open", codedexposure.__all__)


class Examples(unittest.TestCase):
    def setUp(self):
        # matplotlib brings 100 MB of packages; what is tested is what it gets.
        self.plot = mock.Mock()
        library = types.ModuleType("matplotlib")
        library.pyplot = self.plot
        # So do napari and Jupyter.
        self.napari = mock.Mock()
        modules = {"matplotlib": library, "matplotlib.pyplot": self.plot,
                   "napari": self.napari}
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
        self.assertEqual(len(BLOCKS), 6)
        names = {}
        with warnings.catch_warnings():
            for block in BLOCKS:
                exec(block, names)  # pylint: disable=exec-used
        add = self.napari.Viewer.return_value.add_image
        self.assertEqual([call.args[0].shape for call in add.call_args_list],
                         [(48, 32, 48), (48, 64, 96)])
        self.assertEqual(add.call_args_list[0].kwargs["scale"], (1, 2, 2))
        self.assertEqual(names["subframes"].shape, (10, 4, 32, 48))
        self.assertEqual(names["fused"].shape, (10, 4, 64, 96))

    def test_the_notebook(self):
        notebook = json.loads((ROOT / "docs/analyse.ipynb").read_text())
        self.assertEqual(notebook["nbformat"], 4)
        axes = [mock.Mock() for _ in range(5)]
        panes = mock.Mock(), mock.Mock()
        self.plot.subplots.side_effect = [(None, axes), (None, panes)]
        names = {}
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                exec("".join(cell["source"]), names)  # pylint: disable=exec-used
        shown = [axis.imshow.call_args.args[0] for axis in axes]
        whole = names["recording"].subframes()
        self.assertEqual(shown[0].shape, (64, 96))
        for slot in range(4):
            self.assertTrue(np.array_equal(shown[1 + slot],
                                           whole[4 * names["middle"] + slot].image))
        times, means = panes[0].plot.call_args.args
        self.assertEqual(len(times), 48)
        self.assertEqual(means[7], whole[7].image.mean())
        self.assertEqual(len(panes[1].plot.call_args.args[1]), 47)


if __name__ == "__main__":
    unittest.main()
