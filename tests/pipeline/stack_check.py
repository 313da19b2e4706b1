#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compares a stack, read by tifffile or h5py, with the pixels and the table of
times of the same pictures: NAME.ome.tif or NAME.h5 with NAME.mkv.raw and
NAME/times.csv. stack_check.py STACK..."""
import csv
import json
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


def check(stack):
    name = stack.split('.')[0]
    pictures, rows, origin, bits = (
        read_hdf5 if stack.endswith('.h5') else read_tiff)(stack)
    count, height, width = pictures.shape
    bytes_per_row = (width * pictures.itemsize + 3) // 4 * 4
    pixels = numpy.fromfile(f'{name}.mkv.raw', numpy.uint8)
    pixels = pixels.reshape(count, height, bytes_per_row)
    pixels = pixels[:, :, :width * pictures.itemsize].copy().view(pictures.dtype)
    assert numpy.array_equal(pictures, pixels), 'other pixels'
    assert pixels.std() > 0

    with open(f'{name}/times.csv') as file:
        expected = list(csv.DictReader(file))
    for row in expected + rows:
        row.pop('file', None)
        row.pop('picture', None)
    assert rows == expected, [x for x in zip(rows, expected) if x[0] != x[1]][:1]

    setup = origin.get('setup', origin)
    assert setup['code'] == 'sequential' and setup['tile'] == '2x2'
    frames = {int(row['frame']) for row in rows}
    gaps = max(frames) - min(frames) + 1 - len(frames)
    print(f'{stack}: {pictures.shape} {pictures.dtype}, {bits} bits,'
          f' {origin.get("method", "coded")}, {gaps} frames lost')


for path in sys.argv[1:]:
    check(path)
