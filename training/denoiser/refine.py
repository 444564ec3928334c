"""Improves weights by the metric itself: python refine.py BEGIN OUT PAIRS... [--device cuda].

train.py learns from noisy references and so has a loss of its own. Here the references are clean:
PAIRS are folders of pairs.py with `--clean`, or with scenes that are held out. The last picture of
a view is the reference, and the others are inputs. A few hundred small steps gain much, even on a
processor core with few views.

The loss of a picture is its relMSE divided by what it was with the weights at the beginning, so
that all pictures and sample counts count alike. With `--oidn` that of Open Image Denoise is the
divisor. relMSE divides by the square of the reference plus 0.01, and pictures may be dark or
bright. So there are several such floors, `FLOORS`: with the largest all pixels of a picture count
alike, as in a dark room.

Inputs of few samples learn from the reference as the weights at the beginning denoise it
(`DISTILLED`): what is left of its noise is far above what is to be learned, and the error of that
picture far below.

The renderer gives back the light that filtering has lost (`after.py`). Half of the loss is of what
that makes of the output, as far as a crop tells. FLIP has a share as well.

BEGIN and OUT are files of weights; the mean of several in BEGIN, with commas, is where it begins.
Every fifth scene is left out. What is best there, of all that was tried on the way, is written.
Scenes that are unlike those of PAIRS can become worse all the same: README.md says where.
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
from flip import flip
from network import Denoiser, features, filtered
from train import export

LEVELS = {1: 1.0, 2: 0.6, 4: 1.2, 8: 0.8, 16: 1.4, 32: 1.0, 64: 1.4, 128: 1.2, 256: 1.2}
"""Samples per pixel of inputs, and how often each is drawn; a view has three of a single sample."""
FLOORS = {0.002: 0.15, 0.01: 0.35, 0.06: 0.25, 0.8: 0.25}
"""What is added to squares of references that errors are divided by, and how much each counts.

