#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Frames of a recording by index and slice are those of a loop."""
import re
import subprocess
import sys
import unittest
from unittest import mock
import warnings

from rig import BUILD, ROOT, SCRATCH, clean, play, run, simulate
import numpy as np
import codedexposure
from gi.repository import Gst


def camera_file(name, *options):
    """plain.mkv with the times of a camera, which begins late."""
    subprocess.run([BUILD / "tests/pipeline/camera_file", "plain.mkv", name,
                    *options], cwd=SCRATCH, check=True)


def setUpModule():
    simulate("plain.mkv", "--frames", "60")
    camera_file("camera.mkv", "--lose=8-27", "--corrupt=33-33")
    camera_file("pattern.mkv", "--pattern=36-38")
    camera_file("changed.mkv", "--setup=35:sequential:3x3")
    whole = (SCRATCH / "camera.mkv").read_bytes()
    (SCRATCH / "cut.mkv").write_bytes(whole[:len(whole) // 2])
    data = bytearray((SCRATCH / "plain.mkv").read_bytes())
    data[data.index(b"\xbb\x01", data.rindex(b"\x1c\x53\xbb\x6b") + 20) + 8] ^= 4
    (SCRATCH / "damaged.mkv").write_bytes(data)
    data = bytearray(whole)
    for number in (5, 30, 40, 41, 42, 43, 44, 45, 59):
        data[data.index(b'{"frame":%d,' % number) + 1] ^= 1
    (SCRATCH / "gaps.mkv").write_bytes(data)
    play("videotestsrc num-buffers=12 ! video/x-raw,format=GRAY8,width=96,"
         "height=64,framerate=25/1 ! avenc_ffv1 ! matroskamux ! "
         "filesink location=trackless.mkv")
    run("record", "--fast", "--frames", "16", "--size", "96x64", "--codec",
        "raw", "--schedule", "sequential:lattice:8/3", "--output", "raw.mkv")


def tearDownModule():
    clean()


def opened(name):
    return codedexposure.open(SCRATCH / name)


def same(one, other):
    return one == other and np.array_equal(one.image, other.image)


class Sequence(unittest.TestCase):
    def check(self, frames):
        whole = list(frames)
        self.assertEqual(len(frames), len(whole))
        count = len(whole)
        for index in (0, 1, 5, count // 2 + 1, count - 1, -1, -count):
            self.assertTrue(same(frames[index], whole[index]), index)
        for part in (slice(3, 17, 5), slice(None, None, 7), slice(-9, None),
                     slice(10, 2, -3), slice(5, 5), slice(0, 4)):
            self.assertEqual(len(frames[part]), len(whole[part]), part)
            self.assertTrue(all(map(same, frames[part], whole[part])), part)
        self.assertTrue(same(frames[4:][2:9][3], whole[9]))
        self.assertTrue(same(next(reversed(frames)), whole[-1]))
        for beyond in (count, -count - 1):
            with self.assertRaisesRegex(
                    IndexError, f"no frame {beyond}: .* has {count} here"):
                frames[beyond]  # pylint: disable=pointless-statement

    def check_all(self, name):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", codedexposure.RecordingWarning)
            recording = opened(name)
            self.check(recording.coded())
            self.check(recording.subframes())
            self.check(recording.fused("fast"))

    def test_warnings_say_times_of_frames(self):
        """Those of the file begin at 6.4 s."""
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", codedexposure.RecordingWarning)
            frames = list(opened("camera.mkv").coded())
        after = next(frame for frame in frames if frame.lost_before)
        self.assertIn(f"were lost before {after.time:.3f} s: 20",
                      str(said[0].message))

    def test_of_a_bench(self):
        self.check_all("plain.mkv")

    def test_of_a_camera(self):
        self.check_all("camera.mkv")

    def test_with_a_pattern(self):
        self.check_all("pattern.mkv")
        self.assertEqual(len(opened("pattern.mkv").subframes()), 4 * 57)

    def test_that_was_cut_off(self):
        self.check_all("cut.mkv")

    def test_the_last_frame_of_one_that_was_cut_off_warns(self):
        for frames in opened("cut.mkv").coded(), opened("cut.mkv").subframes():
            for read in (lambda f: f[-1], lambda f: list(f[-3:]),
                         lambda f: list(f.between(0.5))):
                with self.assertWarnsRegex(codedexposure.RecordingWarning,
                                           "the recording is cut off"):
                    read(frames)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                frames[2]  # pylint: disable=pointless-statement

    def test_without_lines_of_the_track(self):
        self.check_all("gaps.mkv")
        frames = opened("gaps.mkv").coded()
        self.assertEqual(len(frames), 40)
        for index, number in ((5, 5), (10, 30), (20, 40), (25, 45), (39, 59)):
            with self.assertWarnsRegex(codedexposure.RecordingWarning,
                                       "the track has no line for it") as said:
                frame = frames[index]
            self.assertEqual(frame.frame, number)
            self.assertTrue(frame.corrupted)
            self.assertNotIn("frame 0", str(said.warnings[0].message))

    def test_without_a_track_no_part_says_numbers(self):
        """They are counted from the first frame by time."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", codedexposure.RecordingWarning)
            recording = opened("trackless.mkv")
            frames = recording.subframes(schedule="sequential:2x2")
            self.assertEqual([frame.frame for frame in frames][::4], [*range(12)])
            self.assertIsNone(frames[20].frame)
            self.assertIsNone(recording.coded()[5].frame)

    def test_raw(self):
        self.check_all("raw.mkv")

    def test_a_part_warns_of_its_own_losses_only(self):
        frames = opened("camera.mkv").subframes()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            list(frames[4:12])
        with self.assertWarnsRegex(codedexposure.RecordingWarning, "lost.*: 20"):
            list(frames[28:40])

    def test_a_part_is_silent_about_what_was_read_before_it(self):
        seek = Gst.Pipeline.seek

        def seek_late(pipeline, *args):
            pipeline.get_bus().post(Gst.Message.new_element(
                pipeline, Gst.Structure.new_from_string(
                    "codedexposure/stream-incomplete, count=(guint64)20")))
            return seek(pipeline, *args)

        with warnings.catch_warnings(), \
                mock.patch.object(Gst.Pipeline, "seek", seek_late):
            warnings.simplefilter("error")
            list(opened("camera.mkv").coded()[1:3])

    def test_a_frame_that_cannot_be_decoded(self):
        subprocess.run([sys.executable, ROOT / "tests/support/matroska.py", "spoil",
                        "plain.mkv", "spoiled.mkv", "7"], cwd=SCRATCH, check=True)
        recording = opened("spoiled.mkv")
        for frames in recording.coded(), recording.subframes():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", codedexposure.RecordingWarning)
                before = [frame.time_ns for frame in frames]
                each = len(before) // 59
                self.assertEqual(len(frames), 60 * each)
                # What was asked before does not change the loop.
                self.assertEqual([frame.time_ns for frame in frames], before)
                self.assertEqual(frames[8 * each].frame, 8)
                with self.assertRaisesRegex(codedexposure.Error,
                                            "some cannot be decoded"):
                    list(frames[5 * each:9 * each])
                with self.assertRaises(codedexposure.Error):
                    frames[7 * each]  # pylint: disable=pointless-statement
            with self.assertWarnsRegex(codedexposure.RecordingWarning, "missing: 1"):
                list(frames)

    def check_uncountable(self, name, why):
        recording = opened(name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", codedexposure.RecordingWarning)
            self.assertGreater(len(list(recording.subframes())), 200)
        with self.assertRaisesRegex(codedexposure.UncountableError, why):
            recording.subframes()[3]  # pylint: disable=expression-not-assigned

    def test_a_schedule_that_changes_leaves_the_loop(self):
        self.check_uncountable("changed.mkv", "the schedule changes within")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", codedexposure.RecordingWarning)
            self.check(opened("changed.mkv").coded())

    def test_a_damaged_index_leaves_the_loop(self):
        self.check_uncountable("damaged.mkv", "index or the tags are damaged")


class Whole(unittest.TestCase):
    def test_duration(self):
        self.assertAlmostEqual(opened("plain.mkv").duration, 2.4, places=9)

    def test_with(self):
        with opened("plain.mkv") as recording:
            self.assertEqual(len(recording.coded()), 60)

    def test_version(self):
        text = (ROOT / "meson.build").read_text()
        self.assertEqual(codedexposure.__version__,
                         re.search(r"version: '([0-9.]+)'", text)[1])

    def test_a_part_by_time(self):
        for name in ("plain.mkv", "camera.mkv"):
            recording = opened(name)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", codedexposure.RecordingWarning)
                whole = list(recording.subframes())
                coded = list(recording.coded())
            begin = coded[0].time_ns
            frames = recording.subframes()
            for start, stop in ((0, None), (0.2, 1.1), (0.5, 0.5), (7, 9)):
                chosen = [frame.frame for frame in coded
                          if start * 1e9 <= frame.time_ns - begin
                          < (stop or 1e9) * 1e9]
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", codedexposure.RecordingWarning)
                    part = list(frames.between(start, stop))
                self.assertEqual(len(part), 4 * len(chosen), (name, start))
                wanted = [frame for frame in whole if frame.frame in chosen]
                self.assertEqual(len(wanted), len(part))
                self.assertTrue(all(map(same, part, wanted)))
        self.assertEqual(len(frames.between(0.5, float("inf"))),
                         len(frames.between(0.5)))
        for start, stop in ((-1, None), ("nan", None), (0, "nan"), ("inf", None)):
            with self.assertRaisesRegex(ValueError, f"not from {float(start)} to"):
                frames.between(float(start), stop and float(stop))
        with self.assertRaisesRegex(ValueError, "not from 2 to 1"):
            frames.between(2, 1)
        with self.assertRaisesRegex(ValueError, "a part already"):
            frames[4:8].between(0, 1)

    def test_uncertainty_is_that_of_decode(self):
        run("decode", "plain.mkv", "--fuse", "fast", "--full-well", "5000",
            "--output", "fused.mkv", "--uncertainty", "uncertain.mkv")
        frames = opened("plain.mkv").uncertainty("fast", full_well=5000)
        self.assertEqual(frames[0].image.dtype, np.uint16)
        play("filesrc location=uncertain.mkv ! matroskademux ! avdec_ffv1 ! "
             "filesink location=uncertain.raw")
        wanted = np.fromfile(SCRATCH / "uncertain.raw", np.uint16)
        got = np.stack([frame.image for frame in frames])
        self.assertTrue(np.array_equal(wanted, got.ravel()))
        self.assertGreater(got.max(), 0)


class Arrays(unittest.TestCase):
    def test_a_frame(self):
        frame = opened("plain.mkv").coded()[3]
        self.assertIs(np.asarray(frame), frame.image)
        self.assertEqual(np.asarray(frame, np.float32).dtype, np.float32)
        copy = np.array(frame)
        self.assertTrue(copy.flags.writeable)
        self.assertTrue(np.array_equal(copy, frame.image))
        self.assertEqual(np.mean(frame), frame.image.mean())
        self.assertIs(frame.__array__(copy=False), frame.image)
        self.assertIsNot(frame.__array__(copy=True), frame.image)
        with self.assertRaisesRegex(ValueError, "leave out copy=False"):
            frame.__array__(np.float32, copy=False)

    def test_frames(self):
        frames = opened("plain.mkv").subframes()
        images = np.stack([frame.image for frame in frames])
        for array in np.asarray(frames), np.stack(list(frames)):
            self.assertEqual(array.dtype, np.uint8)
            self.assertTrue(np.array_equal(array, images))
        self.assertTrue(np.array_equal(np.asarray(frames[8:3:-2], float),
                                       images[8:3:-2]))
        with self.assertRaisesRegex(ValueError, "no frame here"):
            np.asarray(frames[5:5])
        with self.assertRaisesRegex(ValueError, "leave out copy=False"):
            frames.__array__(copy=False)


class TwoCameras(unittest.TestCase):
    def test_pictures_are_those_of_decode(self):
        for name, beam in ("first", "on"), ("second", "off"):
            play("codedexposure-scene scene=candle num-buffers=40 ! video/x-raw,"
                 "format=GRAY8,width=96,height=64,framerate=100/1 ! "
                 f"codedexposure-sim schedule=sequential:lattice:4/2 beam={beam} ! "
                 f"dmdsync schedule=sequential:lattice:4/2 beam={beam} ! "
                 f"codedexposure-recordmux ! filesink location={name}.mkv")
        run("decode", "first.mkv", "--second", "second.mkv", "--fuse", "fast",
            "--output", "both.mkv")
        play("filesrc location=both.mkv ! matroskademux ! avdec_ffv1 ! "
             "filesink location=both.raw")
        self.assertEqual(opened("second.mkv").schedule, opened("first.mkv").schedule)
        frames = opened("first.mkv").fused("fast", second=SCRATCH / "second.mkv")
        self.assertEqual(b"".join(frame.image.tobytes() for frame in frames),
                         (SCRATCH / "both.raw").read_bytes())
        with self.assertRaisesRegex(codedexposure.UncountableError, "second camera"):
            len(frames)
        with self.assertRaises(FileNotFoundError):
            opened("first.mkv").fused(second="none.mkv")

    def test_a_recording_of_both_has_complements(self):
        run("record", "--both", "--fast", "--frames", "12", "--size", "96x64",
            "--output", "pairs.mkv")
        run("record", "--fast", "--frames", "12", "--size", "96x64",
            "--output", "on.mkv", "--second", "off.mkv")
        pairs = opened("pairs.mkv")
        frames = list(pairs.coded())
        self.assertEqual(len(frames), 12)
        for frame, on, off in zip(frames, opened("on.mkv").coded(),
                                  opened("off.mkv").coded()):
            self.assertTrue(np.array_equal(frame.image, on.image))
            self.assertTrue(np.array_equal(frame.complement, off.image))
            self.assertTrue(np.array_equal(frame, on.image))
            self.assertEqual(frame.complement.time_ns, frame.time_ns)
        self.assertTrue(np.array_equal(pairs.coded()[7].complement.image,
                                       frames[7].complement.image))
        self.assertIsNone(next(iter(pairs.subframes())).complement)
        self.assertIsNone(opened("on.mkv").coded()[0].complement)
        fused = opened("on.mkv").fused("fast", second=SCRATCH / "off.mkv")
        for one, other in zip(pairs.fused("fast"), fused, strict=True):
            self.assertTrue(np.array_equal(one.image, other.image))
        bright, dark = (pairs.fused("fast", range=white)[20].image.astype(int)
                        for white in (1, 2))
        self.assertGreater(bright.max(), 200)
        self.assertLess(np.abs(2 * dark - bright).mean(), 1)
        with self.assertRaisesRegex(ValueError, "range is from 1 to 16, not 17"):
            list(pairs.fused("fast", range=17))


if __name__ == "__main__":
    unittest.main()
