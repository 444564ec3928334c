"""Batches of views: each is what a picture of its own is, and mistakes are named."""

import threading
import time

import numpy as np
import pytest

import alhazen

SIZE = 16
MATRIX = np.array([[16.0, 0, 7.5], [0, 16.0, 7.5], [0, 0, 1]])
EXACT = ["depth", "normal", "position", "albedo", "instance", "material", "primitive"]


def pose(x, z=6.0):
    """Looks along -Z, with OpenCV's axes."""
    return [[1.0, 0, 0, x], [0, -1, 0, 0], [0, 0, -1, z], [0, 0, 0, 1]]


POSES = np.array([pose(x) for x in (-0.5, 0.0, 0.25, 1.0)])


@pytest.fixture(scope="module")
def scene():
    """A wall at z = 0 and a ball of 0.5 m at z = 3."""
    scene = alhazen.Scene()
    material = scene.add_material(model="lambert", base_color=[0.5, 0.25, 0.125])
    corners = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]
    scene.add_instance(scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], material=material, name="wall"))
    ball = scene.add_spheres([[0, 0, 0]], [0.5], material=material, name="ball")
    scene.add_instance(ball, transform=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 3]])
    scene.set_environment(1.0)
    return scene


def test_every_view_is_the_picture_of_its_camera(scene):
    views = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=["rgb", *EXACT], spp=4, seed=3, backend="cpu")
    assert list(views) == ["rgb", *EXACT]
    assert views["rgb"].shape == (4, SIZE, SIZE, 3) and views["rgb"].dtype == np.float32
    assert views["depth"].shape == (4, SIZE, SIZE) and views["instance"].dtype == np.int32
    for i, at in enumerate(POSES):
        camera = alhazen.Camera.from_opencv(MATRIX, at, SIZE, SIZE)
        picture = scene.render(SIZE, SIZE, spp=4, seed=3, camera=camera, backend="cpu")
        np.testing.assert_array_equal(views["rgb"][i], picture["color"])
        exact = scene.observe(camera, SIZE, SIZE)
        for name in ["normal", "position", "instance", "material"]:
            np.testing.assert_array_equal(views[name][i], exact[name])
        np.testing.assert_allclose(views["depth"][i], exact["depth"], rtol=1e-5)
    assert set(np.unique(views["instance"])) == {0, 1}
    np.testing.assert_allclose(views["albedo"], np.broadcast_to([0.5, 0.25, 0.125], views["albedo"].shape), rtol=1e-6)


def test_known_depths(scene):
    """A wall six metres away, and the nearest point of a ball two and a half metres away."""
    views = scene.render_views(POSES[1:2], 0.8, 15, 15, layers=["depth", "instance"], backend="cpu")
    ball = views["instance"] == 1
    np.testing.assert_allclose(views["depth"][~ball], 6, rtol=1e-6)
    assert views["depth"][0, 7, 7] == pytest.approx(2.5, rel=1e-6)
    assert ball[0, 7, 7] and not ball[0, 0, 0]


def test_opengl_axes_and_angles_say_the_same(scene):
    opengl = POSES @ np.diag([1.0, -1, -1, 1])
    layers = ["depth", "instance"]
    expected = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=layers, backend="cpu")
    found = scene.render_views(opengl, MATRIX, SIZE, SIZE, layers=layers, axes="opengl", backend="cpu")
    angle = 2 * np.arctan(0.5)
    by_angle = scene.render_views(POSES, np.full(4, angle), SIZE, SIZE, layers=layers, backend="cpu")
    for name in layers:
        np.testing.assert_array_equal(found[name], expected[name])
        np.testing.assert_allclose(by_angle[name], expected[name], rtol=1e-5)


def test_flow_is_that_of_the_next_pose(scene):
    after = np.array([pose(x + 0.1) for x in (-0.5, 0.0, 0.25, 1.0)])
    views = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=["flow", "depth"], next_poses=after, backend="cpu")
    expected = -0.1 * 16 / views["depth"]
    np.testing.assert_allclose(views["flow"][..., 0], expected, atol=1e-4)
    np.testing.assert_allclose(views["flow"][..., 1], 0, atol=1e-4)


def test_views_may_have_sizes_of_their_own(scene):
    widths, heights = [16, 8, 16, 8], [16, 12, 16, 12]
    views = scene.render_views(POSES, MATRIX, widths, heights, layers=["depth", "normal"], backend="cpu")
    whole = scene.render_views(POSES, MATRIX, 16, 16, layers=["depth"], backend="cpu")["depth"]
    assert [v.shape for v in views["depth"]] == [(16, 16), (12, 8), (16, 16), (12, 8)]
    assert views["normal"][1].shape == (12, 8, 3)
    for i in range(4):
        np.testing.assert_allclose(views["depth"][i], whole[i, : heights[i], : widths[i]], rtol=1e-6)


def test_no_views_are_empty_arrays(scene):
    views = scene.render_views(np.zeros((0, 4, 4)), MATRIX, 8, 6, layers=["rgb", "instance"], backend="cpu")
    assert views["rgb"].shape == (0, 6, 8, 3) and views["instance"].shape == (0, 6, 8)


def test_gpus_make_the_same_views(scene):
    there = [b["name"] for b in alhazen.backends() if b["available"] and b["name"].startswith("gpu-")]
    if not there:
        pytest.skip("no GPU and no software driver")
    expected = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=EXACT, backend="cpu")
    for backend in there:
        found = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=EXACT, backend=backend)
        alone = scene.render_views(POSES[2:3], MATRIX, SIZE, SIZE, layers=EXACT, backend=backend)
        for name in EXACT:
            np.testing.assert_array_equal(found[name][2], alone[name][0])
            same = np.isclose(found[name], expected[name], rtol=1e-3, atol=1e-3)
            # Rays through the diagonal of the wall may see either of its triangles.
            assert same.mean() > 0.98, (backend, name)


