# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which recordings are decoded, how, and in which chunks."""
import bisect
import dataclasses
import hashlib
import os

from . import programs
from .store import Problem, fingerprint

FORMAT, VERSION = 'coded-exposure-archive', 2
# Options of decode with a value; others are flags.
VALUED = {'method', 'mapping', 'fuse', 'bench', 'full-well', 'read-noise',
          'range', 'overlap', 'region', 'schedule', 'second', 'bits', 'white'}
FLAGS = {'view', 'verbose', 'refine', 'deflate'}
FILES = {'mapping', 'bench', 'schedule'}  # values that may be files
FORMS = {'mkv': '.mkv', 'png': '/', 'mp4': '.mp4', 'ome.tif': '.ome.tif',
         'h5': '.h5'}


def has_types(thing):
    """Whether the fields of a dataclass have the types that it says."""
    return all(isinstance(getattr(thing, field.name),
                          (int, float) if field.type is float else field.type)
               for field in dataclasses.fields(thing))


@dataclasses.dataclass
class Recording:
    path: str
    output: str          # relative to the folder of the archive
    fingerprint: dict
    seconds: float       # from the first coded frame to the last
    frames: int          # coded frames that it has
    recorded: int        # frames that it once had; 0: not known
    borders: list        # between its chunks: positions, as of --excerpt, ns
    whole: str = ''      # why it is one chunk
    second: str = ''     # the recording of a second camera
    second_fingerprint: dict = dataclasses.field(default_factory=dict)

    @property
    def inputs(self):
        """For a message."""
        return ' or '.join(filter(None, (self.path, self.second)))

    @property
    def chunks(self):
        return len(self.borders) + 1

    def excerpt(self, chunk):
        """[from, until) of a chunk, ns; None: to the end."""
        return (self.borders[chunk - 1] if chunk > 0 else 0,
                self.borders[chunk] if chunk + 1 < self.chunks else None)

    def frames_of(self, chunk, length):
        """Coded frames of a chunk."""
        if self.whole:
            return self.frames
        return min(length, self.frames - chunk * length)


def borders_of(times, start, length):
    """In the middle between two coded frames, wherever those lie: recordings of
    cameras begin late and have gaps."""
    return [(times[at - 1] + times[at]) // 2 - start
            for at in range(length, len(times), length)]


def recording_of(info, output, length):
    """Raises Problem if it cannot be decoded."""
    path = info['recording']
    if 'error' in info:
        raise Problem(info['error'])
    times, whole = info['times_ns'], ''
    if info['damaged']:
        whole = 'it is cut off or damaged'
    elif not info['track']:
        whole = 'it has no track that numbers its frames'
    elif times != sorted(times):
        whole = 'its frames are not in the order of their times'
    seconds = (times[-1] - times[0] + info['period_ns']) / 1e9 if times else 0
    return Recording(path, output, fingerprint(path), seconds, len(times),
                     info.get('recorded', 0),
                     [] if whole or not times else
                     borders_of(times, info['start_ns'], length), whole)


def take_second(options):
    """(options without --second, its value or '')."""
    begin = '--second='
    found = [o.removeprefix(begin) for o in options if o.startswith(begin)]
    return ([o for o in options if not o.startswith(begin)],
            os.path.abspath(found[-1]) if found else '')


def add_seconds(recordings, second):
    """The recordings of a second camera: a file for one recording, or a folder
    whose files have the names that the results get."""
    if not os.path.isdir(second) and len(recordings) > 1:
        raise Problem(f'--second {second} is one file for {len(recordings)} '
                      'recordings; name a folder that has one of the name of each')
    for recording in recordings:
        recording.second = (os.path.join(second, beside(recording.output, '.mkv'))
                            if os.path.isdir(second) else second)
    for recording, said in zip(recordings, programs.info(
            [recording.second for recording in recordings])):
        if 'error' in said:
            raise Problem(f'--second: {said["error"]}')
        recording.second_fingerprint = fingerprint(recording.second)
        if said['damaged'] and not recording.whole:
            recording.borders = []
            recording.whole = 'its second recording is cut off or damaged'


