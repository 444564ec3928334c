"""Scenes of `MuJoCo <https://mujoco.org>`_ models: what a simulation's cameras see, path traced or as exact layers.

`from_mujoco` makes a scene of a model; `MujocoScene.update` moves it to where the simulation is::

    import alhazen, mujoco

    model = mujoco.MjModel.from_xml_path("arm.xml")
    data = mujoco.MjData(model)
    scene = alhazen.from_mujoco(model)
    mujoco.mj_step(model, data)
    scene.update(data)
    views = scene.render_views(128, 128, layers=["rgb", "depth", "instance"], spp=16)

The scene's world is MuJoCo's: metres, +Z up. Colours, which MuJoCo shows as they are, are taken for sRGB. The package
``mujoco`` itself is only needed to make models: nothing here imports it before `from_mujoco` is called.
"""

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _mujoco_shapes as shapes
from ._alhazen import Camera, Scene

__all__ = ["MujocoScene", "from_mujoco"]

#: Kinds of geoms (mjtGeom) that have a shape here.
_PLANE, _HFIELD, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(8)
#: What MuJoCo gives a geom that no file gave a colour.
_DEFAULT_RGBA = np.array([0.5, 0.5, 0.5, 1.0], np.float32)
#: Kinds of textures (mjtTexture).
_TEXTURE_2D, _TEXTURE_CUBE, _TEXTURE_SKYBOX = range(3)
#: Where in a row of `mat_texid` the texture of the colour is (mjtTextureRole).
_ROLE_RGB = 1


def from_mujoco(
    model: Any,
    data: Any = None,
    *,
    groups: Sequence[int] = (0, 1, 2),
    worlds: int = 1,
    spacing: Optional[float] = None,
) -> "MujocoScene":
    """Makes a scene of a MuJoCo model.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData, optional
        Where everything is; the model's first pose if not given.
    groups : sequence of int, default (0, 1, 2)
        Geoms of these groups are seen, as in MuJoCo's own viewer.
    worlds : int, default 1
        Copies of the model in one scene, each of which `MujocoScene.update` moves by itself: their cameras see them in one
        call. They stand on a grid, `spacing` apart; planes without an end are there once.
    spacing : float, optional
        Metres between the origins of worlds; ten times the extent of the model if not given.

    Returns
    -------
    MujocoScene
        Its `report` says what was left out or approximated.

    Raises
    ------
    ImportError
        Without the package ``mujoco``.
    """
    try:
        import mujoco
    except ImportError as error:
        raise ImportError("alhazen.from_mujoco needs the package mujoco: pip install mujoco") from error
    if not isinstance(model, mujoco.MjModel):
        raise TypeError(f"model: expected a mujoco.MjModel, got {type(model).__name__}")
    if worlds < 1:
        raise ValueError(f"worlds: {worlds} is not at least 1")
    if data is None:
        data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    extent = float(model.stat.extent)
    return _Builder(model, data, groups).build(worlds, 10 * extent if spacing is None else float(spacing))


def _linear(rgb: Any) -> NDArray[np.float64]:
    """Linear light of colours that are sRGB."""
    rgb = np.clip(np.asarray(rgb, np.float64), 0, 1)
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


