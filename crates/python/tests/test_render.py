"""Pictures."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import alhazen


def furnace(albedo):
    """A diffuse sphere in light from everywhere shows its albedo."""
    scene = alhazen.Scene()
    material = scene.add_material(model="lambert", base_color=albedo)
    scene.add_instance(scene.add_spheres([[0, 0, 0]], [1.0], material=material))
    scene.set_environment(1.0)
    return scene


def test_a_furnace_shows_the_albedo():
    camera = alhazen.Camera.orthographic([0, 0, 5], [0, 0, 0], 1.0)
    picture = furnace([0.5, 0.25, 1.0]).render(16, 16, 64, camera=camera, backend="cpu")
    assert picture["color"].shape == (16, 16, 3) and picture["color"].dtype == np.float32
    np.testing.assert_allclose(picture["color"].mean((0, 1)), [0.5, 0.25, 1.0], rtol=2e-3)
    assert picture.spp == 64 and picture.backend == "cpu" and picture.seconds > 0


def test_lights_have_their_units():
    """A point light of 10 W/sr, 2 m above a diffuse floor: E = I / r², L = albedo E / π."""
    scene = alhazen.Scene()
    material = scene.add_material(model="lambert", base_color=[0.5, 0.5, 0.5])
    square = [[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]]
    scene.add_instance(scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], material=material))
    scene.add_point_light([0, 2, 0], 10.0)
    camera = alhazen.Camera.orthographic([0, 1, 0], [0, 0, 0], 0.01)
    radiance = scene.render(4, 4, 16, camera=camera, max_depth=2, backend="cpu")["color"].mean()
    np.testing.assert_allclose(radiance, 0.5 / np.pi * 10 / 4, rtol=1e-3)
    scene.add_directional_light([0, -1, 0], 3.0)
    # One of the two lights is sampled at a time.
    radiance = scene.render(16, 16, 1024, camera=camera, max_depth=2, backend="cpu")["color"].mean()
    np.testing.assert_allclose(radiance, 0.5 / np.pi * (10 / 4 + 3), rtol=2e-3)


def test_media_absorb_by_their_density():
    """A box of 2 m with a grid of densities 1 and 3 along x: what passes is exp(-density * absorption * 2 m)."""
    scene = alhazen.Scene()
    density = np.ones((1, 1, 8), np.float32)
    density[:, :, 4:] = 3
    medium = alhazen.Medium(absorption=0.25, density=density, bounds=[[-4, -1, -1], [4, 1, 1]])
    inside = scene.add_material(model="boundary", medium=medium)
    x, y, z = np.meshgrid([-4, 4], [-1, 1], [-1, 1], indexing="ij")
    corners = np.stack([x, y, z], -1).reshape(-1, 3)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])]
    scene.add_instance(scene.add_mesh(corners, triangles, material=inside))
    scene.set_environment(1.0)
    for x, expected in ((-3, 0.5), (3, 1.5)):
        camera = alhazen.Camera.orthographic([x, 0, 5], [x, 0, 0], 0.1)
        radiance = scene.render(8, 8, 256, camera=camera, backend="cpu")["color"].mean()
        np.testing.assert_allclose(radiance, np.exp(-expected), rtol=0.02)


def test_fog_hides_what_is_far_away():
    scene = furnace([0.5, 0.5, 0.5])
    camera = alhazen.Camera.orthographic([0, 0, 5], [0, 0, 0], 0.1)

    def seen():
        return scene.render(8, 8, 256, camera=camera, backend="cpu")["color"].mean()

    assert seen() > 0.49
    # Below the sphere: what comes from the lower half of the surroundings is gone.
    scene.set_fog(alhazen.Medium(absorption=1.0), top=-1.5)
    np.testing.assert_allclose(seen(), 0.25, rtol=0.02)
    scene.set_fog(alhazen.Medium(absorption=1.0))
    assert seen() < 1e-6
    scene.set_fog(None)
    assert seen() > 0.49


def test_light_comes_out_of_bodies_again():
    """A dielectric with subsurface scattering and a white base colour keeps nothing in a furnace."""
    scene = alhazen.Scene()
    wax = scene.add_material(model="dielectric", base_color=[1, 1, 1], subsurface_radius=0.5)
    scene.add_instance(scene.add_spheres([[0, 0, 0]], [1.0], material=wax))
    scene.set_environment(1.0)
    camera = alhazen.Camera.orthographic([0, 0, 5], [0, 0, 0], 1.0)
    radiance = scene.render(16, 16, 64, camera=camera, max_depth=1000, backend="cpu")["color"].mean()
    np.testing.assert_allclose(radiance, 1.0, rtol=0.02)


def test_portals_take_noise_away():
    """A room with a window: the same picture with less noise."""
    scene = alhazen.Scene()
    white = scene.add_material(model="lambert", base_color=[0.7, 0.7, 0.7])
    x, y, z = np.meshgrid([-2, 2], [0, 3], [-2, 2], indexing="ij")
    corners = np.stack([x, y, z], -1).reshape(-1, 3)
    window = np.float32([[-0.4, 1, -2], [0.4, 1, -2], [0.4, 2, -2], [-0.4, 2, -2]])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [1, 5, 7, 3]]
    # The wall with the window: four pieces around it.
    wall = [[0, 4, 9, 8], [4, 6, 10, 9], [6, 2, 11, 10], [2, 0, 8, 11]]
    triangles = [t for a, b, c, d in faces + wall for t in ([a, b, c], [a, c, d])]
    scene.add_instance(scene.add_mesh(np.concatenate([corners, window]), triangles, material=white))
    scene.set_environment(1.0)
    camera = alhazen.Camera.look_at([0, 1.5, 1.9], [0, 1, -1])

    def render():
        return scene.render(24, 24, 64, camera=camera, max_depth=4, aovs=["standard-error"], backend="cpu")

    without = render()
    scene.add_portal(window)
    with_portal = render()
    assert with_portal["standard-error"].mean() < 0.5 * without["standard-error"].mean()
    np.testing.assert_allclose(with_portal["color"].mean(), without["color"].mean(), rtol=0.05)


def test_layers_have_names_and_types():
    names = ["depth", "normal", "albedo", "instance", "material", "samples", "uv"]
    picture = alhazen.load("cornell").render(32, 24, 2, aovs=names, backend="cpu")
    assert set(picture) == {"color", *names}
    assert picture["depth"].shape == (24, 32) and picture["depth"].dtype == np.float32
    assert picture["normal"].shape == (24, 32, 3) and picture["uv"].shape == (24, 32, 2)
    assert picture["instance"].dtype == np.int32 and picture["instance"].max() >= 0
    assert (picture["samples"] == 2).all()


def test_the_same_seed_gives_the_same_picture_and_others_do_not():
    scene = alhazen.load("cornell")
    first, again, other = (
        scene.render(16, 16, 4, seed=seed, threads=threads, backend="cpu")["color"]
        for seed, threads in ((1, 1), (1, 2), (2, 2))
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_picture_made_again_starts_anew():
    scene = alhazen.load("cornell")
    first = scene.render(16, 16, 4, backend="cpu", aovs=["samples"])
    again = scene.render(16, 16, 4, backend="cpu", aovs=["samples"])
    assert (again["samples"] == 4).all()
    np.testing.assert_array_equal(first["color"], again["color"])


def test_parts_of_the_samples_average_to_the_whole():
    scene = alhazen.load("cornell")
    whole = scene.render(16, 16, 8, backend="cpu")["color"]
    halves = [scene.render(16, 16, 4, first_sample=first, backend="cpu")["color"] for first in (0, 4)]
    np.testing.assert_allclose((halves[0] + halves[1]) / 2, whole, rtol=1e-5, atol=1e-6)
    crop = scene.render(16, 16, 8, crop=[3, 5, 7, 4], backend="cpu")["color"]
    np.testing.assert_array_equal(crop, whole[5:9, 3:10])


def test_changes_are_seen():
    scene = furnace([0.5, 0.5, 0.5])
    camera = alhazen.Camera.orthographic([0, 0, 5], [0, 0, 0], 1.0)
    before = scene.render(4, 4, 4, camera=camera, backend="cpu")["color"].mean()
    scene.set_environment([2.0, 2.0, 2.0])
    after = scene.render(4, 4, 4, camera=camera, backend="cpu")["color"].mean()
    np.testing.assert_allclose(after, 2 * before, rtol=1e-4)


def test_environment_pictures_are_seen():
    sky = np.zeros((8, 16, 3), np.float32)
    sky[:4] = [0.25, 0.5, 1.0]
    scene = alhazen.Scene()
    scene.set_environment(sky)
    up = scene.render(4, 4, 4, camera=alhazen.Camera.look_at([0, 0, 0], [0, 1, 0], up=[1, 0, 0]), backend="cpu")
    np.testing.assert_allclose(up["color"], np.broadcast_to([0.25, 0.5, 1.0], (4, 4, 3)), rtol=1e-3)


def test_textures_are_seen():
    red_left = np.zeros((1, 16, 3), np.uint8)
    red_left[0, :8] = [255, 0, 0]
    scene = alhazen.Scene()
    material = scene.add_material(model="unlit", base_color=[1, 1, 1], base_color_texture=red_left)
    square = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    uvs = [[0, 1], [1, 1], [1, 0], [0, 0]]
    scene.add_instance(scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], uvs=uvs, material=material))
    camera = alhazen.Camera.orthographic([0, 0, 1], [0, 0, 0], 2.0)
    color = scene.render(16, 16, 4, camera=camera, backend="cpu")["color"]
    np.testing.assert_allclose(color[8, 3], [1, 0, 0], atol=1e-3)
    np.testing.assert_allclose(color[8, 12], [0, 0, 0], atol=1e-3)


def test_a_calibrated_camera_puts_points_where_opencv_does():
    """A small lamp at a known place: its pixels' centre is its projection."""
    matrix = np.array([[400.0, 0, 150.5], [0, 420.0, 90.25], [0, 0, 1]])
    angle = 0.4
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    pose[:3, 3] = [1, 2, 3]
    point = np.array([0.3, -0.2, 5.0])  # in the camera's frame
    world = pose[:3, :3] @ point + pose[:3, 3]
    scene = alhazen.Scene()
    lamp = scene.add_material(model="unlit", base_color=[1, 1, 1])
    scene.add_instance(scene.add_spheres([world], [0.1], material=lamp))
    camera = alhazen.Camera.from_opencv(matrix, pose, 320, 200)
    color = scene.render(320, 200, 64, camera=camera, backend="cpu")["color"][..., 0]
    rows, columns = np.indices(color.shape)
    expected = matrix @ point / point[2]
    found = (columns * color).sum() / color.sum(), (rows * color).sum() / color.sum()
    # A sphere's picture is an ellipse whose centre is a little off that of the sphere.
    np.testing.assert_allclose(found, expected[:2], atol=0.05)
    # Half the size, the same field of view.
    small = scene.render(160, 100, 64, camera=camera, backend="cpu")["color"][..., 0]
    np.testing.assert_allclose(small.sum() * 4, color.sum(), rtol=0.02)


