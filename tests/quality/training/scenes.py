# SPDX-License-Identifier: LGPL-2.1-or-later
"""Scenes to train the refinement of fusion on: photographs of Debian packages
that move over one another, and the scenes of codedexposure-scene. Each is seen
through codedexposure-sim and fused with some schedules and noise."""
import math
import os
import pathlib
import subprocess

import cv2
import numpy as np

WIDTH, HEIGHT, FRAMES = 384, 288, 24
MOST_CODED = 4  # frames of a view
MARGIN = 80  # of the background, for its motion

# Package, licences of its photographs, what to leave out: drawings, pictures
# of a few pixels, and microscopy of other fields.
PACKAGES = (
    ('plasma-workspace-wallpapers', 'GPL-2+', (
        'Altai', 'Canopee', 'Cascade', 'Cluster', 'DarkestHour', 'Elarun',
        'Flow/', 'Honeywave', 'IceCold', 'Kay', 'Kokkini', 'MilkyWay', 'Opal',
        'PastelHills', 'Patak', 'Path/', 'SafeLanding', 'Shell', 'Volna',
        'summer_1am')),
    ('mate-backgrounds', 'GPL-2+', (
        'desktop/', 'abstract/Arc', 'abstract/Flow', 'abstract/Gulp',
        'abstract/Silk', 'abstract/Spring', 'abstract/Waves',
        'Elephants_3840', 'Elephants_5640')),
    ('ukui-wallpapers', 'CC BY-SA 3.0', ('fluent', 'focal')),
    ('lomiri-wallpapers-16.04', 'CC BY 4.0, CC BY-SA 4.0, CC0 1.0', ()),
    ('lomiri-wallpapers-20.04', 'CC BY-SA 3.0', ()),
    ('python3-skimage', 'BSD-3-Clause', (
        '/tests/', 'cell', 'chess', 'checker', 'color.png', 'foo', 'palette', 'logo',
        'multipage', 'no_time', 'horse', 'phantom', 'truncated', 'block',
        'bw_text', 'motorcycle_right', '_blobs', 'registration')))


def photographs():
    """Path of each photograph: the largest of its folder in wallpapers, each
    file once."""
    found = {}
    for package, _, unwanted in PACKAGES:
        listed = subprocess.run(['dpkg', '-L', package], check=True, text=True,
                                capture_output=True).stdout.splitlines()
        for name in sorted(listed):
            path = pathlib.Path(name)
            if path.suffix not in ('.jpg', '.png') or 'screenshot' in name or \
                    '/doc/' in name or '/icons/' in name or \
                    any(part in name for part in unwanted):
                continue
            path = path.resolve()
            key = path.parent if path.parent.name == 'images' else path
            if key not in found or \
                    path.stat().st_size > found[key].stat().st_size:
                found[key] = path
    return sorted(set(found.values()))


def read_photographs():
    pictures = []
    for path in photographs():
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if picture is None or min(picture.shape) < 160:
            continue
        if picture.shape[1] > 2600:
            scale = 2600 / picture.shape[1]
            picture = cv2.resize(picture, None, fx=scale, fy=scale,
                                 interpolation=cv2.INTER_AREA)
        pictures.append(picture)
    return pictures


