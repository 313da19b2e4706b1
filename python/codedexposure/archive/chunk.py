# SPDX-License-Identifier: LGPL-2.1-or-later
"""Decodes one chunk."""
import contextlib
import copy
import json
import os
import resource
import shutil
import socket
import subprocess
import tempfile
import time

from . import programs
from .plan import FORMS, borders_of, digest_of_options
from .store import (Problem, digest, fingerprint, read_json, write_json)

TABLE = 'statistics.csv'
FOR_OUTPUT = '--deflate', '--white'  # for other forms than lossless video
DONE, FAILED, DAMAGED = 0, 1, 3  # of decode
COUNTED = 'frames', 'not_coded', 'lost', 'pictures'  # by decode
NUMBERS = *COUNTED, 'unread', 'status', 'seconds', 'cpu_seconds'  # of a manifest
ENGINE_NAMES = 'SLURM_ARRAY_JOB_ID', 'SLURM_ARRAY_TASK_ID', 'PARALLEL_SEQ'


def seconds(time_ns):
    return f'{time_ns // 10**9}.{time_ns % 10**9:09d}'


def name_of(form):
    """The file or folder with the pictures of a chunk."""
    return 'pictures' + FORMS[form].rstrip('/')


def outputs_of(plan, recording, pictures):
    """The names of what a chunk with so many pictures has. All its frames may show
    a pattern, so that there is none."""
    names = [name_of(plan.chunk_form(recording)), *[TABLE] * plan.statistics]
    return names if pictures else []


def second_of(source):
    """What is written of the recording of a second camera, if there is one."""
    return ({'second': source.second, 'second_hash': source.second_fingerprint}
            if source.second else {})


def identity(plan, recording, chunk):
    """What a chunk's manifest must say to belong to the plan."""
    source = plan.recordings[recording]
    return {
        **second_of(source),
        'statistics': plan.statistics,
        'format': 'coded-exposure-archive-chunk', 'version': 1,
        'recording': source.path, 'recording_hash': source.fingerprint,
        'excerpt_ns': list(source.excerpt(chunk)),
        'options': plan.options, 'options_sha256': plan.options_digest,
        'form': plan.form, 'program': plan.program,
    }


def second_option(source):
    return [f'--second={source.second}'] * bool(source.second)


def command(plan, recording, chunk, scratch):
    """A recording that is one chunk because it is damaged is decoded like any
    other, from front to back if need be."""
    source = plan.recordings[recording]
    start, stop = source.excerpt(chunk)
    form = plan.chunk_form(recording)
    options = [option for option in plan.options if form == plan.form
               or not option.startswith(FOR_OUTPUT)]
    words = [*programs.DECODE, source.path, *options, '--json',
             f'--threads={plan.threads}',
             '--output=' + os.path.join(scratch, 'pictures' + FORMS[form])]
    if plan.statistics:
        words.append(f'--statistics={os.path.join(scratch, TABLE)}')
    words += second_option(source)
    if source.chunks > 1:
        stop = '' if stop is None else seconds(stop)
        words.append(f'--excerpt={seconds(start)}-{stop}')
    return words


def check_options(plan):
    """Raises Problem if decode does not take the options of the plan, or does not
    write its form."""
    first = plan.recordings[0]
    said = subprocess.run(
        [*programs.DECODE, first.path, *plan.options, *second_option(first), '--print',
         f'--output=pictures{FORMS[plan.form]}'], capture_output=True, text=True,
        check=False, stdin=subprocess.DEVNULL)
    if said.returncode != 0:
        raise Problem(said.stderr.partition('\n')[0])


def check_decodes(plan):
    """Raises Problem if the options of the plan do not fit the first recording that
    is not damaged, which only decoding tells. One coded frame is decoded; if that
    fails, another, since the first may be damaged."""
    first = next((r for r in plan.recordings if r.frames and not r.whole), None)
    if not (first and plan.options):
        return
    said = programs.info([first.path])[0]
    part, each = copy.copy(plan), copy.copy(first)
    part.recordings = [each]
    each.borders = borders_of(said['times_ns'], said['start_ns'], 1)
    for frame in 0, first.frames // 2:
        with tempfile.TemporaryDirectory() as folder:
            _, said = programs.run(command(part, 0, frame, folder),
                                   os.path.join(folder, 'log'))
        # This computer may lack the memory to decode, which others have.
        if not said or said.get('element') not in ('demux', 'fuse', 'pair'):
            return
    raise Problem(f'{first.path} cannot be decoded with these options: '
                  f'decode: error: {said["error"]}')


