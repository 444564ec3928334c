"""Pictures: layers by name, and what rendering them took."""

import copy
import io
import os
from typing import Dict, List, Optional

import numpy as np

from ._alhazen import denoise, encode_png, write_file, write_picture


class Picture(Dict[str, np.ndarray]):
    """Layers of a rendered picture by name; notebooks show the colour.

    Attributes
    ----------
    spp : int
        Samples per pixel made.
    seconds : float
        Time that rendering took.
    noise : float or None
        Relative standard error of the picture, if there are enough samples to tell.
    invalid_samples : int
        Samples that were NaN or infinite and were dropped.
    backend : str
        What rendered.
    notices : list of str
        What should be known besides, such as that a device was lost and another went on.
    """

    def __init__(
        self,
        layers: Dict[str, np.ndarray],
        *,
        spp: int = 0,
        seconds: float = 0.0,
        noise: Optional[float] = None,
        invalid_samples: int = 0,
        backend: str = "",
        notices: Optional[List[str]] = None,
    ) -> None:
        super().__init__(layers)
        self.spp = spp
        self.seconds = seconds
        self.noise = noise
        self.invalid_samples = invalid_samples
        self.backend = backend
        self.notices = list(notices or [])

    def png(self, *, tonemap: str = "srgb", exposure: float = 1.0) -> bytes:
        """The colour as a PNG file.

        Parameters
        ----------
        tonemap : {"srgb", "none", "reinhard", "aces", "agx", "neutral"}, default "srgb"
        exposure : float, default 1
            Factor on radiance before the curve.

        Returns
        -------
        bytes
        """
        return encode_png(self["color"], tonemap=tonemap, exposure=exposure)

    def denoised(self) -> "Picture":
        """The picture without its noise; the other layers stay, and the noisy colour becomes the layer "noisy".

        Render with ``aovs=["albedo", "denoising-normal", "standard-error"]``. Without the second, "normal" is taken; layers
        that are missing are not known to the denoiser, see `alhazen.denoise`.

        Returns
        -------
        Picture
        """
        known = {"albedo": self.get("albedo"), "normal": self.get("denoising-normal", self.get("normal"))}
        error = self.get("standard-error") if self.spp > 1 else None
        color = denoise(self["color"], error=error, **known)
        clean = copy.copy(self)
        clean.update({"color": color, "noisy": self["color"]})
        return clean

    def save(self, path: "str | os.PathLike[str]", *, tonemap: str = "srgb", exposure: float = 1.0) -> None:
        """Writes the picture in the format of the path's ending: complete, or not at all.

        EXR files get linear radiance and all layers but mattes, HDR files linear radiance, PNG and JPEG files the tone mapped
        colour, NPZ archives all arrays.

        Parameters
        ----------
        path : str or os.PathLike
            Ends in .png, .jpg, .exr, .hdr or .npz. Files that scenes were loaded from are not written over.
        tonemap : str, default "srgb"
            For PNG and JPEG, see `png`.
        exposure : float, default 1
            For PNG and JPEG, factor on radiance before the curve.
        """
        ending = os.path.splitext(os.fspath(path))[1].lower()
        if ending in (".png", ".jpg", ".jpeg", ".exr", ".hdr"):
            write_picture(path, dict(self), tonemap=tonemap, exposure=exposure)
        elif ending == ".npz":
            archive = io.BytesIO()
            np.savez_compressed(archive, **self)
            write_file(path, archive.getvalue())
        else:
            raise ValueError(f"{os.fspath(path)}: unknown picture format; known are .png, .jpg, .exr, .hdr and .npz")

    def _repr_png_(self) -> bytes:
        return self.png()
