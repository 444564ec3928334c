"""What moves while the shutter is open."""

import numpy as np
import pytest

import alhazen

PANEL = (np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.int32([[0, 1, 2], [0, 2, 3]]))


def moved(x):
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def scene_of_a_panel():
    scene = alhazen.Scene()
    white = scene.add_material("white", base_color="#ffffff", model="unlit")
    panel = scene.add_instance(scene.add_mesh(*PANEL, material=white))
    scene.add_camera(alhazen.Camera.look_at([0, 0, 4], [0, 0, 0], fov_y=1.0))
    scene.set_motion(panel, [0, 1], [moved(-0.5), moved(0.5)])
    return scene


def color(scene, spp):
    return scene.render(24, 16, spp=spp, backend="cpu", threads=1)["color"]


def test_the_mean_of_instants_is_the_blurred_picture():
    scene = scene_of_a_panel()
    assert scene.open_shutter(0, 1) == []
    blurred = color(scene, 512)
    instants = []
    for i in range(64):
        scene.set_time((i + 0.5) / 64)
        instants.append(color(scene, 16))
    assert np.abs(blurred - np.mean(instants, axis=0)).max() < 0.06
    assert np.abs(blurred - instants[0]).max() > 0.5


def test_impossible_motions_are_refused():
    scene = scene_of_a_panel()
    for refused in [
        lambda: scene.open_shutter(1, 0),
        lambda: scene.open_shutter(0, 1, shape="round"),
        lambda: scene.open_shutter(0, 1, rolling="rows"),
        lambda: scene.set_motion(7, [0], [np.eye(4)]),
        lambda: scene.set_motion(0, [1, 0], [np.eye(4), np.eye(4)]),
        lambda: scene.set_time(float("nan")),
    ]:
        with pytest.raises(ValueError):
            refused()