def join_command(plan, videos, output):
    """Writes the pictures of lossless chunks in the form of the plan."""
    options = [option for option in plan.options if plan.form != 'mkv'
               and option.startswith((*FOR_OUTPUT, '--bits'))]
    return [*programs.JOIN, *videos, *options, '--force',
            f'--threads={plan.threads}', f'--output={output}']


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def check_program(plan):
    """The plan's must be what runs here, so that no result is mixed."""
    version = programs.version()
    if version != plan.program:
        raise Problem(f'this is {version}, but {plan.program} began the archive; '
                      'install that on every node, or submit to a new folder')
    if digest_of_options(plan.options) != plan.options_digest:
        raise Problem('a file that an option of decode names was changed; put it '
                      'back, or submit to a new folder')


def check_source(source):
    for path, known in ((source.path, source.fingerprint),
                        (source.second, source.second_fingerprint)):
        if path and fingerprint(path) != known:
            raise Problem(f'{path} is not the file that was planned; put it '
                          'back, or submit it to a new archive')


def decode(plan, recording, chunk, scratch):
    """The manifest of a decoded chunk; raises Problem."""
    source = plan.recordings[recording]
    log = os.path.join(scratch, 'log')
    check_program(plan)
    check_source(source)
    begun, cpu = time.time(), cpu_seconds()
    status, said = programs.run(command(plan, recording, chunk, scratch), log)
    expected = source.frames_of(chunk, plan.length)
    # None of its frames can be decoded, but those of other chunks may be.
    if (status == FAILED and said and said['damaged'] and 'error' not in said
            and not said['frames'] and source.chunks > 1):
        status, said['missing'] = DAMAGED, expected
    if status not in (DONE, DAMAGED) or said is None:
        raise Problem(f'decode ended with status {status}')
    check_source(source)
    # What is too damaged to be decoded is lost. The numbers of frames do not show
    # it before the first frame and after the last one.
    unread = (min(said['missing'], expected - said['frames'])
              if status == DAMAGED else 0)
    found = said['frames'] + (max(said['lost'], unread) if status == DAMAGED else 0)
    if found < expected:
        raise Problem(f'decode read {found} of the {expected} coded frames of this '
                      'chunk')
    manifest = identity(plan, recording, chunk)
    manifest.update(
        outputs={name: digest(os.path.join(scratch, name))
                 for name in outputs_of(plan, recording, said['pictures'])},
        **{name: said[name] for name in COUNTED}, unread=unread, status=status,
        host=socket.gethostname(),
        begun=begun, seconds=time.time() - begun, cpu_seconds=cpu_seconds() - cpu,
        engine={name: os.environ[name] for name in ENGINE_NAMES
                if name in os.environ})
    return manifest


def run(store, plan, recording, chunk):
    """Decodes a chunk that is not there yet. False, with a record of it, if that
    fails."""
    if os.path.isdir(store.part(recording, chunk)):
        return True
    scratch = store.scratch(recording, chunk)
    try:
        manifest = decode(plan, recording, chunk, scratch)
        write_json(os.path.join(scratch, 'manifest.json'), manifest)
        store.publish(scratch, recording, chunk)
    except (Problem, OSError) as error:
        lines = programs.last_lines(os.path.join(scratch, 'log'))
        shutil.rmtree(scratch, ignore_errors=True)  # a full disk has room again
        note_failure(store, recording, chunk, error, lines)
        return False
    with contextlib.suppress(FileNotFoundError):
        os.remove(store.failure(recording, chunk))
    return True


def note_failure(store, recording, chunk, error, lines=()):
    """For status; a full disk may not take it. The job that writes it may be
    killed: nothing else is left of it then."""
    with contextlib.suppress(OSError):
        with open(store.failure(recording, chunk), 'w', encoding='utf-8') as file:
            json.dump({'error': str(error), 'lines': list(lines),
                       'host': socket.gethostname(), 'time': time.time()}, file)


def mismatch(store, plan, recording, chunk):
    """Why a chunk is not what its manifest and the plan say, or None. The
    manifest, if it is."""
    folder = store.part(recording, chunk)
    manifest = read_json(os.path.join(folder, 'manifest.json'))
    if manifest is None or not all(
            isinstance(manifest.get(name), (int, float)) for name in NUMBERS):
        return 'its manifest cannot be read', None
    for name, value in identity(plan, recording, chunk).items():
        if manifest.get(name) != value:
            return f'its {name} is not that of the plan', None
    outputs, names = manifest.get('outputs'), outputs_of(
        plan, recording, manifest['pictures'])
    if not isinstance(outputs, dict) or set(outputs) != set(names):
        return 'its outputs are not those of the plan', None
    for name, said in outputs.items():
        path = os.path.join(folder, name)
        if not os.path.exists(path) or digest(path) != said:
            return f'{name} is not what its manifest says', None
    return None, manifest
