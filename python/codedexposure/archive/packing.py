# SPDX-License-Identifier: LGPL-2.1-or-later
"""Has an engine pack raw recordings, one job each. pack replaces a recording only
when all is checked, so there is no other state than the recordings."""
import os
import shlex
import subprocess
import tempfile

from . import engine, programs
from .store import Problem

DAMAGED = 3  # status of pack


def raw_recordings(paths):
    """Those that are not packed yet. Raises Problem if one is no recording."""
    for said in paths:
        if 'error' in said:
            raise Problem(said['error'])
    return [said['recording'] for said in paths if said['codec'] == 'raw']


def command(threads):
    return shlex.join([*programs.PACK, '--threads', str(threads)])


def on_parallel(paths, settings, threads):
    """The statuses of pack."""
    with tempfile.TemporaryDirectory() as folder:
        names, log = os.path.join(folder, 'names'), os.path.join(folder, 'log')
        with open(names, 'wb') as file:
            file.write(b''.join(os.fsencode(path) + b'\0' for path in paths))
        said = subprocess.run(
            ['parallel', '--will-cite', '--halt=never', '--null', '-a', names,
             '--joblog', log, f'--jobs={settings.get("jobs") or "100%"}',
             *engine.at_hosts(settings), command(threads) + ' {}'],
            stdin=subprocess.DEVNULL, check=False)
        with open(log, encoding='utf-8', errors='replace') as file:
            ends = [line.split('\t')[6:8] for line in list(file)[1:]]
    statuses = [int(status) or int(killed) for status, killed in ends]
    if len(statuses) != len(paths):
        raise Problem(f'GNU parallel ended early, with status {said.returncode}; '
                      'run this again for the rest')
    return statuses


def on_slurm(paths, settings, threads):
    """Submits an array; each element packs its share."""
    tasks = engine.tasks_for(len(paths), settings.get('tasks'))
    log = os.getcwd().replace('%', '%%') + '/codedexposure-pack-%A_%a.log'
    script = '\n'.join(engine.header('pack', tasks, settings, threads) + [
        'recordings=(', *(f'  {shlex.quote(path)}' for path in paths), ')',
        'worst=0',
        f'for ((k = SLURM_ARRAY_TASK_ID; k < {len(paths)}; k += {tasks})); do',
        f'  {command(threads)} "${{recordings[k]}}" || worst=$?',
        'done', 'exit "$worst"', ''])
    said = subprocess.run(['sbatch', '--parsable', f'--output={log}'],
                          input=script, text=True, capture_output=True,
                          check=False)
    if said.returncode != 0:
        raise Problem(f'sbatch refused: {said.stderr.strip()}')
    return said.stdout.strip().split(';')[0]


def run(paths, settings, threads):
    """The exit status."""
    raw = raw_recordings(paths)
    print(f'raw recordings to pack: {len(raw)}; FFV1 already: '
          f'{len(paths) - len(raw)}')
    if not raw:
        return 0
    if settings['on'] == 'slurm':
        print(f'submitted as Slurm job {on_slurm(raw, settings, threads)}; each '
              'element writes what it says to codedexposure-pack-*.log')
        return 0
    statuses = on_parallel(raw, settings, threads)
    damaged = statuses.count(DAMAGED)
    failed = len(statuses) - statuses.count(0) - damaged
    print(f'{statuses.count(0)} packed, {damaged} kept because they are cut off or '
          f'damaged, {failed} failed')
    return 1 if failed else DAMAGED if damaged else 0
