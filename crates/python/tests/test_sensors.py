"""Sensors against scenes whose answers are known; the library's own tests look closer."""

import json

import numpy as np
import pytest

import alhazen

MATRIX = np.array([[60.0, 0, 31.5], [0, 60, 23.5], [0, 0, 1]])


def pose(x):
    """Looks along -Z from six metres."""
    return np.array([[1.0, 0, 0, x], [0, -1, 0, 0], [0, 0, -1, 6], [0, 0, 0, 1]])


@pytest.fixture()
def scene():
    """A wall at z = 0 and a ball of 0.5 m at z = 3."""
    scene = alhazen.Scene()
    material = scene.add_material(model="lambert", base_color=[0.5, 0.5, 0.5])
    corners = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]
    scene.add_instance(scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], material=material, name="wall"))
    ball = scene.add_spheres([[0, 0, 0]], [0.5], material=material, name="ball")
    scene.add_instance(ball, transform=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3]])
    scene.set_environment(1.0)
    return scene


def test_a_floor_is_at_height_over_sine():
    scene = alhazen.Scene()
    corners = np.float32([[-900, 0, -900], [-900, 0, 900], [900, 0, 900], [900, 0, -900]])
    white = scene.add_material(model="lambert", base_color=[1, 1, 1])
    scene.add_instance(scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], material=white))
    lidar = alhazen.Lidar(16, elevation=np.radians([-20, 10]), azimuths=90)
    cloud = lidar.scan(scene, alhazen.level_pose([0, 1.5, 0], heading=0.3))
    elevations = np.radians(np.linspace(-20, 10, 16))
    expected = np.full(16, np.inf)
    expected[elevations < 0] = 1.5 / -np.sin(elevations[elevations < 0])
    reached = np.flatnonzero(expected < 120)
    assert len(cloud) == 90 * len(reached)
    np.testing.assert_array_equal(cloud.channels, np.tile(reached, 90))
    np.testing.assert_array_equal(cloud.firings, np.repeat(np.arange(90), len(reached)))
    np.testing.assert_allclose(cloud.ranges, expected[cloud.channels], atol=1e-3)
    np.testing.assert_allclose(cloud.positions[:, 2], -1.5, atol=1e-3)
    np.testing.assert_allclose(cloud.intensities, 1.5 / cloud.ranges, rtol=1e-3)
    assert (cloud.instances == 0).all()
    noisy = alhazen.Lidar(16, elevation=np.radians([-20, 10]), azimuths=90, noise=0.1, seed=3)
    errors = noisy.scan(scene, alhazen.level_pose([0, 1.5, 0])).ranges - expected[cloud.channels]
    assert 0.08 < errors.std() < 0.12


def test_clouds_are_saved(scene, tmp_path):
    cloud = alhazen.Lidar(4, azimuths=64).scan(scene, alhazen.level_pose([0, 0, 6]))
    assert len(cloud) > 0
    cloud.save(tmp_path / "cloud.npz")
    saved = np.load(tmp_path / "cloud.npz")
    for name in saved.files:
        np.testing.assert_array_equal(saved[name].astype(np.int64), getattr(cloud, name).astype(np.int64))
    assert set(saved.files) == {"positions", "ranges", "intensities", "channels", "firings", "instances"}
    cloud.save(tmp_path / "cloud.ply")
    assert (tmp_path / "cloud.ply").read_bytes().startswith(b"ply\nformat binary_little_endian")
    with pytest.raises(ValueError, match="cloud.las"):
        cloud.save(tmp_path / "cloud.las")


@pytest.mark.parametrize(
    "settings, text",
    [
        (dict(channels=0), "channels"),
        (dict(elevations=[2.0]), "elevation"),
        (dict(range=(5, 1)), "range"),
        (dict(azimuth=(0, 9)), "sweep"),
        (dict(returns="second"), "unknown `second`"),
    ],
)
def test_impossible_scanners_are_refused(scene, settings, text):
    with pytest.raises(ValueError, match=text):
        alhazen.Lidar(**settings).scan(scene, np.eye(4))


def test_layers_are_exact(scene):
    camera, there = (alhazen.Camera.from_opencv(MATRIX, pose(x), 64, 48) for x in (0, 0.1))
    moved = np.eye(4)
    moved[:3, 3] = [0, 0.2, 3]
    layers = scene.observe(
        camera, 64, 48, next_camera=there, next_transforms={1: moved}, categories={"ball": "toy"}
    )
    wall, ball = layers["instance"] == 0, layers["instance"] == 1
    assert wall.sum() + ball.sum() == 64 * 48 and ball.sum() > 100
    np.testing.assert_allclose(layers["depth"][wall], 6, rtol=1e-6)
    np.testing.assert_allclose(layers["normal"][wall], np.broadcast_to([0, 0, 1], (wall.sum(), 3)), atol=1e-6)
    np.testing.assert_allclose(layers["flow"][wall], np.broadcast_to([-1, 0], (wall.sum(), 2)), atol=1e-3)
    np.testing.assert_allclose(layers["flow"][ball][:, 1], -12 / layers["depth"][ball], atol=1e-3)
    assert (layers["category"][wall] == 1).all() and (layers["category"][ball] == 2).all()
    assert "flow" not in scene.observe(camera, 64, 48)
    with pytest.raises(ValueError, match="next_transforms: 9 of only 2"):
        scene.observe(camera, 64, 48, next_transforms={9: moved})


def test_boxes_are_where_the_instances_are(scene):
    centers, half_axes = scene.boxes()
    np.testing.assert_allclose(centers, [[0, 0, 0], [0, 0, 3]])
    np.testing.assert_allclose(half_axes[1], 0.5 * np.eye(3))


def test_data_sets_are_written(scene, tmp_path):
    folder = tmp_path / "data"
    shares = []
    count = scene.write_dataset(
        folder, 64, 48, matrix=MATRIX, poses=[pose(0), pose(0.1)], spp=2, backend="cpu", progress=shares.append
    )
    assert count == 4 and shares[-1] == 1.0
    annotations = json.loads((folder / "annotations.json").read_text())
    assert [c["name"] for c in annotations["categories"]] == ["wall", "ball"]
    assert len(annotations["images"]) == 2
    for image in annotations["images"]:
        assert (folder / image["file_name"]).is_file() and (folder / image["layers"]).is_file()
    left, top, width, height = annotations["annotations"][1]["bbox"]
    assert abs(left + width / 2 - 32) < 1 and abs(top + height / 2 - 24) < 1
    with pytest.raises(ValueError, match="poses"):
        scene.write_dataset(folder, 64, 48, matrix=MATRIX, poses=pose(0))
