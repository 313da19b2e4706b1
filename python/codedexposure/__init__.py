# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads recordings of coded exposures as numpy arrays.

    import codedexposure

    recording = codedexposure.open("coded.mkv")
    for frame in recording.subframes():
        print(frame.time, frame.image.mean())

The frames come from the same GStreamer elements as those of the command line,
so they are equal to what codedexposure-decode writes.
"""
from ._pipeline import BUILD, Error, RecordingWarning
from .arrays import decode_array, fuse_array, simulate
from .frame import Frame
from .recording import Recording, open  # pylint: disable=redefined-builtin

__all__ = ["Error", "Frame", "Recording", "RecordingWarning", "decode_array",
           "fuse_array", "open", "simulate"]

# codedexposure.library is compiled.
__path__.append(str(BUILD / "python"))