def find_recordings(words, lists, avoid, seconds=True):
    """(what info says of it, name of its output without an ending) of each.
    Folders are searched for recordings, but not below the folder @avoid; what is
    none there is named and left out. Without @seconds, those of second cameras are
    none."""
    for name in lists:
        try:
            with open(name, encoding='utf-8') as file:
                words = words + [line.strip() for line in file if line.strip()]
        except OSError as error:
            raise Problem(f'cannot read --list {name}: {error.strerror}') from error
    found, searched = [], []
    for word in words:
        if not os.path.isdir(word):
            stem = os.path.splitext(os.path.basename(word))[0]
            found.append((os.path.abspath(word), stem))
            continue
        for folder, folders, names in os.walk(word):
            folders[:] = sorted(
                name for name in folders if not name.startswith('.') and
                os.path.abspath(os.path.join(folder, name)) != avoid)
            for name in sorted(names):
                path = os.path.join(folder, name)
                # pack writes hidden files.
                if name.endswith('.mkv') and not name.startswith('.'):
                    stem = os.path.relpath(path, word)[:-len('.mkv')]
                    searched.append((os.path.abspath(path), stem))
    known = programs.info([path for path, _ in found + searched])
    named, found = len(found), found + searched
    for said in known:
        if said.get('beam') == 'off' and not seconds:
            said['error'] = (f'{said["recording"]} is the recording of a second '
                             'camera; name that of the first camera, and set '
                             '--second FILE after -- to fuse this one with it')
    for said in known[named:]:
        if 'schedule' not in said:
            said.setdefault('error', f'{said["recording"]} says no schedule: it '
                            'was decoded, or is damaged; name it to decode it')
        if 'error' in said:
            print('left out:', said['error'])
    found = [(said, stem) for i, (said, (_, stem)) in enumerate(zip(known, found))
             if i < named or 'error' not in said]
    if not found:
        raise Problem('no recordings; name .mkv files of record, folders with '
                      'them, or a --list')
    return found


def check_options(words):
    """The options of decode as a list of --NAME=VALUE, with absolute names of
    files."""
    checked, words = [], list(words)
    while words:
        word = words.pop(0)
        name, equals, value = word.removeprefix('--').partition('=')
        if not word.startswith('--') or name not in VALUED | FLAGS:
            raise Problem(f'{word}: after --, set options of decode that say how '
                          'frames are decoded: ' +
                          ', '.join(f'--{n}' for n in sorted(VALUED | FLAGS)))
        if name in FLAGS:
            checked.append(f'--{name}')
            continue
        if not equals:
            if not words:
                raise Problem(f'--{name} needs a value')
            value = words.pop(0)
        if name in FILES and os.path.isfile(value):
            value = os.path.abspath(value)
        checked.append(f'--{name}={value}')
    return checked


def digest_of_options(options):
    """Of the options and of the files that they name."""
    total = hashlib.sha256()
    for option in options:
        total.update(option.encode() + b'\0')
        name, _, value = option.removeprefix('--').partition('=')
        if name in FILES and os.path.isfile(value):
            with open(value, 'rb') as file:
                total.update(file.read() + b'\0')
    return total.hexdigest()


