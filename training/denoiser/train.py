"""Trains the denoiser: python train.py OUT PAIRS... --minutes 20 [--resume OUT/checkpoint.pt].

Every few minutes OUT/checkpoint.pt is written, with all that is needed to go on, and at the end
OUT/denoiser.safetensors, the weights that are committed.
"""

import argparse
import json
import math
import os
import time

import torch
from safetensors.torch import save_file
from torch import Tensor
from torch.nn import functional as F

import data
from data import Batch, Views
from network import CONVOLUTIONS, HEADS, Denoiser, compressed


def gradients(x: Tensor) -> "tuple[Tensor, Tensor]":
    return x[..., 1:] - x[..., :-1], x[..., 1:, :] - x[..., :-1, :]


def losses(output: Tensor, reference: Tensor) -> Tensor:
    """One loss for each picture, [N].

    The difference on a logarithmic scale, that of its gradients, and the relative squared error,
    linear where it is large, so that single pixels do not outweigh the rest.
    """
    mean = lambda x: x.mean((1, 2, 3))
    ours, theirs = compressed(output), compressed(reference)
    tone = mean((ours - theirs).abs())
    edges = sum(mean((a - b).abs()) for a, b in zip(gradients(ours), gradients(theirs)))
    brightness = reference.mean(1, True)
    relative = (output - reference) / (brightness**2 + 0.01).sqrt()
    squared = mean(F.huber_loss(relative, torch.zeros_like(relative), delta=1.0, reduction="none"))
    return tone + 0.5 * edges + squared


class Balance:
    """Weights of the sample counts: each counts by its relative, not its absolute error."""

    def __init__(self, device: str) -> None:
        self.mean = torch.full((len(data.SAMPLES),), 0.05, device=device)

    def weights(self, level: Tensor, loss: Tensor) -> Tensor:
        with torch.no_grad():
            sums = torch.zeros_like(self.mean).index_add_(0, level, loss)
            counts = torch.zeros_like(self.mean).index_add_(0, level, torch.ones_like(loss))
            fresh = torch.where(counts > 0, sums / counts.clamp(min=1), self.mean)
            self.mean.lerp_(fresh, 0.02)
            weights = self.mean ** -0.7
            return (weights / weights.mean())[level]


def rel_mse(output: Tensor, reference: Tensor) -> Tensor:
    """As the renderer's `metrics::rel_mse`, for each picture."""
    return ((output - reference) ** 2 / (reference**2 + 0.01)).mean((1, 2, 3))


@torch.no_grad()
def validate(model: Denoiser, views: Views, count: int = 48) -> "dict[int, list[float]]":
    """relMSE before and after, the geometric mean over held-out views, for each sample count."""
    model.eval()
    device = views.reference.device
    side = views.reference.shape[2]
    result = {}
    for level, spp in enumerate(data.SAMPLES):
        logs = []
        for first in range(0, min(count, len(views)), 16):
            which = torch.arange(first, min(first + 16, count, len(views)), device=device)
            zero = torch.zeros_like(which)
            batch = data.crops(views, zero + level, which, zero, zero, side)
            output = model(batch.color, batch.albedo, batch.normal, batch.variance, batch.known)
            pair = [rel_mse(x, batch.reference).clamp(min=1e-9).log() for x in (batch.color, output)]
            logs.append(torch.stack(pair, 1))
        result[spp] = torch.cat(logs).mean(0).exp().tolist()
    model.train()
    return result


def profile(run, views: Views, args: argparse.Namespace, levels: "list[float]") -> None:
    """Prints where the time of a step goes."""
    for timed in (False, True):
        with torch.profiler.profile() as profiler:
            begin = time.monotonic()
            for _ in range(8):
                batch = data.random_batch(views, args.batch, args.size, levels)
                torch.cuda.synchronize()
                loaded = time.monotonic()
                output = run(batch.color, batch.albedo, batch.normal, batch.variance, batch.known)
                losses(output, batch.reference).mean().backward()
                torch.cuda.synchronize()
        if timed:
            ended = time.monotonic()
            print(f"last step {ended - loaded:.3f} s, all {(ended - begin) / 8:.3f} s a step")
            print(profiler.key_averages().table(sort_by="self_device_time_total", row_limit=18, max_name_column_width=50))


