# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads recordings of coded exposures as numpy arrays.

    import codedexposure

    recording = codedexposure.open("coded.mkv")
    for frame in recording.subframes():
        print(frame.time, frame.image.mean())
    tenth = recording.subframes()[10]

The frames come from the same GStreamer elements as those of the command line,
so they are equal to what "codedexposure decode" writes.
"""
import importlib
import os
import pathlib

_ROOT = pathlib.Path(__file__).resolve().parents[2]
_BUILD = pathlib.Path(os.environ.get("CODEDEXPOSURE_BUILD", _ROOT / "build"))
__path__.append(str(_BUILD / "python"))  # codedexposure.library is compiled

# Where each name is: archives use this package without GStreamer and numpy.
_ROOMS = {"Error": "_pipeline", "RecordingWarning": "_pipeline",
          "Camera": "live", "camera": "live", "Frames": "frames", "UncountableError": "_pipeline",
          "decode_array": "arrays", "fuse_array": "arrays",
          "simulate": "arrays", "Frame": "frame", "Recording": "recording",
          "open": "recording"}


def __getattr__(name):
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module("." + _ROOMS[name], __name__), name)


def __dir__():
    return sorted({*globals(), *__all__})


__version__ = "0.2.0"
__all__ = sorted(_ROOMS)