References have a geometric mean of 0.18. To the renderer's relMSE a picture is 0.4 times to nine
times as bright.
"""
PIXEL, PICTURE = 50.0, 4.0
"""Errors of pixels and of pictures above these count by their logarithm."""
FLIP = 0.5
"""What FLIP counts, relative to relMSE. Both are relative to what they were at the beginning."""
SEEN = 8
"""Inputs of more samples are not judged by FLIP: its reference is not clean enough for them."""
DISTILLED = 4
"""Inputs of at most so many samples learn from the denoised reference."""
MOST = 2.0
"""By how much giving light back may change a pixel, as in after.py."""
LEFT_OUT = 5
"""Scenes whose numbers end so that this divides the next are left out."""
AT_ONCE = 24
"""Pictures that are denoised together to judge."""


class Pictures:
    """Noisy pictures on a device, [P, C, H, W], with those that they are to become.

    light : colour and standard error, float16
    guide : albedo and normal, uint8 as in pairs.py
    samples : samples per pixel, [P]
    last : which picture is the reference of each, [P]
    held : whether it is left out, [P]
    smooth : the reference without its noise, as far as the weights at the beginning can tell
    scale : what errors are multiplied by, [P, floors], and FLIP, [P, 1]; 0 where it does not count
    sure : whether the reference is clean enough to judge by, [P, floors]
    worth : how much is to be learned, [P]: less where the reference has most of the noise
    """

    def __init__(self, folders: "list[str]", device: str) -> None:
        lights, guides, samples, last, held, views = [], [], [], [], [], 0
        first = 0
        for path in sorted(p for f in folders for p in glob.glob(os.path.join(f, "*.npz"))):
            left_out = int(os.path.basename(path).split(".")[0]) % LEFT_OUT == LEFT_OUT - 1
            with np.load(path) as file:
                arrays = file["light"], file["guide"], file["samples"]
            for light, guide, counts in zip(*arrays):
                lights.append(torch.from_numpy(light).to(device))
                guides.append(torch.from_numpy(guide).to(device))
                samples += counts.tolist()
                last += [first + len(counts) - 1] * len(counts)
                held += [left_out] * len(counts)
                first, views = first + len(counts), views + 1
        self.device, self.views = device, views
        self.light, self.guide = torch.cat(lights), torch.cat(guides)
        self.samples = torch.tensor(samples, device=device)
        self.last = torch.tensor(last, device=device)
        self.held = torch.tensor(held, device=device)
        self.input = torch.arange(first, device=device) != self.last

    def layers(self, which: Tensor) -> "list[Tensor]":
        """Colour, albedo, normal, variance, and whether that is known."""
        light, guide = self.light[which].float(), self.guide[which].float()
        known = (self.samples[which] > 1).float()[:, None, None, None]
        albedo, normal = (guide[:, :3] / 255) ** 2, (guide[:, 3:] - 128) / 127
        return [light[:, :3], albedo, normal, light[:, 3:] ** 2, known]

    @torch.no_grad()
    def measure(self, model: Denoiser, oidn) -> None:
        """Finds `smooth`, `scale` and `sure`; `oidn`: None or a function as in evaluate.py."""
        self.smooth = torch.empty_like(self.light[:, :3])
        for which in (~self.input).nonzero()[:, 0].split(AT_ONCE):
            self.smooth[which] = run(model, self.layers(which)).half()
        self.scale = torch.ones((len(self.light), len(FLOORS) + 1), device=self.device)
        self.sure = torch.zeros(self.scale.shape, dtype=torch.bool, device=self.device)
        self.sure[:, -1] = self.samples <= SEEN
        self.worth = torch.zeros(len(self.light), device=self.device)
        for which in self.input.nonzero()[:, 0].split(AT_ONCE):
            layers = self.layers(which)
            output = run(model, layers) if oidn is None else each(oidn, layers[:3])
            error, doubt = self.errors(output, which)
            floor = torch.tensor([1e-5 * min(1.0, 0.01 / f) for f in FLOORS], device=self.device)
            self.scale[which, :-1] = 1 / torch.maximum(torch.maximum(error, 0.5 * doubt), floor)
            noticed = flip(output, self.smooth[self.last[which]].float()).mean((1, 2, 3))
            self.scale[which, -1] = (self.samples[which] <= SEEN) / noticed.clamp(min=0.01)
            share = (error / (error + 0.5 * doubt)).mean(1)
            self.worth[which] = share.nan_to_num(0.0, 0.0, 0.0).clamp(0.1, 1.0)
            self.sure[which, :-1] = (error > doubt) & (error > 2 * floor)

    def errors(self, output: Tensor, which: Tensor) -> "tuple[Tensor, Tensor]":
        """relMSE less what the reference's own noise has of it, and that noise; [N, floors]."""
        last = self.last[which]
        reference, smooth = self.light[last].float(), self.smooth[last].float()
        doubt = reference[:, 3:] ** 2
        square = (output - reference[:, :3]) ** 2
        mean = lambda x, floor: (x / (smooth**2 + floor)).mean((1, 2, 3))
        noise = torch.stack([mean(doubt, floor) for floor in FLOORS], 1)
        return torch.stack([mean(square, floor) for floor in FLOORS], 1) - noise, noise

    def often(self) -> Tensor:
        """How often each picture is drawn; 0 for what is left out."""
        weight = torch.zeros(len(self.samples), device=self.device)
        for count, often in LEVELS.items():
            weight += often * (self.samples == count)
        return weight * self.worth * (self.input & ~self.held)


def each(oidn, layers: "list[Tensor]") -> Tensor:
    """Denoises pictures one by one with arrays [H, W, 3]."""
    found = []
    for parts in zip(*layers):
        arrays = [np.ascontiguousarray(x.permute(1, 2, 0).cpu().numpy()) for x in parts]
        found.append(torch.from_numpy(oidn(*arrays)).permute(2, 0, 1))
    return torch.stack(found).to(layers[0].device)


def soft(x: Tensor, most: float) -> Tensor:
    return torch.where(x < most, x, most * (1 + (x.clamp(min=most) / most).log()))


def batch(pictures: Pictures, often: Tensor, count: int, size: int) -> "list[Tensor]":
    """Random crops, turned, mirrored, with other colours, brightness and axes of normals.

    Some have no albedo, no normals or no variance. Returns what the network sees, the reference,
    its variance, the reference without noise, and `scale`.
    """
    device = pictures.device
    which = torch.multinomial(often, count, replacement=True)
    last = pictures.last[which]
    height, width = pictures.light.shape[2:]
    y, x = (int(torch.randint(0, n - size + 1, ())) for n in (height, width))
    color, albedo, normal, variance, known = pictures.layers(which)
    reference = pictures.light[last].float()
    layers = [color, albedo, normal, variance, reference[:, :3], reference[:, 3:] ** 2]
    layers.append(pictures.smooth[last].float())
    mirrored = [axis for axis in (2, 3) if torch.rand(()) < 0.5]
    turned, order = bool(torch.rand(()) < 0.5), torch.randperm(3).to(device)
    layers = [z[:, :, y : y + size, x : x + size].flip(mirrored) for z in layers]
    layers = [z.transpose(2, 3).contiguous() if turned else z for z in layers]
    some = lambda share: (torch.rand((count, 1, 1, 1), device=device) >= share).float()
    normal = torch.einsum("nij,njhw->nihw", random_rotations(count, device), layers[2])
    ordered = (layers[i][:, order] for i in (0, 1, 3, 4, 5, 6))
    color, albedo, variance, reference, doubt, smooth = ordered
    gain = torch.exp(0.3 * torch.randn((count, 1, 1, 1), device=device))
    gain = gain * torch.exp(0.1 * torch.randn((count, 3, 1, 1), device=device))
    inputs = [color * gain, albedo * some(0.03), normal * some(0.03), variance * gain**2]
    few = (pictures.samples[which] <= DISTILLED)[:, None, None, None]
    reference, doubt = torch.where(few, smooth, reference), torch.where(few, 0.0, doubt)
    targets = [reference * gain, doubt * gain**2, smooth * gain, pictures.scale[which]]
    return [*inputs, known * some(0.06), *targets]


