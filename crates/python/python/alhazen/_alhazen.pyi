"""Types of the compiled part. The documentation is in the docstrings: ``help(alhazen.Scene.render)``."""

import os
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._picture import Picture

__version__: str

class Error(Exception): ...
class LoadError(Error): ...
class BackendError(Error): ...
class PartError(Error): ...

class Backend(TypedDict):
    name: str
    available: bool
    chosen: bool
    device: str
    reason: str

class Camera:
    @staticmethod
    def look_at(
        eye: ArrayLike,
        target: ArrayLike,
        *,
        up: Optional[ArrayLike] = None,
        fov_y: float = 0.8,
        lens_radius: float = 0.0,
        focus_distance: Optional[float] = None,
    ) -> Camera: ...
    @staticmethod
    def orthographic(
        eye: ArrayLike, target: ArrayLike, height: float, *, up: Optional[ArrayLike] = None
    ) -> Camera: ...
    @staticmethod
    def panorama(eye: ArrayLike, target: ArrayLike, *, up: Optional[ArrayLike] = None) -> Camera: ...
    @staticmethod
    def with_projection(
        projection: Literal["perspective", "orthographic", "panorama", "fisheye", "cubemap"],
        eye: ArrayLike,
        target: ArrayLike,
        *,
        up: Optional[ArrayLike] = None,
        fov: float = ...,
        height: float = ...,
    ) -> Camera: ...
    @staticmethod
    def from_opencv(
        matrix: ArrayLike,
        pose: ArrayLike,
        width: int,
        height: int,
        *,
        distortion: Optional[ArrayLike] = None,
        fisheye: bool = False,
    ) -> Camera: ...
    @property
    def eye(self) -> NDArray[np.float32]: ...
    @property
    def target(self) -> NDArray[np.float32]: ...
    @property
    def name(self) -> str: ...
    def rays(self, width: int, height: int) -> Tuple[NDArray[np.float32], NDArray[np.float32]]: ...

class Medium:
    def __init__(
        self,
        *,
        absorption: Optional[ArrayLike] = None,
        scattering: Optional[ArrayLike] = None,
        emission: Optional[ArrayLike] = None,
        density: Optional[ArrayLike] = None,
        bounds: Optional[ArrayLike] = None,
    ) -> None: ...

class Hits:
    @property
    def t(self) -> NDArray[np.float32]: ...
    @property
    def triangle(self) -> NDArray[np.int32]: ...
    @property
    def instance(self) -> NDArray[np.int32]: ...
    @property
    def barycentrics(self) -> NDArray[np.float32]: ...
    @property
    def normals(self) -> Optional[NDArray[np.float32]]: ...
    def __len__(self) -> int: ...