class Drawing:
    """Draws scene number @p index: the same seed and index, the same scene."""

    def __init__(self, pictures, seed, index):
        self.pictures, self.index = pictures, index
        self.random = np.random.default_rng((seed, index))

    def texture(self, height, width):
        """A crop of a photograph, preferably one with details."""
        rng = self.random
        wanted = rng.choice([2., 6., 12.], p=[.2, .4, .4])
        for attempt in range(13):
            picture = self.pictures[rng.integers(len(self.pictures))]
            least = max(height / picture.shape[0], width / picture.shape[1], .22)
            low, high = math.log(max(least, .25)), math.log(max(least * 1.02, .9))
            scale = math.exp(low + (high - low) * rng.random() ** 2)
            rows, columns = math.ceil(height / scale), math.ceil(width / scale)
            if scale > 2 or rows > picture.shape[0] or \
                    columns > picture.shape[1]:
                continue
            crop = self.crop(picture, rows, columns, height, width, wanted,
                             attempt == 12)
            if crop is not None:
                return self.vary(crop)
        return self.vary(np.full((height, width), rng.uniform(0, 255),
                                 np.float32))

    def crop(self, picture, rows, columns, height, width, wanted, last):
        rng = self.random
        for _ in range(4):
            y = rng.integers(picture.shape[0] - rows + 1)
            x = rng.integers(picture.shape[1] - columns + 1)
            crop = cv2.resize(
                picture[y:y + rows, x:x + columns], (width, height),
                interpolation=cv2.INTER_AREA if rows > height
                else cv2.INTER_CUBIC).astype(np.float32)
            detail = np.abs(np.diff(crop, axis=1)).mean() + \
                np.abs(np.diff(crop, axis=0)).mean()
            if detail > wanted:
                return crop
        return crop if last else None

    def vary(self, crop):
        rng = self.random
        if rng.random() < .5:
            crop = crop[:, ::-1]
        if rng.random() < .5:
            crop = crop[::-1]
        if rng.random() < .3:
            crop = 255 - crop
        if rng.random() < .35:
            crop = cv2.GaussianBlur(crop, (0, 0), rng.uniform(.3, .9))
        mean = crop.mean()
        crop = (crop - mean) * rng.uniform(.6, 1.4) + mean + rng.normal() * 15
        return np.ascontiguousarray(np.clip(crop, 0, 255))

    def velocity(self, largest, still):
        """Pixels per slot."""
        rng = self.random
        if rng.random() < still:
            return np.zeros(2)
        speed = math.exp(rng.uniform(math.log(.05), math.log(largest)))
        angle = rng.uniform(0, 2 * math.pi)
        return speed * np.array([math.cos(angle), math.sin(angle)])

    def warp(self):
        """A smooth random displacement per slot, or none."""
        rng = self.random
        if rng.random() >= .6:
            return None
        sigma = math.exp(rng.uniform(math.log(6), math.log(60)))
        size = math.exp(rng.uniform(math.log(.1), math.log(2.)))
        fields = []
        for _ in range(2):
            noise = rng.normal(size=(HEIGHT // 4, WIDTH // 4)).astype(np.float32)
            field = cv2.resize(cv2.GaussianBlur(noise, (0, 0), sigma / 4),
                               (WIDTH, HEIGHT))
            fields.append(size * field / field.std())
        return fields

    def outline(self, side, width, height):
        """Coverage of an ellipse, a rectangle or a polygon."""
        rng = self.random
        mask = np.zeros((side * 4, side * 4), np.uint8)
        centre, turn = side * 2, rng.uniform(0, 180)
        kind = rng.integers(3)
        if kind == 0:
            cv2.ellipse(mask, (centre, centre), (int(width * 2), int(height * 2)),
                        turn, 0, 360, 255, -1)
        elif kind == 1:
            box = cv2.boxPoints(((centre, centre), (width * 4, height * 4), turn))
            cv2.fillPoly(mask, [box.astype(np.int32)], 255)
        else:
            corners = rng.integers(3, 9)
            angle = np.sort(rng.uniform(0, 2 * math.pi, corners))
            reach = rng.uniform(.4, 1, corners)
            points = np.stack([reach * np.cos(angle) * width * 2,
                               reach * np.sin(angle) * height * 2], 1)
            c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
            points = points @ np.array([[c, s], [-s, c]]) + centre
            cv2.fillPoly(mask, [points.astype(np.int32)], 255)
        mask = cv2.resize(mask, (side, side), interpolation=cv2.INTER_AREA)
        mask = mask.astype(np.float32) / 255
        if rng.random() < .2:
            mask = cv2.GaussianBlur(mask, (0, 0), rng.uniform(.5, 2))
        return mask

    def thing(self, background):
        rng = self.random
        size = math.exp(rng.uniform(math.log(10), math.log(200)))
        aspect = math.exp(rng.normal() * .5) if rng.random() < .75 else \
            math.exp(rng.choice([-1, 1]) * rng.uniform(1, 2.2))
        width = max(5, size * math.sqrt(aspect))
        height = max(5, size / math.sqrt(aspect))
        side = math.ceil(math.hypot(width, height)) + 6
        mask = self.outline(side, width, height)
        if rng.random() < .2:
            light = np.full((side, side), rng.uniform(0, 255), np.float32) + \
                self.texture(side, side) * .1
        else:
            light = self.texture(side, side)
        speed = background + self.velocity(4., .15)
        return {'mask': mask, 'light': light, 'velocity': speed,
                'place': rng.uniform(0, 1, 2) * (WIDTH, HEIGHT),
                'acceleration': rng.normal(size=2) * .03 * np.hypot(*speed),
                'turn': rng.normal() * .03 * (rng.random() < .35),
                'growth': rng.normal() * .01 * (rng.random() < .3)}

    @staticmethod
    def put(picture, thing, time):
        mask = thing['mask']
        side = mask.shape[0]
        centre = thing['place'] + thing['velocity'] * time + \
            thing['acceleration'] * time * time / 2
        zoom = 1 + thing['growth'] * time
        reach = int(side * .75 * max(zoom, 1)) + 3
        x0, y0 = int(centre[0]) - reach, int(centre[1]) - reach
        x1, y1 = x0 + 2 * reach, y0 + 2 * reach
        if x1 <= 0 or y1 <= 0 or x0 >= WIDTH or y0 >= HEIGHT:
            return
        turn = cv2.getRotationMatrix2D(
            (side / 2, side / 2), math.degrees(thing['turn'] * time), zoom)
        turn[:, 2] += centre - side / 2 - (x0, y0)
        window = (2 * reach, 2 * reach)
        mask = cv2.warpAffine(mask, turn, window)
        light = cv2.warpAffine(thing['light'], turn, window,
                               flags=cv2.INTER_CUBIC,
                               borderMode=cv2.BORDER_REFLECT)
        a0, b0, a1, b1 = max(x0, 0), max(y0, 0), min(x1, WIDTH), min(y1, HEIGHT)
        part = np.s_[b0 - y0:b1 - y0, a0 - x0:a1 - x0]
        below = picture[b0:b1, a0:a1]
        below += mask[part] * (light[part] - below)

    def scene(self):
        """FRAMES pictures, one for each slot."""
        rng = self.random
        background = self.texture(HEIGHT + 2 * MARGIN, WIDTH + 2 * MARGIN)
        velocity = self.velocity(3., .2)
        acceleration = rng.normal(size=2) * .03 * np.hypot(*velocity)
        turn = rng.normal() * .004 * (rng.random() < .4)
        growth = rng.normal() * .004 * (rng.random() < .4)
        warp, bend = self.warp(), rng.normal() * .02
        count = int(math.exp(rng.uniform(math.log(3), math.log(40))))
        things = [self.thing(velocity) for _ in range(count)]
        noise = rng.uniform(.3, 1.5) * (rng.random() < .2)
        dimming = rng.normal() * .01 * (rng.random() < .2)
        y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
        x -= WIDTH / 2
        y -= HEIGHT / 2
        frames = []
        for t in range(FRAMES):
            time = t - (FRAMES - 1) / 2
            moved = velocity * time + acceleration * time * time / 2
            zoom = 1 + growth * time
            c, s = zoom * math.cos(turn * time), zoom * math.sin(turn * time)
            at_x = c * x + s * y + WIDTH / 2 + MARGIN - moved[0]
            at_y = -s * x + c * y + HEIGHT / 2 + MARGIN - moved[1]
            if warp:
                at_x = at_x - warp[0] * (time + bend * time * time)
                at_y = at_y - warp[1] * (time + bend * time * time)
            picture = cv2.remap(background, at_x.astype(np.float32),
                                at_y.astype(np.float32), cv2.INTER_CUBIC,
                                borderMode=cv2.BORDER_REFLECT)
            for thing in things:
                self.put(picture, thing, time)
            picture *= 1 + dimming * time
            if noise:
                picture += rng.normal(size=picture.shape) * noise
            frames.append(np.clip(picture + .5, 0, 255).astype(np.uint8))
        return np.stack(frames)

    def synthetic(self):
        """Frames of one of the project's own scenes."""
        rng = self.random
        kind = rng.choice(['candle', 'blown-out', 'pour'])
        rate = int(math.exp(rng.uniform(math.log(60), math.log(600))))
        first = int(rng.uniform(.1, .8) * rate)
        frames = launch(
            f'codedexposure-scene scene={kind} num-buffers={first + FRAMES} ! '
            f'video/x-raw,format=GRAY8,width={WIDTH},height={HEIGHT},'
            f'framerate={rate}/1 ! fdsink fd=1')
        return frames.reshape(-1, HEIGHT, WIDTH)[first:]

    def draw(self):
        frames = self.synthetic() if self.random.random() < .06 else \
            self.scene()
        return self.overexposed(frames) if self.index % 4 == 3 else frames

    def overexposed(self, frames):
        """With more contrast than a camera has: large parts are white, black or
        both, where noise is to one side."""
        rng = self.random
        gain = math.exp(rng.uniform(math.log(1.3), math.log(4)))
        fixed = rng.choice([0., rng.uniform(0, 255), 255.], p=[.6, .2, .2])
        values = np.clip((np.arange(256) - fixed) * gain + fixed, 0, 255)
        return np.round(values).astype(np.uint8)[frames]


def launch(pipeline):
    elements = pathlib.Path(__file__).resolve().parents[3] / 'build/gst'
    done = subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()],
                          env={'GST_PLUGIN_PATH': str(elements), **os.environ},
                          capture_output=True)
    if done.returncode or done.stderr:
        raise SystemExit(f'{pipeline}\n{done.stderr.decode()}')
    return np.frombuffer(done.stdout, np.uint8)


