# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the chunks of a recording together, and checks what came of it."""
import csv
import os
import pathlib
import shutil
import subprocess

from . import chunk as chunks
from . import programs
from .store import (Busy, Problem, digest, files_below, read_json,
                           size_of, sync, write_json)

TABLE = 'times.csv'


def ranges(numbers):
    """3, 5-7: for messages."""
    texts, run = [], []
    for number in sorted(numbers) + [None]:
        if run and number == run[-1] + 1 if number is not None else False:
            run.append(number)
            continue
        if run:
            texts.append(f'{run[0]}-{run[-1]}' if len(run) > 1 else f'{run[0]}')
        run = [number]
    return ', '.join(texts)


def check_chunks(store, plan, recording):
    """The manifests of all chunks. Raises Problem: some are missing, or were
    not what they must be and are removed, so that resume decodes them."""
    source = plan.recordings[recording]
    missing = set(range(source.chunks)) - store.done(recording)
    if missing:
        raise Problem(f'{source.path}: chunks {ranges(missing)} of '
                      f'{source.chunks} are missing; see status')
    manifests, bad = [], {}
    for number in range(source.chunks):
        why, manifest = chunks.mismatch(store, plan, recording, number)
        if why:
            bad[number] = why
            store.discard(recording, number)
        manifests.append(manifest)
    if bad:
        raise Problem(f'{source.path}: chunks {ranges(bad)} were not merged and '
                      f'are removed, since {next(iter(bad.values()))}; resume '
                      'decodes them again')
    return manifests


def join_videos(plan, parts, output, log):
    """What the joined video holds: counts of pictures and coded frames."""
    status, said = programs.result(chunks.join_command(plan, parts, output), log,
                                   stdin=subprocess.DEVNULL)
    if status != 0 or said is None:
        raise Problem(f'{output} could not be written: ' +
                      ' '.join(programs.last_lines(log)))
    return said


def follows(head, last, first):
    """Whether a row of a table is of the coded frame after that of another."""
    columns = head.split(',')
    if 'frame' not in columns or 'flags' not in head:
        return False
    at = columns.index('frame')
    before, after = last.split(',')[at], first.split(',')[at]
    return before.isdigit() and after.isdigit() and int(after) == int(before) + 1


def join_tables(parts, output):
    """Tables with the same head. An excerpt begins with a discontinuity, which
    the whole does not have where the coded frame before is in the table before."""
    with open(output + '.part', 'w', encoding='utf-8') as table:
        for i, part in enumerate(parts):
            with open(part, encoding='utf-8') as lines:
                head = lines.readline()
                if i == 0:
                    table.write(head)
                first = lines.readline()
                if i > 0 and follows(head, last, first):
                    first = first.replace('discont ', '').replace('discont', '')
                table.write(first)
                last = first
                for last in lines:
                    table.write(last)
        table.flush()
        os.fsync(table.fileno())
    os.replace(output + '.part', output)


def join_pictures(parts, output):
    """Pictures have the numbers of the whole recording. Links take no room. The
    counts of their tables."""
    folder = output.rstrip('/')
    new = f'{folder}.part'
    shutil.rmtree(new, ignore_errors=True)
    os.makedirs(new)
    join_tables([os.path.join(part, TABLE) for part in parts],
                os.path.join(new, TABLE))
    for part in parts:
        for name in os.listdir(part):
            if name == TABLE:
                continue
            try:
                os.link(os.path.join(part, name), os.path.join(new, name))
            except FileExistsError as error:
                raise Problem(f'{name} is in two chunks') from error
            except OSError:  # a file system without links
                shutil.copyfile(os.path.join(part, name),
                                os.path.join(new, name))
                sync(os.path.join(new, name))
    counts = count_pictures(os.path.join(new, TABLE))
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(new, folder)
    return counts


def count_pictures(table):
    """The same counts as join prints, of a table of pictures; raises Problem
    unless each coded frame's pictures are there exactly once, in their order."""
    slots = {}
    with open(table, encoding='utf-8', newline='') as lines:
        for row in csv.DictReader(lines):
            if not row['frame']:
                raise Problem(f'{table} does not number its pictures')
            slots.setdefault(int(row['frame']), []).append(int(row['slot'] or 0))
    frames = list(slots)
    if frames != sorted(frames):
        raise Problem(f'the coded frames of {table} are not in their order')
    kinds = {tuple(found) for found in slots.values()}
    if len(kinds) > 1 or any(found != tuple(range(len(found))) for found in kinds):
        raise Problem(f'coded frames of {table} have different pictures')
    return {'pictures': sum(map(len, slots.values())), 'coded': len(frames),
            'lost': frames[-1] - frames[0] + 1 - len(frames) if frames else 0}


def outputs_of(store, plan, recording):
    """The paths of the pictures, their statistics, and the report."""
    return [os.path.join(store.folder, name) for name in plan.outputs(recording)]


