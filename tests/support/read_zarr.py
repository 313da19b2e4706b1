# SPDX-License-Identifier: LGPL-2.1-or-later
"""read_zarr.py FOLDER PIXELS: the pixels of an OME-Zarr, read by the words of
the specification of Zarr v3 alone. It prints "SHAPE TYPE STATUS"."""
import json
import pathlib
import struct
import subprocess
import sys

NONE = 2 ** 64 - 1


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def main(folder, pixels):
    root = pathlib.Path(folder)
    group = json.loads((root / 'zarr.json').read_text())
    assert group['zarr_format'] == 3 and group['node_type'] == 'group'
    ome = group['attributes']['ome']
    assert ome['version'] == '0.5'
    scales = ome['multiscales'][0]
    assert [axis['name'] for axis in scales['axes']] == ['t', 'y', 'x']
    array = root / scales['datasets'][0]['path']
    about = json.loads((array / 'zarr.json').read_text())
    count, height, width = about['shape']
    shard, *_ = about['chunk_grid']['configuration']['chunk_shape']
    (codec,) = about['codecs']
    assert codec['name'] == 'sharding_indexed'
    how = codec['configuration']
    assert how['chunk_shape'] == [1, height, width]
    assert how['index_location'] == 'end'
    zstd = [c['name'] for c in how['codecs']] == ['bytes', 'zstd']
    size = height * width * {'uint8': 1, 'uint16': 2}[about['data_type']]
    with open(pixels, 'wb') as out:
        for picture in range(count):
            data = (array / 'c' / str(picture // shard) / '0' / '0').read_bytes()
            index, (crc,) = data[-16 * shard - 4:-4], struct.unpack('<I', data[-4:])
            assert crc32c(index) == crc
            begin, length = struct.unpack_from('<QQ', index, 16 * (picture % shard))
            assert begin != NONE and length != NONE
            chunk = data[begin:begin + length]
            if zstd:
                chunk = subprocess.run(['zstd', '-dc'], input=chunk, check=True,
                                       capture_output=True).stdout
            assert len(chunk) == size
            out.write(chunk)
    own = group['attributes']['codedexposure']
    rows = (root / 'times.csv').read_text().splitlines()[1:]
    # A kill may come between the lines of a shard and the number of pictures.
    assert [int(row.partition(',')[0]) for row in rows] == [*range(len(rows))]
    assert len(rows) == count or (
        own['status'] != 'complete' and len(rows) > count), (len(rows), count)
    print(*about['shape'], about['data_type'], own['status'].partition(':')[0])


main(*sys.argv[1:])
