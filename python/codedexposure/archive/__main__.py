# SPDX-License-Identifier: LGPL-2.1-or-later
"""Decodes archives of recordings on a batch engine."""
import argparse
import os
import shutil
import signal
import sys

from . import (chunk, engine, measure, merge, packing, plan, programs, single,
               status)
from .store import Problem, Stopped, Store, digest, read_json, write_json

NAME = 'archive'
OF_DECODE = sys.argv[1:3] == ['work', 'decode']  # what decode --jobs becomes
STOPPED = 130  # status of a command that was stopped
CALL = 'codedexposure archive'
HELP = f'''Usage: {CALL} plan|submit RECORDING... --to FOLDER [option...]
           [-- DECODE OPTION...]
       {CALL} status|verify|clean FOLDER
       {CALL} resume FOLDER [--hosts FILE]
       {CALL} pack RECORDING... [option...]
Decodes many recordings on many cores or computers. They are cut into chunks,
which Slurm or GNU parallel decodes, and put together: for each recording, byte
for byte what one run of decode writes. RECORDING is a recording, or a folder
with recordings.

  plan     what would be done, in core hours and bytes, by a measured minute
  submit   start; with GNU parallel it also waits for the end
  status   progress, rate, time left, and why chunks failed
  resume   start again what is missing, also on other --hosts
  verify   read all again: each coded frame's pictures are there exactly once
  clean    remove the chunks of recordings that are merged
  pack     turn raw recordings into FFV1, each in its place, as pack does

  --to FOLDER         where results go, and the state of the work (.archive/)
  --list FILE         more recordings or folders, one on each line
  --form FORM         mkv (lossless FFV1), png (a folder with times.csv), mp4
                      (H.264), ome.tif or h5 [mkv]
  --statistics        also NAME.csv, a line for each picture, as of decode
  --report            also NAME.report/, a page of each recording, as of report
  --chunk N           coded frames of a chunk [1500]
  --on ENGINE         slurm or parallel [slurm if sinfo answers, or parallel]
  --jobs N            chunks at the same time, on each host [parallel: one for
                      each core; slurm: no limit]
  --threads N         threads of each job [1]
  --hosts FILE        parallel: other computers, as its --sshloginfile; they
                      need the same folders and programs
  --tasks N           slurm: most elements of an array; each works off its share
                      of the chunks [what Slurm allows]
  --partition NAME    slurm: passed on, as are --time, --account, --qos, --mem
  --time LIMIT        slurm: time limit of an element of the array
  --account NAME      slurm: the account to charge
  --qos NAME          slurm: quality of service
  --mem SIZE          slurm: memory of an element, such as 2G
  --no-measure        plan: do not measure
  --force             replace results that exist, but never a recording
  -h, --help          show this help

Options of decode: --method, --mapping, --fuse, --refine, --overlap, --range,
--bench, --full-well, --read-noise, --region, --schedule, --bits, --view,
--white, --deflate, --second (a file, or a folder whose files are named as the
recordings in theirs).

Exit status: 0 all is done, 1 something failed or is missing, 2 wrong usage, 3
done, but a recording is cut off or damaged, 130 stopped.

Examples:
  What the fusion of a folder of recordings will cost:
    {CALL} plan recordings/ --to decoded/ -- --fuse fast
  Decode it with two jobs at the same time, on this computer:
    {CALL} submit recordings/ --to decoded/ \\
      --on parallel --jobs 2
  See what is done:
    {CALL} status decoded/
'''


class Parser(argparse.ArgumentParser):
    def error(self, message):
        sys.stderr.write(f'{NAME}: {message}\nTry: {CALL} --help\n')
        sys.exit(2)


def number(text):
    value = int(text)
    if not 1 <= value <= 10**9:
        raise ValueError
    return value


FLAG = {'action': 'store_true'}
RUNS = {'--list': {'action': 'append', 'default': []},
        '--on': {'choices': ('slurm', 'parallel')},
        '--jobs': {'type': number}, '--threads': {'type': number, 'default': 1},
        '--hosts': {}, '--tasks': {'type': number},
        **{f'--{name}': {} for name in engine.PASSED}}
DECODES = {**RUNS, '--to': {},
           '--form': {'choices': sorted(plan.FORMS), 'default': 'mkv'},
           '--statistics': FLAG, '--report': FLAG, '--force': FLAG,
           '--chunk': {'type': number, 'default': 1500}}
# The options of each command.
COMMANDS = {'plan': {**DECODES, '--no-measure': FLAG}, 'submit': DECODES,
            'pack': RUNS, 'status': {}, 'resume': {'--hosts': {}}, 'verify': {},
            'clean': {}}


