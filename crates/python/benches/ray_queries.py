"""Ray queries: Python against the Rust library and against trimesh with embreex, on the same rays, in turns.

Run through ``cargo xtask bench python``, which builds what this needs. Absolute figures move with the machine's load, so each
turn measures all of them one after the other, and what counts is the median of the ratios.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import alhazen


def blob(n):
    """A closed, bumpy sphere of 2 n (n - 1) triangles: the mesh of ``cargo bench -p accel``."""
    theta = (np.arange(1, n) / n * np.pi)[:, None]
    phi = (np.arange(n) / n * 2 * np.pi)[None, :]
    r = 1 + 0.2 * np.sin(5 * theta) * np.cos(3 * phi)
    rings = np.stack(
        [r * np.sin(theta) * np.cos(phi), r * np.cos(theta) + 0 * phi, r * np.sin(theta) * np.sin(phi)], axis=-1
    )
    vertices = np.concatenate([[[0, 1, 0]], rings.reshape(-1, 3), [[0, -1, 0]]]).astype(np.float32)
    c = np.arange(n)
    at = lambda row, column: 1 + (row - 1) * n + column % n
    last = len(vertices) - 1
    caps = [np.stack([0 * c, at(1, c + 1), at(1, c)], -1), np.stack([0 * c + last, at(n - 1, c), at(n - 1, c + 1)], -1)]
    row, column = (a.ravel() for a in np.meshgrid(np.arange(1, n - 1), c, indexing="ij"))
    sides = [
        np.stack([at(row, column), at(row, column + 1), at(row + 1, column)], -1),
        np.stack([at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)], -1),
    ]
    return vertices, np.concatenate(caps + sides).astype(np.uint32)


class Rust:
    """The library's own speed: a program that traces when told so, and says how long it took."""

    def __init__(self, program, folder):
        self.process = subprocess.Popen(
            [program, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        assert self.process.stdout.readline().startswith("ready")

    def seconds(self, what):
        self.process.stdin.write(what + "\n")
        answer = self.process.stdout.readline().split()
        return float(answer[0]), int(answer[1])

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def timed(call):
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rust", required=True, help="the library's program, built from crates/alhazen/examples")
    parser.add_argument("--rays", type=int, default=10_000_000)
    parser.add_argument("--size", type=int, default=1000, help="the mesh has about 2 · size² triangles")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--json", help="write all numbers to this file")
    args = parser.parse_args()

    vertices, triangles = blob(args.size)
    rng = np.random.default_rng(42)
    origins = rng.uniform(-1.2, 1.2, (args.rays, 3)).astype(np.float32)
    directions = rng.normal(size=(args.rays, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)

    scene = alhazen.Scene()
    scene.add_instance(scene.add_mesh(vertices, triangles))
    with tempfile.TemporaryDirectory() as folder:
        for name, array in dict(vertices=vertices, triangles=triangles, origins=origins, directions=directions).items():
            array.tofile(pathlib.Path(folder) / name)
        rust = Rust(args.rust, folder)

    contenders = {
        "python": lambda: timed(lambda: scene.intersect(origins, directions, normals=False).triangle),
        "python, normals": lambda: timed(lambda: scene.intersect(origins, directions).triangle),
        "rust arrays": lambda: rust.seconds("arrays"),
        "rust arrays, normals": lambda: rust.seconds("normals"),
        "rust streams": lambda: rust.seconds("streams"),
    }
    try:
        import embreex  # noqa: F401
        import trimesh

        mesh = trimesh.Trimesh(vertices, triangles.astype(np.int64), process=False)
        assert "embree" in type(mesh.ray).__module__
        wide = origins.astype(np.float64), directions.astype(np.float64)
        contenders["trimesh, embreex"] = lambda: timed(lambda: mesh.ray.intersects_first(*wide))
    except ImportError as error:
        print(f"no peer: {error}", file=sys.stderr)

    seconds = {name: [] for name in contenders}
    hits = {}
    for turn in range(args.repeat + 1):
        for name, run in contenders.items():
            taken, result = run()
            hits[name] = result if isinstance(result, int) else int((result >= 0).sum())
            # The first turn builds structures and touches memory.
            if turn > 0:
                seconds[name].append(taken)
    rust.close()

    print(f"{args.rays:,} random rays, {len(triangles):,} triangles, {args.repeat} turns")
    for name, times in seconds.items():
        best = args.rays / min(times) * 1e-6
        print(f"{name:22} {args.rays / statistics.median(times) * 1e-6:8.2f} Mrays/s (best {best:.2f}), {hits[name]:,} hits")
    ratios = {}
    pairs = [
        ("python", "rust arrays"),
        ("python, normals", "rust arrays, normals"),
        ("python", "rust streams"),
        ("python", "trimesh, embreex"),
        ("python, normals", "trimesh, embreex"),
    ]
    for ours, theirs in pairs:
        if theirs in seconds:
            all_ratios = sorted(b / a for a, b in zip(seconds[ours], seconds[theirs]))
            ratios[f"{ours} / {theirs}"] = all_ratios
            print(f"{ours} is {statistics.median(all_ratios):.2f} × as fast as {theirs} ({all_ratios[0]:.2f} to {all_ratios[-1]:.2f})")
    if args.json:
        result = dict(rays=args.rays, triangles=len(triangles), seconds=seconds, hits=hits, ratios=ratios)
        pathlib.Path(args.json).write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
