# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is done, what failed, and how long the rest will take."""
import dataclasses
import os
import re
import shutil
import sys
import time

from . import engine, programs
from .store import Busy, read_json

BAR = 30
SHOWN = 5  # failures
FAILURE = re.compile(r'(\d+)-(merge|\d+)\.json')
RESUME = 'resume goes on with what is missing'


@dataclasses.dataclass
class Status:
    chunks: int = 0      # that are decoded
    of_chunks: int = 0
    merged: int = 0      # recordings
    of_merged: int = 0
    failed: list = dataclasses.field(default_factory=list)

    def complete(self):
        return self.merged == self.of_merged


def take(store, plan):
    """Reads names only, but those of failures."""
    status = Status(of_chunks=plan.chunks, of_merged=len(plan.recordings))
    done = {}
    for number, recording in enumerate(plan.recordings):
        if store.is_merged(number):
            status.merged += 1
            status.chunks += recording.chunks
        else:
            done[number] = store.done(number)
            status.chunks += len(done[number])
    for name in sorted(os.listdir(os.path.join(store.work, 'failed'))):
        found = FAILURE.fullmatch(name)
        if not found or int(found[1]) not in done:
            continue
        recording, chunk = int(found[1]), found[2]
        if chunk == 'merge' or int(chunk) not in done[recording]:
            status.failed.append((recording, chunk, name))
    return status


def duration(seconds):
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f'{hours}:{minutes:02d}:{seconds:02d}'


def progress(store, status):
    """A bar, the rate, and the time left by what the last run has done."""
    share = status.chunks / status.of_chunks
    text = (f'[{"#" * int(BAR * share):{BAR}s}] {100 * share:.1f} %, '
            f'{status.chunks} of {status.of_chunks} chunks, {status.merged} of '
            f'{status.of_merged} recordings merged')
    run = store.last_run()
    begun = read_json(os.path.join(run, 'begun.json')) if run else None
    chunks, at = (begun or {}).get('chunks'), (begun or {}).get('time')
    left = status.of_chunks - status.chunks
    if left and isinstance(chunks, int) and isinstance(at, float) and chunks > left:
        rate = (chunks - left) / max(time.time() - at, 1e-3)
        text += f', {60 * rate:.3g} chunks/min, {duration(left / rate)} left'
    return text


def show_failures(store, plan, status, out=sys.stdout):
    for recording, chunk, name in status.failed[:SHOWN]:
        # A full disk takes no record.
        said = read_json(os.path.join(store.work, 'failed', name)) or {
            'error': 'there is no record why', 'host': 'an unknown computer'}
        what = 'merging' if chunk == 'merge' else f'chunk {int(chunk)} of'
        print(f'failed: {what} {plan.recordings[recording].path}: '
              f'{said.get("error")} (on {said.get("host")})', file=out)
        lines = said.get('lines')
        for line in lines if isinstance(lines, list) else []:
            print(f'  {line}', file=out)
    if len(status.failed) > SHOWN:
        print(f'and {len(status.failed) - SHOWN} more failures, in '
              f'{os.path.join(store.work, "failed")}', file=out)


def show_log(store, out):
    """What the engine said last, of jobs that could not say it themselves."""
    for kind in 'chunk', 'merge':
        path = os.path.join(store.last_run() or '', f'{kind}.log')
        for line in programs.last_lines(path):
            print(f'{kind}: {line}', file=out)


def show_room(store, out):
    """A full disk takes no record of failures."""
    if shutil.disk_usage(store.folder).free < 1 << 16:
        print(f'the disk is full; delete files, or move {store.folder} to '
              'another', file=out)


def show(store, plan):
    """Whether everything is merged."""
    status = take(store, plan)
    print(progress(store, status))
    states = engine.running_jobs(store.last_jobs())
    if states:
        print('in the queue of Slurm: ' + ', '.join(
            f'{count} {state}' for state, count in sorted(states.items())))
    show_failures(store, plan, status)
    if status.complete() or states or store_is_busy(store):
        return status.complete()
    print('nothing runs;' if states is not None else
          'Slurm does not answer; if no job runs,', RESUME)
    return False


def store_is_busy(store):
    """Whether parallel works on it."""
    try:
        store.lock('run').close()
    except Busy:
        return True
    return False


class Watch:
    """A line that shows the progress on a terminal."""

    def __init__(self, store, plan):
        self.store, self.plan = store, plan
        self.shown, self.wait = 0.0, 1.0

    def __call__(self):
        now = time.monotonic()
        if not sys.stderr.isatty() or now - self.shown < self.wait:
            return
        text = progress(self.store, take(self.store, self.plan))
        print(f'\r\033[K{text}', end='', file=sys.stderr, flush=True)
        self.shown = time.monotonic()
        self.wait = max(1.0, 20 * (self.shown - now))  # 5 % of a core at most

    def end(self):
        if self.shown:
            print(file=sys.stderr)