# ---- Schedules ---------------------------------------------------------------

# The lattices that docs/fusion.md recommends, and others that users take.
SHIFTS = {2: (1,), 3: (1,), 4: (2, 1), 5: (2,), 6: (2, 3), 7: (2, 3),
          8: (3, 2), 9: (4, 3), 10: (3, 4), 12: (5, 3), 16: (4, 6)}
RASTERS = {4: (2, 2), 8: (4, 2), 9: (3, 3), 12: (4, 3), 16: (4, 4)}


def bit_reversed(n):
    bits = n.bit_length() - 1
    return [int(format(i, f'0{bits}b')[::-1], 2) for i in range(n)]


def choose_schedule(rng):
    """Text of a schedule, n, and the slot of each pixel."""
    n = int(rng.choice([8, 4, 16, 2, 3, 5, 6, 7, 9, 10, 12],
                       p=[.38, .36, .06, .03] + [.17 / 7] * 7))
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    if n in RASTERS and rng.random() < .15:
        width, height = RASTERS[n]
        element = x % width + width * (y % height)
        text = f'sequential:{width}x{height}'
    else:
        shift = SHIFTS[n][0 if rng.random() < .85 else -1]
        element = (x + shift * y) % n
        text = f'sequential:lattice:{n}/{shift}'
    if n in (8, 16) and rng.random() < .8:
        return (text + ',order=bit-reversal', n,
                np.array(bit_reversed(n))[element])
    return text, n, element