def parse():
    parser = Parser(prog=NAME, add_help=False, allow_abbrev=False)
    words, decode = sys.argv[1:], []
    if '-h' in words or '--help' in words:
        sys.stdout.write(HELP)
        sys.exit(0)
    if '--' in words:
        words, decode = words[:words.index('--')], words[words.index('--') + 1:]
    command = words[0] if words else ''
    option = command.split('=')[0]
    if option.startswith('-') and not any(
            option in known for known in COMMANDS.values()):
        parser.error(f'unknown option {option}')
    if command not in COMMANDS:
        parser.error(f'{command or "no command"}: set one of ' +
                     ', '.join(COMMANDS))
    parser.add_argument('words', nargs='*')
    for name, how in COMMANDS[command].items():
        parser.add_argument(name, **how)
    options, unknown = parser.parse_known_intermixed_args(words[1:])
    if unknown:
        parser.error(f'{unknown[0]} is no option of {command}')
    options.command, options.decode = command, decode
    if command in ('plan', 'submit'):
        if not options.to:
            parser.error('set --to FOLDER')
    elif decode:
        parser.error(f'{command} takes no options of decode')
    elif command != 'pack' and len(options.words) != 1:
        parser.error(f'{command} takes one FOLDER of submit')
    return options


def make_plan(options):
    made = plan.make(options.words, options.list, options.to, options.form,
                     options.chunk, options.threads, options.decode,
                     programs.version())
    made.statistics, made.report = options.statistics, options.report
    plan.check_outputs(options.to, made)
    chunk.check_options(made)
    return made


def show_plan(options):
    made = make_plan(options)
    for line in measure.describe(made):
        print(line)
    if options.no_measure:
        return 0
    core_seconds, size = measure.predict(made)
    free = shutil.disk_usage(existing(options.to)).free
    print(f'{measure.hours(core_seconds)}, by a measured minute')
    print(f'{measure.amount(size)} of disk, half of it or more until clean; '
          f'{measure.amount(free)} are free')
    if size > free:
        print(f'{NAME}: there is not enough room', file=sys.stderr)
        return 1
    return 0


def existing(folder):
    """The folder or the closest above it that exists."""
    folder = os.path.abspath(folder)
    while not os.path.isdir(folder):
        folder = os.path.dirname(folder)
    return folder


def submit(options):
    store = Store(options.to)
    refuse_second(store)
    made = make_plan(options)
    made.engine = engine_of(options)
    if not options.force:
        for number in range(len(made.recordings)):
            for path in merge.outputs_of(store, made, number):
                if os.path.lexists(path.rstrip('/')):
                    raise Problem(f'{path} exists; choose another folder, or set '
                                  '--force to replace it')
    chunk.check_decodes(made)
    is_new = not os.path.exists(store.work)
    store.create()
    with store.lock('run'):
        refuse_second(store)  # submitted meanwhile
        write_json(store.plan, made.to_json())
        for line in measure.describe(made):
            print(line)
        try:
            start(store, made)
        except Problem:
            if made.engine['on'] == 'slurm' and not store.last_jobs():
                store.forget(is_new)  # other options of Slurm need another plan
            raise
    return outcome(store, made)


def refuse_second(store):
    if store.exists():
        raise Problem(f'{store.folder} is an archive already; resume it, or '
                      'choose another folder')


def hosts_of(options):
    """The file that names computers, or None. Raises Problem if it does not."""
    if options.hosts is None:
        return None
    engine.read_hosts(options.hosts)
    return os.path.abspath(options.hosts)


def check_engine(name, options):
    """Refuses options of the other engine, which would have no effect."""
    others = {'parallel': ('tasks', *engine.PASSED), 'slurm': ('hosts',)}[name]
    for option in others:
        if getattr(options, option, None) is not None:
            Parser(prog=NAME).error(f'--{option} has no effect with {name}, which '
                                    'does the work; leave it out, or set --on')


def engine_of(options):
    name = engine.choose(options.on)
    check_engine(name, options)
    settings = {'on': name, 'jobs': options.jobs, 'tasks': options.tasks,
                'hosts': hosts_of(options)}
    settings.update((name, getattr(options, name)) for name in engine.PASSED)
    return settings


def pack(options):
    found = plan.find_recordings(options.words, options.list, None)
    return packing.run([said for said, _ in found], engine_of(options),
                       options.threads)


def resume(store, made, options):
    check_engine(made.engine['on'], options)
    with store.lock('run'):
        if options.hosts is not None:
            made.engine['hosts'] = hosts_of(options)
            write_json(store.plan, made.to_json())
        jobs = store.last_jobs()
        if engine.running_jobs(jobs):
            raise Problem(f'jobs {", ".join(jobs)} still run; wait for their end, '
                          f'or end them: scancel {" ".join(jobs)}')
        start(store, made)
    return outcome(store, made)


def start(store, made):
    watch = status.Watch(store, made)
    try:
        engine.start(store, made, watch)
    finally:
        watch.end()


def outcome(store, made):
    """Says it; the exit status."""
    now = status.take(store, made)
    if made.engine['on'] == 'slurm' and not now.complete():
        return 0
    status.show_failures(store, made, now, sys.stderr)
    if not now.complete() and not now.failed:
        status.show_log(store, sys.stderr)
    if not now.complete():
        status.show_room(store, sys.stderr)
    print(status.progress(store, now))
    if not now.complete():
        print(status.RESUME)
    return result(store, made) if now.complete() else 1


