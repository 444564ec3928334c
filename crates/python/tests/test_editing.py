"""Copies, pickles, saved scenes, editing, and meshes and colours in the forms that people have them."""

import copy
import pickle
import types

import numpy as np
import pytest

import alhazen

TRIANGLE = (np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]), np.int32([[0, 1, 2]]))
CAMERA = alhazen.Camera.look_at([0, 0, 3], [0, 0, 0], fov_y=0.9)


def scene_of_a_triangle():
    scene = alhazen.Scene()
    red = scene.add_material("red", base_color="#ff0000", model="unlit")
    mesh = scene.add_mesh(*TRIANGLE, material=red, name="triangle")
    scene.add_instance(mesh, name="here")
    scene.add_camera(CAMERA)
    scene.set_environment(0.25)
    return scene


def color(scene):
    return scene.render(8, 8, spp=4, backend="cpu", threads=1)["color"]


def test_version():
    assert alhazen.__version__.count(".") == 2


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))], ids=["copy", "deepcopy", "pickle"]
)
def test_copies_are_equal_and_their_own(copied):
    scene = scene_of_a_triangle()
    other = copied(scene)
    np.testing.assert_array_equal(color(other), color(scene))
    other.set_material(0, base_color="#00ff00", model="unlit")
    assert color(other)[4, 4, 1] > 0.9 and color(scene)[4, 4, 1] < 0.1


def test_cameras_are_copied_and_pickled():
    pose = np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 3.5]])
    matrix = [[40, 0.5, 20], [0, 41, 15], [0, 0, 1]]
    lens = alhazen.Camera.from_opencv(matrix, pose, 40, 30, distortion=[[-0.1, 0.02, 0.001, 0.002, 0.003]])
    cameras = [CAMERA, lens, alhazen.Camera.panorama([0, 0, 0], [1, 0, 0])]
    cameras += [
        alhazen.Camera.with_projection("fisheye", [0, 0, 0], [1, 0, 0], fov=4.0),
        alhazen.Camera.with_projection("cubemap", [0, 0, 0], [1, 0, 0]),
    ]
    for camera in cameras:
        for other in (pickle.loads(pickle.dumps(camera)), copy.copy(camera), copy.deepcopy(camera)):
            np.testing.assert_array_equal(other.rays(6, 5), camera.rays(6, 5))
            assert repr(other) == repr(camera)


def test_projections_by_name():
    cubemap = alhazen.Camera.with_projection("cubemap", [0, 0, 0], [0, 0, -1])
    _, directions = cubemap.rays(6, 1)
    faces = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, -1], [0, 0, 1]]
    np.testing.assert_allclose(directions[0], faces, atol=1e-6)
    fisheye = alhazen.Camera.with_projection("fisheye", [0, 0, 0], [0, 0, -1], fov=np.pi)
    _, directions = fisheye.rays(4, 4)
    # The angle to the axis is the distance from the centre: half a pixel of 4 for 180 degrees.
    np.testing.assert_allclose(np.arccos(-directions[1, 1, 2]), np.pi / 4 * np.sqrt(0.5), atol=1e-5)
    for name, number, message in [
        ("round", {}, "fisheye"),
        ("fisheye", {"fov": 7.0}, "out of range"),
        ("orthographic", {}, "height"),
        ("cubemap", {"fov": 1.0}, "no meaning"),
    ]:
        with pytest.raises(ValueError, match=message):
            alhazen.Camera.with_projection(name, [0, 0, 0], [0, 0, -1], **number)


def test_lenses_are_those_of_opencv():
    pose = np.array([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0]])
    camera = alhazen.Camera.from_opencv(
        [[40, 0, 20], [0, 40, 20], [0, 0, 1]], pose, 41, 41, distortion=[0.1, -0.01, 0.001, 0.0001], fisheye=True
    )
    _, directions = camera.rays(41, 41)
    # A pixel right of the centre by θ (1 + 0.1 θ² − …) focal lengths sees the angle θ.
    theta = np.arctan2(directions[20, :, 0], -directions[20, :, 2])
    t2 = theta**2
    seen = 40 * theta * (1 + t2 * (0.1 + t2 * (-0.01 + t2 * (0.001 + t2 * 0.0001)))) + 20
    np.testing.assert_allclose(seen, np.arange(41), atol=1e-3)
    with pytest.raises(ValueError, match="distortion: expected k1, k2, p1, p2"):
        alhazen.Camera.from_opencv(np.eye(3), pose, 4, 4, distortion=[1, 2, 3])


