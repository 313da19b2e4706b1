# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads the head of a recording: length, frame rate, tracks."""
import dataclasses
import re
import struct

SEGMENT, INFO, TRACKS, CLUSTER = 0x18538067, 0x1549A966, 0x1654AE6B, 0x1F43B675
TRACK = 0xAE
TIME_SCALE, DURATION = 0x2AD7B1, 0x4489
TRACK_TYPE, CODEC, FRAME_DURATION = 0x83, 0x86, 0x23E383
CLUSTER_TIME = 0xE7
VIDEO, TEXT = 1, 17
HEAD = 1 << 20  # bytes that hold all before the first frame
TAIL = 1 << 24  # bytes that hold all after the last, with an index of many hours
END = re.compile(rb'\{"end":(\d+)[,}]')  # the last line of the track


class NotMatroska(Exception):
    """What is wrong with the file."""


@dataclasses.dataclass
class Head:
    """Times are in ns."""
    start: int = 0      # time of the first frame
    duration: int = 0   # 0: unknown
    period: int = 0     # of frames; 0: unknown
    codec: str = ''
    has_track: bool = False  # what is known of each frame
    complete: bool = False   # the file was finished and is not cut off


def _number(data, at, keep_marker):
    length = 9 - data[at].bit_length()
    if length > 8 or at + length > len(data):
        raise NotMatroska('its structure is damaged')
    value = int.from_bytes(data[at:at + length], 'big')
    if keep_marker:
        return value, at + length
    value &= ~(1 << 7 * length)
    unknown = value == (1 << 7 * length) - 1
    return (None if unknown else value), at + length


def elements(data, at, end):
    """(id, start of the content, end) of the elements in data[at:end]; an end of
    None: unknown."""
    while at < min(end, len(data) - 12):
        name, body = _number(data, at, True)
        size, body = _number(data, body, False)
        yield name, body, None if size is None else body + size
        if size is None:
            return
        at = body + size


def _whole(data, body, end):
    return int.from_bytes(data[body:end], 'big')


def _real(data, body, end):
    return struct.unpack('>d' if end - body == 8 else '>f', data[body:end])[0]


def _read_track(data, body, end, head):
    track = {name: data[a:b] for name, a, b in elements(data, body, end)}
    kind = int.from_bytes(track.get(TRACK_TYPE, b''), 'big')
    if kind == VIDEO and not head.codec:
        head.codec = track.get(CODEC, b'').decode(
            'ascii', 'replace').rstrip('\0')
        head.period = int.from_bytes(track.get(FRAME_DURATION, b''), 'big')
    head.has_track |= kind == TEXT


def read_head(path, size):
    """The head of the file of that size."""
    with open(path, 'rb') as file:
        data = file.read(HEAD) + bytes(12)
    if data[:4] != b'\x1aE\xdf\xa3':
        raise NotMatroska('it is not a Matroska file')
    head, scale, ticks = Head(), 1000000, 0.0
    for name, body, end in elements(data, 0, len(data)):
        if name == SEGMENT:
            head.complete = end is not None and end <= size
            top, top_end = body, end or size
            break
    else:
        raise NotMatroska('its structure is damaged')
    for name, body, end in elements(data, top, top_end):
        if name == INFO:
            for field, a, b in elements(data, body, end):
                if field == TIME_SCALE:
                    scale = _whole(data, a, b)
                elif field == DURATION:
                    ticks = _real(data, a, b)
        elif name == TRACKS:
            for field, a, b in elements(data, body, end):
                if field == TRACK:
                    _read_track(data, a, b, head)
        elif name == CLUSTER:
            for field, a, b in elements(data, body, end or size):
                if field == CLUSTER_TIME:
                    head.start = _whole(data, a, b) * scale
                    break
            break
    head.duration = int(ticks * scale)
    return head


def recorded_frames(path, size):
    """Coded frames of a complete recording, as the end of its track says; 0:
    unknown."""
    step, tail = 1 << 18, b''
    with open(path, 'rb') as file:
        while len(tail) < min(size, TAIL):
            start = max(0, size - len(tail) - step)
            file.seek(start)
            tail = file.read(size - len(tail) - start) + tail
            if found := END.findall(tail):
                return int(found[-1])
    return 0
