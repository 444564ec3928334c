"""Trains the denoiser: python train.py OUT PAIRS... --minutes 20 [--resume OUT/checkpoint.pt].

On several GPUs: torchrun --nproc-per-node 4 train.py ...; each has a part of the scenes.

Every minute OUT/checkpoint.pt is written, with all that is needed to go on, and at the end
OUT/denoiser.safetensors, the weights that are committed.
"""

import argparse
import json
import math
import os
import time

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, distributed
from torch.nn import functional as F

import data
from data import Batch, Views
from network import CONVOLUTIONS, HEADS, Denoiser

FLOOR = 0.01
"""Added to squares of radiance that errors are divided by, as in the renderer's relMSE."""
CAP = 0.5
"""Relative errors above this and six deviations of the reference count by their size only."""


def gradients(x: Tensor) -> "tuple[Tensor, Tensor]":
    return x[..., 1:] - x[..., :-1], x[..., 1:, :] - x[..., :-1, :]


def capped(x: Tensor, limit: Tensor) -> Tensor:
    """The square of values, linear above `limit`; the mean for each picture, [N]."""
    size = x.abs()
    squares = torch.where(size < limit, size**2, limit * (2 * size - limit))
    return squares.mean((1, 2, 3))


def divisor(reference: Tensor) -> Tensor:
    """What squared errors are divided by, [N, 3, h, w]: the square of what a pixel may show.

    That is its own value, as far as the means of squares of 5×5 pixels that it is in have such
    values. So noise hardly counts, and a pixel beside a lamp is as dark as it is: a mean around it
    would have the lamp in it and hide the halo that a filter leaves there.
    """
    means = F.avg_pool2d(reference, 5, 1, 2, count_include_pad=False)
    least, most = -F.max_pool2d(-means, 5, 1, 2), F.max_pool2d(means, 5, 1, 2)
    return torch.minimum(torch.maximum(reference, least), most) ** 2 + FLOOR


def losses(output: Tensor, batch: Batch) -> "tuple[Tensor, Tensor]":
    """One loss for each picture, and what it would be without the references' own noise, [N] each.

    The mean of a reference's noise is zero, so the expected squared error is least where the
    output is the mean of all pictures that there could be. That holds for sums of squares with
    weights that do not depend on the noise, and for no other loss: no logarithms, no absolute
    values. So the difference from each reference is divided by what the other one shows, which is
    independent of it, and single pixels are capped only where they are far above the noise.

    There are errors of pixels, of means of 4×4 and 16×16, where noise hides less, and of edges.
    Pictures of little noise have more weight: what counts is by which factor noise is reduced.

    The mean of the product of both differences is nearly the square of the output's error alone,
    since the noise of one reference knows nothing of that of the other.
    """
    (one, other), samples = batch.references, batch.reference_samples
    total = noise = 0.0
    product = torch.ones_like(output)
    for i, (reference, elsewhere) in enumerate(((one, other), (other, one))):
        share = samples[i] / (samples[0] + samples[1])
        with torch.no_grad():
            scale = divisor(elsewhere)
            doubt = (batch.doubts[i] / scale).clamp(max=10.0).mean((1, 2, 3))
            limit = (CAP + 6 * doubt.sqrt())[:, None, None, None]
            # The film says it of the reference; the input has other samples.
            noise = noise + share * doubt * samples[i] / batch.samples
        difference = output - reference
        relative = difference / scale.sqrt()
        errors = capped(relative, limit)
        for side, part in ((4, 1.0), (16, 2.0)):
            means = F.avg_pool2d(difference, side) / F.avg_pool2d(scale, side).sqrt()
            errors = errors + part * capped(means, 0.25 + limit / side)
        for edges in gradients(relative):
            errors = errors + 0.1 * capped(edges, 1.5 * limit)
        total = total + share * errors
        product = product * torch.minimum(torch.maximum(relative.detach(), -limit), limit)
    weight = (noise + 1e-3) ** -0.7
    return total * weight, product.mean((1, 2, 3)) * weight


class Balance:
    """Weights of the sample counts: each counts by its relative, not its absolute error."""

    def __init__(self, device: str) -> None:
        self.mean = torch.full((9,), 0.05, device=device)

    def weights(self, samples: Tensor, loss: Tensor) -> Tensor:
        """`samples` [N]: of the inputs; `loss` [N]: their errors without those of references."""
        with torch.no_grad():
            level = samples.log2().round().long().clamp(0, len(self.mean) - 1)
            sums = torch.zeros_like(self.mean).index_add_(0, level, loss)
            counts = torch.zeros_like(self.mean).index_add_(0, level, torch.ones_like(loss))
            fresh = torch.where(counts > 0, sums / counts.clamp(min=1), self.mean)
            self.mean.lerp_(fresh, 0.01)
            weights = self.mean.clamp(min=0.1 * self.mean.mean().clamp(min=1e-6)) ** -0.6
            return (weights / weights.mean())[level]


