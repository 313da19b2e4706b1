#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compares and damages Matroska files for tests.

  matroska.py same A B          whether they are the same, but for the random
                                identifiers and the date that each run writes
  matroska.py lose IN OUT N...  a copy without the Nth clusters, from 0 on; in a
                                recording, each is a coded frame with its line
  matroska.py spoil IN OUT N... a copy with nothing that a decoder knows in the
                                pictures of the Nth clusters
"""
import sys

SEGMENT, CLUSTER, VOID = 0x18538067, 0x1F43B675, 0xEC
SIMPLE_BLOCK = 0xA3
INFO, TRACKS, TRACK, TAGS, TAG, TARGETS = (
    0x1549A966, 0x1654AE6B, 0xAE, 0x1254C367, 0x7373, 0x63C0)
SEGMENT_UID, DATE, TRACK_UID, TAG_TRACK_UID = 0x73A4, 0x4461, 0x73C5, 0x63C5
PARENTS = {SEGMENT, INFO, TRACKS, TRACK, TAGS, TAG, TARGETS}
# Where other elements are in the file.
PLACES = {0x114D9B74, 0x1C53BB6B}
RANDOM = {SEGMENT_UID, DATE, TRACK_UID, TAG_TRACK_UID}


def number(data, at, keep_marker):
    length = 9 - data[at].bit_length()
    value = int.from_bytes(data[at:at + length], 'big')
    return (value if keep_marker else value & ~(1 << 7 * length)), at + length


def elements(data, at, end):
    """(id, start, start of the content, end) of each, also within others."""
    while at < end:
        name, body = number(data, at, True)
        size, body = number(data, body, False)
        stop = min(body + size, end)
        yield name, at, body, stop
        if name in PARENTS:
            yield from elements(data, body, stop)
        at = stop


def contents(name):
    """What a file holds, (id, bytes) of each element, but for random ones; and
    the lengths of those."""
    with open(name, 'rb') as file:
        data = file.read()
    kept, lengths = [], []
    for kind, _, body, end in elements(data, 0, len(data)):
        if kind in RANDOM:
            lengths.append(end - body)
        elif kind not in PARENTS:
            kept.append((kind, data[body:end]))
    return kept, lengths


def difference_of(one, other):
    (a, a_lengths), (b, b_lengths) = contents(one), contents(other)
    placed = [[item for item in items if item[0] not in PLACES] for items in (a, b)]
    # A random number below 2^56 is a byte shorter, and moves what comes after.
    return difference(*placed) or (a_lengths == b_lengths and difference(a, b))


def difference(a, b):
    """Where the contents differ, or nothing."""
    for i, (ours, theirs) in enumerate(zip(a, b)):
        if ours != theirs:
            (one, body), (other, content) = ours, theirs
            at = next((k for k, (x, y) in enumerate(zip(body, content)) if x != y),
                      min(len(body), len(content)))
            return (f'element {i}, {one:x} of {len(body)} bytes and {other:x} of '
                    f'{len(content)}, from byte {at} on: '
                    f'{body[at:at + 60]} and {content[at:at + 60]}')
    return f'{len(a)} and {len(b)} elements' if len(a) != len(b) else None


def lose(data, at, body, end):
    # Void with a size of 8 bytes, over an identifier of 4 and its size.
    data[at:at + 9] = bytes([VOID]) + (end - at - 9 | 1 << 56).to_bytes(8, 'big')


def spoil(data, at, body, end):
    for kind, _, start, stop in elements(bytes(data), body, end):
        if kind == SIMPLE_BLOCK and data[start] == 0x81:  # track 1
            data[start + 4:stop] = b'\xff' * (stop - start - 4)


def damage(how, source, target, numbers):
    with open(source, 'rb') as file:
        data = bytearray(file.read())
    clusters = [place for kind, *place in elements(bytes(data), 0, len(data))
                if kind == CLUSTER]
    for cluster in numbers:
        how(data, *clusters[cluster])
    with open(target, 'wb') as file:
        file.write(data)


def main():
    if sys.argv[1] == 'same':
        if where := difference_of(*sys.argv[2:]):
            sys.exit(f'{sys.argv[2]} and {sys.argv[3]} differ: {where}')
    else:
        damage({'lose': lose, 'spoil': spoil}[sys.argv[1]], sys.argv[2], sys.argv[3],
               map(int, sys.argv[4:]))


main()