class Scene:
    def __init__(self) -> None: ...
    def add_mesh(
        self,
        vertices: Union[ArrayLike, object],
        triangles: Optional[ArrayLike] = None,
        *,
        normals: Optional[ArrayLike] = None,
        uvs: Optional[ArrayLike] = None,
        colors: Optional[ArrayLike] = None,
        material: Union[int, str, Dict[str, object], None] = None,
        name: str = "",
    ) -> int: ...
    def add_spheres(
        self,
        centers: ArrayLike,
        radii: ArrayLike,
        *,
        material: Union[int, str, Dict[str, object], None] = None,
        name: str = "",
    ) -> int: ...
    def add_instance(
        self,
        mesh: int,
        *,
        transform: Optional[ArrayLike] = None,
        material: Union[int, str, Dict[str, object], None] = None,
        name: str = "",
        dynamic: bool = False,
    ) -> int: ...
    def set_transform(self, instance: int, transform: ArrayLike) -> None: ...
    def set_motion(self, instance: int, times: Sequence[float], transforms: ArrayLike) -> None: ...
    def set_time(self, time: float) -> None: ...
    def open_shutter(
        self,
        open: float,
        close: float,
        *,
        time: float = 0.0,
        shape: str = "box",
        rolling: Optional[str] = None,
    ) -> List[str]: ...
    def set_transforms(self, transforms: ArrayLike, instances: Optional[ArrayLike] = None) -> None: ...
    def set_material(self, material: int, **settings: object) -> None: ...
    def set_instance_material(self, instance: int, material: Optional[int]) -> None: ...
    def set_visible(self, instance: int, visible: bool) -> None: ...
    def set_vertices(
        self,
        mesh: int,
        vertices: ArrayLike,
        triangles: Optional[ArrayLike] = None,
        *,
        normals: Optional[ArrayLike] = None,
    ) -> None: ...
    def subdivide(
        self,
        mesh: int,
        *,
        scheme: str = "catmull-clark",
        levels: Optional[int] = None,
        edge_length: Optional[float] = None,
        edge_pixels: Optional[float] = None,
        max_levels: int = 8,
        height: int = 720,
        polygons: Optional[Sequence[Sequence[int]]] = None,
        crease_angle: Optional[float] = None,
        creases: Sequence[Tuple[int, int, float]] = ...,
        corners: Sequence[Tuple[int, float]] = ...,
        displacement: Union[ArrayLike, Dict[str, object], None] = None,
        scale: float = 1.0,
        midlevel: float = 0.0,
        space: str = "normal",
    ) -> List[str]: ...
    def remove_instance(self, instance: int) -> None: ...
    def remove_mesh(self, mesh: int) -> None: ...
    def remove_light(self, light: int) -> None: ...
    def remove_camera(self, camera: int) -> None: ...
    def save(self, path: Union[str, "os.PathLike[str]"]) -> None: ...
    @property
    def mesh_names(self) -> List[str]: ...
    @property
    def light_names(self) -> List[str]: ...
    def transform(self, instance: int) -> NDArray[np.float64]: ...
    def add_material(
        self,
        name: str = "",
        *,
        model: str = "metallic-roughness",
        base_color: Optional[ArrayLike] = None,
        metallic: float = 0.0,
        roughness: float = 0.5,
        specular: float = 1.0,
        ior: float = 1.5,
        transmission: float = 0.0,
        thin_walled: bool = False,
        emission: Optional[ArrayLike] = None,
        emission_two_sided: bool = False,
        alpha_mode: str = "opaque",
        alpha_cutoff: float = 0.5,
        base_color_texture: Union[NDArray[np.uint8], NDArray[np.float32], Dict[str, Any], None] = None,
        metallic_roughness_texture: Union[NDArray[np.uint8], NDArray[np.float32], Dict[str, Any], None] = None,
        emission_texture: Union[NDArray[np.uint8], NDArray[np.float32], Dict[str, Any], None] = None,
        normal_texture: Union[NDArray[np.uint8], NDArray[np.float32], Dict[str, Any], None] = None,
        sheen_color: Optional[ArrayLike] = None,
        specular_color: Optional[ArrayLike] = None,
        iridescence_thickness: float = 400.0,
        anisotropy: float = 0.0,
        anisotropy_rotation: float = 0.0,
        diffuse_transmission_color: Optional[ArrayLike] = None,
        attenuation_color: Optional[ArrayLike] = None,
        attenuation_distance: float = ...,
        medium: Optional[Medium] = None,
        subsurface_radius: Optional[ArrayLike] = None,
        subsurface_anisotropy: float = 0.0,
        priority: Optional[int] = None,
        **layers: float,
    ) -> int: ...
    def add_point_light(self, position: ArrayLike, intensity: ArrayLike, *, name: str = "") -> int: ...
    def add_spot_light(
        self,
        position: ArrayLike,
        direction: ArrayLike,
        intensity: ArrayLike,
        *,
        inner_angle: float = 0.0,
        outer_angle: float = 0.5,
        name: str = "",
    ) -> int: ...
    def add_projector(
        self,
        position: ArrayLike,
        direction: ArrayLike,
        picture: Union[ArrayLike, Dict[str, Any]],
        intensity: ArrayLike,
        *,
        field_of_view: float = 0.5,
        up: Optional[ArrayLike] = None,
        name: str = "",
    ) -> int: ...
    def add_directional_light(
        self, direction: ArrayLike, irradiance: ArrayLike, *, angular_diameter: float = 0.0, name: str = ""
    ) -> int: ...
    def set_environment(
        self,
        radiance: Union[ArrayLike, Dict[str, Any], None],
        *,
        rotation: float = 0.0,
        intensity: float = 1.0,
    ) -> None: ...
    def add_portal(self, corners: ArrayLike) -> None: ...
    def set_fog(self, medium: Optional[Medium], *, top: float = ...) -> None: ...
    def add_camera(self, camera: Camera) -> int: ...
    @property
    def cameras(self) -> List[Camera]: ...
    @property
    def default_camera(self) -> Camera: ...
    @property
    def name(self) -> str: ...
    @property
    def instance_names(self) -> List[str]: ...
    @property
    def material_names(self) -> List[str]: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def origin(self) -> NDArray[np.float64]: ...
    @property
    def bounds(self) -> Optional[NDArray[np.float32]]: ...
    @property
    def report(self) -> List[str]: ...
    def intersect(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: float = 0.0,
        t_max: float = ...,
        normals: bool = True,
        coherent: bool = False,
    ) -> Hits: ...
    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: float = 0.0,
        t_max: float = ...,
        coherent: bool = False,
    ) -> NDArray[np.bool_]: ...
    def explain(
        self,
        x: int,
        y: int,
        *,
        sample: int = 0,
        width: Optional[int] = None,
        height: Optional[int] = None,
        **settings: Any,
    ) -> Dict[str, Any]: ...
    def render(
        self,
        width: Optional[int] = None,
        height: Optional[int] = None,
        spp: Optional[int] = None,
        *,
        camera: Union[Camera, int, str, None] = None,
        aovs: Sequence[str] = ...,
        seed: int = 0,
        integrator: Optional[str] = None,
        max_depth: Optional[int] = None,
        mis: str = "power",
        clamp_indirect: Optional[float] = None,
        caustics: Optional[str] = None,
        guiding: Optional[str] = None,
        ambient_distance: Optional[float] = None,
        sampler: str = "sobol",
        crop: Optional[Sequence[int]] = None,
        first_sample: int = 0,
        time: float = 0.0,
        time_limit: Optional[float] = None,
        noise: Optional[float] = None,
        backend: str = "auto",
        adapter: Optional[str] = None,
        threads: Optional[int] = None,
        progress: Optional[Callable[[float], object]] = None,
    ) -> Picture: ...
    def render_part(
        self,
        width: Optional[int] = None,
        height: Optional[int] = None,
        spp: Optional[int] = None,
        *,
        tile: Optional[str] = None,
        samples: Optional[Tuple[int, int]] = None,
        frame: Optional[int] = None,
        camera: Union[Camera, int, str, None] = None,
        aovs: Sequence[str] = ...,
        seed: int = 0,
        integrator: Optional[str] = None,
        max_depth: Optional[int] = None,
        ambient_distance: Optional[float] = None,
        sampler: str = "sobol",
        crop: Optional[Sequence[int]] = None,
        time: float = 0.0,
        backend: str = "auto",
        adapter: Optional[str] = None,
        threads: Optional[int] = None,
        progress: Optional[Callable[[float], object]] = None,
    ) -> Part: ...
    def render_views(
        self,
        poses: ArrayLike,
        intrinsics: ArrayLike,
        width: Union[int, Sequence[int]],
        height: Union[int, Sequence[int]],
        *,
        layers: Sequence[str] = ("rgb",),
        spp: Optional[int] = None,
        integrator: Optional[str] = None,
        max_depth: Optional[int] = None,
        next_poses: Optional[ArrayLike] = None,
        axes: str = "opencv",
        seed: int = 0,
        sampler: str = "sobol",
        backend: str = "auto",
        adapter: Optional[str] = None,
        threads: Optional[int] = None,
        progress: Optional[Callable[[float], object]] = None,
    ) -> Dict[str, Any]: ...
    def observe(
        self,
        camera: Camera,
        width: int,
        height: int,
        *,
        next_camera: Optional[Camera] = None,
        next_transforms: Optional[Dict[int, ArrayLike]] = None,
        categories: Dict[str, str] = ...,
    ) -> Dict[str, NDArray[np.generic]]: ...
    def boxes(self) -> Tuple[NDArray[np.float32], NDArray[np.float32]]: ...
    def write_dataset(
        self,
        folder: Union[str, "os.PathLike[str]"],
        width: int,
        height: int,
        *,
        matrix: ArrayLike,
        poses: ArrayLike,
        distortion: Optional[ArrayLike] = None,
        fisheye: bool = False,
        moves: Dict[str, ArrayLike] = ...,
        categories: Dict[str, str] = ...,
        spp: Optional[int] = None,
        seed: int = 0,
        backend: str = "auto",
        progress: Optional[Callable[[float], object]] = None,
    ) -> int: ...

