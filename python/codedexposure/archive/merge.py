# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the chunks of a recording together, and checks what came of it."""
import contextlib
import os
import pathlib
import shutil
import tempfile

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


def join_videos(plan, parts, output, counts, log):
    """Raises Problem unless the video has the pictures that were counted, those
    of each coded frame once."""
    status, said = programs.run(chunks.join_command(plan, parts, output), log)
    if status != 0 or said is None:
        raise Problem(f'{output} could not be written: ' +
                      ' '.join(programs.last_lines(log)))
    for name in 'pictures', 'coded':
        if said[name] != counts[name]:
            raise Problem(f'{output} has {name}: {said[name]}, but its chunks '
                          f'have {counts[name]}; remove the chunks and resume')


def join_tables(parts, output):
    """Tables with the same head."""
    with open(output + '.part', 'wb') as table:
        for i, part in enumerate(parts):
            with open(part, 'rb') as lines:
                head = lines.readline()
                if i == 0:
                    table.write(head)
                shutil.copyfileobj(lines, table)
        table.flush()
        os.fsync(table.fileno())
    os.replace(output + '.part', output)


def link(old, new):
    """Takes no room, but on a file system without links."""
    try:
        os.link(old, new)
    except FileExistsError as error:
        raise Problem(f'{os.path.basename(new)} is in two chunks') from error
    except OSError:
        shutil.copyfile(old, new)
        sync(new)


def join_pictures(parts, output):
    """Pictures have the numbers of the whole recording."""
    folder = output.rstrip('/')
    # Hidden, so that it is no folder of recordings, which are searched for.
    new = os.path.join(os.path.dirname(folder), f'.{os.path.basename(folder)}.part')
    shutil.rmtree(new, ignore_errors=True)
    os.makedirs(new)
    join_tables([os.path.join(part, TABLE) for part in parts],
                os.path.join(new, TABLE))
    for part in parts:
        for name in os.listdir(part):
            if name != TABLE:
                link(os.path.join(part, name), os.path.join(new, name))
    put_pictures(new, folder)


def put_pictures(new, folder, force=True):
    """As decode and report do: pictures of an earlier run go, and other files
    stay. The page of a report comes last."""
    try:
        os.rename(new, folder)  # there is none, or it is empty
        return
    except OSError:
        if not force:
            raise
    with contextlib.suppress(FileNotFoundError):
        with open(os.path.join(folder, TABLE), encoding='utf-8',
                  errors='replace') as table:
            for line in list(table)[1:]:
                name = os.path.basename(line.partition(',')[0])
                if name.endswith('.png'):
                    pathlib.Path(folder, name).unlink(missing_ok=True)
    for name in sorted(os.listdir(new), key='index.html'.__eq__):
        part, path = os.path.join(new, name), os.path.join(folder, name)
        (put_pictures if os.path.isdir(part) else os.replace)(part, path)
    os.rmdir(new)


def outputs_of(store, plan, recording):
    """The paths of the pictures, their statistics, and the report."""
    return [os.path.join(store.folder, name) for name in plan.outputs(recording)]


def write_report(plan, recording, output, scratch):
    """As one run of report. It measures the recording itself."""
    new, log = os.path.join(scratch, 'page'), os.path.join(scratch, 'log')
    options = [option for option in plan.options if option.startswith(
        ('--method=', '--schedule=', '--bench=', '--bits='))]
    status, _ = programs.run(
        [*programs.REPORT, plan.recordings[recording].path, *options,
         f'--output={new}'], log)
    if status not in (0, 3):  # 3: the recording is damaged
        raise Problem(f'{output} could not be written: ' +
                      ' '.join(programs.last_lines(log)))
    for name in files_below(new):
        sync(os.path.join(new, name))
    put_pictures(new, output)