def rel_mse(output: Tensor, batch: Batch) -> Tensor:
    """As the renderer's `metrics::rel_mse`, for each picture, less the reference's own error."""
    reference = batch.references[0]
    squares = (output - reference) ** 2 - batch.doubts[0]
    return (squares / (reference**2 + 0.01)).mean((1, 2, 3))


@torch.no_grad()
def validate(model: Denoiser, views: Views) -> "dict[int, list[float]]":
    """relMSE before and after, the geometric mean over held-out views, for each sample count."""
    model.eval()
    result = {}
    if len(views) == 0:
        return result
    device, side = views.light.device, views.light.shape[3]
    for level, spp in enumerate(data.PLANS["held out"][:-1]):
        logs = []
        for first in range(0, len(views), 16):
            which = list(range(first, min(first + 16, len(views))))
            zero = [0] * len(which)
            pick = lambda k: F.one_hot(torch.tensor([k] * len(which), device=device), 6).float()
            chosen = (pick(level), pick(5), pick(5))
            batch = data.crops(views, which, chosen, zero, zero, side)
            output = model(batch.color, batch.albedo, batch.normal, batch.variance, batch.known)
            pair = [rel_mse(x, batch).clamp(min=1e-5).log() for x in (batch.color, output)]
            logs.append(torch.stack(pair, 1))
        result[spp] = torch.cat(logs).mean(0).exp().tolist()
    model.train()
    return result


def export(state: "dict[str, Tensor]", path: str) -> None:
    """The weights as 16-bit floats, in the order of the layers."""
    names = [f"{layer}.{part}" for layer in [*CONVOLUTIONS, *HEADS] for part in ("weight", "bias")]
    save_file({name: state[name].half().contiguous().cpu() for name in names}, path)


class Slopes:
    """The slopes of the loss of a batch, which are left in the parameters' `grad`.

    To launch the thousand operations of a step takes longer than to do them. So they are recorded
    once on a GPU, and then done again with other values in the same memory.
    """

    def __init__(self, model: Denoiser, balance: Balance) -> None:
        self.model, self.balance = model, balance
        self.graph: "torch.cuda.CUDAGraph | None" = None

    def __call__(self, batch: Batch) -> Tensor:
        """Returns the loss."""
        if not batch.color.is_cuda:
            return self._run(batch)
        if self.graph is None:
            self._record(batch)
        for kept, fresh in zip(self.batch.tensors(), batch.tensors()):
            kept.copy_(fresh)
        self.graph.replay()
        return self.loss

    def _run(self, batch: Batch) -> Tensor:
        self.model.zero_grad(set_to_none=True)
        output = self.model(batch.color, batch.albedo, batch.normal, batch.variance, batch.known)
        loss, clean = losses(output, batch)
        total = (self.balance.weights(batch.samples, clean) * loss).mean()
        total.backward()
        return total.detach()

    def _record(self, batch: Batch) -> None:
        self.batch, self.graph = batch, torch.cuda.CUDAGraph()
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):
            for _ in range(3):
                self._run(batch)
        torch.cuda.current_stream().wait_stream(aside)
        # Other threads, as those of NCCL, may go on with what must not be recorded.
        with torch.cuda.graph(self.graph, capture_error_mode="thread_local"):
            self.loss = self._run(batch)


