"""Makes the test case that the Rust inference is compared with: `python golden.py OUTPUT.safetensors`.

Weights are pseudo-random, and the test makes them again, so the file has only a small picture and
its results.
"""

import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 40, 24


def splitmix64(x: np.ndarray) -> np.ndarray:
    """The generator SplitMix64 as a hash of 64-bit integers."""
    with np.errstate(over="ignore"):
        z = x + np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def uniform(tensor: int, count: int) -> np.ndarray:
    """The first `count` numbers of tensor number `tensor`, in [-1, 1)."""
    place = np.uint64(tensor << 32) | np.arange(count, dtype=np.uint64)
    return (splitmix64(place) >> np.uint64(40)).astype(np.float64) / 2**24 * 2 - 1


def weights(layers: "dict[str, tuple[int, int, int]]") -> "dict[str, np.ndarray]":
    """Weights of layers, which are given as inputs, outputs and size, in the specification's order."""
    tensors: "dict[str, np.ndarray]" = {}
    for name, (inputs, outputs, size) in layers.items():
        deviation = np.sqrt(6.0 / (inputs * size * size))
        shape = (outputs, inputs, size, size)
        for part, shape, factor in (("weight", shape, deviation), ("bias", shape[:1], 0.1 * deviation)):
            values = uniform(len(tensors), int(np.prod(shape))) * factor
            tensors[f"{name}.{part}"] = values.astype(np.float32).astype(np.float16).reshape(shape)
    return tensors


def picture() -> "dict[str, np.ndarray]":
    """A picture of 16-bit floats, [3, HEIGHT, WIDTH] each: two textures, noise, a few bright pixels."""
    random = np.random.default_rng(7)
    shape = (3, HEIGHT, WIDTH)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    base = np.stack([0.5 + 0.4 * np.sin(x * 0.2), 0.3 + 0.2 * np.cos(y * 0.15), 0.2 + 0.1 * np.sin(x + y)])
    color = base * random.gamma(0.5, 2.0, shape) * 3.0
    color[:, 10, 20] = 500.0
    albedo = np.clip(base + 0.1 * random.standard_normal(shape), 0.0, 1.0)
    albedo[:, :10, :15] = 0.0
    normal = random.standard_normal(shape)
    normal *= 0.9 / np.linalg.norm(normal, axis=0)
    variance = base * base * random.gamma(1.0, 1.0, shape) * 0.3
    layers = {"color": color, "albedo": albedo, "normal": normal, "variance": variance}
    return {name: values.astype(np.float16) for name, values in layers.items()}


def main() -> None:
    import torch
    from network import CONVOLUTIONS, HEADS, Denoiser, denoise
    from safetensors.numpy import save_file

    layers = {name: (*sides, 3) for name, sides in CONVOLUTIONS.items()}
    layers |= {name: (*sides, 1) for name, sides in HEADS.items()}
    model = Denoiser().eval()
    model.load_state_dict({k: torch.from_numpy(v).float() for k, v in weights(layers).items()})
    tensors = picture()
    inputs = [torch.from_numpy(values).float()[None] for values in tensors.values()]
    with torch.no_grad():
        tensors["output"] = denoise(model, *inputs)[0].numpy()
        tensors["output_unknown"] = denoise(model, *inputs[:3], None)[0].numpy()
    save_file(tensors, Path(sys.argv[1]))


if __name__ == "__main__":
    main()