def write_report(plan, recording, output, scratch):
    """As one run of report. It measures the recording itself."""
    new, log = os.path.join(scratch, 'page'), os.path.join(scratch, 'log')
    options = [option for option in plan.options if option.startswith(
        ('--method=', '--schedule=', '--bench=', '--bits='))]
    status = programs.run(
        [*programs.REPORT, plan.recordings[recording].path, *options,
         f'--output={new}'], log, stdin=subprocess.DEVNULL)
    if status not in (0, 3):  # 3: the recording is damaged
        raise Problem(f'{output} could not be written: ' +
                      ' '.join(programs.last_lines(log)))
    for name in files_below(new):
        sync(os.path.join(new, name))
    shutil.rmtree(output, ignore_errors=True)
    os.rename(new, output)


def merge(store, plan, recording):
    """Raises Problem."""
    source = plan.recordings[recording]
    manifests = check_chunks(store, plan, recording)
    form = plan.chunk_form(recording)
    def files(name):
        return [os.path.join(store.part(recording, number), name)
                for number, m in enumerate(manifests) if name in m['outputs']]
    parts, outputs = files(chunks.name_of(form)), outputs_of(store, plan, recording)
    output = outputs[0]
    os.makedirs(os.path.dirname(output.rstrip('/')), exist_ok=True)
    scratch = store.merging(recording)
    if source.cut_off() and form != 'png':
        take_whole(parts[0], output)
        counts = {}
    elif form == 'png':
        counts = join_pictures(parts, output)
    else:
        counts = join_videos(plan, parts, output, os.path.join(scratch, 'log'))
    frames = sum(m['frames'] for m in manifests)
    missing = max(0, source.recorded - frames)
    if counts and counts['coded'] != frames:
        raise Problem(f'{output} has pictures of {counts["coded"]} coded frames, but '
                      f'{frames} were decoded; remove the chunks and resume')
    if plan.statistics:
        join_tables(files(chunks.TABLE), outputs[1])
    if plan.report:
        write_report(plan, recording, outputs[-1], scratch)
    shutil.rmtree(scratch)
    write_json(store.merged(recording), {
        'format': 'coded-exposure-archive-recording', 'version': 2,
        'recording': source.path, 'recording_hash': source.fingerprint,
        'output': source.output, 'output_hashes': [*map(digest, outputs)],
        'options': plan.options, 'program': plan.program,
        'counts': counts, 'frames': frames,
        'status': chunks.DAMAGED if missing else max(
            m['status'] for m in manifests),
        'seconds': sum(m['seconds'] for m in manifests),
        'cpu_seconds': sum(m['cpu_seconds'] for m in manifests),
    })


def take_whole(part, output):
    """The only part is the result. A link takes no room."""
    new = output + '.part'
    pathlib.Path(new).unlink(missing_ok=True)
    try:
        os.link(part, new)
    except OSError:  # a file system without links
        shutil.copyfile(part, new)
        sync(new)
    os.replace(new, output)


def run_if_ready(store, plan, recording):
    """Merges a recording as soon as its last chunk is there, unless another
    process does."""
    if len(store.done(recording)) == plan.recordings[recording].chunks:
        run(store, plan, recording, others_may=True)


def run(store, plan, recording, others_may=False):
    """Merges a recording that is not merged yet. False, with a record of it, if
    that fails."""
    if store.is_merged(recording):
        return True
    try:
        with store.lock(f'merge-{recording:06d}'):
            if not store.is_merged(recording):
                merge(store, plan, recording)
    except (Problem, OSError) as error:
        if others_may and isinstance(error, Busy):
            return True
        chunks.note_failure(store, recording, None, error)
        return False
    for path in (store.failure(recording, None),
                 os.path.join(store.work, f'merge-{recording:06d}.lock')):
        try:
            os.remove(path)
        except FileNotFoundError:
            pass
    return True


def is_there(store, plan, recording):
    """Whether all that was merged is there, by its size."""
    said = read_json(store.merged(recording))
    return said is not None and all(
        os.path.exists(path) and size_of(path) == hashed['bytes']
        for path, hashed in zip(outputs_of(store, plan, recording),
                                said['output_hashes']))


def verify(store, plan, recording):
    """Raises Problem unless the output is what was merged, and holds the pictures
    of every coded frame of the recording exactly once. The manifest."""
    source = plan.recordings[recording]
    said = read_json(store.merged(recording))
    if said is None:
        raise Problem(f'{source.path} is not merged; see status')
    for path, digested in zip(outputs_of(store, plan, recording),
                              said['output_hashes']):
        if not os.path.exists(path) or digest(path) != digested:
            raise Problem(f'{path} is not what was merged; remove '
                          f'{store.merged(recording)} and resume to merge it '
                          'again')
    recorded = programs.info([source.path])[0]
    if said['counts'] and len(recorded.get('times_ns', [])) != said['frames']:
        raise Problem(f'{source.path} has {len(recorded.get("times_ns", []))} coded '
                      f'frames, but {said["frames"]} were decoded')
    return said
