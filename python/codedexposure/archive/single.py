# SPDX-License-Identifier: LGPL-2.1-or-later
"""decode --jobs: one recording on the cores of this machine."""
import os
import shutil
import sys
import tempfile

from . import chunk, engine, plan, programs, status
from .merge import put_pictures
from .store import Problem, Stopped, Store, read_json, write_json

CHUNKS = 4      # for each job, so that all end at about the same time
SHORTEST = 250  # coded frames; each chunk starts a process and reads more
STATISTICS = '--statistics='


def check_name(output, force):
    """The form of an output."""
    form = next(form for form, ending in plan.FORMS.items()
                if output.endswith(ending))
    name = output.rstrip('/')
    if not force and (os.listdir(name) if form == 'png' and os.path.isdir(name)
                      else os.path.lexists(name)):
        raise Problem(f'{output} exists; choose another name, or set --force to '
                      'replace it')
    return form


def check_table(table, force):
    if os.path.lexists(table) and not force:
        raise Problem(f'{table} exists; choose another name, or set --force to '
                      'replace it')


def put_file(new, path, force):
    """Gives a file its name, which may have been taken meanwhile."""
    if not force and os.path.lexists(path):
        raise Problem(f'{path} appeared meanwhile; it was not replaced')
    shutil.move(new, os.path.realpath(path))  # a link stays


def run(recording, output, jobs, force, options):
    """The exit status of decode. What it needs meanwhile is in a new folder
    beside the output, and removed at the end."""
    form = check_name(output, force)
    name = os.path.abspath(output)
    tables = [option for option in options if option.startswith(STATISTICS)]
    table = tables[-1].removeprefix(STATISTICS) if tables else None
    if table:
        check_table(table, force)
    said = programs.info([recording])[0]
    if 'error' in said:
        raise Problem(said['error'])
    frames = said['frames']
    length = max(SHORTEST, -(-frames // (CHUNKS * jobs)))
    if frames <= length:
        os.execv(programs.PROGRAM, [*programs.DECODE, recording, *options,
                                   f'--output={output}', *['--force'] * force])
    above, base = os.path.split(name)
    os.makedirs(above, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f'.{base}.', dir=above) as folder:
        store = Store(folder)
        store.create()
        made = plan.make([recording], [], folder, form, length, 1,
                         [o for o in options if o not in tables],
                         programs.version())
        made.statistics = bool(table)
        made.engine = {'on': 'parallel', 'jobs': jobs}
        write_json(store.plan, made.to_json())
        return decode(store, made, recording, output, table, force)


def decode(store, made, recording, output, table, force):
    watch = status.Watch(store, made)
    try:
        engine.start(store, made, watch)
    except Stopped:
        raise Stopped('stopped; nothing was written') from None
    finally:
        watch.end()
    now = status.take(store, made)
    if not now.complete():
        status.show_failures(store, made, now, sys.stderr)
        return 1
    result = os.path.join(store.folder, made.recordings[0].output)
    if table:
        put_file(plan.table_of(result), table, force)
    (put_pictures if made.form == 'png' else put_file)(
        result.rstrip('/'), output.rstrip('/'), force)
    said = read_json(store.merged(0))
    counts = said['counts']
    lost = f', {counts["lost"]} lost' if counts['lost'] else ''
    print(f'decode: {counts["frames"]} coded frames of {recording}{lost}; wrote '
          f'{output} ({counts["pictures"]} frames)', file=sys.stderr)
    if said['status'] == chunk.DAMAGED:
        print(f'decode: {made.recordings[0].inputs} is cut off or damaged; what '
              'could be decoded was, and pictures of damaged frames are flagged',
              file=sys.stderr)
    return said['status']