def result(store, made):
    status = 0
    for number, recording in enumerate(made.recordings):
        said = read_json(store.merged(number)) or {}
        if not said.get('status'):
            continue
        status = said['status']
        lost = said['counts']['lost']
        print(f'{recording.inputs} is cut off or damaged; what could be decoded was' +
              (f', {lost} coded {"frame is" if lost == 1 else "frames are"} lost'
               if lost else '') + ', and pictures of damaged frames are flagged')
    return status


def verify(store, made):
    bad, coded, pictures, lost = 0, 0, 0, 0
    for recording in range(len(made.recordings)):
        try:
            said = merge.verify(store, made, recording)
        except (Problem, OSError) as error:
            print(f'{NAME}: {error}', file=sys.stderr)
            bad += 1
            continue
        coded += said['counts']['coded']
        lost += said['counts']['lost']
        pictures += said['counts']['pictures']
    print(f'{len(made.recordings) - bad} of {len(made.recordings)} recordings are '
          f'as merged: {coded} coded frames, each with its pictures exactly once '
          f'({pictures}); {lost} {"was" if lost == 1 else "were"} lost')
    return 1 if bad else 0


def clean(store, made):
    kept = 0
    with store.lock('run'):
        for number, recording in enumerate(made.recordings):
            if not store.is_merged(number):
                kept += 1
            elif not merge.is_there(store, made, number):
                print(f'kept the chunks of {recording.path}, since its result is '
                      'not there any more; see verify')
                kept += 1
            else:
                shutil.rmtree(store.parts(number), ignore_errors=True)
    print(f'removed the chunks of {len(made.recordings) - kept} recordings' +
          (f'; those of {kept} are needed' if kept else ''))
    return 0


def work(words):
    """What the engines run: one chunk or merge, or a share of a list."""
    kind, folder, *rest = words
    if kind == 'host':
        return check_host(folder, *rest)
    store = Store(folder)
    made = plan.Plan.from_json(read_json(store.plan))
    if kind.startswith('one-'):
        numbers = [int(rest[0])]
    else:
        run, task, tasks = rest[0], int(rest[1]), int(rest[2])
        numbers = engine.share(engine.read_list(os.path.join(run, f'{kind}.list')),
                               tasks, task)
    good = True
    for item in numbers:
        if kind.endswith('chunk'):
            recording, number_of_chunk = made.locate(item)
            good &= chunk.run(store, made, recording, number_of_chunk)
            merge.run_if_ready(store, made, recording)
        else:
            good &= merge.run(store, made, item)
    return 0 if good else 1


def check_host(folder, plan_sha256):
    """On another computer: whether it can work; says why not."""
    store = Store(folder)
    try:
        if not store.exists() or digest(store.plan)['sha256'] != plan_sha256:
            raise Problem(f'{folder} is not the folder that was submitted from; '
                          'mount it at the same path')
        made = plan.Plan.from_json(read_json(store.plan))
        chunk.check_program(made)
        for recording in made.recordings:
            for path in (recording.path, recording.second):
                if path and not os.path.exists(path):
                    raise Problem(f'{path} is not there; mount its folder at the '
                                  'same path')
        print(engine.READY)
    except Problem as problem:
        print(problem)
    return 0


def main():
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # status | head
    is_work = sys.argv[1:2] == ['work']
    options = None if OF_DECODE or is_work else parse()
    # The program that became this one blocked it, while Python starts and
    # argparse, which cannot be stopped, reads options.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    if OF_DECODE:
        recording, output, jobs, force, *rest = sys.argv[3:]
        engine.choose('parallel')
        return single.run(recording, output, int(jobs), bool(force), rest)
    if is_work:
        return work(sys.argv[2:])
    if options.command == 'plan':
        return show_plan(options)
    if options.command == 'submit':
        return submit(options)
    if options.command == 'pack':
        return pack(options)
    store = Store(options.words[0])
    if not store.exists():
        raise Problem(f'{store.folder} is no archive; submit makes one')
    made = plan.Plan.from_json(read_json(store.plan))
    store.create()  # folders that someone removed
    if options.command == 'status':
        return 0 if status.show(store, made) else 1
    if options.command == 'resume':
        return resume(store, made, options)
    return {'verify': verify, 'clean': clean}[options.command](store, made)


SAID_BY = 'decode' if OF_DECODE else NAME
try:
    sys.exit(main())
except Stopped as stopped:
    print(f'{SAID_BY}: {stopped}', file=sys.stderr)
    sys.exit(STOPPED)
except KeyboardInterrupt:
    print(f'{SAID_BY}: stopped', file=sys.stderr)
    sys.exit(STOPPED)
except Problem as problem:
    sys.exit(f'{SAID_BY}: {problem}')
except OSError as error:
    said = ': '.join(filter(None, (error.filename, error.strerror)))
    sys.exit(f'{SAID_BY}: {said}; mend this, and run it again: what was done is '
             'kept')