class Part:
    @staticmethod
    def load(path: Union[str, "os.PathLike[str]"]) -> Part: ...
    @staticmethod
    def from_bytes(data: bytes) -> Part: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: Union[str, "os.PathLike[str]"]) -> None: ...
    @property
    def is_complete(self) -> bool: ...
    def picture(self, *, allow_missing: bool = False) -> Picture: ...

def merge(parts: Iterable[Part]) -> Part: ...

class Lidar:
    def __init__(
        self,
        channels: int = 64,
        *,
        elevation: Optional[ArrayLike] = None,
        elevations: Optional[ArrayLike] = None,
        azimuths: int = 1024,
        azimuth: Optional[ArrayLike] = None,
        range: Optional[ArrayLike] = None,
        divergence: float = 0.0,
        beam_rays: int = 16,
        returns: str = "strongest",
        range_resolution: float = 0.3,
        noise: float = 0.0,
        min_intensity: float = 0.0,
        seed: int = 0,
    ) -> None: ...
    def scan(self, scene: Scene, pose: ArrayLike) -> PointCloud: ...

class PointCloud:
    @property
    def positions(self) -> NDArray[np.float32]: ...
    @property
    def ranges(self) -> NDArray[np.float32]: ...
    @property
    def intensities(self) -> NDArray[np.float32]: ...
    @property
    def channels(self) -> NDArray[np.uint16]: ...
    @property
    def firings(self) -> NDArray[np.uint32]: ...
    @property
    def instances(self) -> NDArray[np.int32]: ...
    def save(self, path: Union[str, "os.PathLike[str]"]) -> None: ...
    def __len__(self) -> int: ...

