"""Alhazen, a physically based ray tracer.

Load a scene or build one from arrays, then render it or ask what rays hit::

    import alhazen

    scene = alhazen.load("cornell")
    picture = scene.render(256, 256, spp=16, aovs=["depth", "instance"])
    picture["color"]      # float32, (256, 256, 3), linear radiance
    picture.save("cornell.png")

World units are metres, +Y is up, matrices map column vectors, colours are linear with Rec. 709 primaries. Pictures have
row 0 at the top.
"""

from ._alhazen import (
    __version__,
    BackendError,
    Camera,
    Error,
    Hits,
    Lidar,
    LoadError,
    Medium,
    Part,
    PartError,
    PointCloud,
    Scene,
    SequenceDenoiser,
    backends,
    denoise,
    encode_png,
    level_pose,
    load,
    merge,
    scenes,
)
from ._picture import Picture
from .mujoco import MujocoScene, from_mujoco

__all__ = [
    "__version__",
    "BackendError",
    "Camera",
    "Error",
    "Hits",
    "Lidar",
    "LoadError",
    "Medium",
    "MujocoScene",
    "Part",
    "PartError",
    "Picture",
    "PointCloud",
    "Scene",
    "SequenceDenoiser",
    "backends",
    "denoise",
    "encode_png",
    "from_mujoco",
    "level_pose",
    "load",
    "merge",
    "scenes",
]
