"""Training pairs on the GPU: loading, random crops, augmentation."""

import concurrent.futures
import glob
import os
from dataclasses import dataclass
from typing import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

SAMPLES = (1, 2, 4, 8, 16, 64, 256)
"""Samples per pixel of the noisy pictures of a view."""
LAYERS = ("color", "albedo", "normal", "error")


@dataclass
class Views:
    """Views of scenes in half precision on one device.

    noisy : [views, len(SAMPLES), 12, H, W]: color, albedo, normal, standard error
    reference : [views, 3, H, W]
    share : [views], how much of the mean of the reference and the least noisy picture is the
        reference's: they are independent, and their mean is a better reference for the others
    """

    noisy: Tensor
    reference: Tensor
    share: Tensor

    def __len__(self) -> int:
        return len(self.reference)


TILE = 256
"""Larger views are cut into tiles of this side."""


def tiles(path: str) -> "list[tuple[np.ndarray, np.ndarray, float]]":
    """One file of `pairs.py`: for each tile the noisy pictures, the reference and its share."""
    with np.load(path) as file:
        noisy = np.stack(
            [np.concatenate([file[f"{layer}_{spp}"] for layer in LAYERS]) for spp in SAMPLES]
        )
        reference = file["reference"]
        samples = float(file["reference_samples"])
    share = samples / (samples + SAMPLES[-1])
    found = []
    for y in range(0, reference.shape[1] - TILE + 1, TILE):
        for x in range(0, reference.shape[2] - TILE + 1, TILE):
            cut = np.s_[..., y : y + TILE, x : x + TILE]
            found.append((noisy[cut], reference[cut], share))
    return found


def load(folders: Sequence[str], device: str, held_out: float = 0.05) -> "tuple[Views, Views]":
    """All views of the folders: for training, and those of the last scenes for validation."""
    paths = sorted(path for folder in folders for path in glob.glob(os.path.join(folder, "*.npz")))
    scenes = sorted({os.path.basename(path).split("_")[0] for path in paths})
    kept = set(scenes[: len(scenes) - max(1, round(held_out * len(scenes)))])
    groups = ([], [])
    for path in paths:
        groups[os.path.basename(path).split("_")[0] not in kept].append(path)
    with concurrent.futures.ThreadPoolExecutor(16) as pool:
        return tuple(_stacked(pool.map(tiles, group), device) for group in groups)


def _stacked(files, device: str) -> Views:
    noisy, reference, shares = [], [], []
    for inputs, output, share in (tile for file in files for tile in file):
        shares.append(share)
        noisy.append(torch.from_numpy(np.ascontiguousarray(inputs)).to(device))
        reference.append(torch.from_numpy(np.ascontiguousarray(output)).to(device))
    return Views(torch.stack(noisy), torch.stack(reference), torch.tensor(shares, device=device))


@dataclass
class Batch:
    """Crops, [N, 3, h, w] each; `level` [N]: the index into SAMPLES; `known` [N, 1, 1, 1]."""

    color: Tensor
    albedo: Tensor
    normal: Tensor
    variance: Tensor
    known: Tensor
    reference: Tensor
    level: Tensor


def crops(views: Views, level: Tensor, which: Tensor, top: Tensor, left: Tensor, size: int) -> Batch:
    """The crops of `size` at (`left`, `top`) of the views `which` with the sample counts `level`."""
    device = views.reference.device
    span = torch.arange(size, device=device)
    rows = (top[:, None] + span)[:, None, :, None]
    columns = (left[:, None] + span)[:, None, None, :]
    index = which[:, None, None, None]
    channel = torch.arange(12, device=device)[None, :, None, None]
    noisy = views.noisy[index, level[:, None, None, None], channel, rows, columns].float()
    reference = views.reference[index, channel[:, :3], rows, columns].float()
    color, albedo, normal, error = noisy.split(3, 1)
    last = len(SAMPLES) - 1
    other = views.noisy[index, last, channel[:, :3], rows, columns].float()
    is_last = (level == last)[:, None, None, None]
    share = views.share[which][:, None, None, None]
    reference = torch.where(is_last, reference, share * reference + (1 - share) * other)
    samples = torch.tensor(SAMPLES, device=device)[level]
    known = (samples > 1).float()[:, None, None, None]
    return Batch(color.clamp(min=0), albedo, normal, error**2, known, reference, level)


def random_batch(views: Views, count: int, size: int, levels: Sequence[float]) -> Batch:
    """Random crops; `levels`: how often each sample count is drawn."""
    device = views.reference.device
    height, width = views.reference.shape[2:]
    draw = lambda high: torch.randint(0, high, (count,), device=device)
    level = torch.multinomial(torch.tensor(levels, device=device), count, replacement=True)
    batch = crops(views, level, draw(len(views)), draw(height - size + 1), draw(width - size + 1), size)
    return augmented(batch)


def augmented(batch: Batch) -> Batch:
    """Turns and mirrors, other colours of lights, other brightness, other axes, missing layers."""
    count, device = len(batch.level), batch.level.device
    uniform = lambda *shape: torch.rand(shape, device=device)
    images = [batch.color, batch.albedo, batch.normal, batch.variance, batch.reference]
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
    color, albedo, normal, variance, reference = (turn(x).contiguous() for x in images)
    order = torch.randperm(3, device=device)
    color, albedo, variance, reference = (x[:, order] for x in (color, albedo, variance, reference))
    tint = torch.exp(0.2 * torch.randn((count, 3, 1, 1), device=device))
    tint = tint * torch.exp(0.6 * torch.randn((count, 1, 1, 1), device=device))
    color, reference, variance = color * tint, reference * tint, variance * tint**2
    normal = torch.einsum("nij,njhw->nihw", random_rotations(count, device), normal)
    some = lambda share: (uniform(count, 1, 1, 1) >= share).float()
    albedo, normal = albedo * some(0.04), normal * some(0.04)
    known = batch.known * some(0.1)
    return Batch(color, albedo, normal, variance, known, reference, batch.level)


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
