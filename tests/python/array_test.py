#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Arrays are simulated and decoded as the scripts do it."""
import subprocess
import sys
import textwrap
import unittest

from rig import ROOT, SCRATCH, clean, pixels, play, simulate
import numpy as np
import codedexposure


def setUpModule():
    simulate("plain.mkv", "--schedule", "staircase:2x2")


def tearDownModule():
    clean()


def scene_as_simulated():
    play("codedexposure-scene scene=pour num-buffers=48 ! video/x-raw,"
         "format=GRAY8,width=96,height=64,framerate=100/1 ! filesink "
         "location=scene.raw")
    return np.fromfile(SCRATCH / "scene.raw", np.uint8).reshape(48, 64, 96)


class Arrays(unittest.TestCase):
    def setUp(self):
        self.recording = codedexposure.open(SCRATCH / "plain.mkv")
        self.coded = np.stack([f.image for f in self.recording.coded()])

    def test_simulate(self):
        coded = codedexposure.simulate(scene_as_simulated(), "staircase:2x2")
        self.assertTrue(np.array_equal(coded, self.coded))

    def test_simulate_with_rows_of_any_length(self):
        scene = np.random.default_rng(1).integers(
            65536, size=(9, 6, 7), dtype=np.uint16)
        coded = codedexposure.simulate(scene, "sequential:3x1")
        self.assertEqual(coded.shape, (3, 6, 7))
        for x in range(7):
            self.assertTrue(np.array_equal(coded[:, :, x], scene[x % 3::3, :, x]))

    def test_decode(self):
        subframes = codedexposure.decode_array(self.coded,
                                               self.recording.schedule)
        self.assertEqual(subframes.shape, (12, 4, 32, 48))
        self.assertEqual(subframes.tobytes(),
                         pixels(self.recording.subframes()))

    def test_select_is_slicing(self):
        subframes = codedexposure.decode_array(self.coded, "sequential:2x2")
        for slot in range(4):
            self.assertTrue(np.array_equal(
                subframes[:, slot],
                self.coded[:, slot // 2::2, slot % 2::2]))

    def test_fuse(self):
        frames = codedexposure.fuse_array(self.coded, self.recording.schedule,
                                          "fast")
        self.assertEqual(frames.tobytes(), pixels(self.recording.fused("fast")))

    def test_overlap(self):
        frames = codedexposure.fuse_array(self.coded, "sequential:2x2", "fast",
                                          overlap=2)
        both, alone = (pixels(self.recording.fused(
            "fast", schedule="sequential:2x2", overlap=overlap))
            for overlap in (2, 1))
        self.assertTrue(frames.tobytes() == both)
        self.assertFalse(both == alone)

    def test_errors(self):
        for array in (self.coded.astype(float), self.coded[0]):
            with self.assertRaisesRegex(TypeError, "give uint8 or uint16"):
                codedexposure.decode_array(array, "sequential:2x2")
        with self.assertRaisesRegex(codedexposure.Error, "is no code"):
            codedexposure.decode_array(self.coded, "nix:2x2")
        with self.assertRaisesRegex(ValueError, "bits is from 0 to 16, not 40"):
            codedexposure.decode_array(self.coded, "sequential:2x2", bits=40)
        with self.assertRaisesRegex(ValueError, "3 pictures fill no"):
            codedexposure.simulate(self.coded[:3])
        with self.assertRaisesRegex(
                ValueError, "method is auto, rank, select or decode, not magic"):
            codedexposure.decode_array(self.coded, "sequential:2x2",
                                       method="magic")
        with self.assertRaisesRegex(ValueError, "quality is fast, .*not nix"):
            codedexposure.fuse_array(self.coded, "sequential:2x2", "nix")
        for rate in (0, -25, float("nan"), float("inf")):
            with self.assertRaisesRegex(ValueError, "rate is a number of frames"):
                codedexposure.decode_array(self.coded, "sequential:2x2",
                                           rate=rate)
        for shape in ((2, 0, 0), (2, 4, 0)):
            with self.assertRaisesRegex(ValueError, "have no pixels"):
                codedexposure.decode_array(np.zeros(shape, np.uint8),
                                           "sequential:2x2")

    def test_any_schedule_as_a_dict(self):
        mapping = {"format": "coded-exposure-mapping", "version": 1,
                   "camera": [96, 64], "mirrors": [96, 64],
                   "homography": [1, 0, 0, 0, 1, 0, 0, 0, 1]}
        self.assertTrue(np.array_equal(
            codedexposure.decode_array(self.coded, self.recording.schedule,
                                       mapping=mapping)[:, :, 2:-2, 2:-2],
            codedexposure.decode_array(self.coded, "staircase:2x2")
            [:, :, 2:-2, 2:-2]))


class Processes(unittest.TestCase):
    """Copies of a process that has used the package."""

    def in_child(self, work):
        """What a forked child, which ends as any program does, prints."""
        code = textwrap.dedent("""
            import os, sys
            sys.path[:0] = [%r]
            import numpy as np
            import codedexposure
            coded = np.zeros((2, 4, 4), np.uint8)
            def decode():
                return codedexposure.decode_array(
                    coded, {"format": "coded-exposure", "version": 1,
                            "tile": "2x2", "code": "sequential"})
            def told():
                try:
                    decode()
                except codedexposure.Error as error:
                    print(error)
            decode()
            if os.fork() == 0:
                %s
                sys.exit()
            os.wait()
            decode()
            print("parent goes on")
            """) % (str(ROOT / "python"), work)
        done = subprocess.run([sys.executable, "-c", code], text=True,
                              capture_output=True, timeout=60, check=False)
        self.assertEqual(done.stderr, "")
        return done.stdout

    def test_a_child_that_ends_takes_nothing_along(self):
        self.assertEqual(self.in_child("pass"), "parent goes on\n")

    def test_a_child_that_decodes_is_told_why_it_cannot(self):
        self.assertRegex(
            self.in_child("told()"),
            'was forked .*get_context\\("spawn"\\).*\nparent goes on')


if __name__ == "__main__":
    unittest.main()
