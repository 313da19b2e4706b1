# SPDX-License-Identifier: LGPL-2.1-or-later
"""The program codedexposure, which an archive runs."""
import ctypes
import json
import os
import shutil
import signal
import subprocess

from .store import Problem

# The program that started this one names itself.
PROGRAM = os.environ.get('CODEDEXPOSURE_PROGRAM') or shutil.which('codedexposure')
DECODE, JOIN, REPORT, PACK, ARCHIVE = (
    [PROGRAM, name] for name in ('decode', 'join', 'report', 'pack', 'archive'))
BATCH = 500  # names on one command line


def version():
    """Of the program, and of the build: results of two are not mixed."""
    said = subprocess.run([PROGRAM, '--version', '--build'], capture_output=True,
                          text=True, check=False).stdout.strip()
    if not said.startswith('codedexposure '):
        raise Problem('codedexposure cannot be run; install it')
    return said


def info(paths):
    """What each recording says of itself, as of codedexposure info --json."""
    found = []
    for at in range(0, len(paths), BATCH):
        said = subprocess.run(
            [PROGRAM, 'info', '--json', '--times', *paths[at:at + BATCH]],
            capture_output=True, text=True, check=False)
        try:
            found += json.loads(said.stdout)
        except ValueError as error:
            raise Problem('codedexposure info failed: ' +
                          said.stderr.strip()) from error
    return found


def end_with_parent():
    """In a child: a job that is killed takes its decode along."""
    pr_set_pdeathsig = 1
    ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGTERM)


def run(command, log):
    """Runs a program whose messages go to the file @log. Its status, and what it
    prints as JSON, or None."""
    with open(log, 'ab') as messages:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stderr=messages,
                              stdout=subprocess.PIPE, check=False,
                              preexec_fn=end_with_parent)
    try:
        return done.returncode, json.loads(done.stdout)
    except ValueError:
        return done.returncode, None


def last_lines(log, count=5):
    try:
        with open(log, 'rb') as file:
            file.seek(max(0, os.stat(log).st_size - 4096))
            text = file.read().decode('utf-8', 'replace')
    except OSError:
        return []
    # A progress line ends with a carriage return.
    return [line.rsplit('\r', 1)[-1] for line in text.splitlines()][-count:]
