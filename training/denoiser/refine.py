"""Improves weights by the metric itself: python refine.py BEGIN OUT PAIRS --oidn LIBRARY.

train.py learns from noisy references and so has a loss of its own. Here the references are clean:
PAIRS is a folder of pairs.py with scenes that are held out, whose last picture has 512 samples.
The loss of a picture is its relMSE divided by that of Open Image Denoise, so that all pictures and
sample counts count alike. A few hundred small steps do, and a processor core is enough.

BEGIN and OUT are files of weights; the mean of several in BEGIN, with commas, is where it begins.
Every sixth scene is left out and judges the result.
"""

import argparse
import glob
import math
import os
import time

import numpy as np
import torch
from safetensors.torch import load_file
from torch import Tensor

from data import random_rotations
from evaluate import OpenImageDenoise
from network import Denoiser, features, filtered
from train import export

PICTURES = (0, 1, 2, 3)
"""Of 1, 4, 16 and 64 samples; the last picture of a view is the reference."""
HARDLY_ANY = 2e-5
"""Where Open Image Denoise leaves less than this, the reference is not clean enough to tell."""
PIXEL, PICTURE = 50.0, 4.0
"""Errors of pixels and of pictures above these count by their logarithm."""


class Example:
    """A noisy picture, [3, H, W] each, with its reference and the variance of that."""

    def __init__(self, light: np.ndarray, guide: np.ndarray, samples: np.ndarray, k: int) -> None:
        image = lambda x: torch.from_numpy(x.astype(np.float32))
        self.color, self.variance = image(light[k, :3]), image(light[k, 3:]) ** 2
        self.albedo = (image(guide[k, :3]) / 255) ** 2
        self.normal = (image(guide[k, 3:]) - 128) / 127
        self.reference, self.doubt = image(light[-1, :3]), image(light[-1, 3:]) ** 2
        self.known = torch.full((1, 1, 1), float(samples[k] > 1))
        self.scale = 1.0

    def layers(self) -> "list[Tensor]":
        return [self.color, self.albedo, self.normal, self.variance, self.reference, self.doubt]


def errors(output: Tensor, reference: Tensor, doubt: Tensor) -> Tensor:
    """What relMSE is the mean of, less what the reference's own noise has of it."""
    return ((output - reference) ** 2 - doubt) / (reference**2 + 0.01)


def soft(x: Tensor, most: float) -> Tensor:
    return torch.where(x < most, x, most * (1 + (x.clamp(min=most) / most).log()))


def examples(folder: str, oidn: OpenImageDenoise) -> "tuple[list[Example], list[Example]]":
    """Those to learn from, and those to judge by."""
    found: "tuple[list[Example], list[Example]]" = ([], [])
    for path in sorted(glob.glob(os.path.join(folder, "*.npz"))):
        last = int(os.path.basename(path).split(".")[0]) % 6 == 5
        with np.load(path) as file:
            light, guide, samples = file["light"], file["guide"], file["samples"]
        for view in range(len(light)):
            for k in PICTURES:
                example = Example(light[view], guide[view], samples[view], k)
                last_axis = lambda x: np.ascontiguousarray(x.permute(1, 2, 0).numpy())
                inputs = map(last_axis, (example.color, example.albedo, example.normal))
                theirs = torch.from_numpy(oidn(*inputs)).permute(2, 0, 1)
                error = float(errors(theirs, example.reference, example.doubt).mean())
                if error > HARDLY_ANY:
                    example.scale = 1 / error
                    found[last].append(example)
    return found


