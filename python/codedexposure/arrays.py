# SPDX-License-Identifier: LGPL-2.1-or-later
"""Frames that are in arrays and never were a file."""
from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from fractions import Fraction

import numpy as np

from ._pipeline import Gst, Player, element
from .frame import Frame, frame_of

Schedule = str | os.PathLike | dict
_FORMATS = {"|u1": "GRAY8", "<u2": "GRAY16_LE"}


def _buffers(frames: Iterable[np.ndarray], period: Fraction) -> Iterator:
    """A buffer for each frame, with rows padded to four bytes."""
    for i, frame in enumerate(frames):
        rows = np.ascontiguousarray(frame).view(np.uint8)
        rows = np.pad(rows, ((0, 0), (0, -rows.shape[1] % 4)))
        buffer = Gst.Buffer.new_wrapped(rows.tobytes())
        buffer.pts = int(i * period)
        buffer.duration = int((i + 1) * period) - buffer.pts
        yield buffer


def _rate(rate) -> Fraction:
    most = 10**9  # that caps can hold
    if not 0 < rate < most:
        raise ValueError(
            f"rate is a number of frames per second above 0, not {rate}")
    return Fraction(rate).limit_denominator(100000) or Fraction(1, 100000)


def _play(frames: np.ndarray, rate, filters: str) -> Iterator[Frame]:
    """What the filters make of frames at this rate, frames/s."""
    frames = np.asarray(frames)
    kind = _FORMATS.get(frames.dtype.str)
    if frames.ndim != 3 or not kind:
        raise TypeError(
            f"frames are a {frames.dtype} array of {frames.ndim} dimensions; "
            "give uint8 or uint16 of shape (frames, height, width)")
    if 0 in frames.shape[1:]:
        raise ValueError(f"frames of shape {frames.shape} have no pixels; give "
                         "(frames, height, width)")
    rate = _rate(rate)
    player = Player(
        "appsrc name=in format=time caps=video/x-raw,"
        f"format={kind},width={frames.shape[2]},height={frames.shape[1]},"
        f"framerate={rate.numerator}/{rate.denominator} ! {filters} ! "
        "appsink name=out sync=false max-buffers=8", "array")
    buffers = _buffers(frames, Gst.SECOND / rate)

    # On the thread of the stream, whenever it has used up what it was given.
    def push(source, _):
        buffer = next(buffers, None)
        if buffer:
            source.emit("push-buffer", buffer)
        else:
            source.emit("end-of-stream")

    player.pipeline.get_by_name("in").connect("need-data", push)
    with player:
        for sample in player:
            yield frame_of(sample)


def _in_slots(pictures: list[Frame], coded: int) -> np.ndarray:
    if not pictures:
        raise ValueError("there is no frame to decode")
    images = np.stack([picture.image for picture in pictures])
    return images.reshape(coded, -1, *images.shape[1:])


def simulate(scene: np.ndarray, schedule: Schedule = "sequential:2x2", *,
             rate: float | Fraction = 100, full_well: float | None = None,
             read_noise: float | None = None, psf_sigma: float | None = None,
             bits: int | None = None, gain: float | None = None,
             seed: int | None = None) -> np.ndarray:
    """The coded frames that a camera behind a DMD takes of a scene.

    scene       shape (N times frames, height, width), uint8 or uint16: one
                picture for each slot; what does not fill a frame is left out
    schedule    a preset, a JSON file, or the dict of its JSON form
    rate        pictures of the scene per second
    full_well   electrons at white, e-; 0: no noise
    read_noise  e- rms
    psf_sigma   blur of the lens, pixels
    bits        significant bits of a pixel of the camera, whose largest value
                is the white of the scene; None: all of the type
    gain        0: automatic, white maps to the largest value
    seed        of the noise

    Returns shape (frames, height, width), of the type of the scene.
    """
    bench = element("codedexposure-sim", schedule=schedule,
                    full_well=full_well, read_noise=read_noise,
                    psf_sigma=psf_sigma, bits=bits, gain=gain, seed=seed)
    images = [frame.image for frame in _play(scene, rate, bench)]
    if not images:
        raise ValueError(f"{len(scene)} pictures fill no coded frame")
    return np.stack(images)


def decode_array(coded: np.ndarray, schedule: Schedule, *,
                 rate: float | Fraction = 25, method: str | None = None,
                 mapping: str | os.PathLike | dict | None = None,
                 bits: int | None = None) -> np.ndarray:
    """The subframes of coded frames.

    coded     shape (frames, height, width), uint8 or uint16
    schedule  a preset, a JSON file, or the dict of its JSON form
    rate      coded frames per second, for schedules with times
    method    auto, rank, select or decode
    mapping   a JSON file, or the dict of its JSON form
    bits      significant bits of a pixel; None: all

    Returns shape (frames, N, height of a subframe, width of a subframe).
    """
    demux = element("codedexposure-demux", schedule=schedule, method=method,
                    mapping=mapping, bits=bits)
    return _in_slots(list(_play(coded, rate, demux)), len(coded))


def fuse_array(coded: np.ndarray, schedule: Schedule,
               quality: str = "balanced", *, rate: float | Fraction = 25,
               full_well: float | None = None, read_noise: float | None = None,
               mapping: str | os.PathLike | dict | None = None,
               bits: int | None = None, overlap: int | None = None) -> np.ndarray:
    """Full-size frames at N times the rate; arguments are as for decode_array
    and Recording.fused.

    Returns shape (frames, N, height, width).
    """
    fuse = element("codedexposure-fuse", schedule=schedule, quality=quality,
                   lookahead=1, full_well=full_well, read_noise=read_noise,
                   mapping=mapping, bits=bits, overlap=overlap)
    return _in_slots(list(_play(coded, rate, fuse)), len(coded))
