# SPDX-License-Identifier: LGPL-2.1-or-later
"""The folder of an archive: where its files are, and how they are written.

FOLDER/.archive/plan.json           what is decoded, and how
FOLDER/.archive/parts/R/C/          chunk C of recording R, with manifest.json
FOLDER/.archive/failed/R-C.json     why a chunk or (C: merge) a merge failed
FOLDER/.archive/merged/R.json       the manifest of a finished recording
FOLDER/.archive/runs/N/             lists, script and logs of a run

A chunk is written to a folder of another name and renamed as a whole."""
import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import socket

BLOCK = 1 << 22


class Problem(Exception):
    """A message for the user: value, rule and remedy."""


class Stopped(Problem):
    """A signal ended the work."""


class Busy(Problem):
    """Another process is at it."""


def write_json(path, content):
    """Under another name until it is whole."""
    part = f'{path}.{socket.gethostname()}-{os.getpid()}.part'
    with open(part, 'w', encoding='utf-8') as file:
        json.dump(content, file, indent=1, sort_keys=True)
        file.write('\n')
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def read_json(path, kind=dict):
    """None: there is no such file, or it is damaged."""
    try:
        with open(path, encoding='utf-8') as file:
            content = json.load(file)
    except (OSError, ValueError):
        return None
    return content if isinstance(content, kind) else None


def sync(path):
    """A full disk or a lost network may be reported only here."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def files_below(path):
    """Names of the files of a folder, relative to it, sorted; a file itself is
    the empty name."""
    if os.path.isfile(path):
        return ['']
    found = []
    for folder, _, names in os.walk(path):
        found += [os.path.relpath(os.path.join(folder, name), path)
                  for name in names]
    return sorted(found)


def size_of(path):
    """Bytes of a file, or of all files of a folder."""
    return sum(os.path.getsize(os.path.join(path, name) if name else path)
               for name in files_below(path))


def digest(path):
    """SHA-256 of a file; of a folder, of the names and contents of its files.
    And the bytes."""
    total, size = hashlib.sha256(), 0
    for name in files_below(path):
        if name:
            total.update(name.encode() + b'\0')
        with open(os.path.join(path, name) if name else path, 'rb') as file:
            while block := file.read(BLOCK):
                total.update(block)
                size += len(block)
    return {'sha256': total.hexdigest(), 'bytes': size}


def fingerprint(path):
    """SHA-256 of the size and of 16 stretches of a recording, which may be too
    large to be read in whole more than once; its track has a hash of every
    frame, which decoding checks."""
    stretch, count = 1 << 16, 16
    size = os.stat(path).st_size
    total = hashlib.sha256(str(size).encode())
    with open(path, 'rb') as file:
        for i in range(count):
            file.seek(max(0, size - stretch) * i // (count - 1))
            total.update(file.read(stretch))
    return {'bytes': size, 'sha256_of_samples': total.hexdigest()}


class Store:
    """The files of an archive."""

    def __init__(self, folder):
        self.folder = os.path.abspath(folder)
        self.work = os.path.join(self.folder, '.archive')
        self.plan = os.path.join(self.work, 'plan.json')

    def exists(self):
        return os.path.exists(self.plan)

    def create(self):
        try:
            for name in 'parts', 'failed', 'merged', 'runs':
                os.makedirs(os.path.join(self.work, name), exist_ok=True)
        except OSError as error:
            raise Problem(f'{self.folder} cannot hold an archive: '
                          f'{error.strerror}; name a folder that can be '
                          'written') from None

    def forget(self, is_new):
        """Is no archive any more; a new one leaves nothing."""
        os.remove(self.plan)
        if is_new:
            shutil.rmtree(self.work)
            with contextlib.suppress(OSError):
                os.rmdir(self.folder)

    def parts(self, recording):
        return os.path.join(self.work, 'parts', f'{recording:06d}')

    def part(self, recording, chunk):
        return os.path.join(self.parts(recording), f'{chunk:06d}')

    def failure(self, recording, chunk):
        name = 'merge' if chunk is None else f'{chunk:06d}'
        return os.path.join(self.work, 'failed', f'{recording:06d}-{name}.json')

    def merged(self, recording):
        return os.path.join(self.work, 'merged', f'{recording:06d}.json')

    def new_run(self):
        runs = os.path.join(self.work, 'runs')
        numbers = [int(name) for name in os.listdir(runs) if name.isdigit()]
        path = os.path.join(runs, f'{max(numbers, default=0) + 1:04d}')
        os.mkdir(path)
        return path

    def last_run(self):
        runs = os.path.join(self.work, 'runs')
        numbers = [name for name in os.listdir(runs) if name.isdigit()]
        return os.path.join(runs, max(numbers)) if numbers else None

    def last_jobs(self):
        """Those of the last run on Slurm."""
        path = os.path.join(self.last_run() or self.work, 'jobs.json')
        return [str(job) for job in read_json(path, list) or []]

    def done(self, recording):
        """The chunks of a recording that are complete, by the names of their
        folders alone."""
        try:
            with os.scandir(self.parts(recording)) as entries:
                return {int(entry.name) for entry in entries
                        if entry.name.isdigit()}
        except FileNotFoundError:
            return set()

    def is_merged(self, recording):
        return os.path.exists(self.merged(recording))

    def scratch(self, recording, chunk):
        """A folder of this process for a chunk; those of processes of this
        machine that died are removed."""
        host, parts = socket.gethostname(), self.parts(recording)
        os.makedirs(parts, exist_ok=True)
        start = f'{chunk:06d}.tmp-{host}-'
        for name in os.listdir(parts):
            if name.startswith(start) and not _runs(name[len(start):]):
                shutil.rmtree(os.path.join(parts, name), ignore_errors=True)
        path = os.path.join(parts, f'{start}{os.getpid()}')
        shutil.rmtree(path, ignore_errors=True)
        os.mkdir(path)
        return path

    def publish(self, scratch, recording, chunk):
        """Gives a finished chunk its name, unless another process was faster."""
        for name in files_below(scratch):
            sync(os.path.join(scratch, name))
        try:
            os.rename(scratch, self.part(recording, chunk))
        except OSError:
            if not os.path.isdir(self.part(recording, chunk)):
                raise
            shutil.rmtree(scratch, ignore_errors=True)
        sync(self.parts(recording))

    def discard(self, recording, chunk):
        """Removes a chunk that is not what its manifest says."""
        scratch = self.scratch(recording, chunk)
        os.rename(self.part(recording, chunk), os.path.join(scratch, 'bad'))
        shutil.rmtree(scratch, ignore_errors=True)

    def lock(self, name):
        """An open file, which is locked until it is closed."""
        file = open(os.path.join(self.work, name + '.lock'), 'w',
                    encoding='ascii')
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.close()
            raise Busy(f'{self.folder}: another process is at its {name}; '
                       'wait for its end') from None
        return file


def _runs(pid):
    return pid.isdigit() and os.path.exists(f'/proc/{pid}')
