#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Python package gives what codedexposure decode writes, and says what is lost."""
import csv
import json
import os
import re
import subprocess
import sys
import unittest
import warnings

from rig import ROOT, SCRATCH, clean, decoded, pixels, run, simulate
import numpy as np
import codedexposure
from codedexposure.frame import pixels_of
from gi.repository import Gst


def setUpModule():
    simulate("plain.mkv", "--schedule", "staircase:2x2")


def tearDownModule():
    clean()


def opened(name):
    return codedexposure.open(SCRATCH / name)


def read(name):
    """The subframes, and the warnings."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        frames = list(opened(name).subframes())
    return frames, "\n".join(str(warning.message) for warning in said)


def record(name, on_frame, on_loss="gap"):
    """Records 8 coded frames, for each of which on_frame(pad, number, buffer)
    says whether it is lost."""
    def probe(pad, info):
        frame = info.get_buffer()
        lost = on_frame(pad, frame.pts // (40 * Gst.MSECOND), frame)
        return Gst.PadProbeReturn.DROP if lost else Gst.PadProbeReturn.OK

    pipeline = Gst.parse_launch(
        "videotestsrc num-buffers=32 ! video/x-raw,format=GRAY8,width=96,"
        "height=64,framerate=100/1 ! codedexposure-sim ! identity name=camera ! "
        f"dmdsync device=sim:bench on-loss={on_loss} ! codedexposure-recordmux ! "
        f"filesink location={SCRATCH / name}")
    pipeline.get_by_name("camera").get_static_pad("src").add_probe(
        Gst.PadProbeType.BUFFER, probe)
    pipeline.set_state(Gst.State.PLAYING)
    end = pipeline.get_bus().timed_pop_filtered(
        60 * Gst.SECOND, Gst.MessageType.EOS | Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)
    assert end and end.type == Gst.MessageType.EOS


def record_without(lost, name, on_loss="gap"):
    record(name, lambda pad, number, frame: number in lost, on_loss)


class Pixels(unittest.TestCase):
    """Frames are those of codedexposure decode, bit for bit."""

    def test_subframes(self):
        frames = list(opened("plain.mkv").subframes())
        self.assertEqual(frames[0].image.shape, (32, 48))
        self.assertEqual(frames[0].image.dtype, np.uint8)
        self.assertEqual(pixels(frames), decoded("plain.mkv"))

    def test_methods(self):
        frames = opened("plain.mkv").subframes(method="rank")
        self.assertEqual(pixels(frames),
                         decoded("plain.mkv", "--method", "rank"))

    def test_twelve_bits_and_rows_with_padding(self):
        simulate("deep.mkv", "--bits", "12", "--size", "90x64")
        frames = list(opened("deep.mkv").subframes())
        self.assertEqual(frames[0].image.dtype, np.uint16)
        self.assertEqual(frames[0].image.shape, (32, 45))
        self.assertEqual(frames[0].bits, 12)
        padded = np.frombuffer(decoded("deep.mkv"), np.uint16)
        expected = padded.reshape(48, 32, 46)[:, :, :45]
        self.assertTrue(np.array_equal([f.image for f in frames], expected))

    def test_fused(self):
        frames = list(opened("plain.mkv").fused("fast", full_well=10000))
        self.assertEqual(frames[0].image.shape, (64, 96))
        self.assertEqual(pixels(frames), decoded(
            "plain.mkv", "--fuse", "fast", "--full-well", "10000"))

    def test_regions(self):
        simulate("regions.mkv", "--schedule",
                 "sequential:2x2,region=32x32+32+16:sequential:4x2")
        recording = opened("regions.mkv")
        self.assertEqual(recording.schedule["regions"][0]["tile"], "4x2")
        self.assertEqual(pixels(recording.subframes(region=0)),
                         decoded("regions.mkv", "--region", "0"))

    def test_coded(self):
        coded = list(opened("plain.mkv").coded())
        self.assertEqual([f.frame for f in coded], list(range(12)))
        self.assertEqual({f.slot for f in coded}, {None})
        self.assertEqual(coded[0].image.shape, (64, 96))

    def test_frames_stay_as_they_are(self):
        frames = list(opened("plain.mkv").subframes())
        self.assertEqual(pixels(frames),
                         pixels(opened("plain.mkv").subframes()))
        self.assertFalse(frames[0].image.flags.writeable)

    def test_no_copy(self):
        buffer = Gst.Buffer.new_wrapped(bytes(range(12)))
        caps = Gst.Structure.new_from_string(
            "video/x-raw,format=GRAY8,width=3,height=3")
        image, again = pixels_of(buffer, caps), pixels_of(buffer, caps)
        self.assertEqual(image.ctypes.data, again.ctypes.data)
        row = image[0]
        del image, again
        # The one who writes gets other memory.
        buffer.fill(0, b"\xff")
        self.assertEqual(buffer.extract_dup(0, 1), b"\xff")
        self.assertEqual(row.tolist(), [0, 1, 2])


class Facts(unittest.TestCase):
    """What is known of a frame is what codedexposure decode says of it."""

    def compare_table(self, name, status=0):
        run("decode", name, "--force", "--output", "pictures/", status=status)
        with open(SCRATCH / "pictures/times.csv", encoding="ascii") as table:
            rows = list(csv.DictReader(table))
        words = {True: "true", False: "false", None: "unknown"}
        frames, said = read(name)
        # The encoder of the pictures cuts off what is before time 0.
        self.assertEqual(
            [(str(f.frame), str(f.slot), str(max(f.time_ns, 0)),
              str(f.duration_ns + min(f.time_ns, 0)), words[f.synchronised],
              words[f.corrupted], str(f.lost_before)) for f in frames],
            [tuple(row.values())[1:] for row in rows])
        return frames, said

    def test_times(self):
        frames, said = self.compare_table("plain.mkv")
        self.assertEqual(said, "")
        self.assertAlmostEqual(frames[5].time, 0.05)

    def test_synchronised(self):
        run("record", "--frames", "12", "--size", "96x64", "--schedule",
            "sequential:2x2,pilot=16", "--output", "pilot.mkv")
        frames, _ = self.compare_table("pilot.mkv")
        self.assertIs(frames[-1].synchronised, True)

    def test_lost(self):
        record_without({3, 4}, "lost.mkv")
        frames, said = self.compare_table("lost.mkv")
        self.assertIn("coded frames were lost before", said)
        self.assertEqual([f.frame for f in frames if f.lost_before], [5] * 4)
        self.assertEqual({f.lost_before for f in frames}, {0, 2})

    def test_repeated(self):
        record_without({3, 4}, "repeated.mkv", "repeat")
        frames, _ = self.compare_table("repeated.mkv")
        self.assertEqual([f.frame for f in frames if f.corrupted],
                         [3] * 4 + [4] * 4)

    def test_late(self):
        """The pictures of a frame that comes after the next one have the
        numbers of their slots, and so have those after them."""
        late = []

        def swap(pad, number, frame):
            if number == 2 and not late:
                late.append(frame)
                return True
            if number == 4:
                pad.push(late[0])
            return False

        record("late.mkv", swap)
        frames, _ = self.compare_table("late.mkv")
        order = [4 * k + slot for k in (0, 1, 3, 2, 4, 5, 6, 7)
                 for slot in range(4)]
        self.assertEqual([4 * f.frame + f.slot for f in frames], order)
        with open(SCRATCH / "pictures/times.csv", encoding="ascii") as table:
            self.assertEqual([int(row["file"][:-4])
                              for row in csv.DictReader(table)], order)

    def test_damaged(self):
        data = bytearray((SCRATCH / "plain.mkv").read_bytes())
        data[len(data) // 2] ^= 1
        (SCRATCH / "damaged.mkv").write_bytes(data)
        frames, said = self.compare_table("damaged.mkv", status=3)
        self.assertIn("frames are corrupted", said)
        self.assertEqual(sum(f.corrupted for f in frames), 4)

    def test_damaged_index(self):
        data = (SCRATCH / "plain.mkv").read_bytes()
        at = data.index(b"\xbb\x01", data.rindex(b"\x1c\x53\xbb\x6b") + 20) + 8
        (SCRATCH / "index.mkv").write_bytes(
            data[:at] + bytes([data[at] ^ 4]) + data[at + 1:])
        frames, said = read("index.mkv")
        self.assertEqual(pixels(frames), decoded("index.mkv", status=3))
        self.assertIn("damaged between its frames", said)

    def test_garbage_over_the_beginning_of_a_frame(self):
        data = bytearray((SCRATCH / "plain.mkv").read_bytes())
        begins = [at.start() for at in re.finditer(b"\x1f\x43\xb6\x75", data)]
        garbage = np.random.default_rng(3).integers(256, size=40, dtype=np.uint8)
        data[begins[4]:begins[4] + 40] = garbage.tobytes()
        (SCRATCH / "garbage.mkv").write_bytes(data)
        frames, said = read("garbage.mkv")
        self.assertEqual([f.frame for f in frames[::4]],
                         [0, 1, 2, 3, *range(5, 12)])
        self.assertEqual(pixels(frames), decoded("garbage.mkv", status=3))
        self.assertIn("damaged between its frames", said)
        self.assertIn("missing with all that is known of them: 1", said)

    def test_schedule(self):
        recording = opened("plain.mkv")
        self.assertEqual(recording.schedule["code"], "staircase")
        self.assertEqual(recording.schedule["tile"], "2x2")
        self.assertIsNone(recording.mapping)
        self.assertTrue(recording.simulated)
        self.assertIsNone(recording.bench)
        self.assertEqual(recording.rate, 25)
        self.assertEqual(recording.size, (96, 64))


    def test_bench_profile(self):
        profile = {"format": "coded-exposure-bench", "version": 1,
                   "measured": "2026-03-14T09:26:53Z",
                   "camera": {"size": [96, 64]}, "bits": 8}
        (SCRATCH / "bench.json").write_text(json.dumps(profile))
        simulate("bench.mkv", "--bench", "bench.json")
        recording = opened("bench.mkv")
        self.assertEqual(recording.bench, profile)
        again = recording.subframes(schedule=recording.schedule)
        self.assertEqual(pixels(again), pixels(recording.subframes()))


class Faults(unittest.TestCase):
    """No file hangs, and none is silently taken for whole."""

    def test_cut(self):
        data = (SCRATCH / "plain.mkv").read_bytes()
        (SCRATCH / "cut.mkv").write_bytes(data[:len(data) // 2])
        frames, said = read("cut.mkv")
        self.assertIn("the recording is cut off", said)
        self.assertNotIn("damaged", said)
        self.assertEqual(opened("cut.mkv").schedule["code"], "staircase")
        self.assertGreater(len(frames), 8)
        self.assertTrue(decoded("plain.mkv").startswith(pixels(frames)))

    def test_without_length(self):
        data = bytearray((SCRATCH / "plain.mkv").read_bytes())
        at = data.index(b"\x18\x53\x80\x67") + 4
        data[at:at + 8] = b"\x01" + b"\xff" * 7
        (SCRATCH / "stream.mkv").write_bytes(data)
        frames, said = read("stream.mkv")
        self.assertEqual(pixels(frames), decoded("plain.mkv"))
        self.assertEqual(said, "")
        (SCRATCH / "stream.mkv").write_bytes(data[:len(data) // 2])
        self.assertIn("the recording is cut off", read("stream.mkv")[1])

    def test_part_without_its_last_line(self):
        subprocess.run([sys.executable, ROOT / "tests/support/matroska.py",
                        "lose", SCRATCH / "plain.mkv", SCRATCH / "part.mkv",
                        "12"], check=True)
        frames, said = read("part.mkv")
        self.assertEqual(pixels(frames), decoded("plain.mkv"))
        self.assertIn("the recording is cut off", said)
        self.assertNotIn("damaged", said)
        self.assertEqual(len(opened("part.mkv").coded()), 12)

    def test_cut_with_a_hole(self):
        data = (SCRATCH / "plain.mkv").read_bytes()
        begins = [at.start() for at in re.finditer(b"\x1f\x43\xb6\x75", data)]
        for name, end in ("hole.mkv", None), ("twice.mkv", begins[10] + 99):
            (SCRATCH / name).write_bytes(
                data[:begins[4] + 99] + data[begins[6] + 99:end])
            with self.subTest(name):
                frames, said = read(name)
                self.assertEqual([f.frame for f in frames[::4]],
                                 [0, 1, 2, 3, *range(7, 10 if end else 12)])
                self.assertEqual(pixels(frames), decoded(name, status=3))
                self.assertIn("damaged between its frames", said)
                self.assertIn("the recording is cut off", said)
                with self.assertRaises(codedexposure.UncountableError):
                    len(opened(name).coded())

    def test_damage_anywhere(self):
        data = (SCRATCH / "plain.mkv").read_bytes()
        whole = [f.image.tobytes() for f in opened("plain.mkv").subframes()]
        first = data.index(b"\x1f\x43\xb6\x75", 400) + 4
        rng = np.random.default_rng(1)
        for at in rng.integers(first, len(data), 15):
            changed = bytearray(data)
            changed[at] ^= 1 << rng.integers(8)
            (SCRATCH / "flip.mkv").write_bytes(changed)
            with self.subTest(byte=int(at)):
                frames, said = read("flip.mkv")
                intact = [f.image.tobytes() for f in frames if not f.corrupted]
                self.assertLessEqual(set(intact), set(whole))
                self.assertTrue(said or len(intact) == len(whole))

    def test_strict(self):
        data = (SCRATCH / "plain.mkv").read_bytes()
        (SCRATCH / "cut.mkv").write_bytes(data[:len(data) // 2])
        with warnings.catch_warnings():
            warnings.simplefilter("error", codedexposure.RecordingWarning)
            with self.assertRaises(codedexposure.RecordingWarning):
                list(opened("cut.mkv").subframes())

    def test_no_frame(self):
        (SCRATCH / "head.mkv").write_bytes(
            (SCRATCH / "plain.mkv").read_bytes()[:400])
        with self.assertRaisesRegex(codedexposure.Error,
                                    "cut off and has no complete frame"):
            opened("head.mkv")

    def test_no_recording(self):
        with self.assertRaises(FileNotFoundError):
            opened("missing.mkv")
        os.mkfifo(SCRATCH / "pipe.mkv")
        for name in "pipe.mkv", ".":
            with self.assertRaisesRegex(OSError, "cannot read .*; give the name of"):
                opened(name)
        (SCRATCH / "text.mkv").write_text("no video")
        with self.assertRaisesRegex(
                codedexposure.Error,
                "not a Matroska file; use a recording of 'codedexposure record'"):
            opened("text.mkv")

    def test_decoded_before(self):
        decoded("plain.mkv")
        with self.assertRaisesRegex(codedexposure.Error, "were decoded before"), \
                warnings.catch_warnings():
            warnings.simplefilter("ignore")
            list(opened("fast.mkv").subframes())

    def test_wrong_regions(self):
        recording = opened("plain.mkv")
        with self.assertRaisesRegex(ValueError, "region is 0 or more, not -1"):
            recording.subframes(region=-1)
        with self.assertRaisesRegex(TypeError, "float"):
            recording.subframes(region=1.5)

    def test_wrong_values(self):
        recording = opened("plain.mkv")
        for text, options in {
                "was requested, but": {"region": 1},
                "'nix' is no code": {"schedule": "nix:2x2"}}.items():
            with self.assertRaisesRegex(codedexposure.Error, text):
                list(recording.subframes(**options))
        for options in {"bits": 40}, {"method": "nix"}:
            with self.assertRaises(ValueError):
                recording.subframes(**options)

    def test_iteration_can_be_left(self):
        for _ in range(3):
            for frame in opened("plain.mkv").subframes():
                self.assertEqual(frame.slot, 0)
                break


if __name__ == "__main__":
    unittest.main()
