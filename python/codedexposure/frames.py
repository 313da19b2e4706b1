# SPDX-License-Identifier: LGPL-2.1-or-later
"""The frames of a recording as a sequence."""
from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from ._pipeline import Error, UncountableError
from .frame import Frame, as_array

if TYPE_CHECKING:
    from .recording import Recording


class Frames(Sequence):
    """Frames of a recording, or every so many of a part of them.

    A loop reads the file once, from front to back. frames[i] and frames[a:b]
    seek to the coded frames that they need, and give what a loop gives there,
    bit for bit; a part is again a sequence, which is read when it is used.
    len (), an index and a part first need to know the times of all coded
    frames, for which the recording is read once without decoding it.

    len () and an index count frames that are recorded, not those that were
    lost: compare Frame.frame. Only decoding tells that a recorded frame cannot
    be decoded: its index and a part with it raise Error, and a loop over all
    frames, before and after len (), leaves it out with a RecordingWarning. Where
    the schedule changes, coded frames do not give equally many pictures, and
    only a loop is possible.
    """

    def __init__(self, recording: Recording, decoder: str,
                 part: range | None = None, per_frame: int | None = None,
                 countable: bool = True):
        self._countable = countable
        self._recording = recording
        self._decoder = decoder
        self._part = part
        self._per_frame = per_frame

    def __repr__(self):
        return f"<Frames of {self._recording.path}>"

    def _places(self) -> list[tuple[int, int | None]]:
        """Times and numbers of the coded frames that give pictures."""
        if not self._countable:
            raise UncountableError(
                f"frames of {self._recording.path} and a second camera have no "
                "numbers; read them in a loop")
        return self._recording.coded_places(decoded=bool(self._decoder))

    def _count(self) -> int:
        """Pictures of a coded frame: those of the first one."""
        if self._per_frame is None:
            self._per_frame = 1 if not self._decoder else sum(
                1 for _ in self._recording.play_part(
                    self._decoder, *self._times(0, 0), quiet=True))
        return self._per_frame

    def _times(self, first: int, last: int) -> tuple[int, int | None]:
        """At which the first of these coded frames begins, and the one behind
        the last."""
        places = self._places()
        return (places[first][0],
                places[last + 1][0] if last + 1 < len(places) else None)

    def _whole(self) -> range:
        places = self._places()
        return range(self._count() * len(places) if places else 0)

    def _range(self) -> range:
        return self._whole() if self._part is None else self._part

    def between(self, start: float, stop: float | None = None) -> Frames:
        """Those of the coded frames that begin in [start, stop), in seconds
        from the first coded frame, as decode --excerpt counts. None: to the
        end.

        Raises ValueError unless 0 <= start <= stop, and where these frames are
        only a part already.
        """
        stop = math.inf if stop is None else stop
        if not 0 <= start <= stop or start == math.inf:
            raise ValueError(f"a part is from 0 or later to its start or later, "
                             f"not from {start} to {stop}")
        if self._part is not None and self._part != self._whole():
            raise ValueError("these frames are a part already; take one of the "
                             "whole recording")
        times = [time for time, _ in self._places()]
        first, last = (bisect.bisect_left(times, round(time * 1e9))
                       if time < math.inf else len(times)
                       for time in (start, stop))
        return self[first * self._count():last * self._count()]

    def __len__(self):
        return len(self._range())

    def __getitem__(self, index):
        if isinstance(index, slice):
            part = self._range()[index]
            return Frames(self._recording, self._decoder, part, self._per_frame)
        try:
            place = self._range()[index]
        except IndexError:
            raise IndexError(
                f"there is no frame {index}: {self._recording.path} has "
                f"{len(self)} here, which count from 0") from None
        return next(self._read(range(place, place + 1)))

    def __iter__(self) -> Iterator[Frame]:
        if self._part is None:
            return self._recording.play_whole(self._decoder)
        if self._part.step < 0:
            return iter(list(self._read(self._part[::-1]))[::-1])
        return self._read(self._part)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        """The images of all, shape (frames, height, width), for numpy."""
        if copy is False:
            raise ValueError("images of frames are an array only as a copy; "
                             "leave out copy=False")
        images = [frame.image for frame in self]
        if not images:
            raise ValueError("there is no frame here, whose size and type an "
                             "array could have")
        return as_array(np.stack(images), dtype, None)

    def __reversed__(self):
        return iter(self[::-1])

    def _read(self, part: range) -> Iterator[Frame]:
        """The frames of a range that counts upwards."""
        if not part:
            return
        places, count = self._places(), self._count()
        first, last = part[0] // count, part[-1] // count
        pictures = self._recording.play_part(self._decoder,
                                             *self._times(first, last))
        skipped, given = part[0] - first * count, 0
        for place, frame in zip(part, islice(
                pictures, skipped, skipped + part[-1] - part[0] + 1, part.step)):
            number = places[place // count][1]
            if frame.corrupted or number is None:
                # Without a line, it was counted from where the part begins.
                frame = replace(frame, frame=number)
            if frame.frame != number:
                break
            given += 1
            yield frame
        if given < len(part):
            raise Error(
                f"{self._recording.path}: of coded frames {first} to {last}, some "
                "cannot be decoded; read the others in a loop over all frames")
