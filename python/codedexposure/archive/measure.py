# SPDX-License-Identifier: LGPL-2.1-or-later
"""Predicts time and room by decoding a little of the first recording."""
import copy
import os
import tempfile
import time

from . import chunk as chunks
from . import programs
from .plan import FORMS
from .store import Problem, digest

SHORT = 5     # coded frames of the first measurement
LONGEST = 60  # s of the second


def overlap(plan):
    """Coded frames that a chunk reads beside its own; as in decode."""
    given = {o.split('=')[0] for o in plan.options}
    return 18 + ('--overlap' in given) if '--fuse' in given else 2


def decode(plan, times, frames):
    """(core seconds, seconds, bytes until clean) for so many frames of the first
    recording."""
    part = copy.copy(plan)
    part.length = frames
    first = copy.copy(plan.recordings[0])
    first.borders = times[frames:frames + 1]  # so that the first chunk ends
    part.recordings = [first]
    with tempfile.TemporaryDirectory() as folder:
        begun, cpu = time.monotonic(), chunks.cpu_seconds()
        log = os.path.join(folder, 'log')
        status, _ = programs.run(chunks.command(part, 0, 0, folder), log)
        form = part.chunk_form(0)
        output = os.path.join(folder, chunks.name_of(form))
        size = digest(output)['bytes'] if status == 0 else 0
        joined = form == 'mkv' and plan.form != 'mkv'
        if status == 0 and joined:
            video, output = output, os.path.join(folder, 'out' + FORMS[plan.form])
            status, _ = programs.run(chunks.join_command(part, [video], output),
                                     log)
        if status != 0:
            raise Problem('decoding the first frames failed: ' +
                          ' '.join(programs.last_lines(log)))
        cpu, begun = chunks.cpu_seconds() - cpu, time.monotonic() - begun
        return cpu, begun, size * joined + digest(output)['bytes']


def predict(plan):
    """(core seconds, bytes until clean) of the whole plan: a straight line through two
    measurements."""
    first = plan.recordings[0]
    if first.whole or first.frames <= SHORT:
        raise Problem(f'{first.path} is too short or damaged to measure with; '
                      'name another recording first, or set --no-measure')
    said = programs.info([first.path])[0]
    times = [time - said['start_ns'] for time in said['times_ns']]
    cpu, wall, size = decode(plan, times, SHORT)
    more = min(first.frames, max(4 * SHORT, int(SHORT * LONGEST / wall)))
    cpu_more, _, size_more = decode(plan, times, more)
    each = max(cpu_more - cpu, 1e-6) / (more - SHORT)
    start = max(0.0, cpu - each * SHORT)
    frames = sum(r.frames for r in plan.recordings)
    read = frames + overlap(plan) * plan.chunks
    return (each * read + start * plan.chunks,
            size_more / more * frames)


def hours(core_seconds):
    return f'{core_seconds / 3600:.3g} core hours'


def amount(size):
    for unit in 'B', 'kB', 'MB', 'GB':
        if size < 1000:
            return f'{size:.3g} {unit}'
        size /= 1000
    return f'{size:.3g} TB'


def count(number, thing):
    return f'{number} {thing}' if number == 1 else f'{number} {thing}s'


def describe(plan):
    """The lines of a plan."""
    frames = sum(r.frames for r in plan.recordings)
    seconds = sum(r.seconds for r in plan.recordings)
    yield (f'{count(len(plan.recordings), "recording")}, '
           f'{count(frames, "coded frame")}, {seconds / 3600:.3g} h')
    yield (f'{count(plan.chunks, "chunk")} of up to '
           f'{count(plan.length, "coded frame")}')
    whole = [r for r in plan.recordings if r.whole]
    for recording in whole[:5]:
        yield f'one chunk, since {recording.whole}: {recording.path}'
    if len(whole) > 5:
        yield f'and {len(whole) - 5} more recordings in one chunk'

