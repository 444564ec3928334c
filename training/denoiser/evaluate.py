"""Compares the network with Open Image Denoise on scenes that it was not trained on.

python evaluate.py WEIGHTS cornell glass room.glb@0,1,2:0,1,0 --cache FOLDER --oidn LIBRARY

WEIGHTS is a file of train.py, `built-in` for what the renderer ships, or `none`.
Pictures and references are rendered once and kept in the cache. relMSE is the renderer's,
`mean((a - r)² / (r² + 0.01))`. The mean is over all scenes and sample counts, geometric.
"""

import argparse
import ctypes
import os
import time

import alhazen
import numpy as np
import torch
from safetensors.torch import load_file

from after import finished
from network import Denoiser, denoise


class OpenImageDenoise:
    """The library's filter `RT` on the CPU, with albedo and normal."""

    def __init__(self, path: str) -> None:
        self.library = ctypes.CDLL(path)
        for name in ("oidnNewDevice", "oidnNewFilter"):
            getattr(self.library, name).restype = ctypes.c_void_p

    def __call__(self, color: np.ndarray, albedo: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """All [H, W, 3], float32."""
        library, height, width = self.library, *color.shape[:2]
        device = ctypes.c_void_p(library.oidnNewDevice(1))
        library.oidnCommitDevice(device)
        rt = ctypes.c_void_p(library.oidnNewFilter(device, b"RT"))
        output = np.zeros_like(color)
        images = {b"color": color, b"albedo": albedo, b"normal": normal, b"output": output}
        kept = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
        for name, image in kept.items():
            size = [ctypes.c_size_t(n) for n in (width, height, 0, 0, 0)]
            library.oidnSetSharedFilterImage(rt, name, image.ctypes.data_as(ctypes.c_void_p), 3, *size)
        library.oidnSetFilterBool(rt, b"hdr", ctypes.c_bool(True))
        library.oidnCommitFilter(rt)
        library.oidnExecuteFilter(rt)
        library.oidnReleaseFilter(rt)
        library.oidnReleaseDevice(device)
        return kept[b"output"]


def opened(text: str) -> "tuple[alhazen.Scene, alhazen.Camera | None]":
    """`FILE|SCENE[@EYE:TARGET]`, as in `alhazen bench denoise`."""
    name, _, place = text.partition("@")
    camera = None
    if place:
        eye, target = ([float(x) for x in point.split(",")] for point in place.split(":"))
        camera = alhazen.Camera.look_at(eye, target)
    return alhazen.load(name), camera


def kept(path: str, make) -> "dict[str, np.ndarray]":
    """What a file of the cache holds; it is made first if it is not there."""
    if not os.path.exists(path):
        os.makedirs(os.path.dirname(path), exist_ok=True)
        np.savez(path, **make())
    return {name: array.astype(np.float32) for name, array in np.load(path).items()}


def rendered(text: str, args: argparse.Namespace) -> "dict[str, np.ndarray]":
    """The pictures of a scene at all sample counts, and the reference."""
    scene, camera = opened(text)
    settings = dict(camera=camera, backend=args.backend)
    if args.threads:
        settings["threads"] = args.threads
    name = os.path.basename(text).split("@")[0].replace(":", "_")

    def reference() -> "dict[str, np.ndarray]":
        picture = scene.render(args.width, args.height, args.reference, seed=99, **settings)
        return {"reference": picture["color"].clip(0, 60000).astype(np.float16)}

    def noisy() -> "dict[str, np.ndarray]":
        found = {}
        for spp in args.spp:
            layers = ["albedo", "denoising-normal", "standard-error"]
            picture = scene.render(args.width, args.height, spp, aovs=layers, seed=spp, **settings)
            for layer in ["color", *layers]:
                found[f"{layer.removeprefix('denoising-')}_{spp}"] = picture[layer]
        return found

    pictures = kept(os.path.join(args.cache, f"reference-{name}.npz"), reference)
    return pictures | kept(os.path.join(args.cache, f"noisy-{name}.npz"), noisy)


def by_network(model: Denoiser, device: str):
    """A function that denoises as the renderer would with these weights; arrays [H, W, 3]."""
    image = lambda x: torch.from_numpy(x).to(device).permute(2, 0, 1)[None]

    @torch.no_grad()
    def run(color: np.ndarray, albedo: np.ndarray, normal: np.ndarray, error: "np.ndarray | None"):
        variance = None if error is None else image(error**2)
        ours = denoise(model, image(color), image(albedo), image(normal), variance)
        noise = None if error is None else error**2
        return finished(color, noise, ours[0].permute(1, 2, 0).cpu().numpy())

    return run


def shipped(color: np.ndarray, albedo: np.ndarray, normal: np.ndarray, error: "np.ndarray | None"):
    """What the renderer does, with the weights that it has and all that follows the network."""
    return alhazen.denoise(color, albedo=albedo, normal=normal, error=error)


def rel_mse(picture: np.ndarray, reference: np.ndarray) -> float:
    r = reference.astype(np.float64)
    return float(np.mean((picture - r) ** 2 / (r * r + 0.01)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", help="a safetensors file, `built-in`, or `none` to render only")
    parser.add_argument("scenes", nargs="+", help="FILE|SCENE[@EYE:TARGET]")
    parser.add_argument("--cache", required=True, help="folder for pictures and references")
    parser.add_argument("--oidn", help="libOpenImageDenoise.so.2")
    parser.add_argument("--spp", type=int, nargs="+", default=[1, 4, 16, 64, 256])
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=360)
    parser.add_argument("--reference", type=int, default=16384, help="samples of the references")
    parser.add_argument("--backend", default="auto")
    parser.add_argument("--threads", type=int, help="of the CPU")
    parser.add_argument("--table", help="a file for the table, as in docs/denoising.md")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    args = parser.parse_args()
    model = None
    if args.weights == "built-in":
        model = shipped
    elif args.weights != "none":
        model = Denoiser().eval()
        model.load_state_dict({name: x.float() for name, x in load_file(args.weights).items()})
        model = by_network(model.to(args.device), args.device)
    library = OpenImageDenoise(args.oidn) if args.oidn else None
    ratios: "dict[int, list[float]]" = {spp: [] for spp in args.spp}
    rows = []
    for text in args.scenes:
        begin = time.monotonic()
        pictures = rendered(text, args)
        if model is None:
            print(f"{text}: {time.monotonic() - begin:.1f} s", flush=True)
            continue
        cells = []
        for spp in args.spp:
            noisy = {layer: pictures[f"{layer}_{spp}"] for layer in ("color", "albedo", "normal")}
            error = pictures[f"standard-error_{spp}"]
            errors = [rel_mse(noisy["color"], pictures["reference"])]
            ours = model(*noisy.values(), error if spp > 1 else None)
            errors.append(rel_mse(ours, pictures["reference"]))
            if library is not None:
                theirs = library(noisy["color"], noisy["albedo"], noisy["normal"])
                errors.append(rel_mse(theirs, pictures["reference"]))
            if library is not None:
                ratios[spp].append(errors[1] / errors[2])
                written = f"{errors[1]:.2e} / {errors[2]:.2e}, {ratios[spp][-1]:.2f}"
                rows.append((text, spp, written.replace("e-0", "e-")))
            cells.append(" ".join(f"{e:.2e}" for e in errors))
        ratio = " ".join(f"{ratios[spp][-1]:.2f}" for spp in args.spp) if ratios[args.spp[0]] else ""
        name = os.path.basename(text).split("@")[0]
        print(f"{name:24} {' | '.join(cells)}   ratio {ratio}   {time.monotonic() - begin:.1f} s", flush=True)
    if any(ratios.values()):
        means = {spp: float(np.exp(np.mean(np.log(r)))) for spp, r in ratios.items()}
        everything = float(np.exp(np.mean(np.log([x for r in ratios.values() for x in r]))))
        print("ours / Open Image Denoise, geometric mean:", everything, means)
    if args.table and rows:
        names = list(dict.fromkeys(text for text, _, _ in rows))
        found = {(text, spp): written for text, spp, written in rows}
        lines = ["| scene | " + " | ".join(f"{spp}" for spp in args.spp) + " |"]
        lines.append("|---" * (1 + len(args.spp)) + "|")
        for text in names:
            name = os.path.basename(text).split("@")[0]
            lines.append(f"| {name} | " + " | ".join(found[text, spp] for spp in args.spp) + " |")
        cells = " | ".join(f"{means[spp]:.2f}" for spp in args.spp)
        lines.append(f"| geometric mean of the ratios | {cells} |")
        with open(args.table, "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
