"""What pairs.py has rendered, on the GPU: loading, inputs and references, crops, augmentation."""

import concurrent.futures
import glob
import os
from dataclasses import dataclass
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


@dataclass
class Views:
    """Views of scenes on one device; see pairs.py for the layers.

    light : float16 [views, 6, 6, H, W]: colour and standard error of each picture
    guide : uint8 [views, 6, 6, H, W]: albedo and normal
    samples : float32 [views, 6]: samples per pixel
    """

    light: Tensor
    guide: Tensor
    samples: Tensor

    def __len__(self) -> int:
        return len(self.samples)


def load(
    folders: Sequence[str], device: str, part: int = 0, parts: int = 1
) -> "tuple[Views, Views]":
    """Part `part` of `parts` of the scenes to train on, and all those that are held out.

    What does not fit into the GPU's memory is left out.
    """
    paths = sorted(path for folder in folders for path in glob.glob(os.path.join(folder, "*.npz")))
    with concurrent.futures.ThreadPoolExecutor(16) as pool:
        counts = dict(zip(paths, pool.map(_samples, paths)))
    kept_out = tuple(PLANS["held out"])
    is_held_out = lambda path: tuple(counts[path][0]) == kept_out
    held_out = [path for path in paths if is_held_out(path)]
    training = [path for path in paths if not is_held_out(path)]
    views = _read(training[part::parts], counts, device)
    return views, _read(held_out or training[:8], counts, device)


def _samples(path: str) -> np.ndarray:
    with np.load(path) as file:
        return file["samples"]


def _read(paths: "list[str]", counts: "dict[str, np.ndarray]", device: str) -> Views:
    with np.load(paths[0]) as file:
        shape = file["light"].shape[1:]
    bytes_each = 3 * int(np.prod(shape))
    most = len(paths) * 16
    if device.startswith("cuda"):
        most = (torch.cuda.mem_get_info(device)[0] - RESERVED) // bytes_each
    begins, total = {}, 0
    for path in paths:
        if total + len(counts[path]) <= most:
            begins[path] = total
            total += len(counts[path])
    light = torch.empty((total, *shape), dtype=torch.float16, device=device)
    guide = torch.empty((total, *shape), dtype=torch.uint8, device=device)
    samples = np.concatenate([counts[path] for path in begins]).astype(np.float32)

    def fill(path: str) -> None:
        with np.load(path) as file:
            where = slice(begins[path], begins[path] + len(counts[path]))
            light[where].copy_(torch.from_numpy(file["light"]))
            guide[where].copy_(torch.from_numpy(file["guide"]))

    with concurrent.futures.ThreadPoolExecutor(12) as pool:
        list(pool.map(fill, begins))
    return Views(light, guide, torch.from_numpy(samples).to(device))


@dataclass
class Batch:
    """Crops, [N, 3, h, w] each.

    `known` [N, 1, 1, 1]: 1 where the variance of the input is known. `doubt`: the variance of the
    reference, which is a noisy picture as well. `samples`, `reference_samples` [N]: samples per
    pixel.
    """

    color: Tensor
    albedo: Tensor
    normal: Tensor
    variance: Tensor
    known: Tensor
    reference: Tensor
    doubt: Tensor
    samples: Tensor
    reference_samples: Tensor


def crops(
    views: Views,
    which: Tensor,
    chosen: Tensor,
    others: Tensor,
    top: Tensor,
    left: Tensor,
    size: int,
) -> Batch:
    """The crops of `size` at (`left`, `top`) of the views `which`.

    `chosen` and `others`, [N, 6], are 1 for the pictures whose mean is the input or the reference.
    """
    device = views.light.device
    span = torch.arange(size, device=device)
    rows = (top[:, None] + span)[:, None, None, :, None]
    columns = (left[:, None] + span)[:, None, None, None, :]
    index = which[:, None, None, None, None]
    six = torch.arange(6, device=device)
    picture, channel = six[None, :, None, None, None], six[None, None, :, None, None]
    light = views.light[index, picture, channel, rows, columns].float()
    guide = views.guide[index, picture, channel, rows, columns].float()
    samples = views.samples[which]
    total, rest = (samples * chosen).sum(1), (samples * others).sum(1)
    share, other_share = samples * chosen / total[:, None], samples * others / rest[:, None]
    mean = lambda weights, x: torch.einsum("nk,nkchw->nchw", weights, x)
    colors, variances = light[:, :, :3], light[:, :, 3:] ** 2
    color, reference = mean(share, colors), mean(other_share, colors)
    variance, doubt = mean(share**2, variances), mean(other_share**2, variances)
    albedo = mean(share, (guide[:, :, :3] / 255) ** 2)
    normal = mean(share, (guide[:, :, 3:] - 128) / 127)
    known = (total > 1).float()[:, None, None, None]
    return Batch(color, albedo, normal, variance, known, reference, doubt, total, rest)


def drawn(samples: Tensor) -> "tuple[Tensor, Tensor]":
    """Which pictures are the input and which the reference, [N, 6] each; `samples`: [N, 6]."""
    device = samples.device
    often = torch.zeros_like(samples)
    for count, weight in LEVELS.items():
        often += weight * (samples == count)
    chosen = F.one_hot(torch.multinomial(often, 1)[:, 0], samples.shape[1]).to(device).float()
    size = (samples * chosen).sum(1, True)
    # The error of a single sample is unknown, so it is no part of a mean.
    smaller = (samples < size) & (samples > 1) & (size <= samples.sum(1, True) / 4)
    joined = (torch.rand_like(size) < ODD) & (torch.rand_like(samples) < 0.4) & smaller
    chosen = torch.where(joined, torch.ones_like(chosen), chosen)
    others = (samples > 1).float() * (1 - chosen)
    return chosen, others


def random_batch(views: Views, count: int, size: int, weights: Tensor) -> Batch:
    """Random crops; `weights` [views]: how often each view is drawn."""
    device = views.light.device
    height, width = views.light.shape[3:]
    draw = lambda high: torch.randint(0, high, (count,), device=device)
    which = torch.multinomial(weights, count, replacement=True)
    chosen, others = drawn(views.samples[which])
    top, left = draw(height - size + 1), draw(width - size + 1)
    return augmented(crops(views, which, chosen, others, top, left, size))


def augmented(batch: Batch) -> Batch:
    """Turns and mirrors, other colours of lights, other brightness, other axes, missing layers."""
    count, device = len(batch.samples), batch.samples.device
    uniform = lambda *shape: torch.rand(shape, device=device)
    images = [batch.color, batch.albedo, batch.normal, batch.variance, batch.reference, batch.doubt]
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
    images = [turn(x).contiguous() for x in images]
    order = torch.randperm(3, device=device)
    color, albedo, _, variance, reference, doubt = (x[:, order] for x in images)
    normal = images[2]
    tint = torch.exp(0.2 * torch.randn((count, 3, 1, 1), device=device))
    tint = tint * torch.exp(0.6 * torch.randn((count, 1, 1, 1), device=device))
    color, reference = color * tint, reference * tint
    variance, doubt = variance * tint**2, doubt * tint**2
    normal = torch.einsum("nij,njhw->nihw", random_rotations(count, device), normal)
    some = lambda share: (uniform(count, 1, 1, 1) >= share).float()
    albedo, normal = albedo * some(0.04), normal * some(0.04)
    known = batch.known * some(0.1)
    return Batch(
        color, albedo, normal, variance, known, reference, doubt,
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