def level_pose(position: ArrayLike, heading: float = 0.0) -> NDArray[np.float64]: ...
def load(
    path: Union[str, "os.PathLike[str]"],
    *,
    parameters: Optional[Dict[str, str]] = None,
    lenient: bool = False,
    daylight: bool = True,
    allow_paths: Optional[Sequence[Union[str, "os.PathLike[str]"]]] = None,
    max_memory: Optional[int] = None,
    max_load_time: Optional[float] = None,
    cull_backs: bool = False,
    exact_terminator: bool = False,
    keep_normals: bool = False,
    untrusted: bool = False,
) -> Scene: ...
def backends() -> List[Backend]: ...
def scenes() -> List[str]: ...
def denoise(
    color: ArrayLike,
    *,
    albedo: Optional[ArrayLike] = None,
    normal: Optional[ArrayLike] = None,
    error: Optional[ArrayLike] = None,
) -> NDArray[np.float32]: ...
class SequenceDenoiser:
    def __init__(self) -> None: ...
    def denoise(
        self,
        color: ArrayLike,
        *,
        albedo: Optional[ArrayLike] = None,
        normal: Optional[ArrayLike] = None,
        error: Optional[ArrayLike] = None,
        motion: Optional[ArrayLike] = None,
        distance: Optional[ArrayLike] = None,
        ids: Optional[ArrayLike] = None,
    ) -> NDArray[np.float32]: ...

def encode_png(color: ArrayLike, *, tonemap: str = "srgb", exposure: float = 1.0) -> bytes: ...
def write_file(path: str | os.PathLike[str], data: bytes) -> None: ...
def write_picture(
    path: str | os.PathLike[str], layers: Dict[str, NDArray], *, tonemap: str = "srgb", exposure: float = 1.0
) -> None: ...