def run(model: Denoiser, inputs: "list[Tensor]") -> Tensor:
    """As `Denoiser.forward`, but in 32 bits."""
    seen = features(*inputs).contiguous(memory_format=torch.channels_last)
    return filtered(inputs[0], inputs[1], model.heads(seen))


def given_back(output: Tensor, mean: Tensor) -> Tensor:
    """As `after.restored` for a picture without variances: each pixel has a share of what is
    missing in the mean, [N, 3, 1, 1], by the square of its value."""
    share = output.detach() ** 2
    share = share / share.mean((2, 3), True).clamp(min=1e-12)
    more = output + (mean - output.mean((2, 3), True)) * share
    return torch.minimum(torch.maximum(more, output / MOST), output * MOST)


def loss_of(model: Denoiser, values: "list[Tensor]") -> Tensor:
    reference, doubt, smooth, scale = values[5:]
    output = run(model, values[:5])
    restored = given_back(output, reference.mean((2, 3), True))
    total = FLIP * (flip(restored, smooth).mean((1, 2, 3)) * scale[:, -1]).mean()
    for picture in (output, restored):
        difference = (picture - reference) ** 2 - doubt
        for i, (floor, share) in enumerate(FLOORS.items()):
            error = soft(difference / (smooth**2 + floor), PIXEL).mean((1, 2, 3))
            total = total + 0.5 * share * soft(error * scale[:, i], PICTURE).mean()
    return total


class Slopes:
    """Leaves the slopes of the loss in the parameters' `grad`; on a GPU as `train.Slopes`."""

    def __init__(self, model: Denoiser) -> None:
        self.model, self.graph = model, None

    def __call__(self, values: "list[Tensor]") -> Tensor:
        """Returns the loss."""
        if not values[0].is_cuda:
            return self._run(values)
        if self.graph is None:
            self.values, self.graph = values, torch.cuda.CUDAGraph()
            aside = torch.cuda.Stream()
            aside.wait_stream(torch.cuda.current_stream())
            with torch.cuda.stream(aside):
                for _ in range(3):
                    self._run(values)
            torch.cuda.current_stream().wait_stream(aside)
            with torch.cuda.graph(self.graph):
                self.loss = self._run(values)
        torch._foreach_copy_(self.values, values)
        self.graph.replay()
        return self.loss

    def _run(self, values: "list[Tensor]") -> Tensor:
        self.model.zero_grad(set_to_none=True)
        loss = loss_of(self.model, values)
        loss.backward()
        for parameter in self.model.parameters():
            parameter.grad.nan_to_num_(0.0, 0.0, 0.0)
        return loss.detach()


