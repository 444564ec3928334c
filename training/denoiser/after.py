"""What the renderer does after the network, as `crates/post/src/denoise/limit.rs` and `energy.rs`.

Here it is in numpy, so that weights can be judged without building the renderer. Pictures are
float32 [H, W, 3].
"""

import numpy as np

DEVIATIONS = 2.0
MORE_IN_THE_DARK = 4.0
RADIUS = 10
DARK_RADIUS = 2
BLOCK = 64
EXPECTED_BIAS = 0.015
MOST = 1.25
MOST_OF_PIXEL = 2.0
ROUNDS = 3
STEPS = 8
NOISY = 0.02
TILE = 4


def windows(x, radius):
    """Sums over squares of `radius` round each pixel, cut off at the edges."""
    for axis in (0, 1):
        n = x.shape[axis]
        sums = np.concatenate([np.zeros_like(x.take([0], axis)), np.cumsum(x, axis)], axis)
        low, high = np.arange(n) - radius, np.arange(n) + radius + 1
        x = sums.take(np.minimum(high, n), axis) - sums.take(np.maximum(low, 0), axis)
    return x


def limited(noisy, variance, filtered):
    """No pixel is moved by more than two standard deviations, or six where all is dark."""
    variance = variance.astype(np.float64)
    mean = lambda x, radius: windows(x, radius) / windows(np.ones_like(variance), radius)
    dark = mean((variance <= 0).astype(np.float64), DARK_RADIUS)
    known = np.maximum(np.maximum(variance, mean(variance, RADIUS)), 0)
    reach = (DEVIATIONS + MORE_IN_THE_DARK * dark) * np.sqrt(known)
    return np.clip(filtered, np.maximum(noisy, 0) - reach, np.maximum(noisy, 0) + reach)


def sums(picture, side=BLOCK):
    """Sums over blocks, [rows, columns, 3]."""
    rows = np.arange(0, picture.shape[0], side)
    columns = np.arange(0, picture.shape[1], side)
    return np.add.reduceat(np.add.reduceat(picture.astype(np.float64), rows, 0), columns, 1)


def ratio(before, after):
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = before / after
    usable = (after > 0) & np.isfinite(quotient)
    return np.where(usable, np.clip(np.where(usable, quotient, 1), 1 / MOST, MOST), 1.0)


def spread(blocks, length, axis):
    """Values of blocks for each of `length` pixels along an axis, linear between the centres."""
    count = blocks.shape[axis]
    place = np.clip((np.arange(length) + 0.5) / BLOCK - 0.5, 0, count - 1)
    first = place.astype(int)
    weight = (place - first).reshape([-1 if i == axis else 1 for i in range(3)])
    second = np.minimum(first + 1, count - 1)
    return blocks.take(first, axis) * (1 - weight) + blocks.take(second, axis) * weight


def over_tiles(blocks, shape):
    """Values of tiles for each pixel."""
    return blocks.repeat(TILE, 0).repeat(TILE, 1)[: shape[0], : shape[1]]


def part_of(noisy, variance, filtered):
    """The part of each value that may be noise, the same in tiles of 4×4 pixels."""
    moved = (noisy.astype(np.float64) - filtered) ** 2
    squares = moved if variance is None else np.maximum(variance.astype(np.float64), 0)
    squares, certain = sums(squares, TILE), NOISY**2 * sums(filtered**2, TILE)
    return np.where(certain > 0, squares / np.where(certain > 0, certain, 1), 0).clip(0, 1)


def restored(noisy, variance, filtered):
    """The means of blocks, as far as they are certain, and of the picture are those of `noisy`."""
    filtered = filtered.astype(np.float64)
    parts = part_of(noisy, variance, filtered)
    part = over_tiles(parts, filtered.shape)
    if variance is not None:
        before, after, noise = sums(noisy), sums(filtered), sums(part * filtered)
        error = np.maximum(sums(variance), 0) / np.maximum(after**2, np.finfo(float).tiny)
        certain = EXPECTED_BIAS**2 / (EXPECTED_BIAS**2 + error)
        wanted = after * (1 + certain * (ratio(before, after) - 1))
        gains, first = np.zeros_like(wanted), filtered
        for _ in range(ROUNDS):
            gains = gains + (wanted - sums(filtered)) / np.where(noise > 0, noise, np.inf)
            gains = np.clip(gains, 1 / MOST - 1, MOST - 1)
            field = spread(spread(gains, len(part), 0), part.shape[1], 1)
            filtered = first * (1 + part * field)
        # Blocks that are certain have theirs already.
        open_to = spread(spread(1 - certain, len(part), 0), part.shape[1], 1)
        parts = sums(part * open_to, TILE) / sums(np.ones_like(part), TILE)
        part = over_tiles(parts, filtered.shape)
    mean = noisy.mean((0, 1), np.float64)
    strength = strength_of(mean * part[..., 0].size, parts, filtered)
    change = (strength * part * filtered).clip(1 / MOST_OF_PIXEL - 1, MOST_OF_PIXEL - 1)
    filtered = filtered * (1 + change)
    return filtered * ratio(mean, filtered.mean((0, 1)))


def strength_of(wanted, part, filtered):
    """The `λ` of each colour with which all `v + λ part v²` have the wanted sum.

    By Newton's method, as if all values of a tile were alike.
    """
    values, square, strength = sums(filtered, TILE), part * sums(filtered**2, TILE), np.zeros(3)
    for _ in range(STEPS):
        free = values + strength * square
        kept = np.clip(free, values / MOST_OF_PIXEL, values * MOST_OF_PIXEL)
        missing, slope = wanted - kept.sum((0, 1)), (square * (free == kept)).sum((0, 1))
        strength = strength + np.where(slope > 0, missing / np.where(slope > 0, slope, 1), 0)
    return strength


def finished(noisy, variance, filtered):
    """All of it; `variance` is None where it is not known."""
    if variance is not None:
        filtered = limited(noisy, variance, filtered)
    return restored(noisy, variance, filtered).astype(np.float32)