def test_scenes_are_saved_and_loaded(tmp_path):
    scene = scene_of_a_triangle()
    path = tmp_path / "a.alhazen"
    scene.save(path)
    again = alhazen.load(path)
    np.testing.assert_array_equal(color(again), color(scene))
    again.save(path)
    with pytest.raises(ValueError, match="saved as .alhazen"):
        scene.save(tmp_path / "a.obj")
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(alhazen.LoadError, match="a.alhazen"):
        alhazen.load(path)


def test_pictures_are_saved_in_all_formats(tmp_path):
    picture = scene_of_a_triangle().render(8, 8, spp=1, aovs=["depth", "instance"], backend="cpu")
    for ending in ("png", "jpg", "exr", "hdr", "npz"):
        picture.save(tmp_path / f"a.{ending}")
        assert (tmp_path / f"a.{ending}").stat().st_size > 100
    exr = (tmp_path / "a.exr").read_bytes()
    assert exr[:4] == b"\x76\x2f\x31\x01" and b"depth.Z" in exr
    with pytest.raises(ValueError, match="known are .png, .jpg"):
        picture.save(tmp_path / "a.tif")


def test_inputs_are_not_written_over(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n")
    sky = tmp_path / "sky.exr"
    scene_of_a_triangle().render(8, 4, spp=1, backend="cpu").save(sky)
    scene_file = tmp_path / "s.toml"
    scene_file.write_text('[environment]\nfile = "sky.exr"\n[[model]]\nfile = "a.obj"\n')
    scene = alhazen.load(scene_file)
    before = sky.read_bytes()
    picture = scene.render(8, 8, spp=1, backend="cpu")
    with pytest.raises(OSError, match="a scene was loaded from it"):
        picture.save(sky)
    assert sky.read_bytes() == before
    picture.save(tmp_path / "b.exr")


def test_things_are_changed_and_removed():
    scene = scene_of_a_triangle()
    lit = color(scene)[4, 4]
    scene.set_visible(0, False)
    assert np.allclose(color(scene), 0.25)
    scene.set_visible(0, True)
    green = scene.add_material("green", base_color="#00ff00", model="unlit")
    scene.set_instance_material(0, green)
    assert color(scene)[4, 4, 1] > 0.9
    scene.set_instance_material(0, None)
    np.testing.assert_array_equal(color(scene)[4, 4], lit)
    scene.set_vertices(0, TRIANGLE[0] + np.float32([50, 0, 0]))
    assert np.allclose(color(scene), 0.25)
    scene.set_vertices(0, np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), [[0, 1, 2], [0, 2, 3]])
    assert scene.triangle_count == 2 and color(scene)[4, 4, 0] > 0.9
    light = scene.add_point_light([0, 0, 1], 1, name="lamp")
    assert scene.light_names == ["lamp"] and scene.mesh_names == ["triangle"]
    scene.remove_light(light)
    scene.remove_instance(0)
    assert scene.instance_names == [] and scene.light_names == []
    scene.add_instance(0)
    scene.remove_mesh(0)
    assert scene.mesh_names == [] and scene.instance_names == []
    scene.remove_camera(0)
    assert scene.cameras == []
    for change in (
        lambda: scene.remove_mesh(0),
        lambda: scene.remove_instance(0),
        lambda: scene.remove_light(0),
        lambda: scene.remove_camera(0),
        lambda: scene.set_visible(0, True),
        lambda: scene.set_material(7),
        lambda: scene.set_vertices(0, TRIANGLE[0]),
    ):
        with pytest.raises(ValueError, match="of only"):
            change()


def test_materials_have_many_forms():
    scene = alhazen.Scene()
    by_dictionary = scene.add_mesh(*TRIANGLE, material={"name": "blue", "base_color": [0, 0, 1], "roughness": 0.2})
    scene.add_mesh(*TRIANGLE, material="#ff8000")
    scene.add_mesh(*TRIANGLE, material="blue")
    scene.add_instance(by_dictionary, material={"name": "other"})
    assert scene.material_names == ["blue", "", "other"]
    for wrong, text in [("red", "no `red`"), ("#12", "not a colour"), ({"colour": 1}, "colour"), (1.5, "material")]:
        with pytest.raises((ValueError, TypeError), match=text):
            scene.add_mesh(*TRIANGLE, material=wrong)
    with pytest.raises(ValueError, match="emission: `white`"):
        scene.add_material(emission="white")