class Team:
    """The processes that train together, one for each GPU."""

    def __init__(self, device: str) -> None:
        self.size = int(os.environ.get("WORLD_SIZE", 1))
        self.rank = int(os.environ.get("RANK", 0))
        self.device = f"cuda:{self.rank}" if device == "cuda" else device
        if device == "cuda":
            torch.cuda.set_device(self.rank)
        if self.size > 1:
            distributed.init_process_group("nccl" if device == "cuda" else "gloo")

    def average(self, tensors: "list[Tensor]") -> None:
        """Replaces tensors by their means over all processes, and what is no number by 0."""
        flat = torch.cat([x.reshape(-1) for x in tensors])
        if self.size > 1:
            distributed.all_reduce(flat)
        flat = (flat / self.size).nan_to_num_(0.0, 0.0, 0.0)
        parts = flat.split([x.numel() for x in tensors])
        torch._foreach_copy_(tensors, [part.view_as(x) for part, x in zip(parts, tensors)])

    def agreed(self, value: float) -> float:
        """What the first process says."""
        if self.size == 1:
            return value
        told = torch.tensor([value], device=self.device, dtype=torch.float64)
        distributed.broadcast(told, 0)
        return float(told)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", help="folder to write")
    parser.add_argument("pairs", nargs="+", help="folders of pairs.py")
    parser.add_argument("--minutes", type=float, default=20, help="how long this run may take")
    parser.add_argument("--steps", type=int, help="stop after so many, for tests")
    parser.add_argument("--total", type=float, help="minutes of all runs, for the schedule")
    parser.add_argument("--resume", help="a checkpoint to go on from")
    parser.add_argument("--begin", help="weights to begin with, a safetensors file")
    parser.add_argument("--batch", type=int, default=28, help="crops of a step, for each GPU")
    parser.add_argument("--size", type=int, default=192, help="side of the crops, a multiple of 32")
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    team = Team(args.device)
    device, first = team.device, team.rank == 0
    torch.backends.cuda.matmul.allow_tf32 = True
    torch.backends.cudnn.benchmark = True
    os.makedirs(args.out, exist_ok=True)
    begin = time.monotonic()
    scenes = data.Scenes(args.pairs, device, team.rank, team.size)
    views = scenes.views

    def refresh() -> Tensor:
        """Takes up new scenes; returns how often each view is drawn."""
        scenes.refresh()
        most = views.samples.amax(1)
        # Views of many samples are few.
        return (1.0 + 0.5 * (most >= 64).float() + 0.5 * (most >= 256).float()).cpu()

    weights = refresh()
    print(f"GPU {team.rank}: {len(views)} views, {time.monotonic() - begin:.0f} s", flush=True)
    torch.manual_seed(args.seed)
    model = Denoiser().to(device).to(memory_format=torch.channels_last)
    torch.manual_seed(args.seed + team.rank)
    average = {name: value.clone() for name, value in model.state_dict().items()}
    optimiser = torch.optim.AdamW(
        model.parameters(), lr=args.rate, betas=(0.9, 0.99), weight_decay=1e-4
    )
    balance = Balance(device)
    step, spent = 0, 0.0
    if args.begin:
        model.load_state_dict({name: x.float() for name, x in load_file(args.begin).items()})
        average = {name: value.clone() for name, value in model.state_dict().items()}
    if args.resume:
        stored = torch.load(args.resume, map_location=device)
        model.load_state_dict(stored["model"])
        optimiser.load_state_dict(stored["optimiser"])
        average, balance.mean = stored["average"], stored["balance"]
        step, spent = stored["step"], stored["seconds"]
    total = 60 * (args.total or args.minutes + spent / 60)
    slopes = Slopes(model, balance)
    log = open(os.path.join(args.out, "log.jsonl"), "a") if first else None
    begun, shown, written, refreshed = step, *[time.monotonic()] * 3
    seconds = team.agreed(time.monotonic() - begin)

    def keep() -> None:
        stored = {
            "model": model.state_dict(), "optimiser": optimiser.state_dict(), "average": average,
            "balance": balance.mean, "step": step, "seconds": spent + time.monotonic() - begin,
        }
        path = os.path.join(args.out, "checkpoint.pt")
        torch.save(stored, path + ".tmp")
        os.replace(path + ".tmp", path)
        export(average, os.path.join(args.out, "denoiser.safetensors"))

    def judge() -> "dict[int, list[float]]":
        judged = Denoiser().to(device)
        judged.load_state_dict({n: v.half().float() for n, v in average.items()})
        return validate(judged, scenes.held_out)

    while seconds < 60 * args.minutes and (args.steps is None or step - begun < args.steps):
        progress = min((spent + seconds) / total, 1.0)
        cosine = 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * progress))
        for group in optimiser.param_groups:
            group["lr"] = args.rate * min(1.0, (step - begun + 1) / 300) * cosine
        batch = data.random_batch(views, args.batch, args.size, weights)
        loss = slopes(batch)
        team.average([p.grad for p in model.parameters()])
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0, error_if_nonfinite=False)
        optimiser.step()
        step += 1
        decay = min(0.999, step / (step + 10))
        with torch.no_grad():
            values = list(model.state_dict().values())
            torch._foreach_lerp_(list(average.values()), values, 1 - decay)
        if step % 20 == 0:
            seconds = team.agreed(time.monotonic() - begin)
        if step % 100 == 0 and time.monotonic() - refreshed > 20:
            weights, refreshed = refresh(), time.monotonic()
        if step % 100 == 0:
            value = float(loss)
            if not math.isfinite(value):
                raise SystemExit(f"the loss is {value} at step {step}; the last checkpoint stands")
        if first and time.monotonic() - shown > 20:
            shown = time.monotonic()
            print(
                f"{seconds:6.0f} s  step {step}  views {len(views)}  loss {float(loss):.4f}  "
                f"balance {[round(x, 3) for x in balance.mean.tolist()]}",
                flush=True,
            )
        if first and time.monotonic() - written > 60:
            written = time.monotonic()
            keep()
            errors = judge()
            line = {"step": step, "seconds": spent + seconds, "relmse": errors}
            print(json.dumps(line), file=log, flush=True)
            print("   ", {spp: f"{a:.3g}>{b:.3g}" for spp, (a, b) in errors.items()}, flush=True)
    if first:
        keep()
        errors = judge()
        print(json.dumps({"step": step, "relmse": errors}), file=log, flush=True)
        shown = {spp: f"{a:.4g}>{b:.4g}" for spp, (a, b) in errors.items()}
        print("final", step, shown, flush=True)
    if team.size > 1:
        distributed.barrier()
        distributed.destroy_process_group()


if __name__ == "__main__":
    main()