@pytest.mark.parametrize(
    "change, text",
    [
        ({"poses": np.eye(4)}, r"poses: expected the shape \(n, 4, 4\), got \(4, 4\)"),
        ({"poses": np.full((1, 4, 4), np.nan)}, "poses: the last row"),
        ({"poses": [[[np.nan, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]]}, "view 0: pose"),
        ({"poses": [pose(0), np.diag([2.0, 1, 1, 1])]}, "view 1: pose: .* is not a rotation"),
        ({"poses": "somewhere"}, "poses: not an array of numbers"),
        ({"intrinsics": np.eye(4)}, r"intrinsics: expected the shape \(3, 3\) or \(4, 3, 3\).* got \(4, 4\)"),
        ({"intrinsics": np.zeros((3, 3))}, "view 0: matrix: expected"),
        ({"intrinsics": 4.0}, "4 is not between 0 and π"),
        ({"width": 0}, "views of 0×16 pixels"),
        ({"width": [16, 16]}, "width: expected 4 numbers"),
        ({"width": "wide"}, "width: expected a number of pixels"),
        ({"layers": ["colour"]}, "layers: unknown `colour`; there are: rgb, depth"),
        ({"layers": []}, "at least one"),
        ({"layers": ["depth", "depth"]}, "`depth` is named twice"),
        ({"layers": ["flow"]}, "`flow` needs next_poses"),
        ({"layers": ["flow"], "next_poses": POSES[:2]}, "next_poses: 2 matrices for 4 poses"),
        ({"axes": "maya"}, "axes: unknown `maya`"),
        ({"spp": 0}, "at least one sample"),
        ({"integrator": "realtime"}, "`realtime`"),
        ({"integrator": "magic"}, "integrator: unknown `magic`"),
        ({"sampler": "dice"}, "sampler: unknown `dice`"),
        ({"backend": "magic"}, "backend: unknown"),
    ],
)
def test_mistakes_are_named(scene, change, text):
    arguments = {"poses": POSES, "intrinsics": MATRIX, "width": SIZE, "height": SIZE, "backend": "cpu", **change}
    with pytest.raises(ValueError, match=text):
        scene.render_views(**arguments)


def test_many_instances_move_at_once():
    scene = alhazen.Scene()
    ball = scene.add_spheres([[0, 0, 0]], [0.25], material="#ffffff")
    balls = [scene.add_instance(ball) for _ in range(3)]
    scene.set_environment(1.0)
    moves = np.tile(np.eye(4)[:3], (3, 1, 1))
    moves[:, 0, 3] = [-1, 0, 1]
    scene.set_transforms(moves)
    for i in balls:
        np.testing.assert_array_equal(scene.transform(i)[:3], moves[i])
    views = scene.render_views([pose(0)], 0.8, 31, 31, layers=["instance"], backend="cpu")
    assert set(np.unique(views["instance"])) == {-1, 0, 1, 2}
    up = np.eye(4)[None].copy()
    up[0, 1, 3] = 50
    scene.set_transforms(up, instances=[1])
    views = scene.render_views([pose(0)], 0.8, 31, 31, layers=["instance"], backend="cpu")
    assert set(np.unique(views["instance"])) == {-1, 0, 2}
    for arguments, text in [
        ((moves[:2],), "2 matrices for 3 instances"),
        ((moves, [0, 1, 7]), "instances: 7 of only 3"),
        ((moves, [0, 1, -1]), "instances: -1 of only 3"),
        ((np.zeros((3, 2, 4)),), r"expected the shape \(n, 3, 4\)"),
        ((np.zeros((3, 3, 4)),), "matrix 0: the matrix has no inverse"),
        ((np.full((3, 3, 4), np.nan),), "matrix 0: it is not finite"),
        ((np.ones((3, 4, 4)),), "matrix 0: the last row"),
    ]:
        with pytest.raises(ValueError, match=text):
            scene.set_transforms(*arguments)


def test_arrays_are_shared_without_a_copy(scene):
    views = scene.render_views(POSES, MATRIX, SIZE, SIZE, layers=["depth"], backend="cpu")
    torch = pytest.importorskip("torch")
    tensor = torch.from_dlpack(views["depth"])
    assert tensor.shape == (4, SIZE, SIZE) and tensor.data_ptr() == views["depth"].ctypes.data


def test_other_threads_run_and_an_exception_stops_it(scene):
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    many = np.repeat(POSES, 64, axis=0)
    try:
        start = time.monotonic()

        def stop(share):
            if share > 0 and time.monotonic() > start + 0.1:
                raise RuntimeError("enough")

        with pytest.raises(RuntimeError, match="enough"):
            scene.render_views(many, MATRIX, 64, 64, spp=256, backend="cpu", progress=stop)
    finally:
        done.set()
        thread.join()
    assert len(ticks) > 5


def test_many_small_calls_need_no_more_memory(scene):
    resource = pytest.importorskip("resource")

    def calls(count):
        for i in range(count):
            poses = POSES.copy()
            poses[:, 0, 3] += 1e-4 * i
            scene.render_views(poses, MATRIX, 8, 8, layers=["depth", "rgb"], spp=1, backend="cpu")
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = calls(100)
    assert calls(300) - before < 20_000  # kilobytes; on macOS bytes, which is stricter
