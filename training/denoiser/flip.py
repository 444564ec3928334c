"""LDR-FLIP in PyTorch, with slopes: what a viewer notices who flips between two pictures.

Method: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020. Same as
`crates/film/src/flip.rs`, where constants are explained, but pictures are linear and not rounded.
"""

import functools
import math

import torch
from torch import Tensor
from torch.nn import functional as F

PIXELS_PER_DEGREE = 67.0
EXPONENT, KNEE, KNEE_ERROR = 0.7, 0.4, 0.95
FEATURE_WIDTH = 0.082
SENSITIVITY = ((1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025))
LEAST = 1e-3
"""Differences of colours below this have no slope that grows without bound."""

RGB_TO_XYZ = [
    [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
    [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
    [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
]
WHITE = [0.95042854, 1.0, 1.0889004]
OPPONENT = [[0.0, 116.0, 0.0], [500.0, -500.0, 0.0], [0.0, 200.0, -200.0]]
"""YCxCz of XYZ relative to white, but for 16 of the first."""


class Constants:
    """Matrices and filters on one device, made once.

    relative : XYZ relative to white of linear RGB
    opponent : YCxCz of XYZ relative to white; seen : of linear RGB; back : the inverse of that
    sensitivity : filters of Y, Cx and the two terms of Cz, [4, taps]
    feature : a Gaussian, its first and its second derivative, [3, taps]
    """

    def __init__(self, device: torch.device) -> None:
        relative = torch.tensor(RGB_TO_XYZ) / torch.tensor(WHITE)[:, None]
        opponent = torch.tensor(OPPONENT)
        self.relative, self.opponent = relative.to(device), opponent.to(device)
        self.seen = (opponent @ relative).to(device)
        self.back = torch.linalg.inv((opponent @ relative).double()).float().to(device)
        self.sensitivity = sensitivity_taps().to(device)
        self.feature = feature_taps().to(device)


@functools.lru_cache
def constants(device: torch.device) -> Constants:
    return Constants(device)


def converted(matrix: Tensor, picture: Tensor) -> Tensor:
    """Multiplies the three channels of each pixel by a matrix."""
    return torch.einsum("ij,njhw->nihw", matrix, picture)


def lab(linear: Tensor) -> Tensor:
    """CIELAB of linear RGB, less colourful where it is dark (Hunt)."""
    known = constants(linear.device)
    xyz = converted(known.relative, linear)
    delta = 6 / 29
    root = xyz.clamp(min=delta**3) ** (1 / 3)
    compressed = torch.where(xyz > delta**3, root, xyz / (3 * delta**2) + 4 / 29)
    light, a, b = converted(known.opponent, compressed).split(1, 1)
    light = light - 16
    return torch.cat([light, 0.01 * light * a, 0.01 * light * b], 1)


def sensitivity_taps() -> Tensor:
    widest = max(b for _, b in SENSITIVITY)
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * PIXELS_PER_DEGREE)
    degrees = torch.arange(-radius, radius + 1) / PIXELS_PER_DEGREE
    taps = []
    for i, (a, b) in enumerate(SENSITIVITY):
        factor = a * math.sqrt(math.pi / b)
        factor = factor if i < 2 else math.sqrt(factor)
        taps.append(factor * (-((math.pi * degrees) ** 2) / b).exp())
    both = math.hypot(float(taps[2].sum()), float(taps[3].sum()))
    sums = [float(taps[0].sum()), float(taps[1].sum()), both, both]
    return torch.stack([tap / total for tap, total in zip(taps, sums)])


def feature_taps() -> Tensor:
    deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE
    radius = math.ceil(3 * deviation)
    x = torch.arange(-radius, radius + 1.0)
    gaussian = (-0.5 * (x / deviation) ** 2).exp()
    taps = torch.stack([gaussian, -x * gaussian, ((x / deviation) ** 2 - 1) * gaussian])
    rises, falls = taps.clamp(min=0).sum(1, True), (-taps).clamp(min=0).sum(1, True)
    return torch.where(taps > 0, taps / rises, taps / falls.clamp(min=1e-9))


def along(picture: Tensor, taps: Tensor, vertical: bool) -> Tensor:
    """Filters each channel with its own taps along one axis; borders go on."""
    radius = taps.shape[1] // 2
    pad = (0, 0, radius, radius) if vertical else (radius, radius, 0, 0)
    weight = taps[:, None, :, None] if vertical else taps[:, None, None]
    return F.conv2d(F.pad(picture, pad, mode="replicate"), weight, groups=picture.shape[1])


def perceived(seen: Tensor) -> Tensor:
    """What the eye's contrast sensitivity leaves of YCxCz, as CIELAB."""
    known = constants(seen.device)
    four = torch.cat([seen, seen[:, 2:]], 1)
    four = along(along(four, known.sensitivity, False), known.sensitivity, True)
    kept = torch.cat([four[:, :2], four[:, 2:3] + four[:, 3:]], 1)
    return lab(converted(known.back, kept).clamp(0, 1))


def features(seen: Tensor) -> "tuple[Tensor, Tensor]":
    """How strongly pixels look like an edge and like a point, [N, 1, H, W] each."""
    taps = constants(seen.device).feature
    light = seen[:, :1] / 116
    plain = along(light, taps[:1], False)
    length = lambda x, y: (x**2 + y**2 + 1e-10).sqrt()
    found = []
    for i in (1, 2):
        across = along(along(light, taps[i : i + 1], False), taps[:1], True)
        found.append(length(across, along(plain, taps[i : i + 1], True)))
    return found[0], found[1]


def distance(a: Tensor, b: Tensor) -> Tensor:
    """Between colours in CIELAB, [N, 1, H, W]: city block in lightness, Euclidean in chroma."""
    light, chroma = (a - b)[:, :1], (a - b)[:, 1:]
    return (light**2 + LEAST**2).sqrt() + (chroma.square().sum(1, True) + LEAST**2).sqrt()


@functools.lru_cache
def largest() -> float:
    pair = torch.tensor([[0.0, 1, 0], [0, 0, 1]])[:, :, None, None]
    green, blue = lab(pair).split(1)
    return float(distance(green, blue) ** EXPONENT)


def flip(picture: Tensor, reference: Tensor) -> Tensor:
    """The error of each pixel, [N, 1, H, W]; both [N, 3, H, W], linear, white is 1."""
    matrix = constants(picture.device).seen
    seen = [converted(matrix, x.clamp(0, 1)) for x in (picture, reference)]
    error = distance(*(perceived(x) for x in seen)) ** EXPONENT
    knee = KNEE * largest()
    above = KNEE_ERROR + (error - knee) / (largest() - knee) * (1 - KNEE_ERROR)
    error = torch.where(error < knee, error * (KNEE_ERROR / knee), above)
    (edge, point), (edge_there, point_there) = (features(x) for x in seen)
    feature = torch.maximum((edge - edge_there).abs(), (point - point_there).abs())
    return error ** (1 - (feature / math.sqrt(2) + 1e-8).sqrt())
