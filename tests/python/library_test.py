#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The binding of the C++ library gives what the elements give."""
import sys
import unittest

import rig
import numpy as np
import codedexposure
try:
    from codedexposure import library
except ImportError:
    print("skipped: it was not built; apt-get install pybind11-dev python3-dev")
    rig.clean()
    sys.exit(77)


def frames(kind, white, shape=(3, 24, 32)):
    return np.random.default_rng(1).integers(white, size=shape, dtype=kind)


class Library(unittest.TestCase):
    @classmethod
    def tearDownClass(cls):
        rig.clean()

    def test_extracts_what_the_demux_extracts(self):
        for bind, coded, bits in (
                (library.Extractor8, frames(np.uint8, 256), 0),
                (library.Extractor16, frames(np.uint16, 4096), 12)):
            for schedule in ("staircase:2x2", "sequential:lattice:8/3"):
                extract = bind(schedule, 32, 24, bits=bits)
                expected = codedexposure.decode_array(coded, schedule, bits=bits)
                self.assertTrue(np.array_equal(
                    [extract(frame) for frame in coded], expected))

    def test_fuses_what_fuse_fuses(self):
        coded = frames(np.uint8, 256)
        fuser = library.Fuser8("sequential:2x2", 32, 24, "fast", lookahead=1,
                               full_well=10000)
        for frame in coded:
            fuser.take(frame)
        fused = [fuser.fuse() for _ in range(fuser.pending)]
        self.assertTrue(np.array_equal(fused, codedexposure.fuse_array(
            coded, "sequential:2x2", "fast", full_well=10000)))

    def test_strided_frames(self):
        wide = frames(np.uint8, 256, (24, 96))
        extract = library.Extractor8("sequential:2x2", 32, 24)
        for view in (wide[:, 40:72], wide[:, ::3], wide[::-1, :32]):
            self.assertTrue(np.array_equal(extract(view),
                                           extract(view.copy())))

    def test_results_do_not_change(self):
        extract = library.Extractor8("sequential:2x2", 32, 24)
        first = extract(np.zeros((24, 32), np.uint8))
        extract(np.full((24, 32), 9, np.uint8))
        self.assertEqual(first.max(), 0)

    def test_errors(self):
        with self.assertRaisesRegex(ValueError, "is no code"):
            library.Extractor8("nix:2x2", 32, 24)
        with self.assertRaisesRegex(ValueError, "not auto, rank"):
            library.Extractor8("sequential:2x2", 32, 24, "nix")
        extract = library.Extractor8("sequential:2x2", 32, 24)
        with self.assertRaises(ValueError):
            extract(np.zeros((24, 31), np.uint8))
        with self.assertRaisesRegex(ValueError, "2 dimensions"):
            extract(np.zeros((1, 24, 32), np.uint8))
        with self.assertRaises(TypeError):
            extract(np.zeros((24, 32)))
        with self.assertRaises(ValueError):
            library.Fuser8("sequential:2x2", 32, 24).fuse()


if __name__ == "__main__":
    unittest.main()
