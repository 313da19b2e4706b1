#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compares pictures, as other programs read them, with the pixels and the table
of times of the same pictures: NAME.mkv.raw and NAME/times.csv.

picture_check.py FILE...: NAME.ome.tif by tifffile, NAME.h5 by h5py, and NAME.mkv,
NAME.mp4 and the folder NAME/ by ffmpeg."""
import csv
import json
import subprocess
import sys

import numpy


def read_tiff(path):
    import tifffile
    with tifffile.TiffFile(path) as file:
        assert file.is_ome and file.series[0].axes == 'TYX', file.series[0].axes
        head = tifffile.xml2dict(file.ome_metadata)['OME']
        assert file.pages[0].predictor == 1
        notes = {x['Namespace']: x['Value']
                 for x in head['StructuredAnnotations']['CommentAnnotation']}
        planes = head['Image']['Pixels']['Plane']
        rows = list(csv.DictReader(notes['codedexposure/pictures'].split('\n')))
        assert [int(row['picture']) for row in rows] == list(range(len(rows)))
        for plane, row in zip(planes, rows, strict=True):
            assert abs(plane['DeltaT'] * 1e9 - int(row['pts_ns'])) < 1
            assert plane['TheT'] == int(row['picture'])
        return (file.asarray(), rows, json.loads(
            notes['codedexposure/origin/0']),
            head['Image']['Pixels']['SignificantBits'])


def read_hdf5(path):
    import h5py
    with h5py.File(path) as file:
        assert file.attrs['status'] == 'complete'
        truth = {0: 'false', 1: 'true', -1: 'unknown'}
        names = ('frame', 'slot', 'pts_ns', 'duration_ns', 'lost_before')
        rows = [{name: '' if file[name][i] < 0 else str(file[name][i])
                 for name in names}
                | {'synchronised': truth[file['synchronised'][i]],
                   'corrupted': truth[int(file['corrupted'][i])]}
                for i in range(len(file['pts_ns']))]
        return (file['pictures'][:], rows, json.loads(file['origin'][0]),
                file.attrs['significant_bits'])


def run(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout


def table_of(name):
    with open(f'{name}/times.csv') as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        del row['file']
    return rows


def read_by_ffmpeg(path, *options):
    """Pixel values in 8 bits, or in 16 where the file has more."""
    stream, = json.loads(run(
        'ffprobe', '-v', 'error', *options, '-select_streams', 'v',
        '-show_streams', '-of', 'json', path))['streams']
    deep = '16' in stream['pix_fmt']
    pixels = run('ffmpeg', '-v', 'error', *options, '-i', path, '-f', 'rawvideo',
                 '-pix_fmt', 'gray16le' if deep else 'gray', '-vsync',
                 'passthrough', '-')
    return numpy.frombuffer(pixels, '<u2' if deep else 'u1').reshape(
        -1, stream['height'], stream['width'])


def read_folder(path):
    pictures = read_by_ffmpeg(f'{path}*.png', '-f', 'image2', '-pattern_type',
                              'glob')
    return pictures, table_of(path[:-1]), {}, 'all'


def read_video(path):
    """The times of a file without a time of its own for each picture are those
    of the ticks of its clock."""
    rows = table_of(path.rsplit('.', 1)[0])
    packets = json.loads(run(
        'ffprobe', '-v', 'error', '-select_streams', 'v', '-show_packets',
        '-show_streams', '-of', 'json', path))
    stream, = packets['streams']
    numerator, denominator = map(int, stream['time_base'].split('/'))
    tick = 1e9 * numerator / denominator
    first = int(rows[0]['pts_ns']) if path.endswith('.mp4') else 0
    times = sorted(int(x['pts']) * tick for x in packets['packets'])
    for row, time in zip(rows, times, strict=True):
        late = time + first - int(row['pts_ns'])
        assert abs(late) <= max(tick, 1000), (row, late)
    return read_by_ffmpeg(path), rows, {}, 'all'


READERS = {'.tif': read_tiff, '.h5': read_hdf5, '.mkv': read_video,
           '.mp4': read_video, '/': read_folder}


def psnr(pictures, truth):
    error = (pictures.astype(float) - truth) ** 2
    return [10 * numpy.log10(255 ** 2 / x)
            for x in (error.mean(), error.mean(axis=(1, 2)).max())]


def check(path):
    name = path.split('.')[0].rstrip('/')
    read = next(v for k, v in READERS.items() if path.endswith(k))
    pictures, rows, origin, bits = read(path)
    count, height, width = pictures.shape
    bytes_per_row = (width * pictures.itemsize + 3) // 4 * 4
    pixels = numpy.fromfile(f'{name}.mkv.raw', numpy.uint8)
    pixels = pixels.reshape(count, height, bytes_per_row)
    pixels = pixels[:, :, :width * pictures.itemsize].copy().view(pictures.dtype)
    assert pixels.std() > 0
    if path.endswith('.mp4'):  # docs/formats.md, "Videos"
        mean, worst = psnr(pictures, pixels)
        print(f'{path}: {mean:.1f} dB, worst picture {worst:.1f} dB')
        assert mean > 39 and worst > 38
    else:
        assert numpy.array_equal(pictures, pixels), 'other pixels'

    expected = table_of(name)
    for row in rows:
        row.pop('picture', None)
    assert rows == expected, [x for x in zip(rows, expected) if x[0] != x[1]][:1]

    setup = origin.get('setup', origin)
    if setup:
        assert setup['code'] == 'sequential' and setup['tile'] == '2x2'
    frames = {int(row['frame']) for row in rows}
    gaps = max(frames) - min(frames) + 1 - len(frames)
    print(f'{path}: {pictures.shape} {pictures.dtype}, {bits} bits,'
          f' {origin.get("method", "coded")}, {gaps} frames lost')


for argument in sys.argv[1:]:
    check(argument)
