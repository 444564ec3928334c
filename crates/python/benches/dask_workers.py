"""Two workers of Dask against one process, of one thread each: the same picture, in turns.

Needs ``alhazen`` and ``distributed``. Absolute figures move with the machine's load, so each turn measures both one after the
other, and what counts is the median of the ratios. Two cores must be free.
"""

import argparse
import json
import os
import statistics
import time

import numpy as np
from distributed import Client, LocalCluster

import alhazen
import alhazen.distributed


def seconds(work):
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="cornell")
    parser.add_argument("--side", type=int, default=384, help="width and height in pixels")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--repeat", type=int, default=5)
    args = parser.parse_args()
    settings = dict(width=args.side, height=args.side, spp=args.spp, backend="cpu")

    scene = alhazen.load(args.scene)
    one = lambda: scene.render(threads=1, **settings)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        two = lambda: alhazen.distributed.render(args.scene, client=client, **settings)
        # Workers load the scene once; that is not what is measured.
        assert np.array_equal(one()["color"], two()["color"]), "the pictures differ"
        turns = [(seconds(one)[0], seconds(two)[0]) for _ in range(args.repeat)]
    ratios = [a / b for a, b in turns]
    result = {
        "scene": args.scene,
        "side": args.side,
        "spp": args.spp,
        "one_process_seconds": [round(a, 3) for a, _ in turns],
        "two_workers_seconds": [round(b, 3) for _, b in turns],
        "speedup_median": round(statistics.median(ratios), 3),
        "speedup_range": [round(min(ratios), 3), round(max(ratios), 3)],
        "cores": os.cpu_count(),
    }
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
