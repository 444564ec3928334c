"""Scenes of MuJoCo models: depths of shapes whose sizes are known, materials, cameras, worlds."""

import os
import pathlib
import runpy

import numpy as np
import pytest

import alhazen

mujoco = pytest.importorskip("mujoco", reason="pip install mujoco")

#: A shape of each kind, a metre apart on a floor, each 0.4 m high but the mesh and the height field; a ball that falls.
SHAPES = """
<mujoco>
  <visual><headlight ambient="0.2 0.2 0.2" diffuse="0.4 0.4 0.4"/></visual>
  <asset>
    <texture name="checks" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>
    <texture name="sides" type="cube" builtin="flat" rgb1="0 1 0" rgb2="1 1 0" width="16" height="96"/>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="1 1 1" width="16" height="96"/>
    <material name="floor" texture="checks" texrepeat="4 4" reflectance="0.2"/>
    <material name="painted" texture="sides"/>
    <material name="steel" rgba="0.5 0.5 0.5 1" metallic="1" roughness="0.3"/>
    <mesh name="wedge" vertex="-0.2 -0.2 -0.1  0.2 -0.2 -0.1  0.2 0.2 -0.1  -0.2 0.2 -0.1  0 0 0.3"/>
    <hfield name="hill" nrow="3" ncol="3" size="0.3 0.3 0.4 0.1" elevation="0 0 0  0 1 0  0 0 0"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="0 0 4" dir="0 0 -1" diffuse="0.5 0.5 0.5"/>
    <light name="sun" type="directional" dir="0 1 -1" diffuse="0.3 0.3 0.3"/>
    <camera name="above" pos="3 0 5" xyaxes="1 0 0 0 1 0" fovy="90"/>
    <camera name="side" pos="3 -6 0.2" xyaxes="1 0 0 0 0 1" fovy="60"/>
    <geom name="floor" type="plane" size="20 20 1" material="floor"/>
    <geom name="ball" type="sphere" size="0.2" pos="0 0 0.2" rgba="1 0 0 1"/>
    <geom name="box" type="box" size="0.3 0.2 0.2" pos="1 0 0.2" material="painted"/>
    <geom name="cylinder" type="cylinder" size="0.2 0.2" pos="2 0 0.2" material="steel"/>
    <geom name="capsule" type="capsule" size="0.1 0.1" pos="3 0 0.2"/>
    <geom name="egg" type="ellipsoid" size="0.3 0.1 0.2" pos="4 0 0.2"/>
    <geom name="wedge" type="mesh" mesh="wedge" pos="5 0 0.1"/>
    <geom name="hill" type="hfield" hfield="hill" pos="6 0 0"/>
    <geom name="hidden" type="box" size="1 1 1" pos="3 0 3" group="3"/>
    <body name="falling" pos="3 1 2"><freejoint/><geom name="drop" type="sphere" size="0.2"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(SHAPES)


def seen(scene, views, world=0):
    """The depth in the middle of each geom of a picture from above, by its name."""
    geom = np.where(views["instance"] >= 0, scene.geoms[views["instance"]], -1)[world]
    depth = views["depth"][world]
    names = {scene.model.geom(g).name: g for g in np.unique(geom) if g >= 0}
    return {name: depth[geom == g].min() for name, g in names.items()}


def test_shapes_have_their_size_and_place(model):
    scene = alhazen.from_mujoco(model)
    views = scene.render_views(257, 257, camera="above", layers=["depth", "instance"], backend="cpu")
    nearest = seen(scene, views)
    assert set(nearest) == {"floor", "ball", "box", "cylinder", "capsule", "egg", "wedge", "hill", "drop"}
    assert nearest["floor"] == pytest.approx(5, abs=1e-4)
    for name in ["ball", "box", "cylinder", "capsule", "egg"]:
        assert nearest[name] == pytest.approx(4.6, abs=0.01), name
    assert nearest["hill"] == pytest.approx(4.6, abs=0.03)
    assert nearest["drop"] == pytest.approx(2.8, abs=0.01)
    # MuJoCo moves a mesh to its centre of mass and says so: its top is at 0.4.
    assert nearest["wedge"] == pytest.approx(4.6, abs=0.05)
    # The capsule is under the camera: 257 pixels are 9.6 m where it is widest.
    capsule = (scene.geoms[views["instance"][0]] == model.geom("capsule").id).any(axis=0)
    assert capsule.sum() == pytest.approx(0.2 * 257 / 9.6, abs=1.5)


def test_what_moves_follows_the_simulation(model):
    data = mujoco.MjData(model)
    scene = alhazen.from_mujoco(model, data)
    for _ in range(100):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    scene.update(data)
    views = scene.render_views(129, 129, camera=0, layers=["depth", "instance"], backend="cpu")
    top = data.geom("drop").xpos[2] + 0.2
    assert top < 2.2
    assert seen(scene, views)["drop"] == pytest.approx(5 - top, abs=0.01)


def test_worlds_are_seen_in_one_call(model):
    both = [mujoco.MjData(model), mujoco.MjData(model)]
    both[1].qpos[2] = 0.5
    for data in both:
        mujoco.mj_forward(model, data)
    scene = alhazen.from_mujoco(model, worlds=2, spacing=60)
    scene.update(both)
    views = scene.render_views(129, 129, layers=["depth", "instance", "rgb"], spp=1, integrator="direct", backend="cpu")
    assert views["depth"].shape == (4, 129, 129) and views["rgb"].shape == (4, 129, 129, 3)
    assert seen(scene, views, 0)["drop"] == pytest.approx(2.8, abs=0.01)
    assert seen(scene, views, 2)["drop"] == pytest.approx(4.3, abs=0.01)
    ids = views["instance"]
    assert set(scene.worlds[np.unique(ids[2])]) == {1}
    with pytest.raises(ValueError, match="data: expected 2"):
        scene.update(both[0])


def test_colours_and_lights_are_those_of_the_model(model):
    scene = alhazen.from_mujoco(model)
    layers = ["albedo", "instance", "rgb"]
    views = scene.render_views(129, 129, camera="above", layers=layers, spp=4, backend="cpu")
    geom = scene.geoms[views["instance"][0]]
    albedo = views["albedo"][0]

    def of(name):
        return albedo[geom == model.geom(name).id]

    np.testing.assert_allclose(of("ball"), np.broadcast_to([1, 0, 0], of("ball").shape), atol=1e-5)
    assert np.median(of("box"), axis=0) == pytest.approx([0, 1, 0], abs=0.02)
    assert np.median(of("cylinder"), axis=0) == pytest.approx([0.214] * 3, abs=0.01)
    floor = of("floor")
    assert (floor[:, 0] > 0.9).mean() > 0.3 and (floor[:, 2] > 0.9).mean() > 0.3
    assert views["rgb"].mean() > 0.05
    told = " ".join(scene.report)
    for what in ["reflectance", "headlight", "skybox", "square of the distance"]:
        assert what in told, told


def test_cameras_are_those_of_the_model(model):
    scene = alhazen.from_mujoco(model)
    assert scene.poses().shape == (2, 4, 4) and scene.intrinsics(64, 48).shape == (2, 3, 3)
    side = scene.render_views(65, 65, camera="side", layers=["depth", "instance"], backend="cpu")
    assert seen(scene, side)["capsule"] == pytest.approx(5.9, abs=0.01)
    matrix = scene.intrinsics(100, 100, "above")[0]
    np.testing.assert_allclose(matrix, [[50, 0, 49.5], [0, 50, 49.5], [0, 0, 1]], atol=1e-4)
    with pytest.raises(ValueError, match="there is no 'below'"):
        scene.poses("below")
    empty = alhazen.from_mujoco(mujoco.MjModel.from_xml_string("<mujoco/>"))
    with pytest.raises(ValueError, match="no camera"):
        empty.render_views(8, 8)


def own_renderer(model, data, camera, size):
    """Depth, geoms and colours by MuJoCo's own renderer, where that runs."""
    if not (os.environ.get("MUJOCO_GL") or os.environ.get("DISPLAY")):
        pytest.skip("MuJoCo's renderer ends the process where there is no display; MUJOCO_GL=egl")
    try:
        renderer = mujoco.Renderer(model, size, size)
    except Exception as error:  # whatever the display says
        pytest.skip(f"MuJoCo's renderer does not run here: {error}")
    renderer.update_scene(data, camera=camera)
    color = renderer.render().astype(float)
    renderer.enable_depth_rendering()
    depth = renderer.render().copy()
    renderer.disable_depth_rendering()
    renderer.enable_segmentation_rendering()
    return depth, renderer.render()[..., 0].copy(), color


