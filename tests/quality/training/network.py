# SPDX-License-Identifier: LGPL-2.1-or-later
"""The network that refines fused frames, slot by slot, its inputs and its
file. lib/fuse/refine_network.h has the same in C++."""
import struct

import numpy as np
import torch
from torch import nn
from torch.nn import functional

CHANNELS, HIDDEN = 32, 6
PLANES = 15  # of a slot, at full size
RESULTS = 2  # for each pixel: a correction, and the deviation that it leaves
FOLD = 2  # they are folded 2x2 into planes of half the size
REACH = 2 * (HIDDEN + 2)  # pixels from which an output pixel is computed
STEP = .25  # of the output
DEVIATION = 1 / 255  # whose logarithm to base 2 is 0
MAGIC = b'CEXN'


class Network(nn.Module):
    def __init__(self, planes=PLANES, hidden=HIDDEN, results=RESULTS):
        super().__init__()
        widths = [planes * FOLD ** 2] + [CHANNELS] * (hidden + 1) + \
            [results * FOLD ** 2]
        self.layers = nn.ModuleList(
            nn.Conv2d(a, b, 3, padding=1) for a, b in zip(widths, widths[1:]))
        for layer in self.layers:
            nn.init.kaiming_normal_(layer.weight, nonlinearity='relu')
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.layers[-1].weight)

    def forward(self, folded):
        """Planes of half the size to the same of the results."""
        light = torch.relu(self.layers[0](folded))
        for i, layer in enumerate(self.layers[1:-1]):
            next_light = torch.relu(layer(light))
            light = light + next_light if i % 2 else next_light
        return self.layers[-1](light)

    def refine(self, planes, keep):
        """Light of a slot, and the deviation that is left of it, white = 1.
        @p keep: 1 where it stays as it is."""
        folded = functional.pixel_unshuffle(planes, FOLD)
        results = functional.pixel_shuffle(
            self(folded.contiguous(memory_format=torch.channels_last)), FOLD)
        change, deviation = results[:, 0].float(), results[:, 1].float()
        return planes[:, 0] + .5 + (1 - keep) * STEP * change, \
            DEVIATION * torch.exp2(deviation)


def grown(small):
    """A network that begins with the results of @p small, which has fewer
    planes, hidden layers or results: what it lacks adds little at first."""
    large = Network()
    with torch.no_grad():
        for part in large.layers:
            part.weight *= .1
        first, last = large.layers[0], large.layers[-1]
        planes = small.layers[0].weight.shape[1]
        first.weight[:, planes:] *= .1
        first.weight[:, :planes] = small.layers[0].weight
        first.bias[:] = small.layers[0].bias
        for new, old in zip(large.layers[1:-1], small.layers[1:-1]):
            new.load_state_dict(old.state_dict())
        for i in range(len(small.layers) - 1, len(large.layers) - 1, 2):
            nn.init.dirac_(large.layers[i].weight)
        results = small.layers[-1].weight.shape[0]
        last.weight[:results] = small.layers[-1].weight
        last.bias[:results] = small.layers[-1].bias
    return large


class Seen:
    """What the network sees of a coded frame: @p fused slots, the @p coded
    frame, those @p before and after it or None, the slot of each pixel, the
    noise of a coded pixel, and whether there was a second camera. Light is 1
    for white."""

    def __init__(self, fused, coded, before, after, slot, noise, pair):
        self.fused, self.coded, self.slot = fused, coded, slot
        self.near = ((before, -len(fused)), (after, len(fused)))
        self.noise, self.pair = noise, pair
        self.mean = fused.mean(axis=0)

    def planes(self, k):
        """Inputs of slot @p k, and where it is kept."""
        last, own = len(self.fused) - 1, self.fused[k]
        distance = (self.slot - k).astype(np.float32)
        planes = [own - .5]
        for step in (1, 2):
            planes += [4 * (self.fused[min(k + step, last)] - own),
                       4 * (self.fused[max(k - step, 0)] - own)]
        planes += [4 * (self.coded - own), distance / 4,
                   1 / (1 + np.abs(distance)),
                   np.full_like(own, 8 * self.noise)]
        for light, slots in self.near:
            planes += [np.zeros_like(own)] * 2 if light is None else [
                4 * (light - own), 1 / (1 + np.abs(distance + slots))]
        planes += [4 * (self.mean - own),
                   np.full_like(own, self.pair)]
        keep = (distance == 0) & (self.noise == 0)
        return np.stack(planes).astype(np.float32), keep.astype(np.float32)


def weights_bytes(network):
    """The file: magic, channels, hidden layers, planes; of each layer its
    weights by row, column, input and output, and its biases; little endian."""
    parts = [MAGIC, struct.pack('<3I', CHANNELS, HIDDEN, PLANES)]
    for layer in network.layers:
        weights = layer.weight.detach().numpy().transpose(2, 3, 1, 0)
        parts += [weights.astype('<f4').tobytes(),
                  layer.bias.detach().numpy().astype('<f4').tobytes()]
    return b''.join(parts)


def read_weights(path):
    data = path.read_bytes()
    channels, hidden, planes = struct.unpack('<3I', data[4:16])
    values = np.frombuffer(data[16:], '<f4')
    # The last layer has the rest of the values.
    per_result = FOLD ** 2 * (9 * CHANNELS + 1)
    before_last = (9 * planes * FOLD ** 2 + 1) * CHANNELS + \
        hidden * (9 * CHANNELS + 1) * CHANNELS
    results = (len(values) - before_last) // per_result
    if data[:4] != MAGIC or channels != CHANNELS or \
            len(values) != before_last + results * per_result:
        raise SystemExit(f'{path}: not the weights of this network')
    network = Network(planes, hidden, results)
    at = 0
    for layer in network.layers:
        outputs, inputs = layer.weight.shape[:2]
        count = 9 * inputs * outputs
        weights = values[at:at + count].reshape(3, 3, inputs, outputs)
        layer.weight.data = torch.from_numpy(
            weights.transpose(3, 2, 0, 1).copy())
        layer.bias.data = torch.from_numpy(
            values[at + count:at + count + outputs].copy())
        at += count + outputs
    return network
