# SPDX-License-Identifier: LGPL-2.1-or-later
"""Gives the work to an engine, which does all scheduling and retrying."""
import collections
import contextlib
import os
import re
import shlex
import shutil
import signal
import subprocess
import time

from . import programs
from .store import Problem, Stopped, digest, write_json

RETRIES = 3
READY = 'ready'  # what a computer says that can work
# A computer that says nothing for a minute is given up.
SSH = ('ssh -o BatchMode=yes -o ConnectTimeout=20 -o ServerAliveInterval=20 '
       '-o ServerAliveCountMax=3')
PASSED = 'partition', 'time', 'account', 'qos', 'mem'  # on to sbatch


def slurm_answers():
    try:
        return shutil.which('sbatch') is not None and subprocess.run(
            ['sinfo', '-h'], capture_output=True, timeout=20,
            check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def choose(name):
    """slurm or parallel."""
    if name is None:
        name = 'slurm' if slurm_answers() else 'parallel'
    needed, package = {'slurm': ('sbatch', 'slurm-client'),
                       'parallel': ('parallel', 'parallel')}[name]
    if shutil.which(needed) is None:
        raise Problem(f'--on {name} needs {needed}; install the package {package}')
    return name


def share(items, parts, part):
    """The items of one of as many parts, in their order."""
    return items[len(items) * part // parts:len(items) * (part + 1) // parts]


def read_list(path):
    with open(path, encoding='ascii') as file:
        return [int(line) for line in file]


def write_list(path, numbers):
    with open(path, 'w', encoding='ascii') as file:
        file.writelines(f'{number}\n' for number in numbers)


# ---- Slurm -------------------------------------------------------------------

def limits():
    """(array elements, jobs) that Slurm takes."""
    said = subprocess.run(['scontrol', 'show', 'config'], capture_output=True,
                          text=True, check=False).stdout
    def value(name, default):
        found = re.search(rf'^{name}\s*=\s*(\d+)', said, re.MULTILINE)
        return int(found[1]) if found else default
    return value('MaxArraySize', 1001), value('MaxJobCount', 10000)


def tasks_for(count, most):
    """Array elements for so many chunks or merges. Half of Slurm's jobs are left
    to others; each element works off its share."""
    elements, jobs = limits()
    return max(1, min(count, elements - 1, jobs // 2, most or count))


def header(kind, tasks, engine, threads):
    """The first lines of a script for sbatch."""
    lines = ['#!/bin/bash', f'#SBATCH --job-name=codedexposure-{kind}',
             f'#SBATCH --array=0-{tasks - 1}' +
             (f'%{engine["jobs"]}' if engine.get('jobs') else ''),
             '#SBATCH --requeue --open-mode=append --ntasks=1',
             f'#SBATCH --cpus-per-task={threads}']
    lines += [f'#SBATCH --{name}={engine[name]}' for name in PASSED
              if engine.get(name)]
    return lines


def script_for(kind, store, run, tasks, engine, threads):
    lines = header(kind, tasks, engine, threads)
    lines.append(shlex.join(['exec', *programs.ARCHIVE, 'work', kind,
                             store.folder, run]) +
                 f' "$SLURM_ARRAY_TASK_ID" {tasks}')
    return '\n'.join(lines) + '\n'


def sbatch(kind, store, run, tasks, engine, threads, after=None):
    path = os.path.join(run, f'{kind}.sh')
    with open(path, 'w', encoding='utf-8') as file:
        file.write(script_for(kind, store, run, tasks, engine, threads))
    # A script could not have every name of a folder.
    log = os.path.join(run, kind).replace('%', '%%') + '-%a.log'
    words = ['sbatch', '--parsable', f'--output={log}']
    if after:
        words.append(f'--dependency=afterany:{after}')
    said = subprocess.run(words + [path], capture_output=True, text=True,
                          check=False)
    if said.returncode != 0:
        raise Problem(f'sbatch refused {kind}.sh: {said.stderr.strip()}')
    return said.stdout.strip().split(';')[0]


def start_slurm(store, plan, run, chunks, merges):
    engine, jobs = plan.engine, []
    most = engine.get('tasks')
    after = None
    if chunks:
        after = sbatch('chunk', store, run, tasks_for(len(chunks), most), engine,
                       plan.threads)
        jobs.append(after)
        # The other may be refused.
        write_json(os.path.join(run, 'jobs.json'), jobs)
    jobs.append(sbatch('merge', store, run, tasks_for(len(merges), most), engine,
                       1, after))
    write_json(os.path.join(run, 'jobs.json'), jobs)
    print(f'submitted as Slurm jobs {", ".join(jobs)}; see status')


def running_jobs(jobs):
    """The counts of the states of the jobs of a run that are in Slurm's queue;
    None: Slurm does not say it."""
    if not jobs:
        return {}
    try:
        said = subprocess.run(
            ['squeue', '-h', '-r', '-o', '%T', '-j', ','.join(jobs)],
            capture_output=True, text=True, check=False)
    except OSError:
        return None
    if said.returncode != 0 and 'Invalid job id' not in said.stderr:
        return None  # Slurm forgets jobs that ended
    return collections.Counter(said.stdout.lower().split())


# ---- GNU parallel ------------------------------------------------------------

def at_hosts(engine):
    """The words that have parallel use the computers of the engine."""
    if not engine.get('hosts'):
        return []
    words = ['--sshloginfile', engine['hosts'], '--workdir', os.getcwd()]
    if 'PARALLEL_SSH' not in os.environ:
        words += ['--ssh', SSH]
    return words


def read_hosts(path):
    """The computers that a file of --hosts names."""
    try:
        with open(path, encoding='utf-8') as file:
            hosts = [line.strip() for line in file]
    except (OSError, ValueError) as error:
        raise Problem(f'cannot read --hosts {path}: '
                      f'{getattr(error, "strerror", "it is no text")}; name a file '
                      'with a line for each computer') from error
    return [host for host in hosts if host and not host.startswith('#')]


def check_hosts(store, plan):
    """Raises Problem if a computer would mix results, or none answers; prints
    which do not."""
    hosts = read_hosts(plan.engine['hosts'])
    said = subprocess.run(
        ['parallel', '--will-cite', '--nonall', '--tag', *at_hosts(plan.engine),
         shlex.join([*programs.ARCHIVE, 'work', 'host', store.folder,
                     digest(store.plan)['sha256']])],
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    answers = dict(line.partition('\t')[::2] for line in said.stdout.splitlines())
    bad = [f'{host}: {answer}' for host, answer in answers.items()
           if answer != READY]
    if bad:
        raise Problem('; '.join(bad))
    if not answers:
        raise Problem('no computer answers: ' + ' '.join(said.stderr.split()))
    for host in hosts:
        if host not in answers:
            print(f'{host} does not answer; its work is done by others')


def parallel(kind, store, run, engine, watch):
    """Runs the list of the run; calls @watch meanwhile. Whether all went well."""
    words = ['parallel', '--will-cite', f'--retries={RETRIES}', '--halt=never',
             '--joblog', os.path.join(run, f'{kind}.joblog'),
             f'--jobs={engine.get("jobs") or "100%"}', *at_hosts(engine)]
    words += [shlex.join([*programs.ARCHIVE, 'work', f'one-{kind}',
                          store.folder]) + ' {}',
              '::::', os.path.join(run, f'{kind}.list')]
    with open(os.path.join(run, f'{kind}.log'), 'ab') as log:
        child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log,
                                 stderr=log,
                                 preexec_fn=programs.end_with_parent)
        with _passed_on(child):
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    return child.wait(timeout=1) == 0
                watch()


@contextlib.contextmanager
def _passed_on(child):
    """Signals that end this process end parallel and its jobs."""
    stopped = []

    def stop(number, _):
        stopped.append(number)
        child.send_signal(signal.SIGTERM)  # no new jobs
        child.send_signal(signal.SIGTERM)  # and none that run
    before = {number: signal.signal(number, stop)
              for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if stopped:
        raise Stopped('stopped; resume goes on')


def start_parallel(store, plan, run, chunks, merges, watch):
    if plan.engine.get('hosts'):
        check_hosts(store, plan)
    if chunks:
        parallel('chunk', store, run, plan.engine, watch)
    # The last job of a recording merges it; if it could not, this tells why.
    merges = [number for number in merges if not store.is_merged(number)]
    write_list(os.path.join(run, 'merge.list'), merges)
    if merges:
        parallel('merge', store, run, plan.engine, watch)
    watch()


# ---- Both --------------------------------------------------------------------

def start(store, plan, watch):
    """Starts what is not done yet; on parallel, to its end."""
    chunks, merges = [], []
    for number, first in enumerate(plan.first):
        if store.is_merged(number):
            continue
        merges.append(number)
        done = store.done(number)
        chunks += [first + chunk
                   for chunk in range(plan.recordings[number].chunks)
                   if chunk not in done]
    if not merges:
        print('everything is merged')
        return
    run = store.new_run()
    write_list(os.path.join(run, 'chunk.list'), chunks)
    write_list(os.path.join(run, 'merge.list'), merges)
    write_json(os.path.join(run, 'begun.json'),
               {'time': time.time(), 'chunks': len(chunks)})
    if plan.engine['on'] == 'slurm':
        start_slurm(store, plan, run, chunks, merges)
    else:
        start_parallel(store, plan, run, chunks, merges, watch)
