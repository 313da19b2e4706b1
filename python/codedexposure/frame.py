# SPDX-License-Identifier: LGPL-2.1-or-later
"""One picture, and what is known of it."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass, field

import numpy as np

from ._pipeline import Error, Gst

# Elements write this time where a time is not known.
_NO_TIME = 2**64 - 1
_TYPES = {"GRAY8": np.dtype("u1"), "GRAY16_LE": np.dtype("<u2")}


def as_array(image: np.ndarray, dtype, copy) -> np.ndarray:
    """What __array__ () returns; numpy before 2.0 does not know copy=None."""
    if copy is False and dtype not in (None, image.dtype):
        raise ValueError(f"pixels of {image.dtype} cannot be {np.dtype(dtype)} "
                         "without a copy; leave out copy=False")
    return image.astype(dtype or image.dtype, copy=bool(copy))


@dataclass(frozen=True)
class Frame:
    """A subframe, a full-size frame or a coded frame. Unknown values are None.

    The array is the memory in which the frame was decoded. It stays valid as
    long as it is used. It is read-only; use image.copy() to change it.
    """
    image: np.ndarray = field(repr=False, compare=False)
    """Pixel values, shape (height, width), uint8 or uint16, never scaled."""
    time_ns: int
    """Start of its slot, or of its exposure: the time since the first coded
    frame of the recording."""
    duration_ns: int | None
    """Time until the next frame, if none is lost."""
    frame: int | None
    """Number of the coded frame since the start; lost frames are counted."""
    slot: int | None
    """Index of the subframe in its coded frame, from 0; None: a coded frame."""
    synchronised: bool | None
    """Whether the masks were synchronised with the exposure."""
    corrupted: bool
    """The pixels may not be those of the scene in this slot."""
    lost_before: int
    """Coded frames lost between the previous coded frame and its own."""
    saturated: int | None
    """Pixels of the coded frame at the largest value."""
    bits: int
    """Significant bits of a pixel, counted from the lowest."""
    exposure_start_ns: int | None
    exposure_duration_ns: int | None
    time_uncertainty_ns: int | None
    """The error of exposure_start_ns that 95 % of frames stay below."""
    complement: Frame | None = field(default=None, repr=False, compare=False)
    """Of a coded frame: that of a second camera, in the other beam, with the
    same exposure; None: there is none."""

    @property
    def time(self) -> float:
        """time_ns in seconds."""
        return self.time_ns * 1e-9

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        """image, for numpy."""
        return as_array(self.image, dtype, copy)


class _MapInfo(ctypes.Structure):  # pylint: disable=too-few-public-methods
    """GstMapInfo. That of PyGObject copies the memory."""
    _fields_ = [("memory", ctypes.c_void_p), ("flags", ctypes.c_int),
                ("data", ctypes.c_void_p), ("size", ctypes.c_size_t),
                ("maxsize", ctypes.c_size_t),
                ("user_data", ctypes.c_void_p * 4),
                ("reserved", ctypes.c_void_p * 4)]


_gst = ctypes.CDLL("libgstreamer-1.0.so.0")
for _call in (_gst.gst_buffer_map, _gst.gst_buffer_unmap):
    _call.argtypes = [ctypes.c_void_p, ctypes.POINTER(_MapInfo)]
_gst.gst_buffer_map.argtypes.append(ctypes.c_int)


class _Mapped:  # pylint: disable=too-few-public-methods
    """The bytes of a buffer, which stays mapped as long as an array of them is
    used. owner: it holds the buffer."""

    def __init__(self, buffer, owner):
        self._buffer, self._owner = buffer, owner
        self._info = _MapInfo()
        # The hash of a GstBuffer is its address.
        if not _gst.gst_buffer_map(hash(buffer), self._info,
                                   int(Gst.MapFlags.READ)):
            raise Error("the memory of a frame cannot be read")
        self.__array_interface__ = {
            "version": 3, "typestr": "|u1", "shape": (self._info.size,),
            "data": (self._info.data, True)}

    def __del__(self):
        if self._info.data:
            _gst.gst_buffer_unmap(hash(self._buffer), self._info)


def pixels_of(buffer, caps, owner=None) -> np.ndarray:
    """The picture, in the memory of the buffer. PyGObject does not hold a
    buffer that it found in a structure: owner does."""
    kind = _TYPES[caps.get_value("format")]
    width, height = caps.get_value("width"), caps.get_value("height")
    data = np.asarray(_Mapped(buffer, owner))
    # Rows are padded to a multiple of four bytes.
    stride = len(data) // height // kind.itemsize * kind.itemsize
    rows = data[:height * stride].view(kind)
    return rows.reshape(height, -1)[:, :width]


def position_of(sample, time: int | None = None) -> int:
    """The position of a time, or of the sample itself, in its stream, ns."""
    # A frame may begin nanoseconds before the segment, whose times are those of
    # the container.
    sign, there = sample.get_segment().to_stream_time_full(
        Gst.Format.TIME, sample.get_buffer().pts if time is None else time)
    return sign * there


def _fields_of(buffer, name="CodedExposureFrame"):
    meta = buffer.get_custom_meta(name)
    return meta.get_structure() if meta else None


def shows_pattern(sample) -> bool:
    """Whether a coded frame shows a pattern, so that it is not decoded."""
    fields = _fields_of(sample.get_buffer())
    return bool(fields and fields.has_field("pattern"))


def number_of(sample) -> int | None:
    """Frame.frame."""
    fields = _fields_of(sample.get_buffer())
    return fields.get_value("frame") if fields else None


def frame_of(sample) -> Frame:
    """The frame in a GstSample."""
    buffer = sample.get_buffer()
    partner = _fields_of(buffer, "CodedExposurePartner")
    return _frame(sample, buffer, sample.get_caps(), partner and _frame(
        sample, partner.get_value("buffer"), partner.get_value("caps")))


def _frame(sample, buffer, caps, complement=None) -> Frame:
    """That in a buffer, whose times are those of the sample."""
    fields = _fields_of(buffer)

    def value(name):
        return fields.get_value(name) if fields and fields.has_field(name) \
            else None

    def time(name):
        return None if value(name) == _NO_TIME else value(name)

    exposure = time("exposure-start")
    image = pixels_of(buffer, caps.get_structure(0), sample.get_buffer())
    slot = value("subframe")
    return Frame(
        image=image,
        time_ns=position_of(sample, buffer.pts),
        duration_ns=None if buffer.duration == _NO_TIME else buffer.duration,
        frame=value("frame"),
        slot=None if slot is None or slot < 0 else slot,
        synchronised=value("locked"),
        corrupted=bool(buffer.get_flags() & (
            Gst.BufferFlags.CORRUPTED | Gst.BufferFlags.GAP)),
        lost_before=value("lost-before") or 0,
        saturated=value("saturated"),
        bits=value("bits") or 8 * image.itemsize,
        exposure_start_ns=None if exposure is None else position_of(
            sample, exposure),
        exposure_duration_ns=time("exposure-duration"),
        time_uncertainty_ns=time("time-uncertainty"),
        complement=complement)