class MujocoScene:
    """A scene that follows simulations of a MuJoCo model; `from_mujoco` makes it.

    Attributes
    ----------
    scene : Scene
        To be rendered, or asked by rays, as any other. More may be added to it.
    model : mujoco.MjModel
    geoms : ndarray of int, shape (n,)
        The geom of each instance: ``geoms[views["instance"]]`` is the geom that a pixel sees.
    worlds : ndarray of int, shape (n,)
        The world of each instance.
    origins : ndarray, shape (worlds, 3)
        Where each world's origin is, metres.
    report : list of str
        What was left out or approximated.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        scene: Scene,
        placed: Sequence[Tuple[int, int, NDArray[np.float64]]],
        origins: NDArray[np.float64],
        report: List[str],
    ) -> None:
        self.model = model
        self.scene = scene
        self.report = report
        self.origins = origins
        self.worlds = np.array([world for world, _, _ in placed], int)
        self.geoms = np.array([geom for _, geom, _ in placed], int)
        self._scales = np.array([scale for _, _, scale in placed], float).reshape(-1, 3)
        self._instances = np.arange(len(placed))
        self._cameras = np.zeros((len(origins), model.ncam, 4, 4))
        self.update([data] * len(origins))

    def update(self, data: Any) -> None:
        """Moves everything to where simulations are.

        Parameters
        ----------
        data : mujoco.MjData, or a sequence of one for each world
            After ``mj_forward`` or ``mj_step``.
        """
        all_data = [data] if hasattr(data, "geom_xpos") else list(data)
        if len(all_data) != len(self.origins):
            raise ValueError(f"data: expected {len(self.origins)}, one for each world, got {len(all_data)}")
        axes = np.stack([d.geom_xmat for d in all_data]).reshape(len(all_data), -1, 3, 3)
        at = np.stack([d.geom_xpos for d in all_data]) + self.origins[:, None]
        transforms = np.empty((len(self.geoms), 3, 4))
        transforms[:, :, :3] = axes[self.worlds, self.geoms] * self._scales[:, None, :]
        transforms[:, :, 3] = at[self.worlds, self.geoms]
        self.scene.set_transforms(transforms, self._instances)
        for poses, d, origin in zip(self._cameras, all_data, self.origins):
            poses[:, :3, :3] = d.cam_xmat.reshape(-1, 3, 3)
            poses[:, :3, 3] = d.cam_xpos + origin
            poses[:, 3, 3] = 1

    def poses(self, camera: Union[int, str, None] = None) -> NDArray[np.float64]:
        """Where the model's cameras are now.

        Parameters
        ----------
        camera : int or str, optional
            One camera by its number or name; all of them if not given.

        Returns
        -------
        ndarray, shape (worlds × cameras, 4, 4)
            Camera to world with OpenGL's axes, world by world.
        """
        chosen = slice(None) if camera is None else [self._camera(camera)]
        return self._cameras[:, chosen].reshape(-1, 4, 4)

    def intrinsics(self, width: int, height: int, camera: Union[int, str, None] = None) -> NDArray[np.float64]:
        """Intrinsics of the model's cameras, as OpenCV has them.

        Parameters
        ----------
        width, height : int
            Pixels.
        camera : int or str, optional
            One camera by its number or name; all of them if not given.

        Returns
        -------
        ndarray, shape (worlds × cameras, 3, 3)
            World by world, as `poses`.
        """
        model = self.model
        numbers = range(model.ncam) if camera is None else [self._camera(camera)]
        matrices = np.tile(np.eye(3), (len(numbers), 1, 1))
        for matrix, number in zip(matrices, numbers):
            focal = 0.5 * height / np.tan(0.5 * np.radians(model.cam_fovy[number]))
            matrix[0, 0] = matrix[1, 1] = focal
            matrix[:2, 2] = 0.5 * (width - 1), 0.5 * (height - 1)
            sensor = getattr(model, "cam_sensorsize", np.zeros((model.ncam, 2)))[number]
            if (sensor > 0).all():
                pixels = np.array([width, height]) / sensor
                matrix[[0, 1], [0, 1]] = model.cam_intrinsic[number, :2] * pixels
                matrix[:2, 2] += model.cam_intrinsic[number, 2:] * pixels * [-1, 1]
        return np.tile(matrices, (len(self.origins), 1, 1))

    def render_views(
        self, width: int, height: int, *, camera: Union[int, str, None] = None, **options: Any
    ) -> Dict[str, Any]:
        """What the model's cameras see, of all worlds in one call.

        Parameters
        ----------
        width, height : int
            Pixels.
        camera : int or str, optional
            One camera by its number or name; all of them if not given.
        **options
            layers, spp, integrator and others, as for `Scene.render_views`.

        Returns
        -------
        dict of str to ndarray
            By layer, of shape (worlds × cameras, height, width, …), world by world.
        """
        if self.model.ncam == 0:
            raise ValueError("the model has no camera; give poses to scene.render_views")
        matrices = self.intrinsics(width, height, camera)
        return self.scene.render_views(self.poses(camera), matrices, width, height, axes="opengl", **options)

    def _camera(self, camera: Union[int, str]) -> int:
        names = [self.model.camera(i).name for i in range(self.model.ncam)]
        if isinstance(camera, str) and camera in names:
            return names.index(camera)
        if isinstance(camera, int) and 0 <= camera < len(names):
            return camera
        raise ValueError(f"camera: there is no {camera!r}; the model has {names}")


class _Builder:
    """Translates a model."""

    def __init__(self, model: Any, data: Any, groups: Sequence[int]) -> None:
        self.model, self.data, self.groups = model, data, set(groups)
        self.scene = Scene()
        self.report: List[str] = []
        self.meshes: Dict[Any, int] = {}
        self.materials: Dict[Any, int] = {}

    def note(self, text: str) -> None:
        """Says something once."""
        if text not in self.report:
            self.report.append(text)

    def build(self, worlds: int, spacing: float) -> MujocoScene:
        model, placed = self.model, []
        side = int(np.ceil(np.sqrt(worlds)))
        grid = [[spacing * (i % side), spacing * (i // side), 0.0] for i in range(worlds)]
        rooted = model.body_rootid[model.geom_bodyid]
        moving = (model.body_weldid[model.geom_bodyid] != 0) | (model.body_mocapid[rooted] >= 0)
        for geom in range(model.ngeom):
            made = self.shape(geom)
            if made is None:
                continue
            mesh, scale = made
            for world in range(1 if self.endless(geom) and not moving[geom] else worlds):
                name = model.geom(geom).name or f"geom {geom}"
                self.scene.add_instance(mesh, name=name, material=self.material(geom), dynamic=bool(moving[geom]))
                placed.append((world, geom, scale))
        self.lights(grid)
        self.left_out()
        for number in range(model.ncam):
            eye = self.data.cam_xpos[number]
            right, up, back = self.data.cam_xmat[number].reshape(3, 3).T
            fov_y = np.radians(model.cam_fovy[number])
            self.scene.add_camera(Camera.look_at(eye, eye - back, up=up, fov_y=fov_y))
        return MujocoScene(model, self.data, self.scene, placed, np.array(grid), self.report)

    def left_out(self) -> None:
        """Says what models have that is not shown."""
        model = self.model
        for count, what in [("nflex", "flexes"), ("nskin", "skins"), ("ntendon", "tendons"), ("nsite", "sites")]:
            if getattr(model, count, 0):
                self.note(f"{getattr(model, count)} {what} are not shown")

    # Shapes

    def shape(self, geom: int) -> Optional[Tuple[int, NDArray[np.float64]]]:
        """The mesh of a geom, and how it is scaled; None if it is not seen."""
        model = self.model
        if model.geom_group[geom] not in self.groups or self.rgba(geom)[3] <= 0:
            return None
        kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom], float)
        key, scale, make = self.plan(geom, kind, size)
        if key is None:
            self.note(f"geom {geom}: shapes of type {kind} are not known")
            return None
        texture = self.texture(geom)
        kind_of_texture = None if texture is None else int(model.tex_type[texture])
        repeat = self.repeat(geom, scale) if kind_of_texture == _TEXTURE_2D else None
        key = (key, kind_of_texture, repeat)
        if key not in self.meshes:
            self.meshes[key] = self.add(make, kind, kind_of_texture, repeat)
        return self.meshes[key], scale

    def plan(self, geom: int, kind: int, size: NDArray[np.float64]) -> Tuple[Any, NDArray[np.float64], Any]:
        """What tells a geom's mesh from others, its scale, and what makes it."""
        one = np.ones(3)
        if kind == _PLANE:
            # As far as MuJoCo shows anything.
            far = float(self.model.vis.map.zfar * self.model.stat.extent)
            size = np.where(size > 0, size, far)
            return "plane", np.array([size[0], size[1], 1.0]), shapes.plane
        if kind == _SPHERE:
            return "sphere", one * size[0], shapes.ball
        if kind == _ELLIPSOID:
            return "ball", size, shapes.ball
        if kind == _BOX:
            return "box", size, shapes.box
        if kind == _CYLINDER:
            return "cylinder", np.array([size[0], size[0], size[1]]), shapes.cylinder
        if kind == _CAPSULE:
            return ("capsule", size[1] / size[0]), one * size[0], lambda: shapes.capsule(size[1] / size[0])
        number = int(self.model.geom_dataid[geom])
        if kind == _HFIELD and number >= 0:
            return ("hfield", number), one, lambda: shapes.height_field(self.model, number)
        if number >= 0 and kind in (_MESH, 8):
            return ("mesh", number), one, lambda: shapes.mesh(self.model, number)
        return None, one, None

    def add(self, make: Any, kind: int, texture: Optional[int], repeat: Any) -> int:
        """Adds a mesh with the coordinates that its texture wants."""
        if kind == _SPHERE and texture is None:
            return self.scene.add_spheres([[0, 0, 0]], [1.0])
        made = make()
        if texture == _TEXTURE_CUBE:
            made = shapes.with_cube_coordinates(made)
        elif texture == _TEXTURE_2D and made.uvs is None:
            made.uvs = (repeat[2] + made.vertices[:, :2] * [0.5, -0.5]) * repeat[:2]
        elif texture == _TEXTURE_2D:
            made.uvs = made.uvs * repeat[:2]
        return self.scene.add_mesh(made.vertices, made.triangles, normals=made.normals, uvs=made.uvs)

    def endless(self, geom: int) -> bool:
        """Whether a geom is a plane without an end."""
        is_plane = self.model.geom_type[geom] == _PLANE
        return bool(is_plane and not (self.model.geom_size[geom, :2] > 0).all())

    def repeat(self, geom: int, scale: NDArray[np.float64]) -> Tuple[float, float, float]:
        """How often a 2D texture is repeated along x and y, and where on the object it begins, from 0 to 1."""
        material = self.model.geom_matid[geom]
        repeat = np.array(self.model.mat_texrepeat[material], float)
        # By two metres, or by the object.
        if self.model.mat_texuniform[material] or self.endless(geom):
            repeat = repeat * scale[:2]
        return float(repeat[0]), float(repeat[1]), 0.0 if self.endless(geom) else 0.5

    # Materials

    def rgba(self, geom: int) -> NDArray[np.float64]:
        model, material = self.model, self.model.geom_matid[geom]
        own = model.geom_rgba[geom]
        return own if material < 0 or (own != _DEFAULT_RGBA).any() else model.mat_rgba[material]

    def texture(self, geom: int) -> Optional[int]:
        """The texture of a geom's colour."""
        material = int(self.model.geom_matid[geom])
        if material < 0:
            return None
        of_roles = np.atleast_1d(self.model.mat_texid[material])
        number = int(of_roles[_ROLE_RGB if len(of_roles) > 1 else 0])
        if len(of_roles) > 1 and (np.delete(of_roles, _ROLE_RGB) >= 0).any():
            self.note("of materials' textures only those of the colour are shown")
        return number if number >= 0 and self.model.tex_type[number] != _TEXTURE_SKYBOX else None

    def picture(self, number: int) -> NDArray[np.uint8]:
        """A texture's picture; of a cube its six faces below each other."""
        model = self.model
        height, width = int(model.tex_height[number]), int(model.tex_width[number])
        channels = int(model.tex_nchannel[number]) if hasattr(model, "tex_nchannel") else 3
        values = model.tex_data if hasattr(model, "tex_data") else model.tex_rgb
        first = int(model.tex_adr[number])
        picture = np.array(values[first : first + height * width * channels], np.uint8)
        picture = picture.reshape(height, width, channels)
        return np.repeat(picture, 3, axis=2) if channels == 1 else picture

    def material(self, geom: int) -> int:
        """The material of a geom."""
        number, rgba = int(self.model.geom_matid[geom]), self.rgba(geom)
        texture = self.texture(geom)
        key = (number, tuple(rgba), texture)
        if key not in self.materials:
            self.materials[key] = self.scene.add_material(**self.described(number, rgba, texture))
        return self.materials[key]

    def described(self, number: int, rgba: NDArray[np.float64], texture: Optional[int]) -> Dict[str, Any]:
        """What `Scene.add_material` wants to know."""
        model, color = self.model, _linear(rgba[:3])
        options: Dict[str, Any] = {"base_color": [*color, float(np.clip(rgba[3], 0, 1))]}
        if rgba[3] < 1:
            options["alpha_mode"] = "blend"
        if texture is not None:
            options["base_color_texture"] = self.picture(texture)
        if number < 0:
            return {"name": f"rgba {rgba.round(3).tolist()}", "roughness": 0.6, "specular": 0.5, **options}
        options["name"] = model.material(number).name or f"material {number}"
        options["specular"] = float(np.clip(model.mat_specular[number], 0, 1))
        # Blinn's exponent is 128 × shininess, and GGX's alpha of that sqrt(2 / (exponent + 2)).
        alpha = np.sqrt(2 / (128 * np.clip(model.mat_shininess[number], 0, 1) + 2))
        roughness = getattr(model, "mat_roughness", np.full(model.nmat, -1.0))[number]
        options["roughness"] = float(np.sqrt(alpha) if roughness < 0 else min(roughness, 1))
        metallic = getattr(model, "mat_metallic", np.full(model.nmat, -1.0))[number]
        options["metallic"] = float(np.clip(metallic, 0, 1))
        if model.mat_emission[number] > 0:
            options["emission"] = (model.mat_emission[number] * color).tolist()
        if model.mat_reflectance[number] > 0:
            options["roughness"] = min(options["roughness"], 0.1)
            self.note("reflectance: mirrors are surfaces of roughness 0.1")
        return options

    # Lights

    def lights(self, grid: Sequence[Sequence[float]]) -> None:
        """Adds the model's lights. MuJoCo's are no physical quantities: a surface that faces a light of diffuse 1 has its
        own colour, so the light's irradiance is π there."""
        model, head = self.model, self.model.vis.headlight
        sky = np.zeros(3)
        if head.active:
            sky += np.array(head.ambient) + 0.5 * np.array(head.diffuse)
            self.note("the headlight is light from all sides, half as bright as from the camera")
        for light in range(model.nlight):
            if model.light_active[light]:
                sky += model.light_ambient[light]
                self.light(light, grid)
        for number in np.flatnonzero(np.asarray(model.tex_type) == _TEXTURE_SKYBOX)[:1]:
            faces = _linear(self.picture(number) / 255.0).reshape(-1, 3)
            self.note("the skybox is its mean colour all around")
            sky += 0.5 * faces.mean(axis=0)
        self.scene.set_environment(sky.tolist())

    def light(self, light: int, grid: Sequence[Sequence[float]]) -> None:
        model, data = self.model, self.data
        name = model.light(light).name or f"light {light}"
        direction = np.array(data.light_xdir[light])
        strength = np.pi * np.array(model.light_diffuse[light], float)
        if model.body_weldid[model.light_bodyid[light]] != 0:
            self.note(f"{name} moves with a body, and here it does not")
        # The kinds of mjtLightType: 0 spot, 1 directional, 2 point.
        old = getattr(model, "light_directional", np.zeros(model.nlight))
        kind = int(getattr(model, "light_type", old)[light])
        if not strength.any() or kind > 2:
            self.note(f"{name} is left out: it has no diffuse light, or is an image")
            return
        if kind == 1:
            self.scene.add_directional_light(direction, irradiance=strength.tolist(), name=name)
            return
        distance = float(np.linalg.norm(data.light_xpos[light] - model.stat.center))
        intensity = (strength * distance**2).tolist()
        self.note("lights fade by the square of the distance; at the model's centre they are as bright as in MuJoCo")
        for origin in grid:
            at, cutoff = data.light_xpos[light] + origin, float(model.light_cutoff[light])
            if kind == 2 or cutoff >= 90:
                self.scene.add_point_light(at, intensity=intensity, name=name)
            else:
                outer = float(np.radians(cutoff))
                angles = {"inner_angle": 0.8 * outer, "outer_angle": outer}
                self.scene.add_spot_light(at, direction, intensity=intensity, **angles, name=name)
