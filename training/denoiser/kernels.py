"""The sums of the filter's kernels on an NVIDIA GPU, forward and backward, in Triton.

`sums(weighted, logits)` is what `network.weighted_sums` computes of PyTorch's operations, without
keeping 25 copies of the picture in memory.
"""

import torch
import triton
import triton.language as tl
from torch import Tensor

BLOCK = 128  # pixels of a program


@triton.jit
def place(total, height, width, BLOCK: tl.constexpr):
    """The pixels of a program: (index, image, row, column, whether they exist)."""
    pixel = tl.program_id(0) * BLOCK + tl.arange(0, BLOCK)
    image = pixel // (height * width)
    inside = pixel - image * (height * width)
    return pixel, image, inside // width, inside % width, pixel < total


@triton.jit
def forward_kernel(
    weighted, logits, output, greatest, total, height, width, ln, lc, ly, lx,
    CHANNELS: tl.constexpr, TAPS: tl.constexpr, BLOCK: tl.constexpr,
):
    """output[n, c, y, x]: sums of exp(logit - greatest) · weighted[n, c, y + i, x + k] over taps.

    `greatest` [n, y, x] becomes the greatest logit of a pixel. `ln`, `lc`, `ly`, `lx`: steps of
    `logits` in memory; everything else is contiguous.
    """
    pixel, image, row, column, exists = place(total, height, width, BLOCK)
    plane = height * width
    logit_at = logits + image * ln + row * ly + column * lx
    top = tl.full((BLOCK,), float("-inf"), tl.float32)
    for tap in range(TAPS * TAPS):
        top = tl.maximum(top, tl.load(logit_at + tap * lc, mask=exists, other=0.0).to(tl.float32))
    tl.store(greatest + pixel, top, mask=exists)
    first = weighted + image * CHANNELS * plane
    for channel in tl.static_range(CHANNELS):
        total_here = tl.zeros((BLOCK,), tl.float32)
        for tap in range(TAPS * TAPS):
            y, x = row + (tap // TAPS - TAPS // 2), column + (tap % TAPS - TAPS // 2)
            near = exists & (y >= 0) & (y < height) & (x >= 0) & (x < width)
            logit = tl.load(logit_at + tap * lc, mask=exists, other=0.0).to(tl.float32)
            value = tl.load(first + channel * plane + y * width + x, mask=near, other=0.0)
            total_here += tl.exp(logit - top) * value
        tl.store(
            output + (image * CHANNELS + channel) * plane + row * width + column,
            total_here, mask=exists,
        )


@triton.jit
def logits_kernel(
    weighted, logits, greatest, slope, logit_slope, total, height, width, ln, lc, ly, lx,
    CHANNELS: tl.constexpr, TAPS: tl.constexpr, BLOCK: tl.constexpr,
):
    """The loss's slope by the logits, [n, taps, y, x]; `slope`: that by the sums."""
    pixel, image, row, column, exists = place(total, height, width, BLOCK)
    plane = height * width
    top = tl.load(greatest + pixel, mask=exists, other=0.0)
    first = image * CHANNELS * plane
    for tap in range(TAPS * TAPS):
        y, x = row + (tap // TAPS - TAPS // 2), column + (tap % TAPS - TAPS // 2)
        near = exists & (y >= 0) & (y < height) & (x >= 0) & (x < width)
        at = logits + image * ln + row * ly + column * lx + tap * lc
        logit = tl.load(at, mask=exists, other=0.0).to(tl.float32)
        product = tl.zeros((BLOCK,), tl.float32)
        for channel in tl.static_range(CHANNELS):
            here = first + channel * plane
            by_sum = tl.load(slope + here + row * width + column, mask=exists, other=0.0)
            product += by_sum * tl.load(weighted + here + y * width + x, mask=near, other=0.0)
        place_of = (image * TAPS * TAPS + tap) * plane + row * width + column
        tl.store(logit_slope + place_of, tl.exp(logit - top) * product, mask=exists)


@triton.jit
def weighted_kernel(
    logits, greatest, slope, weighted_slope, total, height, width, ln, lc, ly, lx,
    CHANNELS: tl.constexpr, TAPS: tl.constexpr, BLOCK: tl.constexpr,
):
    """The loss's slope by the weighted picture, [n, c, y, x]: what all pixels around took of it."""
    pixel, image, row, column, exists = place(total, height, width, BLOCK)
    plane = height * width
    first = image * CHANNELS * plane
    for channel in tl.static_range(CHANNELS):
        total_here = tl.zeros((BLOCK,), tl.float32)
        for tap in range(TAPS * TAPS):
            y, x = row - (tap // TAPS - TAPS // 2), column - (tap % TAPS - TAPS // 2)
            near = exists & (y >= 0) & (y < height) & (x >= 0) & (x < width)
            at = logits + image * ln + y * ly + x * lx + tap * lc
            logit = tl.load(at, mask=near, other=0.0).to(tl.float32)
            top = tl.load(greatest + image * plane + y * width + x, mask=near, other=0.0)
            by_sum = tl.load(slope + first + channel * plane + y * width + x, mask=near, other=0.0)
            total_here += tl.exp(logit - top) * by_sum
        here = first + channel * plane + row * width + column
        tl.store(weighted_slope + here, total_here, mask=exists)


class KernelSums(torch.autograd.Function):
    """As autograd needs it; the slope by the greatest logit cancels out once sums are divided."""

    @staticmethod
    def forward(context, weighted: Tensor, logits: Tensor) -> Tensor:
        weighted = weighted.contiguous()
        count, channels, height, width = weighted.shape
        output = torch.empty_like(weighted)
        greatest = weighted.new_empty((count, height, width))
        total = count * height * width
        shape = (total, height, width, *logits.stride(), channels, 5, BLOCK)
        grid = (triton.cdiv(total, BLOCK),)
        forward_kernel[grid](weighted, logits, output, greatest, *shape)
        context.save_for_backward(weighted, logits, greatest)
        context.shape, context.grid = shape, grid
        return output

    @staticmethod
    def backward(context, slope: Tensor) -> "tuple[Tensor, Tensor]":
        weighted, logits, greatest = context.saved_tensors
        slope, shape, grid = slope.contiguous(), context.shape, context.grid
        by_weighted = torch.empty_like(weighted)
        by_logits = torch.empty(logits.shape, device=logits.device, dtype=torch.float32)
        weighted_kernel[grid](logits, greatest, slope, by_weighted, *shape)
        logits_kernel[grid](weighted, logits, greatest, slope, by_logits, *shape)
        return by_weighted, by_logits.to(logits.dtype)


def sums(weighted: Tensor, logits: Tensor) -> Tensor:
    """Sums over 5×5 pixels of `weighted` [N, C, H, W] with weights exp(`logits`), [N, 25, H, W]."""
    return KernelSums.apply(weighted, logits)
