# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the chunks of a recording together, and checks what came of it."""
import bisect
import os
import pathlib
import re
import shutil
import subprocess

from archive import chunk as chunks
from archive import ledger, programs
from archive.plan import FINISHED, FORMS
from archive.store import (Busy, Problem, digest, files_below, read_json,
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


def join_videos(parts, notes, output):
    """The number of pictures."""
    joined = subprocess.run(
        [programs.join_program(), '--force', output], text=True, check=False,
        input=''.join(f'{video}\0{note}\0' for video, note in zip(parts, notes)),
        capture_output=True, preexec_fn=programs.end_with_parent)
    if joined.returncode != 0:
        raise Problem(joined.stderr.strip() or 'codedexposure-join failed')
    return int(joined.stdout)


def join_tables(parts, output):
    """Tables with the same head."""
    with open(output + '.part', 'w', encoding='utf-8') as table:
        for i, part in enumerate(parts):
            with open(part, encoding='utf-8') as lines:
                head = lines.readline()
                if i == 0:
                    table.write(head)
                shutil.copyfileobj(lines, table)
        table.flush()
        os.fsync(table.fileno())
    os.replace(output + '.part', output)


def join_pictures(parts, output):
    """Pictures have the numbers of the whole recording. Links take no room."""
    folder = output.rstrip('/')
    new = f'{folder}.part'
    shutil.rmtree(new, ignore_errors=True)
    os.makedirs(new)
    pictures = 0
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
            pictures += 1
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(new, folder)
    return pictures


def provenance(line):
    """Of a line of notes, without the number of the first picture; empty: none."""
    said = re.search(r'coded-exposure-decoded.*?(?<!\\)"', line)
    return re.sub(r'\\"(frame|slot)\\":\d+', '', said[0]) if said else ''


def join_notes(parts, output):
    """Notes of one run: those of the whole stream are at its beginning. The times
    of the pictures, ns. Raises Problem if the provenance changes on the way."""
    times, known = [], set()
    with open(output, 'w', encoding='utf-8') as notes:
        for part in parts:
            with open(part, encoding='utf-8') as lines:
                for line in lines:
                    if line.startswith('picture '):
                        times.append(int(line.split(' ', 2)[1]))
                    elif line.startswith('tags ') and (said := provenance(line)):
                        known.add(said)
                    if line.startswith('picture ') or part == parts[0]:
                        notes.write(line)
    if len(known) > 1:
        raise Problem('the schedule changes within the recording; decode it '
                      'without archive')
    return times


def finish(store, plan, recording, videos, notes, output, scratch):
    """Writes the chunks' pictures in the form of the plan. The number of
    pictures."""
    video, all_notes, log, new = (
        os.path.join(scratch, name) for name in (
            'pictures.mkv', 'notes', 'log', 'result' + FORMS[plan.form]))
    times = join_notes(notes, all_notes)
    pictures = join_videos(videos, notes, video)
    status = programs.run(
        chunks.finish_command(plan, video, all_notes, new), log,
        stdin=subprocess.DEVNULL)
    if status != 0:
        raise Problem(f'{output} could not be written: ' +
                      ' '.join(programs.last_lines(log)))
    with open(store.times(recording) + '.part', 'w', encoding='ascii') as file:
        file.writelines(f'{time}\n' for time in times)
    os.replace(store.times(recording) + '.part', store.times(recording))
    sync(new)
    os.replace(new, output)
    return pictures


def take_whole(part, notes, output):
    """The only part is the result. A link takes no room. The number of pictures;
    None: there are no notes."""
    new = output + '.part'
    pathlib.Path(new).unlink(missing_ok=True)
    try:
        os.link(part, new)
    except OSError:  # a file system without links
        shutil.copyfile(part, new)
        sync(new)
    os.replace(new, output)
    if not notes:
        return None
    with open(notes[0], encoding='utf-8') as lines:
        return sum(line.startswith('picture ') for line in lines)


def write_ledger(store, plan, recording):
    path = store.ledger(recording)
    with open(path + '.part', 'wb') as file:
        for number in range(plan.recordings[recording].chunks):
            part = os.path.join(store.part(recording, number), 'ledger')
            if os.path.exists(part):
                with open(part, 'rb') as lines:
                    shutil.copyfileobj(lines, file)
        file.flush()
        os.fsync(file.fileno())
    os.replace(path + '.part', path)


def outputs_of(store, plan, recording):
    """The paths of the pictures, their statistics, and the report."""
    return [os.path.join(store.folder, name) for name in plan.outputs(recording)]


def write_report(plan, recording, output, scratch):
    """As one run of report. It measures the recording itself."""
    new, log = os.path.join(scratch, 'page'), os.path.join(scratch, 'log')
    options = [option for option in plan.options if option.startswith(
        ('--method=', '--schedule=', '--bench=', '--bits='))]
    status = programs.run(
        [programs.REPORT, plan.recordings[recording].path, *options,
         f'--output={new}'], log, stdin=subprocess.DEVNULL)
    if status != 0:
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
    sums = ledger.total([m['counts'] for m in manifests if m['counts']])
    form = plan.chunk_form(recording)
    def files(name):
        return [os.path.join(store.part(recording, number), name)
                for number, m in enumerate(manifests) if name in m['outputs']]
    parts, outputs = files(chunks.name_of(form)), outputs_of(store, plan, recording)
    output = outputs[0]
    if not parts:
        raise Problem(f'{source.path} has no coded frame')
    os.makedirs(os.path.dirname(output.rstrip('/')), exist_ok=True)
    scratch = store.merging(recording)
    known = []
    if form != plan.form:
        pictures = finish(store, plan, recording, parts, files(chunks.NOTES),
                          output, scratch)
    elif form == 'png':
        pictures = join_pictures(parts, output)
    elif len(parts) == 1:
        # That was compared above, and is large.
        known = [m['outputs'][chunks.name_of(form)] for m in manifests
                 if chunks.name_of(form) in m['outputs']]
        pictures = take_whole(parts[0], files(chunks.NOTES), output)
    else:
        pictures = join_videos(parts, files(chunks.NOTES), output)
    counted = any(m['counts'] for m in manifests)
    if counted and pictures != sums['pictures']:
        raise Problem(f'{output} has {pictures} pictures, but its ledger '
                      f'{sums["pictures"]}')
    if plan.statistics:
        join_tables(files(chunks.TABLE), outputs[1])
    if plan.report:
        write_report(plan, recording, outputs[-1], scratch)
    shutil.rmtree(scratch)
    write_ledger(store, plan, recording)
    missing = max(0, source.recorded - sums['coded']) if counted else 0
    status = max(m['status'] % chunks.EMPTY for m in manifests)
    write_json(store.merged(recording), {
        'format': 'coded-exposure-archive-recording', 'version': 1,
        'recording': source.path, 'recording_hash': source.fingerprint,
        'output': source.output,
        'output_hashes': [*known, *map(digest, outputs[len(known):])],
        'options': plan.options, 'program': plan.program, 'pictures': pictures,
        'counts': sums if counted else {},
        'missing': missing, 'status': chunks.DAMAGED if missing else status,
        'seconds': sum(m['seconds'] for m in manifests),
        'cpu_seconds': sum(m['cpu_seconds'] for m in manifests),
    })


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


def times_in(path):
    """Of all frames of a Matroska file, without decoding it."""
    listed = subprocess.run([programs.join_program(), '--times', path],
                            capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        raise Problem(listed.stderr.strip())
    return [int(line) for line in listed.stdout.split()]


def times_of_output(store, plan, recording, path):
    """Of all pictures, ns. Forms that cannot be listed were compared with the
    notes of their pictures when they were written, and are as they were."""
    if plan.form in FINISHED:
        with open(store.times(recording), encoding='ascii') as file:
            return [int(line) for line in file]
    if plan.form == 'mkv':
        return times_in(path)
    with open(os.path.join(path, TABLE), encoding='utf-8') as table:
        column = table.readline().strip().split(',').index('pts_ns')
        return [int(line.split(',')[column]) for line in table]


def is_there(store, plan, recording):
    """Whether all that was merged is there, by its size."""
    said = read_json(store.merged(recording))
    return said is not None and all(
        os.path.exists(path) and size_of(path) == hashed['bytes']
        for path, hashed in zip(outputs_of(store, plan, recording),
                                said['output_hashes']))


def verify(store, plan, recording):
    """Raises Problem unless the output is what was merged, and the pictures of
    every coded frame of the recording are in it exactly once. The manifest."""
    source = plan.recordings[recording]
    output = os.path.join(store.folder, source.output)
    said = read_json(store.merged(recording))
    if said is None:
        raise Problem(f'{source.path} is not merged; see status')
    for path, digested in zip(outputs_of(store, plan, recording),
                              said['output_hashes']):
        if not os.path.exists(path) or digest(path) != digested:
            raise Problem(f'{path} is not what was merged; remove '
                          f'{store.merged(recording)} and resume to merge it '
                          'again')
    if not said['counts']:
        return said
    coded, pictures = ledger.read(store.ledger(recording))
    check_coded(sorted(times_in(source.path)), sorted(coded), source.path)
    check_once(sorted(coded), pictures, times_of_output(
        store, plan, recording, output), output)
    return said


def check_coded(recorded, coded, path):
    """Whether these are the same times, up to the rounding of the recording."""
    if len(recorded) != len(coded):
        raise Problem(f'{path} has {len(recorded)} coded frames, but the ledger '
                      f'{len(coded)}')
    for time, said in zip(recorded, coded):
        if abs(time - said) > ledger.ROUNDING:
            raise Problem(f'{path} has a coded frame at {time} ns, but the ledger '
                          f'at {said} ns')


def check_once(coded, pictures, times, output):
    """Whether each coded frame has as many times from it to the next as the
    ledger says."""
    found = [0] * len(coded)
    for time in times:
        at = bisect.bisect_right(coded, time + ledger.ROUNDING) - 1
        if at < 0:
            raise Problem(f'{output} has a picture at {time} ns, before the first '
                          'coded frame')
        found[at] += 1
    for time, count in zip(coded, found):
        expected = pictures.get(time, (0, 0))[1]
        if count != expected:
            raise Problem(f'{output} has {count} pictures of the coded frame at '
                          f'{time} ns, not {expected}')