@torch.no_grad()
def judged(model: Denoiser, pictures: Pictures) -> "tuple[float, str]":
    """The mean of the ratios on what is left out, geometric: of relMSE, and of FLIP as `FLIP` says.

    Light has been given back. The text has the means of sample counts, floors and FLIP.
    """
    chosen = (pictures.input & pictures.held).nonzero()[:, 0]
    logs = []
    for which in chosen.split(AT_ONCE):
        layers = pictures.layers(which)
        output = given_back(run(model, layers), layers[0].mean((2, 3), True))
        error, _ = pictures.errors(output, which)
        noticed = flip(output, pictures.smooth[pictures.last[which]].float()).mean((1, 2, 3))
        ratio = torch.cat([error, noticed[:, None]], 1) * pictures.scale[which]
        logs.append(ratio.clamp(min=0.2, max=20).log())
    logs, sure, samples = torch.cat(logs), pictures.sure[chosen], pictures.samples[chosen]
    mean = lambda x, those: float((x * those).sum() / those.sum().clamp(min=1))
    shares = torch.tensor([*FLOORS.values(), 0.0], device=logs.device)
    parts = []
    for count in sorted(set(samples.tolist())):
        here = sure & (samples == count)[:, None]
        parts.append(f"{count}: {math.exp(mean(logs, here * shares)):.3f}")
    columns = [f"{math.exp(mean(logs[:, i], sure[:, i])):.3f}" for i in range(len(shares))]
    relative, noticed = mean(logs, sure * shares), mean(logs[:, -1], sure[:, -1])
    ratio = math.exp((relative + FLIP * noticed) / (1 + FLIP))
    floors = f"floors {' '.join(columns[:-1])}; FLIP {columns[-1]}"
    return ratio, f"relMSE {math.exp(relative):.4f}: {', '.join(parts)}; {floors}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("begin", help="weights to begin with")
    parser.add_argument("out", help="the file to write")
    parser.add_argument("pairs", nargs="+", help="folders of pairs.py")
    parser.add_argument("--oidn", help="libOpenImageDenoise.so.2, for the divisor")
    parser.add_argument("--measure", help="weights that errors are relative to, if not the first")
    parser.add_argument("--minutes", type=float, default=15)
    parser.add_argument("--steps", type=int, help="stop after so many, if not the minutes before")
    parser.add_argument("--rate", type=float, default=1.5e-4)
    parser.add_argument("--decay", type=float, default=0.0, help="of the weights")
    parser.add_argument("--batch", type=int, default=6)
    parser.add_argument("--size", type=int, default=128, help="side of the crops")
    parser.add_argument("--average", type=float, default=0.98, help="decay of the mean of weights")
    parser.add_argument("--judge-seconds", type=float, default=120)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    torch.manual_seed(args.seed)
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True
    torch.backends.cudnn.benchmark = True

    def opened(paths: str) -> Denoiser:
        files = [load_file(path) for path in paths.split(",")]
        model = Denoiser()
        model.load_state_dict({n: sum(f[n].float() for f in files) / len(files) for n in files[0]})
        return model.to(args.device).to(memory_format=torch.channels_last)

    oidn = None
    if args.oidn:
        from evaluate import OpenImageDenoise

        oidn = OpenImageDenoise(args.oidn)
    begin = time.monotonic()
    pictures = Pictures(args.pairs, args.device)
    pictures.measure(opened(args.measure or args.begin), oidn)
    often, model, shadow = pictures.often(), opened(args.begin), opened(args.begin)
    best, text = judged(model, pictures)
    kept = {name: value.clone() for name, value in model.state_dict().items()}
    seconds = time.monotonic() - begin
    learned = int((often > 0).sum())
    print(f"{pictures.views} views, {learned} pictures, {seconds:.0f} s", flush=True)
    print(f"{best:.4f}  {text}", flush=True)
    optimiser = torch.optim.AdamW(
        model.parameters(), lr=args.rate, betas=(0.9, 0.98), weight_decay=args.decay
    )
    slopes, loss = Slopes(model), torch.zeros((), device=args.device)
    mean = [value for value in shadow.state_dict().values()]
    begin = shown = time.monotonic()
    step = 0

    def look() -> None:
        """Keeps the mean of the last weights if it is the best so far."""
        nonlocal best, kept
        ratio, text = judged(shadow, pictures)
        if ratio < best:
            best, kept = ratio, {name: value.clone() for name, value in shadow.state_dict().items()}
            export(kept, args.out)
        seconds = time.monotonic() - begin
        print(f"{seconds:.0f} s  step {step}  {float(loss):.3f}  {ratio:.4f}  {text}", flush=True)

    def passed() -> float:
        """The part of the run that is over."""
        by_time = (time.monotonic() - begin) / max(60 * args.minutes, 1e-9)
        return max(by_time, step / args.steps) if args.steps else by_time

    while (progress := passed()) < 1:
        values = batch(pictures, often, args.batch, args.size)
        fresh = slopes(values)
        cosine = 0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * progress))
        for group in optimiser.param_groups:
            group["lr"] = args.rate * min(1.0, (step + 1) / 40) * cosine
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimiser.step()
        step += 1
        with torch.no_grad():
            loss = fresh.clone() if step == 1 else loss.lerp(fresh, 0.03)
            decay = min(args.average, step / (step + 10))
            torch._foreach_lerp_(mean, list(model.state_dict().values()), 1 - decay)
        if time.monotonic() - shown > args.judge_seconds:
            look()
            shown = time.monotonic()
    if step:
        look()
    export(kept, args.out)
    print(f"{step} steps, left out {best:.4f}")


if __name__ == "__main__":
    main()
