"""Makes training pairs: noisy pictures, their auxiliary layers and a reference, of random scenes.

    python pairs.py OUT --seed 1 --scenes 500 --views 3 --size 256 --reference 4096 --backend gpu \
        --processes 12 --seconds 480
    python pairs.py --contact-sheet OUT sheet.png

Each view becomes OUT/NNNNNN_V.npz, NNNNNN being the number of the scene and V that of the view:

- `reference`, `reference_error`: float16 [3, H, W], linear radiance and its standard error;
  `reference_samples`: its samples per pixel.
- for s of 1, 2, 4, 8, 16, 64 and 256 samples per pixel `color_s`, `albedo_s`, `normal_s` (world
  space) and `error_s` (standard error of the mean; of one sample it is unknown, and 0), float16
  [3, H, W]. All renders are independent.
- `scale`: the factor that all colours and errors have been multiplied by, so that the geometric
  mean of the reference is 0.18; `seed` of the scene; `family`, its name; `max_depth` of its paths.

A file is complete once it has its name. Seeds of scenes are 10⁶ · `--seed` + NNNNNN.
"""

import argparse
import collections
import multiprocessing
import multiprocessing.connection
import os
import pathlib
import sys
import time

import numpy as np

SAMPLES = (1, 2, 4, 8, 16, 64, 256)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
THUMBNAIL = 192  # pixels of a side on contact sheets
LARGEST = 60000.0  # below the largest half, 65504


class Unusable(Exception):
    """A view that must not be learned from; the message says why."""


def scale_of(color):
    """The factor that brings the geometric mean luminance of a picture [H, W, 3] to 0.18.

    The mean is over blocks of 16 x 16 pixels; black ones are left out.
    """
    light = color.astype(np.float64) @ LUMINANCE
    height, width = light.shape
    rows, columns = np.arange(0, height, 16), np.arange(0, width, 16)
    sums = np.add.reduceat(np.add.reduceat(light, rows, 0), columns, 1)
    areas = np.outer(np.diff([*rows, height]), np.diff([*columns, width]))
    means = sums / areas
    means = means[means > 1e-8 * light.mean()]
    return 0.18 / np.exp(np.log(means).mean())


def half(picture, factor=1.0):
    """A picture [H, W, 3] times a factor as float16 [3, H, W]."""
    return np.clip(picture * factor, -LARGEST, LARGEST).transpose(2, 0, 1).astype(np.float16)


def render_view(scene, camera, settings, seeds, options):
    """The arrays of one view, without `seed`."""

    def render(samples, seed, aovs):
        threads = {"threads": options.threads} if options.backend == "cpu" else {}
        return scene.render(
            options.size,
            options.size,
            samples,
            camera=camera,
            aovs=aovs,
            seed=int(seed),
            integrator="path",
            max_depth=min(settings["max_depth"], options.max_depth),
            backend=options.backend,
            **threads,
        )

    reference = render(options.reference, seeds[0], ["standard-error"])
    color = reference["color"]
    if not np.isfinite(color).all():
        raise Unusable("the reference has invalid values")
    if not color.mean() > 0:
        raise Unusable("the reference is black")
    scale = scale_of(color)
    arrays = {
        "reference": half(color, scale),
        "reference_error": half(np.nan_to_num(reference["standard-error"]), scale),
        "reference_samples": options.reference, "scale": np.float32(scale),
        "family": settings["family"],
        "max_depth": settings["max_depth"],
    }
    for samples, seed in zip(SAMPLES, seeds[1:]):
        noisy = render(samples, seed, ["albedo", "normal", "standard-error"])
        if not np.isfinite(noisy["color"]).all():
            raise Unusable(f"the picture of {samples} samples has invalid values")
        arrays[f"color_{samples}"] = half(noisy["color"], scale)
        arrays[f"albedo_{samples}"] = half(noisy["albedo"])
        arrays[f"normal_{samples}"] = half(noisy["normal"])
        arrays[f"error_{samples}"] = half(np.nan_to_num(noisy["standard-error"]), scale)
    return arrays


def work(connection, options):
    """A worker: makes the scenes whose numbers it receives, until it receives None.

    Sends ("view", family), ("failed", why) for each view or scene, and ("done", number).
    """
    import scenes

    while (number := connection.recv()) is not None:
        try:
            seed = options.seed * 10**6 + number
            scene, cameras, settings = scenes.random_scene(seed, options.views, options.family)
            for view, camera in enumerate(cameras):
                path = options.out / f"{number:06}_{view}.npz"
                seeds = np.random.SeedSequence([seed, view]).generate_state(1 + len(SAMPLES)) >> 1
                try:
                    arrays = render_view(scene, camera, settings, seeds, options)
                except Unusable as why:
                    connection.send(("failed", f"{settings['family']} {number:06}_{view}: {why}"))
                    continue
                unfinished = path.with_name(f".{path.stem}.{os.getpid()}.tmp")
                with open(unfinished, "wb") as file:
                    np.savez(file, seed=np.int64(seed), **arrays)
                os.replace(unfinished, path)
                connection.send(("view", settings["family"]))
        except KeyboardInterrupt:
            return
        except BaseException as why:  # also panics of the renderer: the others go on
            connection.send(("failed", f"scene {number:06}: {type(why).__name__}: {why}"))
        connection.send(("done", number))


