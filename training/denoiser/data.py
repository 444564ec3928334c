"""What pairs.py has rendered, on the GPU: loading, inputs and references, crops, augmentation."""

import concurrent.futures
import glob
import os
from dataclasses import dataclass, fields
from typing import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from pairs import PLANS

LEVELS = {1: 1.0, 2: 0.7, 4: 1.0, 8: 0.8, 16: 1.0, 32: 0.5, 64: 1.0, 128: 0.5, 256: 1.0}
"""Samples per pixel of inputs, and how often each is drawn among the pictures of a view."""
ODD = 0.2
"""How many inputs are means of several pictures, so that there are also 6, 12 or 26 samples."""
RESERVED = 16 << 30
"""Bytes of a GPU's memory that are left to the training."""


class Views:
    """Views of scenes on one device, with room for more; see pairs.py for the layers.

    light : float16 [room, 6, 6, H, W]: colour and standard error of each picture
    guide : uint8 [room, 6, 6, H, W]: albedo and normal
    samples : float32 [views, 6]: samples per pixel
    """

    def __init__(self, device: str) -> None:
        self.device = device
        self.samples = torch.zeros((0, 6), device=device)

    def __len__(self) -> int:
        return len(self.samples)

    def add(self, light: np.ndarray, guide: np.ndarray, samples: np.ndarray, most: int) -> None:
        """Adds the views of a scene, as long as there are no more than `most`."""
        if len(self) == 0:
            room = lambda like, kind: torch.empty(
                (most, *like.shape[1:]), dtype=kind, device=self.device
            )
            self.light, self.guide = room(light, torch.float16), room(guide, torch.uint8)
        begin, end = len(self), len(self) + len(samples)
        if end > len(self.light):
            return
        self.light[begin:end].copy_(torch.from_numpy(light))
        self.guide[begin:end].copy_(torch.from_numpy(guide))
        fresh = torch.from_numpy(samples.astype(np.float32)).to(self.device)
        self.samples = torch.cat([self.samples, fresh])


class Scenes:
    """The scenes in folders that pairs.py may still be writing to.

    Part `part` of `parts` is for training, and every part has all that are held out. What does not
    fit into the GPU's memory is left out.
    """

    def __init__(self, folders: Sequence[str], device: str, part: int = 0, parts: int = 1) -> None:
        self.folders, self.device, self.part, self.parts = folders, device, part, parts
        self.views, self.held_out = Views(device), Views(device)
        self.seen: "set[str]" = set()

    def refresh(self) -> None:
        """Takes up the scenes that are new."""
        found = (glob.glob(os.path.join(folder, "*.npz")) for folder in self.folders)
        fresh = sorted(set().union(*found) - self.seen)
        self.seen.update(fresh)
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            for first in range(0, len(fresh), 64):
                for arrays in pool.map(self._read, fresh[first : first + 64]):
                    if arrays is not None:
                        self._add(*arrays)

    def _read(self, path: str) -> "tuple[np.ndarray, np.ndarray, np.ndarray] | None":
        number = int(os.path.basename(path).split(".")[0])
        with np.load(path) as file:
            samples = file["samples"]
            if not is_held_out(samples) and number % self.parts != self.part:
                return None
            return file["light"], file["guide"], samples

    def _add(self, light: np.ndarray, guide: np.ndarray, samples: np.ndarray) -> None:
        if is_held_out(samples):
            self.held_out.add(light, guide, samples, 64)
        else:
            self.views.add(light, guide, samples, self._room(light[0].size))

    def _room(self, values: int) -> int:
        """How many views of so many values the memory has room for."""
        if not self.device.startswith("cuda"):
            return 512
        return (torch.cuda.mem_get_info(self.device)[0] - RESERVED) // (3 * values)


def is_held_out(samples: np.ndarray) -> bool:
    return tuple(samples[0]) == tuple(PLANS["held out"])


@dataclass
class Batch:
    """Crops, [N, 3, h, w] each.

    `known` [N, 1, 1, 1]: 1 where the variance of the input is known. `references`: two that are
    independent of the input and of each other. They are noisy pictures as well, and `doubts` are
    their variances. `samples`, `reference_samples` [N]: samples per pixel.
    """

    color: Tensor
    albedo: Tensor
    normal: Tensor
    variance: Tensor
    known: Tensor
    references: "tuple[Tensor, Tensor]"
    doubts: "tuple[Tensor, Tensor]"
    samples: Tensor
    reference_samples: "tuple[Tensor, Tensor]"

    def tensors(self) -> "list[Tensor]":
        values = (getattr(self, field.name) for field in fields(self))
        return [x for value in values for x in (value if isinstance(value, tuple) else (value,))]