def test_meshes_of_other_packages_are_taken():
    vertices, faces = TRIANGLE
    visual = types.SimpleNamespace(kind="vertex", vertex_colors=np.uint8([[255, 0, 0, 255]] * 3))
    trimesh = types.SimpleNamespace(vertices=vertices, faces=faces, visual=visual)
    open3d = types.SimpleNamespace(
        vertices=vertices.astype(np.float64),
        triangles=faces,
        vertex_normals=np.float64([[0, 0, 1]] * 3),
        vertex_colors=np.float64([[0, 1, 0]] * 3),
        has_vertex_normals=lambda: True,
        has_vertex_colors=lambda: True,
    )
    for mesh, channel in ((trimesh, 0), (open3d, 1)):
        scene = alhazen.Scene()
        white = scene.add_material(base_color=1, model="unlit")
        scene.add_instance(scene.add_mesh(mesh, material=white))
        scene.add_camera(CAMERA)
        seen = color(scene)[4, 4]
        assert seen[channel] > 0.9 and np.delete(seen, channel).max() < 0.1
    with pytest.raises(ValueError, match="triangles: expected an array, or a mesh"):
        alhazen.Scene().add_mesh(vertices)


def test_numbers_of_layers_are_keywords():
    scene = alhazen.Scene()
    assert scene.add_material(clearcoat=1, clearcoat_roughness=0.2, diffuse_roughness=0.5, dispersion=3) == 0
    with pytest.raises(ValueError, match="diffuse_roughness: 2 is not between 0 and 1"):
        scene.add_material(diffuse_roughness=2)
    with pytest.raises(ValueError, match="iridescence_ior: 0.5 is not between 1 and 10"):
        scene.add_material(iridescence_ior=0.5)
    with pytest.raises(TypeError, match="unexpected keyword argument `clearcot`"):
        scene.add_material(clearcot=1)


@pytest.mark.parametrize("name", ["vertices", "normals", "uvs", "colors"])
def test_nan_in_arrays_raises(name):
    arrays = {"vertices": TRIANGLE[0], "normals": np.ones((3, 3)), "uvs": np.ones((3, 2)), "colors": np.ones((3, 3))}
    arrays[name] = arrays[name].copy()
    arrays[name][1, 0] = np.nan
    vertices = arrays.pop("vertices")
    with pytest.raises(ValueError, match=f"{name}: row 1 is"):
        alhazen.Scene().add_mesh(vertices, TRIANGLE[1], **arrays)


def test_repr_reads_like_python():
    scene = scene_of_a_triangle()
    assert repr(scene) == "Scene(name='', meshes=1, instances=1, materials=1, lights=0)"
    assert repr(CAMERA).startswith("Camera.look_at(eye=[0, 0, 3], target=[0, 0, 0], up=[0, 1, 0], fov_y=0.9")
    assert repr(alhazen.Lidar(32, azimuths=720)) == "Lidar(channels=32, azimuths=720)"


def test_indirect_light_is_clamped():
    scene = alhazen.load("cornell")
    free = scene.render(16, 16, spp=4, backend="cpu")["color"]
    clamped = scene.render(16, 16, spp=4, backend="cpu", clamp_indirect=0.01)["color"]
    assert clamped.mean() < free.mean()
    for wrong in (0, -1, float("nan")):
        with pytest.raises(ValueError, match="clamp_indirect"):
            scene.render(16, 16, spp=1, clamp_indirect=wrong)
    with pytest.raises(ValueError, match="clamp_indirect is for the integrator path"):
        scene.render(16, 16, spp=1, integrator="direct", clamp_indirect=1)


def test_meshes_become_surfaces():
    scene = alhazen.Scene()
    corners = np.float32([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    triangles = np.int32([t for a, b, c, d in sides for t in ([a, b, c], [a, c, d])])

    def bounds(**settings):
        mesh = scene.add_mesh(corners, triangles)
        scene.add_instance(mesh)
        notes = scene.subdivide(mesh, **settings)
        low, high = scene.bounds
        scene.remove_mesh(mesh)
        return notes, float(high[0])

    # The middle of a side: (16 + 12 + 20/9) / 36.
    assert bounds(levels=3)[1] == pytest.approx(0.8395, abs=1e-3)
    assert bounds(levels=3, polygons=sides)[1] == pytest.approx(0.8395, abs=1e-3)
    assert bounds(levels=2, creases=[(1, 3, 10), (3, 7, 10), (7, 5, 10), (5, 1, 10)])[1] == pytest.approx(1)
    assert bounds(levels=2, corners=[(7, 10)])[1] == pytest.approx(1)
    flat = {"scheme": "linear", "levels": 1, "displacement": np.full((2, 2, 3), 0.5, np.float32), "scale": 0.2}
    assert bounds(**flat, space="object")[1] == pytest.approx(1.1)
    assert bounds(levels=1, polygons=[[0, 1, 1], *sides])[0] != []
    for wrong in ({"scheme": "doo"}, {"levels": 99}, {"levels": 1, "edge_length": 1}, {"edge_pixels": 0},
                  {"polygons": [[0, 1, 99]]}, {"space": "uv"}, {"creases": [(0, 99, 1)]}):
        with pytest.raises(ValueError):
            bounds(**wrong)