class Worker:
    """A process of the pool and what it is doing."""

    def __init__(self, context, options):
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=work, args=(theirs, options), daemon=True)
        self.process.start()
        theirs.close()
        self.number = None
        self.since = time.monotonic()

    def give(self, number):
        self.number, self.since = number, time.monotonic()
        self.connection.send(number)

    def stop(self):
        self.process.kill()
        self.process.join()
        self.connection.close()


def make(options):
    """Makes all pairs; returns how many views there are."""
    options.out.mkdir(parents=True, exist_ok=True)
    context = multiprocessing.get_context("spawn")
    start = time.monotonic()
    pool = [Worker(context, options) for _ in range(min(options.processes, options.scenes))]
    queue = collections.deque(range(options.first, options.first + options.scenes))
    families, failures, scenes_done, shown = collections.Counter(), [], 0, 0.0

    def fail(message):
        failures.append(message)
        print("failed:", message, flush=True)

    for worker in pool:
        worker.give(queue.popleft())
    while any(w.number is not None for w in pool):
        now = time.monotonic()
        if now - start > options.seconds:
            print("time is up", flush=True)
            break
        if now - shown > 5:
            shown = now
            views, passed = sum(families.values()), now - start
            left = min(
                options.seconds - passed,
                passed / max(scenes_done, 1) * (options.scenes - scenes_done),
            )
            print(
                f"{scenes_done}/{options.scenes} scenes, {views} views, "
                f"{views / passed:.2f} views/s, "
                f"{passed:.0f} s, about {left:.0f} s left",
                flush=True,
            )
        ready = multiprocessing.connection.wait(
            [w.connection for w in pool if w.number is not None], 0.5
        )
        for i, worker in enumerate(pool):
            if worker.connection in ready:
                try:
                    kind, what = worker.connection.recv()
                except (EOFError, OSError):
                    worker.process.join(5)
                    kind, what = "dead", worker.process.exitcode
                if kind == "view":
                    families[what] += 1
                elif kind == "failed":
                    fail(what)
                elif kind == "done":
                    scenes_done += 1
                    worker.number = None
                else:
                    fail(f"scene {worker.number:06}: the process ended with {what}")
            elif worker.number is not None and now - worker.since > options.scene_seconds:
                fail(f"scene {worker.number:06}: longer than {options.scene_seconds:.0f} s")
                kind = "dead"
            else:
                continue
            if kind == "dead":
                worker.stop()
                scenes_done += 1
                pool[i] = worker = Worker(context, options)
            if worker.number is None and queue:
                worker.give(queue.popleft())
    for worker in pool:
        worker.stop()
    for unfinished in options.out.glob(".*.tmp"):
        unfinished.unlink()
    views, passed = sum(families.values()), time.monotonic() - start
    print(f"{views} views of {scenes_done} scenes in {passed:.0f} s, {len(failures)} failures")
    for name, count in families.most_common():
        print(f"  {name}: {count}")
    return views


def contact_sheet(folder, path, limit=240, columns=12):
    """Writes a PNG with the tone-mapped references of a folder, in the order of their names."""
    import alhazen

    files = sorted(folder.glob("*.npz"))
    files = [
        files[i]
        for i in np.unique(np.linspace(0, len(files) - 1, min(limit, len(files))).astype(int))
    ]
    tiles = []
    for file in files:
        with np.load(file) as arrays:
            picture = arrays["reference"].astype(np.float32)
        side = picture.shape[1] // THUMBNAIL * THUMBNAIL or picture.shape[1]
        step = max(1, side // THUMBNAIL)
        blocks = picture[:, :side, :side].reshape(3, side // step, step, side // step, step)
        tiles.append(blocks.mean((2, 4)).transpose(1, 2, 0))
    size = tiles[0].shape[0]
    rows = -(-len(tiles) // columns)
    sheet = np.zeros((rows * (size + 4), columns * (size + 4), 3), np.float32)
    for i, tile in enumerate(tiles):
        y, x = i // columns * (size + 4), i % columns * (size + 4)
        sheet[y : y + size, x : x + size] = tile
    path.write_bytes(alhazen.encode_png(sheet, tonemap="agx", exposure=1.0))
    print(f"{len(tiles)} references in {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=pathlib.Path, help="folder for the pairs, or to look at")
    parser.add_argument("sheet", type=pathlib.Path, nargs="?", help="PNG file of the contact sheet")
    parser.add_argument(
        "--contact-sheet", action="store_true", help="write a sheet of what is there, and stop"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--views", type=int, default=3, help="views of each scene, at most")
    parser.add_argument("--size", type=int, default=256, help="pixels of a side")
    parser.add_argument(
        "--reference", type=int, default=4096, help="samples per pixel of the reference"
    )
    parser.add_argument("--backend", default="gpu", help='"gpu", "cpu" or another of the package')
    parser.add_argument("--processes", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=480.0, help="stop after so long")
    parser.add_argument(
        "--scene-seconds", type=float, default=120.0, help="give a scene up after so long"
    )
    parser.add_argument("--max-depth", type=int, default=8, help="limit of the depths that scenes ask for")
    parser.add_argument("--family", help="scenes of this family only")
    options = parser.parse_args()
    if options.contact_sheet:
        if options.sheet is None:
            parser.error("--contact-sheet needs a folder and a PNG file")
        contact_sheet(options.out, options.sheet)
        return
    options.threads = max(1, (os.cpu_count() or 1) // options.processes)
    sys.exit(0 if make(options) else 1)


if __name__ == "__main__":
    main()