@pytest.mark.parametrize("camera", ["above", "side"])
def test_pictures_are_those_of_mujocos_own_renderer(model, camera):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    depth, geoms, color = own_renderer(model, data, camera, 129)
    scene = alhazen.from_mujoco(model, data)
    layers = ["depth", "instance", "albedo"]
    views = scene.render_views(129, 129, camera=camera, layers=layers, backend="cpu")
    there = views["instance"][0] >= 0
    found = np.where(there, scene.geoms[views["instance"][0]], -1)
    assert (found == geoms).mean() > 0.998
    assert (np.abs(views["depth"][0] - depth) < 0.01 * depth)[there].mean() > 0.998
    # The floor's checks are where they are there.
    floor = (found == model.geom("floor").id) & (geoms == found)
    red = views["albedo"][0][..., 0] > views["albedo"][0][..., 2]
    assert (red == (color[..., 0] > color[..., 2]))[floor].mean() > 0.97


def test_what_is_no_model_is_refused():
    with pytest.raises(TypeError, match="expected a mujoco.MjModel, got str"):
        alhazen.from_mujoco("arm.xml")
    with pytest.raises(ValueError, match="worlds: 0"):
        alhazen.from_mujoco(mujoco.MjModel.from_xml_string("<mujoco/>"), worlds=0)


def test_the_example_runs():
    pytest.importorskip("gymnasium", reason="pip install gymnasium")
    path = pathlib.Path(__file__).resolve().parents[1] / "examples" / "gymnasium_cameras.py"
    example = runpy.run_path(str(path))
    env = example["PendulumCameras"](3, 24, backend="cpu")
    env.action_space.seed(1)
    seen, _ = env.reset(seed=1)
    assert env.observation_space.contains(seen)
    again, rewards, ended, cut, _ = env.step(env.action_space.sample())
    assert again["rgb"].shape == (3, 24, 24, 3) and rewards.shape == (3,) and not cut.any()
    # Pendulums that are pushed apart are seen apart.
    assert not np.array_equal(again["depth"][0], again["depth"][1])
    assert 0 < again["depth"].mean() < 40 and not ended.any()