def noise_level(full_well, read_noise, n):
    """Standard deviation of a coded pixel at 40 % of white, white = 1; 0 if
    the camera is not described. As Engine::typical_noise ()."""
    if not full_well:
        return 0.
    white = full_well / n
    return math.sqrt((.4 * white + read_noise ** 2) / white ** 2 +
                     1 / 255 ** 2 / 12)


def observe(scene, rng, folder):
    """A scene as a camera, or two of them, see it, and fused: a dict."""
    schedule, n, slot = choose_schedule(rng)
    quality = rng.choice(['best', 'balanced', 'fast'], p=[.6, .22, .18])
    lookahead, pair = rng.random() < .5, rng.random() < .3
    full_well, read_noise = 0., 0.
    if rng.random() < .4:
        full_well = math.exp(rng.uniform(math.log(3000), math.log(40000)))
        read_noise = rng.uniform(0, 10)
    scene = scene[:min(len(scene) // n, MOST_CODED) * n]
    source, coded, fused = (folder / f'{name}.raw'
                            for name in ('scene', 'coded', 'fused'))
    scene.tofile(source)
    noise = f'full-well={full_well} read-noise={read_noise}'

    def camera(more):
        return f'codedexposure-sim schedule={schedule} {noise} ' \
            f'seed={rng.integers(1, 1 << 30)} {more}'

    second = f'! pair.on light. ! queue ! {camera("beam=off")} ! pair.off ' \
        'codedexposure-pair name=pair' if pair else ''
    launch(f'filesrc location={source} ! rawvideoparse format=gray8 '
           f'width={WIDTH} height={HEIGHT} framerate={25 * n}/1 ! '
           f'tee name=light ! queue ! {camera("")} {second} ! tee name=t ! '
           f'queue ! filesink location={coded} t. ! queue ! '
           f'codedexposure-fuse quality={quality} threads=1 '
           f'lookahead={int(lookahead)} {noise} ! '
           f'filesink location={fused}')
    coded = np.fromfile(coded, np.uint8).reshape(-1, HEIGHT, WIDTH)
    fused = np.fromfile(fused, np.uint8).reshape(-1, n, HEIGHT, WIDTH)
    truth = scene.reshape(-1, n, HEIGHT, WIDTH)
    assert len(coded) == len(fused) == len(truth), schedule
    if not full_well:
        for c, t in zip(coded, truth):
            assert (np.take_along_axis(t, slot[None], 0)[0] == c).all(), schedule
    return {'truth': truth, 'fused': fused, 'coded': coded,
            'slot': slot.astype(np.int8), 'schedule': schedule,
            'quality': quality, 'lookahead': lookahead, 'pair': pair,
            'noise': noise_level(full_well, read_noise, n)}


def draw_scenes(first, step, count, seed, folder):
    """Writes scenes first, first + step, ... below @p count, each once."""
    cv2.setNumThreads(1)
    pictures = read_photographs()
    work = folder / f'work{first}'
    work.mkdir(parents=True, exist_ok=True)
    for index in range(first, count, step):
        path = folder / f'scene{index:05d}.npz'
        if path.exists():
            continue
        drawing = Drawing(pictures, seed, index)
        scene = drawing.draw()
        views = [observe(scene, drawing.random, work) for _ in range(2)]
        part = work / 'part.npz'
        np.savez(part, **{f'{name}{i}': value for i, view in enumerate(views)
                          for name, value in view.items()})
        part.rename(path)
