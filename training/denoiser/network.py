"""The denoiser's network and filter in PyTorch, exactly as `crates/post/src/denoise/network` runs them.

A U-Net at half resolution predicts, for each pixel and level of a pyramid, the weights of a 5×5
kernel and how the levels are put together. The result is linear in the picture.

Sources: Bako et al., "Kernel-Predicting Convolutional Networks for Denoising Monte Carlo
Renderings", 2017; Vogels et al., "Denoising with Kernel Prediction and Asymmetric Loss Functions",
2018; Ronneberger et al., "U-Net", 2015.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

TAPS = 5
LEVELS = 6
PADDING = 32
"""Pictures are padded to multiples of this: the coarsest level has a pixel for each 32×32."""
ALBEDO_FLOOR = 0.05
FEATURES = 11

CONVOLUTIONS = {
    "e0a": (4 * FEATURES, 48),
    "e0b": (48, 48),
    "e1": (48, 64),
    "e2": (64, 80),
    "e3": (80, 96),
    "e4a": (96, 96),
    "e4b": (96, 96),
    "d3a": (96 + 96, 96),
    "d3b": (96, 96),
    "d2a": (96 + 80, 80),
    "d2b": (80, 80),
    "d1a": (80 + 64, 64),
    "d1b": (64, 64),
    "d0a": (64 + 48, 64),
    "d0b": (64, 64),
}
HEADS = {
    "h0": (64, 4 * 29),
    "h1": (64, 27),
    "h2": (64, 27),
    "h3": (80, 27),
    "h4": (96, 27),
    "h5": (96, 25),
}
"""25 logarithms of weights; on the finest level trust; how much of the coarser level is taken,
but on the coarsest; on the finest level the share without albedo; and how much detail is kept."""


def compressed(x: Tensor) -> Tensor:
    """Radiance on a scale that a network can read: steep in the dark, logarithmic in the light."""
    return torch.log1p(16.0 * x) / 3.0


def exposure(color: Tensor) -> Tensor:
    """The factor that brings a picture's logarithmic mean to 0.18, [N, 1, 1, 1].

    The mean is over blocks of 16×16 pixels, so that noise does not move it.
    """
    luminance = (color * color.new_tensor([0.2126, 0.7152, 0.0722]).view(1, 3, 1, 1)).sum(1, True)
    blocks = F.avg_pool2d(luminance, 16, ceil_mode=True, count_include_pad=False)
    lit = blocks > 1e-8
    logarithm = torch.where(lit, blocks, torch.ones_like(blocks)).log().sum((1, 2, 3), True)
    count = lit.sum((1, 2, 3), True)
    scale = 0.18 / (logarithm / count.clamp(min=1)).exp()
    return torch.where(count > 0, scale, torch.ones_like(scale))


def features(color: Tensor, albedo: Tensor, normal: Tensor, variance: Tensor, known: Tensor) -> Tensor:
    """What the network sees, [N, 11, H, W]. `known`: [N, 1, 1, 1], 1 where the variance is known."""
    demodulator = albedo + ALBEDO_FLOOR
    deviation = (variance / demodulator**2).mean(1, True).sqrt()
    known = known.expand_as(deviation)
    noise = torch.where(known > 0, compressed(deviation), torch.zeros_like(deviation))
    return torch.cat([compressed(color / demodulator), albedo, normal, noise, known], 1)


class Denoiser(nn.Module):
    """The network and the filter."""

    def __init__(self) -> None:
        super().__init__()
        for name, (inputs, outputs) in CONVOLUTIONS.items():
            self.add_module(name, nn.Conv2d(inputs, outputs, 3, padding=1))
        for name, (inputs, outputs) in HEADS.items():
            self.add_module(name, nn.Conv2d(inputs, outputs, 1))
        self._start()

    def _start(self) -> None:
        """Kernels begin as blurs that trust every pixel: training is short if this is sensible."""
        for name in CONVOLUTIONS:
            layer = getattr(self, name)
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
        for name in HEADS:
            head = getattr(self, name)
            nn.init.normal_(head.weight, std=0.02)
            nn.init.zeros_(head.bias)
        with torch.no_grad():
            bias = self.h0.bias.view(29, 4)
            bias[12] = 1.0
            bias[25] = 3.0
            bias[27] = 2.0
            bias[28] = 4.0
            for name in ("h1", "h2", "h3", "h4"):
                getattr(self, name).bias[26] = 4.0

    def heads(self, features: Tensor) -> "list[Tensor]":
        """The predictions for each level, finest first; [N, 29 | 27 | 25, H / 2^l, W / 2^l]."""

        def layer(name: str, x: Tensor) -> Tensor:
            return F.relu(getattr(self, name)(x))

        def pool(x: Tensor) -> Tensor:
            return F.max_pool2d(x, 2)

        def up(x: Tensor, skip: Tensor) -> Tensor:
            return torch.cat([F.interpolate(x, scale_factor=2, mode="nearest"), skip], 1)

        x0 = layer("e0b", layer("e0a", F.pixel_unshuffle(features, 2)))
        x1 = layer("e1", pool(x0))
        x2 = layer("e2", pool(x1))
        x3 = layer("e3", pool(x2))
        x4 = layer("e4b", layer("e4a", pool(x3)))
        y3 = layer("d3b", layer("d3a", up(x4, x3)))
        y2 = layer("d2b", layer("d2a", up(y3, x2)))
        y1 = layer("d1b", layer("d1a", up(y2, x1)))
        y0 = layer("d0b", layer("d0a", up(y1, x0)))
        return [
            F.pixel_shuffle(self.h0(y0), 2),
            self.h1(y0),
            self.h2(y1),
            self.h3(y2),
            self.h4(y3),
            self.h5(x4),
        ]

    def forward(
        self, color: Tensor, albedo: Tensor, normal: Tensor, variance: Tensor, known: Tensor
    ) -> Tensor:
        """The picture without its noise; all [N, 3, H, W], `color` at its exposure, padded."""
        seen = features(color, albedo, normal, variance, known)
        with torch.autocast(color.device.type, torch.bfloat16, enabled=self.training):
            heads = self.heads(seen.contiguous(memory_format=torch.channels_last))
        return filtered(color, albedo, [h.float() for h in heads])


def weighted_sums(weighted: Tensor, logits: Tensor) -> Tensor:
    """Sums over the 5×5 around each pixel with weights exp(`logits`), up to a factor of the pixel.

    `weighted`: [N, C, H, W]; `logits`: [N, 25, H, W]. What is outside is 0.
    """
    if weighted.is_cuda:
        import kernels

        return kernels.sums(weighted, logits)
    n, channels, height, width = weighted.shape
    kernel = (logits - logits.amax(1, True)).exp()
    taps = F.unfold(weighted, TAPS, padding=TAPS // 2).view(n, channels, TAPS**2, height, width)
    return (taps * kernel[:, None]).sum(2)


def weighted_kernel(picture: Tensor, trust: Tensor, logits: Tensor) -> Tensor:
    """Each pixel's weighted mean of the 5×5 around it that lie inside; `picture`: [N, 6, H, W].

    Outside the picture nothing is trusted, so those pixels have no weight.
    """
    channels = picture.shape[1]
    sums = weighted_sums(torch.cat([trust * picture, trust], 1), logits)
    return sums[:, :channels] / sums[:, channels:].clamp(min=1e-30)


def composition(heads: "list[Tensor]", level: int) -> "tuple[Tensor, Tensor]":
    """How much of the coarser level a level takes, and how much of its own detail is kept."""
    first, second = (26, 28) if level == 0 else (25, 26)
    return heads[level][:, first : first + 1].sigmoid(), heads[level][:, second : second + 1].sigmoid()


def composed(fine: Tensor, coarse: Tensor, alpha: Tensor, detail: Tensor) -> Tensor:
    """A level and the one below it, [N, 6, H, W] and half of that.

    What is finer than the coarse level is noise on a plain wall, and pattern elsewhere: a 5×5 kernel
    leaves a tenth of the noise in it.
    """
    larger = lambda x: F.interpolate(x, scale_factor=2, mode="bilinear")
    mean = F.avg_pool2d(fine, 2)
    smooth = larger(mean)
    return smooth + detail * (fine - smooth) + alpha * larger(coarse - mean)


def filtered(color: Tensor, albedo: Tensor, heads: "list[Tensor]") -> Tensor:
    """The filter that the heads describe, applied to a picture."""
    demodulator = albedo + ALBEDO_FLOOR
    picture = torch.cat([color, color / demodulator], 1)
    trust = 0.001 + 0.999 * heads[0][:, 25:26].sigmoid()
    levels = []
    for level in range(LEVELS):
        levels.append(weighted_kernel(picture, trust, heads[level][:, :25]))
        if level + 1 < LEVELS:
            mean = F.avg_pool2d(trust, 2)
            picture = F.avg_pool2d(trust * picture, 2) / mean
            trust = mean
    out = levels[-1]
    for level in reversed(range(LEVELS - 1)):
        out = composed(levels[level], out, *composition(heads, level))
    beta = heads[0][:, 27:28].sigmoid()
    return (beta * demodulator * out[:, 3:] + (1 - beta) * out[:, :3]).clamp(min=0)


def mirrored(length: int) -> Tensor:
    """Places of a row that is mirrored at its end, up to a multiple of `PADDING`."""
    place = torch.arange(-(-length // PADDING) * PADDING) % (2 * length)
    return torch.minimum(place, 2 * length - 1 - place)


def denoise(
    model: Denoiser, color: Tensor, albedo: Tensor, normal: Tensor, variance: "Tensor | None"
) -> Tensor:
    """Denoises whole pictures of any size and brightness, [N, 3, H, W]."""
    clean = lambda x, low, high: torch.nan_to_num(x, 0.0, 0.0, 0.0).clamp(low, high)
    color, albedo, normal = clean(color, 0, None), clean(albedo, 0, 1), clean(normal, -1, 1)
    known = variance is not None
    variance = clean(variance, 0, None) if known else torch.zeros_like(color)
    scale = exposure(color)
    height, width = color.shape[2:]
    rows, columns = mirrored(height).to(color.device), mirrored(width).to(color.device)
    layers = (color * scale, albedo, normal, variance * scale**2)
    padded = [x[:, :, rows][:, :, :, columns] for x in layers]
    flag = color.new_full((color.shape[0], 1, 1, 1), float(known))
    return model(*padded, flag)[:, :, :height, :width] / scale