def merge(store, plan, recording):
    """Raises Problem."""
    source = plan.recordings[recording]
    manifests = check_chunks(store, plan, recording)
    form = plan.chunk_form(recording)
    def files(name):
        return [os.path.join(store.part(recording, number), name)
                for number, m in enumerate(manifests) if name in m['outputs']]
    parts, outputs = files(chunks.name_of(form)), outputs_of(store, plan, recording)
    output, counts = outputs[0], counted(manifests)
    if not parts:
        raise Problem(f'{source.path} has no picture: during all its frames that '
                      'can be decoded, the mirrors show a pattern')
    os.makedirs(os.path.dirname(output.rstrip('/')), exist_ok=True)
    with tempfile.TemporaryDirectory(dir=store.parts(recording)) as scratch:
        if form == 'png':
            join_pictures(parts, output)
        elif source.chunks == 1:
            pathlib.Path(output + '.part').unlink(missing_ok=True)
            link(parts[0], output + '.part')
            os.replace(output + '.part', output)
        else:
            join_videos(plan, parts, output, counts, os.path.join(scratch, 'log'))
        if plan.statistics:
            join_tables(files(chunks.TABLE), outputs[1])
        if plan.report:
            write_report(plan, recording, outputs[-1], scratch)
    write_json(store.merged(recording), {
        'format': 'coded-exposure-archive-recording', 'version': 2,
        'recording': source.path, 'recording_hash': source.fingerprint,
        **chunks.second_of(source), 'output': source.output, 'output_hashes': [*map(digest, outputs)],
        'options': plan.options, 'program': plan.program, 'counts': counts,
        'status': chunks.DAMAGED if counts['frames'] < source.recorded else max(
            m['status'] for m in manifests),
        'seconds': sum(m['seconds'] for m in manifests),
        'cpu_seconds': sum(m['cpu_seconds'] for m in manifests),
    })


def counted(manifests):
    """Of all chunks; the frames that are decoded have pictures. What could not be
    decoded at the end of a chunk may be lost before the next one, too."""
    counts = {name: sum(m[name] for m in manifests) for name in chunks.COUNTED}
    counts['lost'] = max(counts['lost'], sum(m['unread'] for m in manifests))
    counts['coded'] = counts['frames'] - counts['not_coded']
    return counts


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
        pathlib.Path(path).unlink(missing_ok=True)
    return True


def manifest_of(store, plan, recording):
    """Of a merged recording. Raises Problem if there is none, or it was damaged."""
    path = store.merged(recording)
    if not store.is_merged(recording):
        raise Problem(f'{plan.recordings[recording].path} is not merged; see status')
    said = read_json(path)
    try:
        numbers = [said['status'], *(said['counts'][name] for name in (
            *chunks.COUNTED, 'coded')), *(h['bytes'] for h in said['output_hashes'])]
        is_whole = all(isinstance(number, int) for number in numbers) and \
            len(said['output_hashes']) == len(plan.outputs(recording))
    except (KeyError, TypeError):
        is_whole = False
    if not is_whole:
        raise Problem(f'{path} was changed or damaged; remove it and resume to merge '
                      'the recording again')
    return said


def is_there(store, plan, recording):
    """Whether all that was merged is there, by its size."""
    try:
        said = manifest_of(store, plan, recording)
    except Problem:
        return False
    return all(
        os.path.exists(path) and size_of(path) == hashed['bytes']
        for path, hashed in zip(outputs_of(store, plan, recording),
                                said['output_hashes']))


def verify(store, plan, recording):
    """Raises Problem unless the output is what was merged, and holds the pictures
    of every coded frame of the recording exactly once. The manifest."""
    source = plan.recordings[recording]
    said = manifest_of(store, plan, recording)
    for path, digested in zip(outputs_of(store, plan, recording),
                              said['output_hashes']):
        if not os.path.exists(path) or digest(path) != digested:
            raise Problem(f'{path} is not what was merged; remove '
                          f'{store.merged(recording)} and resume to merge it '
                          'again')
    now, counts = programs.info([source.path])[0], said['counts']
    if 'error' in now:
        raise Problem(now['error'])
    frames = now['frames']
    found = counts['frames'] + (counts['lost'] if said['status'] else 0)
    if found < frames:
        raise Problem(f'{source.path} has {frames} coded frames, but {found} were '
                      'decoded')
    return said