def crops(
    views: Views,
    which: "list[int]",
    chosen: "tuple[Tensor, Tensor, Tensor]",
    top: "list[int]",
    left: "list[int]",
    size: int,
) -> Batch:
    """The crops of `size` at (`left`, `top`) of the views `which`.

    `chosen`, [N, 6] each, are 1 for the pictures whose mean is the input, the one and the other
    reference.
    """
    cut = lambda layers: torch.stack(
        [layers[w, :, :, y : y + size, x : x + size] for w, y, x in zip(which, top, left)]
    ).float()
    light, guide, samples = cut(views.light), cut(views.guide), views.samples[which]
    colors, variances = light[:, :, :3], light[:, :, 3:] ** 2
    totals = [(samples * those).sum(1) for those in chosen]
    shares = [samples * those / total[:, None] for those, total in zip(chosen, totals)]
    mean = lambda weights, x: torch.einsum("nk,nkchw->nchw", weights, x)
    color, *references = [mean(share, colors) for share in shares]
    variance, *doubts = [mean(share**2, variances) for share in shares]
    albedo = mean(shares[0], (guide[:, :, :3] / 255) ** 2)
    normal = mean(shares[0], (guide[:, :, 3:] - 128) / 127)
    known = (totals[0] > 1).float()[:, None, None, None]
    return Batch(
        color, albedo, normal, variance, known, tuple(references), tuple(doubts),
        totals[0], tuple(totals[1:]),
    )


def drawn(samples: Tensor) -> "tuple[Tensor, Tensor, Tensor]":
    """Which pictures are the input and which the references, [N, 6] each; `samples`: [N, 6]."""
    often = torch.zeros_like(samples)
    for count, weight in LEVELS.items():
        often += weight * (samples == count)
    only = lambda index: F.one_hot(index, samples.shape[1]).float()
    chosen = only(torch.multinomial(often, 1)[:, 0])
    size = (samples * chosen).sum(1, True)
    # The error of a single sample is unknown, so it is no part of a mean.
    smaller = (samples < size) & (samples > 1) & (size <= samples.sum(1, True) / 4)
    joined = (torch.rand_like(size) < ODD) & (torch.rand_like(samples) < 0.4) & smaller
    chosen = torch.where(joined, torch.ones_like(chosen), chosen)
    others = (samples > 1).float() * (1 - chosen)
    # The last pictures have the most samples: about as many as all others together.
    largest = only((samples * others).argmax(1))
    return chosen, largest, others - largest


def random_batch(views: Views, count: int, size: int, weights: Tensor) -> Batch:
    """Random crops; `weights` [views], in the memory of the CPU: how often each view is drawn."""
    height, width = views.light.shape[3:]
    draw = lambda high: torch.randint(0, high, (count,)).tolist()
    which = torch.multinomial(weights, count, replacement=True).tolist()
    chosen = drawn(views.samples[which])
    top, left = draw(height - size + 1), draw(width - size + 1)
    return augmented(crops(views, which, chosen, top, left, size))


def augmented(batch: Batch) -> Batch:
    """Turns and mirrors, other colours of lights, other brightness, other axes, missing layers."""
    count, device = len(batch.samples), batch.samples.device
    uniform = lambda *shape: torch.rand(shape, device=device)
    # Whole batches are turned alike: the batches are small and many.
    turn = [
        lambda x: x,
        lambda x: x.flip(3),
        lambda x: x.flip(2),
        lambda x: x.flip(2, 3),
        lambda x: x.transpose(2, 3),
        lambda x: x.transpose(2, 3).flip(3),
        lambda x: x.transpose(2, 3).flip(2),
        lambda x: x.transpose(2, 3).flip(2, 3),
    ][int(torch.randint(0, 8, ()))]
    order = torch.randperm(3).to(device, non_blocking=True)
    tint = torch.exp(0.2 * torch.randn((count, 3, 1, 1), device=device))
    tint = tint * torch.exp(0.6 * torch.randn((count, 1, 1, 1), device=device))
    ordered = lambda x: turn(x).index_select(1, order)
    light = lambda x: ordered(x) * tint
    noise = lambda x: ordered(x) * tint**2
    some = lambda share: (uniform(count, 1, 1, 1) >= share).float()
    rotations = random_rotations(count, device)
    normal = torch.einsum("nij,njhw->nihw", rotations, turn(batch.normal)) * some(0.04)
    albedo = ordered(batch.albedo) * some(0.04)
    return Batch(
        light(batch.color), albedo, normal, noise(batch.variance), batch.known * some(0.1),
        tuple(map(light, batch.references)), tuple(map(noise, batch.doubts)),
        batch.samples, batch.reference_samples,
    )


def random_rotations(count: int, device: torch.device) -> Tensor:
    """Uniformly distributed rotations and mirrored rotations, [count, 3, 3], from quaternions."""
    w, x, y, z = F.normalize(torch.randn((4, count), device=device), dim=0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    mirror = torch.where(torch.rand((count, 1, 1), device=device) < 0.5, -1.0, 1.0)
    return torch.stack([torch.stack(row) for row in rows]).permute(2, 0, 1) * mirror
