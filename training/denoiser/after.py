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
STEPS = 6
MET = 1e-6
NOISY = 0.02
DOUBT_RADIUS = 2


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


def sums(picture):
    """Sums over blocks, [rows, columns, 3]."""
    rows = np.arange(0, picture.shape[0], BLOCK)
    columns = np.arange(0, picture.shape[1], BLOCK)
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


def doubt_of(noisy, variance, filtered):
    """The square below which a value is all noise."""
    moved = (noisy.astype(np.float64) - filtered) ** 2
    squares = moved if variance is None else np.maximum(variance.astype(np.float64), 0)
    return windows(squares, DOUBT_RADIUS) / windows(np.ones_like(squares), DOUBT_RADIUS) / NOISY**2


def restored(noisy, variance, filtered):
    """The means of blocks, as far as they are certain, and of the picture are those of `noisy`."""
    doubt, filtered = doubt_of(noisy, variance, filtered), filtered.astype(np.float64)
    if variance is not None:
        before, after = sums(noisy), sums(filtered)
        error = np.maximum(sums(variance), 0) / np.maximum(after**2, np.finfo(float).tiny)
        certain = EXPECTED_BIAS**2 / (EXPECTED_BIAS**2 + error)
        wanted = after * (1 + certain * (ratio(before, after) - 1))
        for _ in range(ROUNDS):
            part = np.minimum(filtered, doubt / np.maximum(filtered, 1e-30))
            parts = sums(part)
            gains = (wanted - sums(filtered)) / np.where(parts > 0, parts, np.inf)
            gains = np.clip(gains, 1 / MOST - 1, MOST - 1)
            filtered = filtered + part * spread(spread(gains, len(part), 0), part.shape[1], 1)
    return with_mean(noisy.mean((0, 1), np.float64), doubt, filtered)


def with_mean(wanted, doubt, filtered):
    """Each value `v` gets `λ min(v², doubt)`, so that means are as wanted; `λ` by Newton's method."""
    square, strength = np.minimum(filtered**2, doubt), np.zeros(3)
    for _ in range(STEPS + 1):
        free = filtered + strength * square
        kept = np.clip(free, filtered / MOST_OF_PIXEL, filtered * MOST_OF_PIXEL)
        missing, slope = wanted - kept.mean((0, 1)), (square * (free == kept)).mean((0, 1))
        unmet = (np.abs(missing) > MET * wanted) & (slope > 0)
        if not unmet.any():
            break
        strength = strength + np.where(unmet, missing / np.where(unmet, slope, 1), 0)
    return kept * ratio(wanted, kept.mean((0, 1)))


def finished(noisy, variance, filtered):
    """All of it; `variance` is None where it is not known."""
    if variance is not None:
        filtered = limited(noisy, variance, filtered)
    return restored(noisy, variance, filtered).astype(np.float32)
