# SPDX-License-Identifier: LGPL-2.1-or-later
"""Coded frames of a camera, as they come."""
from __future__ import annotations

import os
from collections.abc import Iterator
from fractions import Fraction

from ._pipeline import Player, element
from .frame import Frame, frame_of

# Of a loop that takes long: older frames are lost, and counted.
_WAITING = 8


def camera(name: str = "", *, device: str = "",
           schedule: str | os.PathLike | dict = "sequential:2x2",
           size: tuple[int, int] | None = None, rate: float | None = None,
           exposure: float | None = None, pixel_format: str | None = None,
           trigger: str = "dmd", trigger_line: str | None = None,
           features: str | None = None) -> Camera:
    """A GenICam camera behind a DMD, whose frames are read as they come.

    name          as codedexposure camera list shows it; "": the first one
    device        the DMD, such as usb:; "": another program drives it
    schedule      a preset, a JSON file, or the dict of its JSON form
    size          width and height, pixels; None: as the camera is set
    rate          coded frames/s; None: as the camera is set
    exposure      us; None: as the camera is set
    pixel_format  Mono8, Mono12p ...; None: Mono8 or Mono16
    trigger       dmd: it triggers the camera; camera: the camera triggers it;
                  none: as the camera is set
    trigger_line  of the camera
    features      others, as "GainAuto=Off Gain=3"
    """
    return Camera(
        element("codedexposure-camerasrc", camera_name=name, trigger=trigger,
                trigger_line=trigger_line, exposure_time=exposure,
                pixel_format=pixel_format, features=features)
        + " ! " + _caps(size, rate)
        + element("dmdsync", device=device, schedule=schedule,
                  timestamp_at="device-clock"), name or "the camera")


def _caps(size, rate) -> str:
    caps = "video/x-raw"
    if size is not None:
        caps += f",width={int(size[0])},height={int(size[1])}"
    if rate is not None:
        exact = Fraction(rate).limit_denominator(1001)
        caps += f",framerate={exact.numerator}/{exact.denominator}"
    return f"{caps} ! "


class Camera:
    """A source of coded frames. Each loop starts it, and its end stops it:

        for frame in codedexposure.camera(device="usb:").subframes():
            if frame.image.max() > 200:
                break

    Frames that a loop is too slow for are lost, as those of the camera are:
    lost_before counts them, and a RecordingWarning says so.
    """

    def __init__(self, source: str, about: str):
        self._source = source
        self._about = about

    def __repr__(self):
        return f"<Camera {self._about}>"

    def subframes(self, *, method: str | None = None) -> Iterator[Frame]:
        """The subframes; method: auto, rank, select or decode."""
        return self._frames(element("codedexposure-demux", method=method) + " !")

    def fused(self, quality: str = "fast") -> Iterator[Frame]:
        """Full-size frames at the rate of the subframes."""
        return self._frames(element("codedexposure-fuse", quality=quality) + " !")

    def coded(self) -> Iterator[Frame]:
        """The coded frames."""
        return self._frames("")

    def _frames(self, decoder: str) -> Iterator[Frame]:
        player = Player(
            f"{self._source} ! queue leaky=downstream max-size-bytes=0 "
            f"max-size-time=0 max-size-buffers={_WAITING} ! {decoder} "
            f"appsink name=out sync=false max-buffers={_WAITING}", self._about)
        with player:
            yield from map(frame_of, player)