@dataclasses.dataclass
class Plan:
    options: list        # of decode
    options_digest: str
    form: str
    length: int          # of a chunk, coded frames
    threads: int
    program: str         # name and version
    recordings: list
    statistics: bool = False  # of each picture, in a table
    report: bool = False      # a page of each recording
    engine: dict = dataclasses.field(default_factory=dict)

    def __post_init__(self):
        total, self.first = 0, []  # number of the first chunk of each
        for recording in self.recordings:
            self.first.append(total)
            total += recording.chunks
        self.chunks = total

    def chunk_form(self, recording):
        """The form of the chunks of a recording. Several are lossless video, whose
        track holds what is known of each picture, or pictures, which are numbered
        files."""
        several = self.recordings[recording].chunks > 1 and self.form != 'png'
        return 'mkv' if several else self.form

    def outputs(self, recording):
        """What is written for a recording, relative to the folder."""
        output = self.recordings[recording].output
        return [output, *[table_of(output)] * self.statistics,
                *[report_of(output)] * self.report]

    def locate(self, number):
        """(recording, chunk) of the chunk of that number."""
        recording = bisect.bisect_right(self.first, number) - 1
        return recording, number - self.first[recording]

    def to_json(self):
        fields = {'format': FORMAT, 'version': VERSION}
        fields.update((f.name, getattr(self, f.name))
                      for f in dataclasses.fields(self))
        fields['recordings'] = [vars(r) for r in self.recordings]
        return fields

    def is_valid(self):
        """What was read from a file may be anything."""
        return (
            has_types(self) and self.recordings and self.form in FORMS
            and min(self.length, self.threads) > 0
            and all(has_types(r) and all(isinstance(b, int) for b in r.borders)
                    for r in self.recordings)
            and all(isinstance(option, str) for option in self.options)
            and self.engine.get('on') in ('slurm', 'parallel')
            and all(value is None or isinstance(
                value, int if name in ('jobs', 'tasks') else str)
                for name, value in self.engine.items()))

    @staticmethod
    def from_json(fields):
        unreadable = Problem(
            'the plan of this archive, .archive/plan.json, was changed or damaged; '
            'put it back, or submit to a new folder')
        if not fields or fields.get('format') != FORMAT:
            raise unreadable
        if fields.get('version') != VERSION:
            raise Problem(f'this archive has version {fields.get("version")}; '
                          f'this program reads {VERSION}')
        fields = {k: v for k, v in fields.items() if k not in (
            'format', 'version')}
        try:
            fields['recordings'] = [Recording(**r) for r in fields['recordings']]
            made = Plan(**fields)
        except (KeyError, TypeError) as error:
            raise unreadable from error
        if not made.is_valid():
            raise unreadable
        return made


def beside(output, ending):
    """The name of what is written beside an output."""
    output = output.rstrip('/')
    for other in sorted(FORMS.values(), key=len, reverse=True):
        if output.endswith(other):
            return output.removesuffix(other) + ending
    return output + ending


def table_of(output):
    return beside(output, '.csv')


def report_of(output):
    return beside(output, '.report')


def identity_of(path):
    status = os.stat(path)
    return status.st_dev, status.st_ino


def check_outputs(folder, plan):
    """Raises Problem if an output is a recording, or holds one, or another
    output."""
    paths = {os.path.realpath(os.path.join(folder, name))
             for number in range(len(plan.recordings))
             for name in plan.outputs(number)}
    inputs = [path for recording in plan.recordings
              for path in (recording.path, recording.second) if path]
    known = {identity_of(path) for path in inputs}
    there = [name for path in sorted(paths) for name in (path, f'{path}.part')
             if os.path.isfile(name)]
    for path, said in zip(there, programs.info(there)):
        if identity_of(path) in known or 'schedule' in said:
            raise Problem(f'{path} is a recording, and would be replaced; choose '
                          'another --to')
    for path in [*sorted(paths), *map(os.path.realpath, inputs)]:
        above = os.path.dirname(path)
        while above != '/':
            if above in paths:
                raise Problem(f'{path} is in {above}, which would be replaced; '
                              'choose another --to, or --form')
            above = os.path.dirname(above)


def make(words, lists, folder, form, length, threads, options, program):
    """The plan of an archive in @folder."""
    options, second = take_second(check_options(options))
    recordings, outputs = [], {}
    # Decoding one by itself needs its schedule.
    alone = not second and any(o.startswith('--schedule=') for o in options)
    for said, stem in find_recordings(words, lists, os.path.abspath(folder), alone):
        output, path = stem + FORMS[form], said['recording']
        if output in outputs:
            raise Problem(f'{path} and {outputs[output]} would both become '
                          f'{output}; archive them into different folders')
        outputs[output] = path
        recordings.append(recording_of(said, output, length))
    if second:
        add_seconds(recordings, second)
    return Plan(options, digest_of_options(options), form, length, threads,
                program, recordings)