def batch(pool: "list[Example]", count: int, size: int) -> "tuple[list[Tensor], Tensor, Tensor]":
    """Random crops, turned, mirrored, with other colours, brightness and axes of normals."""
    chosen = [pool[i] for i in torch.randint(0, len(pool), (count,)).tolist()]
    crops = []
    for example in chosen:
        height, width = example.color.shape[1:]
        y, x = (int(torch.randint(0, n - size + 1, ())) for n in (height, width))
        crops.append([layer[:, y : y + size, x : x + size] for layer in example.layers()])
    mirrored = [axis for axis in (2, 3) if torch.rand(()) < 0.5]
    turned, order = bool(torch.rand(()) < 0.5), torch.randperm(3)
    layers = [torch.stack(layer).flip(mirrored) for layer in zip(*crops)]
    layers = [layer.transpose(2, 3).contiguous() if turned else layer for layer in layers]
    normal = torch.einsum("nij,njhw->nihw", random_rotations(count, layers[2].device), layers[2])
    color, albedo, _, variance, reference, doubt = (layer[:, order] for layer in layers)
    gain = torch.exp(0.3 * torch.randn(count, 1, 1, 1))
    known = torch.stack([example.known for example in chosen])
    scale = torch.tensor([example.scale for example in chosen])
    inputs = [color * gain, albedo, normal, variance * gain**2, known]
    return inputs, torch.stack([reference * gain, doubt * gain**2]), scale


def run(model: Denoiser, inputs: "list[Tensor]") -> Tensor:
    """As `Denoiser.forward`, but in 32 bits."""
    return filtered(inputs[0], inputs[1], model.heads(features(*inputs)))


@torch.no_grad()
def judged(model: Denoiser, pool: "list[Example]") -> float:
    """The geometric mean of the ratios to Open Image Denoise."""
    logs = []
    for x in pool:
        inputs = [y[None] for y in (x.color, x.albedo, x.normal, x.variance, x.known)]
        ratio = errors(run(model, inputs)[0], x.reference, x.doubt).mean() * x.scale
        logs.append(float(ratio.clamp(min=0.01).log()))
    return math.exp(np.mean(logs))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("begin", help="weights to begin with")
    parser.add_argument("out", help="the file to write")
    parser.add_argument("pairs", help="a folder of pairs.py")
    parser.add_argument("--oidn", required=True, help="libOpenImageDenoise.so.2")
    parser.add_argument("--minutes", type=float, default=15)
    parser.add_argument("--rate", type=float, default=1.5e-4)
    parser.add_argument("--batch", type=int, default=6)
    parser.add_argument("--size", type=int, default=128, help="side of the crops")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    torch.manual_seed(args.seed)
    learned, left_out = examples(args.pairs, OpenImageDenoise(args.oidn))
    files = [load_file(path) for path in args.begin.split(",")]
    model = Denoiser()
    model.load_state_dict({n: sum(f[n].float() for f in files) / len(files) for n in files[0]})
    print(f"{len(learned)} pictures, left out {judged(model, left_out):.3f}", flush=True)
    average = {name: value.clone() for name, value in model.state_dict().items()}
    optimiser = torch.optim.Adam(model.parameters(), lr=args.rate, betas=(0.9, 0.98))
    begin, step, losses = time.monotonic(), 0, []
    while (progress := (time.monotonic() - begin) / (60 * args.minutes)) < 1:
        inputs, (reference, doubt), scale = batch(learned, args.batch, args.size)
        error = soft(errors(run(model, inputs), reference, doubt), PIXEL).mean((1, 2, 3))
        loss = soft(error * scale, PICTURE).mean()
        cosine = 0.03 + 0.97 * 0.5 * (1 + math.cos(math.pi * progress))
        for group in optimiser.param_groups:
            group["lr"] = args.rate * min(1.0, (step + 1) / 20) * cosine
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimiser.step()
        step += 1
        losses.append(float(loss.detach()))
        with torch.no_grad():
            values = list(model.state_dict().values())
            torch._foreach_lerp_(list(average.values()), values, 1 - min(0.98, step / (step + 10)))
        if step % 20 == 0:
            seconds = 60 * args.minutes * progress
            print(f"{seconds:.0f} s  step {step}  {np.mean(losses[-40:]):.3f}", flush=True)
    model.load_state_dict(average)
    export(average, args.out)
    print(f"{step} steps, left out {judged(model, left_out):.3f}")


if __name__ == "__main__":
    main()
