# SPDX-License-Identifier: LGPL-2.1-or-later
"""The network that refines fused frames, slot by slot, its inputs and its
file. lib/fuse/refine_network.h has the same in C++."""
import struct

import numpy as np
import torch
from torch import nn
from torch.nn import functional

CHANNELS, HIDDEN = 32, 4
PLANES = 9  # of a slot, at full size
FOLD = 2  # they are folded 2x2 into planes of half the size
REACH = 2 * (HIDDEN + 2)  # pixels from which an output pixel is computed
STEP = .25  # of the output
MAGIC = b'CEXN'


class Network(nn.Module):
    def __init__(self):
        super().__init__()
        widths = [PLANES * FOLD ** 2] + [CHANNELS] * (HIDDEN + 1) + [FOLD ** 2]
        self.layers = nn.ModuleList(
            nn.Conv2d(a, b, 3, padding=1) for a, b in zip(widths, widths[1:]))
        for layer in self.layers:
            nn.init.kaiming_normal_(layer.weight, nonlinearity='relu')
            nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.layers[-1].weight)

    def forward(self, folded):
        """Planes of half the size to the same of the correction."""
        light = torch.relu(self.layers[0](folded))
        for i, layer in enumerate(self.layers[1:-1]):
            next_light = torch.relu(layer(light))
            light = light + next_light if i % 2 else next_light
        return self.layers[-1](light)

    def refine(self, planes, keep):
        """Light of a slot. @p keep: 1 where it stays as it is."""
        folded = functional.pixel_unshuffle(planes, FOLD)
        change = functional.pixel_shuffle(
            self(folded.contiguous(memory_format=torch.channels_last)), FOLD)
        return planes[:, 0] + .5 + (1 - keep) * STEP * change[:, 0]


def planes_of(fused, coded, slot, k, noise):
    """Inputs of slot @p k. @p fused, @p coded: light, 1 for white; @p slot of
    each pixel; @p noise of a coded pixel, white = 1."""
    last = len(fused) - 1
    own = fused[k]
    distance = (slot - k).astype(np.float32)
    planes = [own - .5]
    for step in (1, 2):
        planes += [4 * (fused[min(k + step, last)] - own),
                   4 * (fused[max(k - step, 0)] - own)]
    planes += [4 * (coded - own), distance / 4, 1 / (1 + np.abs(distance)),
               np.full_like(own, 8 * noise)]
    keep = (distance == 0) & (noise == 0)
    return np.stack(planes), keep.astype(np.float32)


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
    network = Network()
    if data[:16] != weights_bytes(network)[:16]:
        raise SystemExit(f'{path}: not the weights of this network')
    values = np.frombuffer(data[16:], '<f4')
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
