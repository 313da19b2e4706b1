# SPDX-License-Identifier: LGPL-2.1-or-later
"""A recording of coded frames."""
from __future__ import annotations

import builtins
import json
import operator
import os
import re
import stat
from collections.abc import Iterator
from contextlib import closing
from fractions import Fraction

from ._pipeline import (ContainerError, Error, Player, UncountableError,
                        element, quoted)
from .frame import Frame, frame_of, number_of, position_of, shows_pattern
from .frames import Frames

_NOT_OF_SCHEDULE = ("mapping", "size", "rate", "bits", "track", "simulated",
                    "bench", "partner", "beam")
_CUT = "the recording is cut off; what could be decoded was"


def open(path: str | os.PathLike) -> Recording:  # pylint: disable=W0622
    """Opens a recording, a .mkv file of "codedexposure record" or "simulate".

    Raises OSError if the file cannot be read, and Error if it has no coded
    frame.
    """
    return Recording(path)


def _schedule_of(setup: dict) -> dict:
    return {key: value for key, value in setup.items()
            if key not in _NOT_OF_SCHEDULE}


class Recording:
    """The coded frames of a recording, and what can be decoded from them.

    subframes (), fused () and coded () are sequences: loop over them, or take
    frames by index and slice. If frames were lost or damaged, or the recording
    was cut off, a RecordingWarning says so as soon as it is known, at the
    latest after the last frame.
    """

    def __init__(self, path: str | os.PathLike):
        self.path = os.fspath(path)
        self._places: list[tuple[int, int | None, bool]] | None = None
        self._is_uniform = True
        self._check()
        first, setup = self._look()
        self.size: tuple[int, int] = (first.image.shape[1], first.image.shape[0])
        """Width and height of the coded frames, pixels."""
        self.schedule: dict | None = setup and _schedule_of(setup)
        """The JSON form of the schedule; None: the recording has none, and
        decoding needs the argument schedule."""
        self.mapping: dict | None = setup and setup.get("mapping")
        """The JSON form of the mapping from pixels to mirrors; None: not
        known."""
        self.bench: dict | None = setup and setup.get("bench")
        """The JSON form of the bench profile; None: not known."""
        self.simulated: bool = bool(setup and setup.get("simulated"))
        """The recording says that its frames are those of a simulated bench."""
        rate = setup and setup.get("rate")
        self.rate: Fraction | None = Fraction(*rate) if rate else None
        """Coded frames per second; None: not known."""

    def __repr__(self):
        return f"<Recording {self.path}, {self.size[0]}x{self.size[1]}>"

    def subframes(self, *, method: str | None = None, region: int | None = None,
                  schedule: str | os.PathLike | dict | None = None,
                  mapping: str | os.PathLike | dict | None = None,
                  bits: int | None = None) -> Frames:
        """The subframes in the order of their times.

        method    auto, rank, select or decode
        region    the subframes of this region, from 0 on, instead of the
                  background
        schedule  a preset, a JSON file, or the dict of its JSON form, instead
                  of that of the recording
        mapping   a JSON file or its dict, instead of that of the recording
        bits      significant bits of the pixels, instead of those of the
                  recording
        """
        if region is not None and operator.index(region) < 0:
            raise ValueError(f"region is 0 or more, not {region}")
        pad = "src" if region is None else f"region_{operator.index(region)}"
        return Frames(
            self, "queue max-size-buffers=8 ! "
            + element("codedexposure-demux", name="demux",
                      require_schedule=True, method=method, schedule=schedule,
                      mapping=mapping, bits=bits) + f" demux.{pad} !")

    def fused(self, quality: str = "balanced", *,
              second: str | os.PathLike | None = None,
              full_well: float | None = None, read_noise: float | None = None,
              range: int | None = None,  # pylint: disable=redefined-builtin
              schedule: str | os.PathLike | dict | None = None,
              mapping: str | os.PathLike | dict | None = None,
              bits: int | None = None, overlap: int | None = None) -> Frames:
        """Full-size frames at the rate of the subframes.

        quality     fast, balanced, best or learned
        second      the recording of a second camera in the other beam; these
                    frames can only be read in a loop
        full_well   noise of the camera: electrons at white, e-; 0: no noise
        read_noise  noise of the camera, e- rms
        range       of both cameras: white of the frames in whites of the first
                    one, whose saturated pixels are seen by the second behind a
                    filter
        overlap     exposures that are fused for each coded frame, 1 to 8; beyond
                    1, those between two frames make the first and last slots
                    as true as the others, in as many times the time
        The rest is as for subframes ().
        """
        fuse = self._fuse(quality, full_well, read_noise, range, schedule,
                          mapping, bits, overlap) + " !"
        if second is None:
            return Frames(self, fuse)
        Recording(second)  # raises what is wrong with it
        return Frames(
            self, f"pair.on filesrc location={quoted(os.fspath(second))} ! "
            f"codedexposure-recorddemux ! pair.off codedexposure-pair name=pair ! "
            f"{fuse}", countable=False)

    def uncertainty(self, quality: str = "balanced", *,
                    full_well: float | None = None,
                    read_noise: float | None = None,
                    range: int | None = None,  # pylint: disable=redefined-builtin
                    schedule: str | os.PathLike | dict | None = None,
                    mapping: str | os.PathLike | dict | None = None,
                    bits: int | None = None, overlap: int | None = None) -> Frames:
        """How uncertain each pixel of fused () is, with the same arguments:
        frames whose image has half the width of the interval that holds 68 %
        of the errors, in 1/65280 of white.
        """
        return Frames(self, self._fuse(
            quality, full_well, read_noise, range, schedule, mapping, bits,
            overlap) + " fuse. ! queue leaky=downstream ! fakesink sync=false async=false "
            "fuse.uncertainty ! queue max-size-buffers=1 !")

    @staticmethod
    def _fuse(quality, full_well, read_noise, white, schedule, mapping, bits,
              overlap) -> str:
        return "queue max-size-buffers=1 ! " + element(
            "codedexposure-fuse", name="fuse", lookahead=1,
            require_schedule=True, quality=quality, full_well=full_well,
            read_noise=read_noise, range=white, schedule=schedule,
            mapping=mapping, bits=bits, overlap=overlap)

    def coded(self) -> Frames:
        """The coded frames as the camera delivered them."""
        return Frames(self, "")

    @property
    def duration(self) -> float:
        """From the first coded frame to the end of the last one, s."""
        last = self.coded()[-1]
        return (last.time_ns + (last.duration_ns or 0)) * 1e-9

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_):
        """Nothing is open between calls."""

    # ---------------------------------------------------------------- file --

    def _check(self) -> None:
        # To open a pipe may wait for ever.
        if not stat.S_ISREG(os.stat(self.path).st_mode):
            raise OSError(f"cannot read {self.path}; give the name of a recording")
        with builtins.open(self.path, "rb") as file:
            head = file.read(100000)
        if head[:4] != b"\x1a\x45\xdf\xa3":
            raise Error(f"{self.path} is not a Matroska file; use a recording "
                        "of 'codedexposure record' or 'codedexposure simulate'")
        codecs = re.findall(rb"[VA]_[A-Z0-9/_]{3,30}|FFV1", head)
        if codecs and not any(b"FFV1" in codec or codec == b"V_UNCOMPRESSED"
                              for codec in codecs):
            raise Error(f"{self.path} has {codecs[0].decode()}, but coded "
                        "frames are recorded as FFV1 or raw")
        at = head.find(b"\x18\x53\x80\x67", 0, 4096)
        size = head[at + 4:at + 12]
        # One that was not finished, or went through a pipe, says no length.
        self._open = (at < 0 or len(size) < 8 or size[0] != 1
                      or size[1:] == b"\xff" * 7)
        # It is shorter than its head says, or ended without its last line.
        self._cut = (b"S_TEXT/UTF8" not in head if self._open else
                     at + 12 + int.from_bytes(size[1:], "big")
                     > os.path.getsize(self.path))

    def _description(self, decoder: str, salvage: bool,
                     decode: bool = True) -> str:
        return (f"filesrc location={quoted(self.path)} ! "
                f"codedexposure-recorddemux salvage={salvage} decode={decode} ! "
                f"{decoder} appsink name=out sync=false max-buffers=8")

    def _play(self, decoder: str,
              quiet: bool = False) -> Iterator[tuple[Player, Frame]]:
        last = None  # that was given out, ns
        for salvage in (False, True):
            player = Player(self._description(decoder, salvage), self.path,
                            quiet)
            try:
                with player:
                    for sample in player:
                        frame = frame_of(sample)
                        # The second run begins with those of the first.
                        if last is None or frame.time_ns > last or not salvage:
                            last = (frame.time_ns if last is None else
                                    max(last, frame.time_ns))
                            yield player, frame
                    if (player.was_cut and not salvage
                            and self._goes_on(last, bool(decoder))):
                        raise ContainerError("its end was not reached")
                    self._cut |= player.was_cut
                break
            except ContainerError as damage:
                if salvage:
                    raise self._no_frame(damage) from None
                player.warn("the file is damaged between its frames; reading "
                            "it from front to back")
        if last is None:
            raise self._no_frame()
        if self._cut:
            player.warn(_CUT)

    def _goes_on(self, last: int | None, decoded: bool) -> bool:
        """Of one whose end was not reached: whether frames follow the last one
        that was, behind damage."""
        with Player(self._description("", True, decode=False), self.path,
                    quiet=True) as player:
            return any((last is None or position_of(sample) > last)
                       and not (decoded and shows_pattern(sample))
                       for sample in player)

    def play_whole(self, decoder: str) -> Iterator[Frame]:
        """What the decoder gives, of all coded frames."""
        for _, frame in self._play(decoder):
            yield frame

    def play_part(self, decoder: str, start: int, stop: int | None,
                  quiet: bool = False) -> Iterator[Frame]:
        """The same of the coded frames at times of [start, stop), ns."""
        with Player(self._description(decoder, False), self.path, quiet,
                    part=(start, stop)) as player:
            if self._cut and stop is None:
                player.warn(_CUT)
            for sample in player:
                # A coded frame before may last until the start.
                if position_of(sample) >= start:
                    yield frame_of(sample)

    def coded_places(self, decoded: bool) -> list[tuple[int, int | None]]:
        """The times, ns, and the numbers of all coded frames, or of those that
        are decoded."""
        if self._places is None:
            self._places = self._read_places()
        if decoded and not self._is_uniform:
            raise UncountableError(
                f"the schedule changes within {self.path}, so its pictures "
                "have no numbers; read them in a loop")
        return [(time, number) for time, number, pattern in self._places
                if not (decoded and pattern)]

    def _read_places(self) -> list[tuple[int, int | None, bool]]:
        try:
            with Player(self._description("", False, decode=False), self.path,
                        quiet=True) as player:
                places = [(position_of(sample), number_of(sample),
                           shows_pattern(sample)) for sample in player]
                if player.was_cut and self._goes_on(
                        max(time for time, *_ in places) if places else None,
                        False):
                    raise ContainerError("its end was not reached")
                self._cut |= player.was_cut
        except ContainerError as damage:
            raise UncountableError(
                f"{self.path}: the index or the tags are damaged ({damage}), so "
                "its frames have no numbers; read them in a loop") from None
        schedules = {json.dumps(_schedule_of(setup))
                     for setup in player.setups()}
        self._is_uniform = len(schedules) <= 1
        return places

    def _look(self) -> tuple[Frame, dict | None]:
        """The first frame, and the setup in the stream tag. What is wrong is
        said when frames are read."""
        with closing(self._play("", quiet=True)) as frames:
            player, frame = next(frames)
            setups = player.setups()
        return frame, setups[0] if setups else None

    def _no_frame(self, damage: Error | None = None) -> Error:
        if self._cut or self._open:
            return Error(f"{self.path} is cut off and has no complete frame")
        return damage or Error(f"{self.path} has no coded frame")