def export(state: "dict[str, Tensor]", path: str) -> None:
    """The weights as 16-bit floats, in the order of the layers."""
    names = [f"{layer}.{part}" for layer in [*CONVOLUTIONS, *HEADS] for part in ("weight", "bias")]
    save_file({name: state[name].half().contiguous().cpu() for name in names}, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", help="folder to write")
    parser.add_argument("pairs", nargs="+", help="folders of pairs.py")
    parser.add_argument("--minutes", type=float, default=20, help="how long this run may take")
    parser.add_argument("--total", type=float, help="minutes of all runs together, for the schedule")
    parser.add_argument("--resume", help="a checkpoint to go on from")
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--size", type=int, default=128, help="side of the crops, a multiple of 32")
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--compile", action="store_true", help="fuse the filter (takes a minute)")
    parser.add_argument("--profile", action="store_true", help="say where the time of a step goes")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    torch.manual_seed(args.seed)
    torch.backends.cuda.matmul.allow_tf32 = True
    torch.backends.cudnn.benchmark = True
    os.makedirs(args.out, exist_ok=True)
    begin = time.monotonic()
    views, held_out = data.load(args.pairs, args.device)
    print(f"{len(views)} views, {len(held_out)} held out, {time.monotonic() - begin:.0f} s", flush=True)
    model = Denoiser().to(args.device).to(memory_format=torch.channels_last)
    average = {name: value.clone() for name, value in model.state_dict().items()}
    optimiser = torch.optim.AdamW(model.parameters(), lr=args.rate, betas=(0.9, 0.99), weight_decay=1e-4)
    balance = Balance(args.device)
    step, spent = 0, 0.0
    if args.resume:
        stored = torch.load(args.resume, map_location=args.device)
        model.load_state_dict(stored["model"])
        optimiser.load_state_dict(stored["optimiser"])
        average, balance.mean = stored["average"], stored["balance"]
        step, spent = stored["step"], stored["seconds"]
    total = 60 * (args.total or args.minutes + spent / 60)
    run = torch.compile(model) if args.compile else model
    levels = [1.0, 0.7, 1.0, 0.7, 1.0, 1.0, 0.8]
    log = open(os.path.join(args.out, "log.jsonl"), "a")
    running, shown, written = 0.0, time.monotonic(), time.monotonic()

    def keep() -> None:
        stored = {
            "model": model.state_dict(), "optimiser": optimiser.state_dict(), "average": average,
            "balance": balance.mean, "step": step, "seconds": spent + time.monotonic() - begin,
        }
        path = os.path.join(args.out, "checkpoint.pt")
        torch.save(stored, path + ".tmp")
        os.replace(path + ".tmp", path)
        export(average, os.path.join(args.out, "denoiser.safetensors"))

    if args.profile:
        profile(run, views, args, levels)
    while (seconds := time.monotonic() - begin) < 60 * args.minutes:
        progress = min((spent + seconds) / total, 1.0)
        rate = args.rate * min(1.0, (step + 1) / 500) * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * progress)))
        for group in optimiser.param_groups:
            group["lr"] = rate
        batch = data.random_batch(views, args.batch, args.size, levels)
        output = run(batch.color, batch.albedo, batch.normal, batch.variance, batch.known)
        loss = losses(output, batch.reference)
        total_loss = (balance.weights(batch.level, loss) * loss).mean()
        optimiser.zero_grad(set_to_none=True)
        total_loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0, error_if_nonfinite=False)
        optimiser.step()
        step += 1
        decay = min(0.999, step / (step + 10))
        with torch.no_grad():
            torch._foreach_lerp_(list(average.values()), list(model.state_dict().values()), 1 - decay)
        if step % 50 == 0:
            value = float(total_loss.detach())
            if not math.isfinite(value):
                raise SystemExit(f"the loss is {value} at step {step}; the last checkpoint stands")
            running = value if running == 0 else 0.9 * running + 0.1 * value
        if time.monotonic() - shown > 30:
            shown = time.monotonic()
            rounds = f"{step / (spent + seconds):.1f} steps/s"
            print(f"{seconds:6.0f} s  step {step}  loss {running:.4f}  rate {rate:.1e}  {rounds}", flush=True)
        if time.monotonic() - written > 150:
            written = time.monotonic()
            keep()
            judged = Denoiser().to(args.device)
            judged.load_state_dict(average)
            errors = validate(judged, held_out)
            line = {"step": step, "seconds": spent + seconds, "loss": running, "relmse": errors}
            print(json.dumps(line), file=log, flush=True)
            print("   ", {spp: f"{a:.3g}>{b:.3g}" for spp, (a, b) in errors.items()}, flush=True)
    keep()
    judged = Denoiser().to(args.device)
    judged.load_state_dict({n: v.half().float() for n, v in average.items()})
    print("final", {spp: f"{a:.4g}>{b:.4g}" for spp, (a, b) in validate(judged, held_out).items()})


if __name__ == "__main__":
    main()
