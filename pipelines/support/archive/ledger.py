# SPDX-License-Identifier: LGPL-2.1-or-later
"""Proves that each coded frame's pictures are there exactly once.

A ledger, as decode --ledger writes it, has two kinds of lines:
  coded PTS                              a coded frame of the recording
  pictures PTS FRAME COUNT ORDER NAME    its pictures that were written
with the time of the coded frame in ns, and its number."""
import itertools

from archive.store import Problem

ROUNDING = 10000  # ns; as decode's


def read(path):
    """(coded times, {time: (frame, count)}); raises Problem."""
    coded, pictures = [], {}
    with open(path, encoding='ascii') as file:
        for line in file:
            words = line.split()
            if words[0] == 'coded' and len(words) == 2:
                coded.append(int(words[1]))
            elif words[0] == 'pictures' and len(words) == 6:
                time = int(words[1])
                if time in pictures:
                    raise Problem(f'the pictures of the coded frame at {time} ns '
                                  'were written twice')
                if words[4] != 'in-order':
                    raise Problem(f'the pictures of the coded frame at {time} ns '
                                  'are not in their order')
                pictures[time] = int(words[2]), int(words[3])
            else:
                raise Problem(f'{path} has a damaged line: {line.strip()}')
    return coded, pictures


def check(path, start, stop):
    """Counts of a ledger whose coded frames lie in [start, stop); raises Problem
    if it does not prove what it must."""
    coded, pictures = read(path)
    for time in coded:
        if time + ROUNDING < start or (
                stop is not None and time + ROUNDING >= stop):
            raise Problem(f'the coded frame at {time} ns is not of this chunk')
    for before, after in itertools.pairwise(coded):
        if before == after:
            raise Problem(f'the coded frame at {after} ns came twice')
    if not set(pictures) <= set(coded):
        raise Problem('pictures were written of coded frames that did not come')
    each = {count for _, count in pictures.values()}
    if len(each) > 1:
        raise Problem(f'coded frames have different numbers of pictures: {each}')
    frames = [frame for frame, _ in pictures.values()]
    return {
        'coded': len(coded), 'decoded': len(pictures),
        'pictures': sum(count for _, count in pictures.values()),
        'slots': max(each, default=0),
        'first_frame': min(frames, default=None),
        'last_frame': max(frames, default=None),
    }


def total(counts):
    """Of the chunks of a recording, in their order; raises Problem."""
    kinds = {c['slots'] for c in counts if c['slots']}
    if len(kinds) > 1:
        raise Problem('chunks have different numbers of pictures a coded frame')
    numbered = [c for c in counts if c['first_frame'] is not None]
    for before, after in itertools.pairwise(numbered):
        if after['first_frame'] <= before['last_frame']:
            raise Problem(f'coded frame {after["first_frame"]} is in two chunks')
    sums = {name: sum(c[name] for c in counts)
            for name in ('coded', 'decoded', 'pictures')}
    sums['slots'] = max(kinds, default=0)
    span = (numbered[-1]['last_frame'] - numbered[0]['first_frame'] + 1
            if numbered else 0)
    sums['lost'] = max(0, span - sums['coded'])
    return sums
