# SPDX-License-Identifier: LGPL-2.1-or-later
"""The programs of this project that an archive runs."""
import ctypes
import os
import pathlib
import re
import signal
import subprocess

from archive.store import Problem

SCRIPTS = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = str(SCRIPTS / 'archive')
DECODE = str(SCRIPTS / 'decode')
REPORT = str(SCRIPTS / 'report')
PACK = str(SCRIPTS / 'pack')


def join_program():
    """In the build tree beside the scripts, or with them."""
    build = os.environ.get('CODEDEXPOSURE_BUILD', SCRIPTS.parent / 'build')
    for folder in pathlib.Path(build) / 'pipelines', SCRIPTS:
        program = folder / 'codedexposure-join'
        if program.exists():
            return str(program)
    raise Problem('codedexposure-join is missing; run meson compile -C build')


def version():
    """Of this project."""
    build = os.environ.get('CODEDEXPOSURE_BUILD', SCRIPTS.parent / 'build')
    for tool in (pathlib.Path(build) / 'lib/tools/codedexposure',
                 SCRIPTS.parents[1] / 'bin/codedexposure'):
        if tool.exists():
            said = subprocess.run([tool, '--version'], capture_output=True,
                                  text=True, check=False).stdout.strip()
            if re.fullmatch(r'codedexposure \S+', said):
                return said
    raise Problem('codedexposure is missing; run meson compile -C build')


def end_with_parent():
    """In a child: a job that is killed takes its decode along."""
    pr_set_pdeathsig = 1
    ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGTERM)


def run(command, log, **options):
    """Runs a program whose messages go to the file @log; its status."""
    with open(log, 'ab') as messages:
        return subprocess.run(command, stderr=messages, check=False,
                              preexec_fn=end_with_parent, **options).returncode


def last_lines(log, count=5):
    try:
        with open(log, 'rb') as file:
            file.seek(max(0, os.stat(log).st_size - 4096))
            text = file.read().decode('utf-8', 'replace')
    except OSError:
        return []
    # A progress line ends with a carriage return.
    return [line.rsplit('\r', 1)[-1] for line in text.splitlines()][-count:]