def test_progress_grows_to_one():
    shares = []
    alhazen.load("cornell").render(64, 64, 64, progress=shares.append, backend="cpu")
    assert shares[-1] == 1.0 and shares == sorted(shares)


def test_an_exception_in_progress_stops_the_picture():
    def progress(share):
        raise RuntimeError("enough")

    start = time.monotonic()
    with pytest.raises(RuntimeError, match="enough"):
        alhazen.load("cornell").render(256, 256, 100_000, progress=progress, backend="cpu")
    assert time.monotonic() - start < 20


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_keyboard_interrupt_stops_a_picture():
    scene = alhazen.load("cornell")
    scene.render(16, 16, 1, backend="cpu")
    # Programs that are started in the background ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            scene.render(512, 512, 1_000_000, backend="cpu", time_limit=60)
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
    assert scene.render(16, 16, 1, backend="cpu").spp == 1, "the scene can be rendered again"


def test_other_threads_run_meanwhile():
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.01):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    seconds = alhazen.load("cornell").render(128, 128, 64, backend="cpu").seconds
    stop.set()
    thread.join()
    assert len(ticks) > 5 or seconds < 0.1


def test_pictures_show_and_save_themselves(tmp_path):
    picture = alhazen.load("cornell").render(16, 12, 1, aovs=["depth"], backend="cpu")
    png = picture._repr_png_()
    assert png[:8] == b"\x89PNG\r\n\x1a\n" and png[16:24] == b"\x00\x00\x00\x10\x00\x00\x00\x0c"
    assert picture.png(tonemap="aces", exposure=2.0) != png
    picture.save(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes() == png
    picture.save(tmp_path / "picture.npz")
    np.testing.assert_array_equal(np.load(tmp_path / "picture.npz")["depth"], picture["depth"])
    with pytest.raises(ValueError, match="picture.bmp"):
        picture.save(tmp_path / "picture.bmp")


def test_time_limits_and_noise_limits_hold():
    scene = alhazen.load("cornell")
    assert scene.render(32, 32, 1_000_000, time_limit=0.3, backend="cpu").seconds < 5
    noisy = scene.render(32, 32, 4096, noise=0.2, backend="cpu")
    assert noisy.noise <= 0.2 and noisy.spp < 4096
