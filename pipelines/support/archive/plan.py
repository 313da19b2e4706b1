# SPDX-License-Identifier: LGPL-2.1-or-later
"""Which recordings are decoded, how, and in which chunks."""
import bisect
import dataclasses
import hashlib
import os

from archive import matroska
from archive.store import Problem, fingerprint

FORMAT, VERSION = 'coded-exposure-archive', 1
# Options of decode with a value; others are flags.
VALUED = {'method', 'mapping', 'fuse', 'bench', 'full-well', 'read-noise',
          'region', 'schedule', 'bits', 'white'}
FLAGS = {'view', 'verbose', 'refine', 'deflate'}
FILES = {'mapping', 'bench', 'schedule'}  # values that may be files
FORMS = {'mkv': '.mkv', 'png': '/', 'mp4': '.mp4', 'ome.tif': '.ome.tif',
         'h5': '.h5'}
# Forms that cannot be cut: the chunks are lossless video, with notes of what that
# does not hold, and become the form when they are merged.
FINISHED = {'mp4', 'ome.tif', 'h5'}
CUT_OFF = 'it is cut off'


@dataclasses.dataclass
class Recording:
    path: str
    output: str          # relative to the folder of the archive
    fingerprint: dict
    start: int           # time of the first coded frame, ns
    period: int          # of coded frames, ns
    frames: int          # coded frames, by its duration
    recorded: int        # coded frames, by the end of its track; 0: unknown
    chunks: int
    whole: str = ''      # why it is one chunk

    def cut_off(self):
        return self.whole == CUT_OFF

    def excerpt(self, chunk, length):
        """[from, until) of a chunk, ns; None: to the end. A border lies in the
        middle between two coded frames."""
        def border(index):
            return self.start + ((2 * index * length - 1) * self.period) // 2
        return (border(chunk) if chunk > 0 else 0,
                border(chunk + 1) if chunk + 1 < self.chunks else None)


def read_recording(path, output, length):
    """Raises Problem if it cannot be decoded."""
    try:
        size = os.stat(path).st_size
        head = matroska.read_head(path, size)
        recorded = matroska.recorded_frames(path, size) if head.has_track else 0
        print_of_file = fingerprint(path)
    except OSError as error:
        raise Problem(f'cannot read {path}: {error.strerror}') from error
    except (matroska.NotMatroska, IndexError) as error:
        raise Problem(f'{path}: {error}; use a recording of record or '
                      'simulate') from error
    if not has_coded_frames(head):
        raise Problem(f'{path} has {head.codec or "no video"}, but coded frames '
                      'are recorded as FFV1 or raw; use a recording of record or '
                      'simulate')
    frames = round(head.duration / head.period) if head.period else 0
    whole = ''
    if not head.complete:
        whole = CUT_OFF
    elif not head.has_track:
        whole = 'it has no track that numbers its frames'
    elif not frames:
        whole = 'its length or rate is not known'
    return Recording(path, output, print_of_file, head.start, head.period,
                     frames, recorded, 1 if whole else max(1, -(-frames // length)), whole)


def has_coded_frames(head):
    return 'FFV1' in head.codec or head.codec == 'V_UNCOMPRESSED'


def is_recording(path):
    """Whether a file of a folder is a recording: video of coded frames with a
    track. What decode wrote has none."""
    try:
        head = matroska.read_head(path, os.stat(path).st_size)
    except (OSError, matroska.NotMatroska, IndexError):
        return False
    return has_coded_frames(head) and head.has_track


def find_recordings(words, lists, avoid):
    """(path, name of its output without an ending) of each. Folders are searched
    for recordings, but not below the folder @avoid."""
    for name in lists:
        try:
            with open(name, encoding='utf-8') as file:
                words = words + [line.strip() for line in file if line.strip()]
        except OSError as error:
            raise Problem(f'cannot read --list {name}: {error.strerror}') from error
    found = []
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
                if (name.endswith('.mkv') and not name.startswith('.')
                        and is_recording(path)):
                    stem = os.path.relpath(path, word)[:-len('.mkv')]
                    found.append((os.path.abspath(path), stem))
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
        """The form of the chunks of a recording. One that is cut off is decoded
        without an excerpt, and has its form at once."""
        if self.form in FINISHED and not self.recordings[recording].cut_off():
            return 'mkv'
        return self.form

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

    @staticmethod
    def from_json(fields):
        if not fields or fields.get('format') != FORMAT:
            raise Problem('the plan of this archive cannot be read')
        if fields['version'] != VERSION:
            raise Problem(f'this archive has version {fields["version"]}; '
                          f'this program reads {VERSION}')
        fields = {k: v for k, v in fields.items() if k not in (
            'format', 'version')}
        fields['recordings'] = [Recording(**r) for r in fields['recordings']]
        return Plan(**fields)


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


def make(words, lists, folder, form, length, threads, options, program):
    """The plan of an archive in @folder."""
    options = check_options(options)
    recordings, outputs = [], {}
    for path, stem in find_recordings(words, lists, os.path.abspath(folder)):
        output = stem + FORMS[form]
        if output in outputs:
            raise Problem(f'{path} and {outputs[output]} would both become '
                          f'{output}; archive them into different folders')
        outputs[output] = path
        recordings.append(read_recording(path, output, length))
    return Plan(options, digest_of_options(options), form, length, threads,
                program, recordings)
