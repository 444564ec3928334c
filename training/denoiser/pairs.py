"""Renders what the denoiser learns from: several independent noisy pictures of random scenes.

    python pairs.py OUT --seed 1 --scenes 6000 --views 4 --seconds 480 --processes 64
    python pairs.py OUT --contact-sheet sheet.png

Nothing is rendered until it is clean. One picture of a view is the input, and the mean of others,
which are independent of it, the reference (Lehtinen et al., "Noise2Noise", 2018). So a view costs
a hundred samples a pixel and not thousands, and in the same time many more scenes are rendered.

Each scene becomes OUT/NNNNNN.npz, NNNNNN being its number:

- `light`: float16 [views, pictures, 6, H, W], for each of the pictures of a view, six, with
  `--clean` ten, with `--quick` five or nine, the colour (linear radiance) and its standard error,
  which is 0 for a single sample: then it is unknown;
- `guide`: uint8 [views, pictures, 6, H, W], the square root of the albedo times 255, and the normal
  in world space times 127 plus 128, the latter of what mirrors and clear glass show;
- `samples`: int32 [views, pictures], samples per pixel of the pictures, one of `PLANS`;
- `scale`: float32 [views], the factor that colours and errors have been multiplied by, so that the
  geometric mean of the last picture is 0.18; `family`, the scene's name; `seed`.

A file is complete once it has its name. Seeds of scenes are 10⁶ · `--seed` + NNNNNN. The first
`--held-out` scenes are for validation, with a last picture of many samples. With `--clean` the last
picture of all scenes has many, with `--quick` enough for refine.py.
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

PLANS = {
    "few": (1, 2, 4, 8, 16, 32),
    "some": (2, 8, 16, 32, 64, 64),
    "many": (1, 4, 16, 64, 128, 256),
    "held out": (1, 4, 16, 64, 128, 512),
    "clean": (1, 1, 1, 2, 4, 4, 8, 16, 64, 256),
    "cleanest": (1, 1, 2, 4, 8, 16, 32, 128, 256, 512),
    "quick": (1, 1, 1, 2, 4, 4, 8, 16, 128),
    "quick, many": (1, 4, 16, 64, 192),
}
"""Samples per pixel of the pictures of a view; refine.py learns from the last four plans."""
GUIDES = ("albedo", "denoising-normal")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
THUMBNAIL = 128  # pixels of a side on contact sheets
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


def plan_of(rng, number, view, options):
    """Which pictures are made of a view: those of many samples are few."""
    if number < options.held_out:
        return PLANS["held out"]
    if options.quick:
        return PLANS[rng.choice(["quick", "quick, many"], p=[0.8, 0.2])]
    if options.clean:
        return PLANS[rng.choice(["clean", "cleanest"], p=[0.88, 0.12])]
    return PLANS[rng.choice(["few", "some", "many"], p=[0.8, 0.15, 0.05])]


def window_of(rng, options):
    """(side, x, y): a view is a part of a square picture, so that there are all resolutions."""
    side = round(options.size * np.exp(rng.uniform(0, np.log(options.zoom))))
    x, y = rng.integers(0, side - options.size + 1, 2)
    return side, int(x), int(y)


def render_picture(render, samples, seed, most):
    """The layers of one picture, put together from pictures of at most `most` samples.

    On a GPU many samples at once have shaders of their own, which take seconds to compile.
    """
    rng = np.random.default_rng(seed)
    parts = [min(most, samples - done) for done in range(0, samples, most)]
    pictures = [render(part, int(rng.integers(2**31))) for part in parts]
    weights = np.array(parts) / samples
    layers = {}
    for name in ("color", *GUIDES):
        layers[name] = sum(w * p[name] for w, p in zip(weights, pictures))
    squares = [(w * p["standard-error"]) ** 2 for w, p in zip(weights, pictures)]
    layers["standard-error"] = np.sqrt(sum(squares))
    return layers


def render_view(scene, camera, settings, plan, window, seeds, options):
    """The pictures of one view: (light, guide, scale)."""
    side, x, y = window
    threads = {"threads": 1} if options.backend == "cpu" else {}

    def render(samples, seed):
        return scene.render(
            side,
            side,
            samples,
            camera=camera,
            crop=[x, y, options.size, options.size],
            aovs=[*GUIDES, "standard-error"],
            seed=seed,
            integrator="path",
            max_depth=min(settings["max_depth"], options.max_depth),
            backend=options.backend,
            **threads,
        )

    pictures = []
    for samples, seed in zip(plan, seeds):
        picture = render_picture(render, samples, int(seed), options.portion)
        if not np.isfinite(picture["color"]).all():
            raise Unusable(f"the picture of {samples} samples has invalid values")
        pictures.append(picture)
    if not pictures[-1]["color"].mean() > 0:
        raise Unusable("the picture is black")
    scale = scale_of(pictures[-1]["color"])
    light = np.empty((len(plan), 6, options.size, options.size), np.float16)
    guide = np.empty(light.shape, np.uint8)
    for i, picture in enumerate(pictures):
        error = np.nan_to_num(picture["standard-error"])
        if plan[i] == 1:
            error = np.zeros_like(error)
        for half, layer in ((light[i, :3], picture["color"]), (light[i, 3:], error)):
            half[:] = np.clip(layer * scale, 0, LARGEST).transpose(2, 0, 1)
        albedo, normal = (picture[name] for name in GUIDES)
        albedo = 255 * np.sqrt(np.clip(albedo, 0, 1))
        normal = 128 + 127 * np.clip(normal, -1, 1)
        guide[i, :3] = np.round(albedo).transpose(2, 0, 1)
        guide[i, 3:] = np.round(normal).transpose(2, 0, 1)
    return light, guide, scale


def make_scene(number, options, connection):
    """Makes the views of a scene and writes its file; returns how many there are."""
    import scenes

    seed = options.seed * 10**6 + number
    wanted = 1 if number < options.held_out else options.views
    begin = time.monotonic()
    scene, cameras, settings = scenes.random_scene(seed, wanted, options.family)
    built = time.monotonic()
    views, plans = [], []
    for view, camera in enumerate(cameras):
        rng = np.random.default_rng([seed, view])
        # With `--quick`, plans differ in length, and views of one scene must not.
        chosen = np.random.default_rng([seed, 0]) if options.quick else rng
        plan, window = plan_of(chosen, number, view, options), window_of(rng, options)
        seeds = rng.integers(0, 2**31, len(plan))
        try:
            views.append(render_view(scene, camera, settings, plan, window, seeds, options))
        except Unusable as why:
            connection.send(("failed", f"{settings['family']} {number:06}_{view}: {why}"))
            continue
        plans.append(plan)
        # What is done so far is kept if the rest would take too long.
        if time.monotonic() - begin > options.enough:
            break
    if not views:
        return 0
    rendered = time.monotonic()
    path = options.out / f"{number:06}.npz"
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}.tmp")
    with open(unfinished, "wb") as file:
        np.savez(
            file,
            light=np.stack([light for light, _, _ in views]),
            guide=np.stack([guide for _, guide, _ in views]),
            scale=np.array([scale for _, _, scale in views], np.float32),
            samples=np.array(plans, np.int32),
            family=settings["family"],
            seed=np.int64(seed),
        )
    os.replace(unfinished, path)
    samples = int(np.sum(plans)) * options.size**2
    times = (built - begin, rendered - built, time.monotonic() - rendered)
    connection.send(("scene", settings["family"], len(views), samples, times))
    return len(views)


def work(connection, options):
    """A worker: makes the scenes whose numbers it receives, until it receives None.

    Sends ("scene", family, views, samples, seconds of building, rendering and writing),
    ("failed", why), and ("done", number).
    """
    os.environ["RAYON_NUM_THREADS"] = "1"
    while (number := connection.recv()) is not None:
        try:
            make_scene(number, options, connection)
        except KeyboardInterrupt:
            return
        except BaseException as why:  # also panics of the renderer: the others go on
            connection.send(("failed", f"scene {number:06}: {type(why).__name__}: {why}"))
            if type(why).__name__ == "BackendError":
                return  # a process that has lost the GPU does not find it again; another takes over
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
    """Makes all scenes; returns how many views there are."""
    options.out.mkdir(parents=True, exist_ok=True)
    context = multiprocessing.get_context("spawn")
    start = time.monotonic()
    pool = [Worker(context, options) for _ in range(min(options.processes, options.scenes))]
    queue = collections.deque(range(options.first, options.first + options.scenes))
    families, failures = collections.Counter(), []
    scenes_done, views, samples, shown, times = 0, 0, 0, 0.0, np.zeros(3)

    def fail(message):
        failures.append(message)
        print("failed:", message[:200], flush=True)

    for worker in pool:
        worker.give(queue.popleft())
    while any(w.number is not None for w in pool):
        now = time.monotonic()
        if now - start > options.seconds:
            print("time is up", flush=True)
            break
        if now - shown > 10:
            shown, passed = now, now - start
            print(
                f"{passed:.0f} s: {scenes_done} scenes, {views} views, "
                f"{samples / passed / 1e6:.1f} Msamples/s, seconds of building, rendering, "
                f"writing a scene {np.round(times / max(scenes_done, 1), 2)}",
                flush=True,
            )
        busy = {w.connection: i for i, w in enumerate(pool) if w.number is not None}
        ready = multiprocessing.connection.wait(busy, 0.5)
        for connection, i in busy.items():
            worker, kind = pool[i], None
            if connection in ready:
                try:
                    kind, *what = connection.recv()
                except (EOFError, OSError):
                    worker.process.join(5)
                    kind = "dead"
                    fail(f"scene {worker.number:06}: ended with {worker.process.exitcode}")
                if kind == "scene":
                    families[what[0]] += what[1]
                    views, samples = views + what[1], samples + what[2]
                    times += what[3]
                elif kind == "failed":
                    fail(what[0])
                elif kind == "done":
                    scenes_done += 1
                    worker.number = None
            elif worker.number is not None and now - worker.since > options.scene_seconds:
                fail(f"scene {worker.number:06}: longer than {options.scene_seconds:.0f} s")
                kind = "dead"
            if kind == "dead":
                worker.stop()
                pool[i] = worker = Worker(context, options)
            if worker.number is None and queue:
                worker.give(queue.popleft())
    for worker in pool:
        worker.stop()
    for unfinished in options.out.glob(".*.tmp"):
        unfinished.unlink()
    passed = time.monotonic() - start
    print(
        f"{views} views of {scenes_done} scenes in {passed:.0f} s, "
        f"{samples / 1e6:.0f} million samples, {len(failures)} failures"
    )
    for name, count in families.most_common():
        print(f"  {name}: {count}")
    return views


def contact_sheet(folder, path, limit=144, columns=12):
    """Writes a PNG with the tone-mapped last pictures of a folder, in the order of their names."""
    import alhazen

    files = sorted(folder.glob("*.npz"))
    chosen = np.unique(np.linspace(0, len(files) - 1, min(limit, len(files))).astype(int))
    tiles = []
    for i in chosen:
        with np.load(files[i]) as arrays:
            tiles.append(arrays["light"][0, -1, :3].astype(np.float32))
    step = max(1, tiles[0].shape[1] // THUMBNAIL)
    size = tiles[0].shape[1] // step
    rows = -(-len(tiles) // columns)
    sheet = np.zeros((rows * (size + 4), columns * (size + 4), 3), np.float32)
    for i, tile in enumerate(tiles):
        tile = tile[:, : size * step, : size * step]
        means = tile.reshape(3, size, step, size, step).mean((2, 4)).transpose(1, 2, 0)
        y, x = i // columns * (size + 4), i % columns * (size + 4)
        sheet[y : y + size, x : x + size] = means
    path.write_bytes(alhazen.encode_png(sheet, tonemap="agx", exposure=1.0))
    print(f"{len(tiles)} pictures in {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=pathlib.Path, help="folder for the scenes, or to look at")
    parser.add_argument(
        "--contact-sheet", type=pathlib.Path, help="write a PNG of what is there, and stop"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--views", type=int, default=4, help="views of each scene, at most")
    parser.add_argument("--size", type=int, default=192, help="pixels of a side")
    parser.add_argument(
        "--zoom", type=float, default=2.5, help="a view is part of a picture up to so much larger"
    )
    parser.add_argument("--held-out", type=int, default=24, help="scenes for validation")
    parser.add_argument(
        "--clean", action="store_true", help="for refine.py: the last picture is clean"
    )
    parser.add_argument(
        "--quick", action="store_true", help="the same, with fewer samples and so more scenes"
    )
    parser.add_argument(
        "--portion", type=int, default=1024, help="pictures of more samples are put together"
    )
    parser.add_argument("--backend", default="gpu-bvh", help="of the renderer")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--seconds", type=float, default=480.0, help="stop after so long")
    parser.add_argument(
        "--enough", type=float, default=20.0, help="no more views of a scene after so long"
    )
    parser.add_argument(
        "--scene-seconds", type=float, default=45.0, help="give a scene up after so long"
    )
    parser.add_argument("--max-depth", type=int, default=8, help="limits what scenes ask for")
    parser.add_argument("--family", help="scenes of this family only")
    options = parser.parse_args()
    if options.contact_sheet:
        contact_sheet(options.out, options.contact_sheet)
        return
    sys.exit(0 if make(options) else 1)


if __name__ == "__main__":
    main()
