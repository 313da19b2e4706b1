# SPDX-License-Identifier: LGPL-2.1-or-later
"""Puts the chunks of a recording together, and checks what came of it."""
import bisect
import os
import shutil
import subprocess

from archive import chunk as chunks
from archive import ledger, programs
from archive.plan import table_of
from archive.store import Problem, digest, read_json, sync, write_json

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


def join_videos(parts, output):
    """The number of pictures."""
    joined = subprocess.run(
        [programs.join_program(), '--force', output], text=True, check=False,
        input=''.join(f'{part}\n' for part in parts), capture_output=True,
        preexec_fn=programs.end_with_parent)
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
    """The paths of the pictures and of their statistics."""
    output = os.path.join(store.folder, plan.recordings[recording].output)
    return [output, *[table_of(output)] * plan.statistics]


def merge(store, plan, recording):
    """Raises Problem."""
    source = plan.recordings[recording]
    manifests = check_chunks(store, plan, recording)
    sums = ledger.total([m['counts'] for m in manifests if m['counts']])
    name = chunks.NAMES[plan.form]
    def files(name):
        return [os.path.join(store.part(recording, number), name)
                for number, m in enumerate(manifests) if name in m['outputs']]
    parts, outputs = files(name), outputs_of(store, plan, recording)
    output = outputs[0]
    if not parts:
        raise Problem(f'{source.path} has no coded frame')
    os.makedirs(os.path.dirname(output.rstrip('/')), exist_ok=True)
    join = join_videos if plan.form == 'mkv' else join_pictures
    pictures = join(parts, output)
    counted = any(m['counts'] for m in manifests)
    if counted and pictures != sums['pictures']:
        raise Problem(f'{output} has {pictures} pictures, but its ledger '
                      f'{sums["pictures"]}')
    if plan.statistics:
        join_tables(files(chunks.TABLE), outputs[1])
    write_ledger(store, plan, recording)
    missing = max(0, source.recorded - sums['coded']) if counted else 0
    status = max(m['status'] % chunks.EMPTY for m in manifests)
    write_json(store.merged(recording), {
        'format': 'coded-exposure-archive-recording', 'version': 1,
        'recording': source.path, 'recording_hash': source.fingerprint,
        'output': source.output,
        'output_hashes': [digest(path) for path in outputs],
        'options': plan.options, 'program': plan.program, 'pictures': pictures,
        'counts': sums if counted else {},
        'missing': missing, 'status': chunks.DAMAGED if missing else status,
        'seconds': sum(m['seconds'] for m in manifests),
        'cpu_seconds': sum(m['cpu_seconds'] for m in manifests),
    })


def run(store, plan, recording):
    """Merges a recording that is not merged yet. False, with a record of it, if
    that fails."""
    if store.is_merged(recording):
        return True
    try:
        with store.lock(f'merge-{recording:06d}'):
            if not store.is_merged(recording):
                merge(store, plan, recording)
    except (Problem, OSError) as error:
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


def times_of_output(path):
    if os.path.isfile(path):
        return times_in(path)
    with open(os.path.join(path, TABLE), encoding='utf-8') as table:
        column = table.readline().strip().split(',').index('pts_ns')
        return [int(line.split(',')[column]) for line in table]


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
    recorded = times_in(source.path)
    if sorted(recorded) != sorted(coded):
        odd = sorted(set(recorded) ^ set(coded))
        raise Problem(f'{source.path} and the ledger differ in {len(odd)} coded '
                      f'frames, the first at {odd[0] if odd else "?"} ns')
    check_once(sorted(coded), pictures, times_of_output(output), output)
    return said


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
