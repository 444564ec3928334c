"""What rays hit."""

import threading

import numpy as np
import pytest

import alhazen


@pytest.fixture()
def scene():
    """A floor at height 0, the same floor at height 2 turned about x (it faces down), and a sphere."""
    scene = alhazen.Scene()
    square = [[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]]
    floor = scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], name="floor")
    ball = scene.add_spheres([[0, 0, 0]], [0.5], name="ball")
    scene.add_instance(floor)
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    turned[:3, 3] = [0, 2, 20]
    scene.add_instance(floor, transform=turned, name="ceiling")
    scene.add_instance(ball, transform=[[1, 0, 0, 1], [0, 1, 0, 3], [0, 0, 1, 1]])
    return scene


DOWN = [0.0, -2.0, 0.0]


def test_hits_have_all_properties(scene):
    hits = scene.intersect([[1, 1, 2], [3, 4, 20], [1, 9, 1], [50, 1, 0]], [DOWN] * 4)
    np.testing.assert_allclose(hits.t, [0.5, 1.0, 2.75, np.inf])
    np.testing.assert_array_equal(hits.instance, [0, 1, 2, -1])
    np.testing.assert_array_equal(hits.triangle[2:], [0, -1])
    np.testing.assert_allclose(hits.normals, [[0, 1, 0], [0, -1, 0], [0, 1, 0], [0, 0, 0]], atol=1e-6)
    assert len(hits) == 4
    assert hits.t.dtype == np.float32 and hits.triangle.dtype == np.int32 and hits.barycentrics.shape == (4, 2)
    assert scene.intersect([[1, 1, 2]], [DOWN], normals=False).normals is None


def test_barycentrics_lead_to_the_point(scene):
    rng = np.random.default_rng(1)
    corners = np.float32([[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    origins = np.float32(rng.uniform(-4.9, 4.9, (1000, 3)))
    origins[:, 1] = 0.25
    hits = scene.intersect(origins, np.broadcast_to(np.float32(DOWN), origins.shape))
    u, v = hits.barycentrics[:, :1], hits.barycentrics[:, 1:]
    a, b, c = (corners[triangles[hits.triangle, k]] for k in range(3))
    expected = origins * [1, 0, 1]
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, expected, atol=1e-5)
    np.testing.assert_allclose(hits.t, 0.125, rtol=1e-6)


def test_any_shape_and_any_layout_give_the_same(scene):
    rng = np.random.default_rng(2)
    origins = np.float32(rng.uniform(-6, 6, (40, 30, 3)))
    directions = np.float32(rng.normal(size=(40, 30, 3)))
    whole = scene.intersect(origins, directions)
    assert whole.t.shape == (40, 30) and whole.normals.shape == (40, 30, 3)
    assert np.isfinite(whole.t).any() and np.isinf(whole.t).any()
    flat = scene.intersect(np.asfortranarray(origins.reshape(-1, 3)), directions.reshape(-1, 3).astype(np.float64))
    coherent = scene.intersect(origins, directions, coherent=True)
    for name in ("t", "triangle", "instance"):
        np.testing.assert_array_equal(getattr(whole, name).ravel(), getattr(flat, name))
        np.testing.assert_array_equal(getattr(whole, name), getattr(coherent, name))


def test_inputs_of_the_right_type_are_read_in_place(scene):
    origins, directions = np.float32([[1, 1, 2]]), np.float32([DOWN])
    origins.flags.writeable = directions.flags.writeable = False
    assert scene.intersect(origins, directions).t[0] == 0.5


def test_occluded_agrees_with_intersect(scene):
    rng = np.random.default_rng(3)
    origins, directions = np.float32(rng.uniform(-6, 6, (2, 5000, 3)))
    hit = scene.occluded(origins, directions)
    assert hit.dtype == bool
    np.testing.assert_array_equal(hit, np.isfinite(scene.intersect(origins, directions).t))
    near = scene.occluded(origins, directions, t_min=0.1, t_max=0.7)
    t = scene.intersect(origins, directions, t_min=0.1).t
    np.testing.assert_array_equal(near, t < 0.7)
    assert 0 < near.sum() < hit.sum()


def test_no_rays_and_broken_rays_are_misses(scene):
    none = scene.intersect(np.zeros((0, 3)), np.zeros((0, 3)))
    assert none.t.shape == (0,) and none.normals.shape == (0, 3)
    broken = scene.intersect([[np.nan, 1, 0], [1, 1, 2], [1, 1, 2]], [DOWN, [0, 0, 0], [np.inf, 0, 0]])
    assert (broken.triangle == -1).all()
    assert (alhazen.Scene().intersect([[0, 0, 0]], [DOWN]).instance == -1).all()


def test_changes_are_seen(scene):
    origin = [[1, 1, 2]]
    assert scene.intersect(origin, [DOWN]).t[0] == 0.5
    scene.set_transform(0, [[1, 0, 0, 0], [0, 1, 0, -1], [0, 0, 1, 0]])
    assert scene.intersect(origin, [DOWN]).t[0] == 1.0


def test_many_threads_may_ask(scene):
    rng = np.random.default_rng(4)
    origins, directions = np.float32(rng.uniform(-6, 6, (2, 200_000, 3)))
    expected = scene.intersect(origins, directions)
    wrong = []

    def ask():
        hits = scene.intersect(origins, directions)
        if not np.array_equal(hits.t, expected.t):
            wrong.append(hits)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_camera_rays_hit_what_the_picture_shows(scene):
    camera = alhazen.Camera.look_at([8, 6, 12], [0, 1, 0], fov_y=1.0)
    origins, directions = camera.rays(64, 48)
    assert origins.shape == (48, 64, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1, rtol=1e-6)
    hits = scene.intersect(origins, directions, coherent=True)
    picture = scene.render(64, 48, 1, camera=camera, integrator="aov", aovs=["instance"], backend="cpu")
    # The picture's sample lies anywhere in the pixel: only edges may differ.
    assert (picture["instance"] == hits.instance).mean() > 0.9
    assert set(np.unique(hits.instance)) >= {-1, 0, 2}


def test_explained_samples_are_those_of_pictures():
    scene = alhazen.load("cornell")
    settings = {"width": 16, "height": 16, "seed": 3, "max_depth": 5}
    picture = scene.render(spp=1, backend="cpu", threads=1, **settings)
    for x, y in [(8, 8), (3, 12), (12, 4)]:
        explained = scene.explain(x, y, **settings)
        np.testing.assert_array_equal(np.float32(explained["radiance"]), picture["color"][y, x])
        (path,) = explained["paths"]
        vertices = path["vertices"]
        assert [v["depth"] for v in vertices] == list(range(1, len(vertices) + 1))
        added = sum(np.sum(f["contribution"]) for v in vertices for f in v["found"])
        lights = [v["light_sample"] for v in vertices if v["light_sample"]]
        added += sum(np.sum(light["contribution"]) for light in lights)
        np.testing.assert_allclose(added, np.sum(path["radiance"]), rtol=1e-5)
        assert {light["visibility"] for light in lights} <= {"visible", "occluded", "behind", "dark"}
    with pytest.raises(ValueError, match="no pixel 16,0"):
        scene.explain(16, 0, **settings)
