"""Scenes from files and from arrays."""

import numpy as np
import pytest

import alhazen

TRIANGLE = (np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.int32([[0, 1, 2]]))


def test_built_in_scenes_load():
    assert "cornell" in alhazen.scenes()
    scene = alhazen.load("cornell")
    assert scene.triangle_count > 10 and scene.bounds.shape == (2, 3)
    assert len(scene.instance_names) > 0 and "Scene(" in repr(scene)


def test_parameters_reach_the_scene():
    few = alhazen.load("material-grid", parameters={"columns": "2", "rows": "2"})
    many = alhazen.load("material-grid", parameters={"columns": "3", "rows": "2"})
    assert len(many.instance_names) - len(few.instance_names) == 2
    with pytest.raises(alhazen.LoadError, match="pillars"):
        alhazen.load("material-grid", parameters={"pillars": "2"})


def test_errors_tell_the_whole_chain(tmp_path):
    with pytest.raises(alhazen.LoadError, match="no_such.*No such file"):
        alhazen.load(tmp_path / "no_such.obj")
    broken = tmp_path / "broken.ply"
    broken.write_text("ply\nformat ascii 1.0\nelement vertex x\nend_header\n")
    with pytest.raises(alhazen.Error, match="broken.ply"):
        alhazen.load(broken)
    with pytest.raises(alhazen.LoadError, match="no built-in scene `cornel`"):
        alhazen.load("cornel")
    assert issubclass(alhazen.LoadError, alhazen.Error) and issubclass(alhazen.BackendError, alhazen.Error)


def test_a_file_gives_what_was_written(tmp_path):
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 2 0 0\nv 0 3 0\nf 1 2 3\n")
    scene = alhazen.load(path)
    np.testing.assert_array_equal(scene.bounds, [[0, 0, 0], [2, 3, 0]])
    assert any("sky was added" in note for note in scene.report)
    assert not any("sky" in note for note in alhazen.load(path, daylight=False).report)


@pytest.mark.parametrize(
    "change, text",
    [
        (lambda s: s.add_mesh([[0, 0]], [[0, 0, 0]]), "vertices: expected the shape"),
        (lambda s: s.add_mesh(TRIANGLE[0], [[0, 1, 3]]), "row 0 is .* but there are 3 vertices"),
        (lambda s: s.add_mesh(TRIANGLE[0], [[0, 1, -1]]), "row 0"),
        (lambda s: s.add_mesh(TRIANGLE[0], [[0.5, 1, 2]]), "whole numbers|not an array"),
        (lambda s: s.add_mesh(*TRIANGLE, normals=[[0, 0, 1]]), "normals: 1 rows for 3 vertices"),
        (lambda s: s.add_mesh(*TRIANGLE, material=3), "material: 3 of only"),
        (lambda s: s.add_mesh("nothing", [[0, 1, 2]]), "vertices: not an array of numbers"),
        (lambda s: s.add_instance(7), "mesh: 7 of only"),
        (lambda s: s.add_spheres([[0, 0, 0]], [-1]), "sphere 0"),
        (lambda s: s.add_spheres([[0, 0, 0]], [1, 2]), "1 centers but 2 radii"),
        (lambda s: s.add_material(model="velvet"), "unknown `velvet`; there are: .*lambert"),
        (lambda s: s.add_material(roughness=2), "roughness: 2"),
        (lambda s: s.add_material(base_color=[1, 2, 3, 4, 5]), "base_color"),
        (lambda s: s.add_material(base_color_texture=np.zeros((2, 2, 5))), "expected uint8"),
        (lambda s: s.add_point_light([0, 0, np.nan], 1), "position"),
        (lambda s: s.add_point_light([0, 0, 0], -1), "intensity"),
        (lambda s: s.add_spot_light([0, 0, 0], [0, 0, 0], 1), "direction"),
        (lambda s: s.add_projector([0, 0, 0], [0, 0, 0], np.ones((2, 2, 3)), 1), "direction, up"),
        (lambda s: s.add_projector([0, 0, 0], [0, 1, 0], np.ones((2, 2, 3)), 1), "along each other"),
        (lambda s: s.add_projector([0, 0, 0], [0, 0, -1], np.ones((2, 2)), 1), "picture: expected uint8"),
        (lambda s: s.add_projector([0, 0, 0], [0, 0, -1], np.ones((2, 2, 3)), 1, field_of_view=4), "field_of_view: 4"),
        (lambda s: s.set_environment([-1, 0, 0]), "radiance"),
        (lambda s: s.add_portal([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), r"corners: expected the shape \(4, 3\)"),
        (lambda s: s.add_portal([[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]]), "not flat"),
        (lambda s: s.add_portal([[0, 0, 0]] * 4), "no area"),
        (lambda s: s.set_fog(alhazen.Medium(emission=1)), "infinitely bright"),
        (lambda s: s.set_fog(alhazen.Medium(scattering=1, density=np.ones((2, 2, 2)))), "boundary"),
        (lambda s: s.set_fog(alhazen.Medium(scattering=1), top=np.nan), "top"),
        (lambda s: alhazen.Medium(absorption=-1), "absorption"),
        (lambda s: alhazen.Medium(anisotropy=1), "anisotropy: 1"),
        (lambda s: alhazen.Medium(density=np.ones((2, 2))), "density: expected the shape"),
        (lambda s: alhazen.Medium(density=[[[-1]]]), "density: -1"),
        (lambda s: alhazen.Medium(density=np.ones((2, 2, 2)), bounds=[[1, 1, 1], [0, 0, 0]]), "bounds must be"),
        (lambda s: alhazen.Medium(density=np.ones((0, 2, 2))), "there must be cells"),
        (lambda s: s.add_material(medium=alhazen.Medium(scattering=1)), "light gets into"),
        (lambda s: s.add_material(model="lambert", priority=1), "light gets into"),
        (lambda s: s.add_material(model="dielectric", priority=5000), "priority: 5000"),
        (lambda s: s.add_material(subsurface_radius=0.01), "model dielectric"),
        (lambda s: s.add_material(model="dielectric", subsurface_radius=0), "subsurface_radius: .* not positive"),
        (lambda s: s.set_transform(0, np.eye(4)), "instance: the scene has only 0"),
        (lambda s: s.render(16, 16, 0), "spp"),
        (lambda s: s.render(0, 16, 1), "not possible"),
        (lambda s: s.render(16, 16, 1, aovs=["dephts"]), "unknown layer `dephts`"),
        (lambda s: s.render(16, 16, 1, camera="left"), "there is no left"),
        (lambda s: s.render(16, 16, 1, backend="magic"), "unknown back end `magic`"),
        (lambda s: s.render(16, 16, 1, crop=[10, 10, 10, 10]), "window"),
        (lambda s: s.intersect([[0, 0, 0]], [[0, 0]]), r"one shape \(..., 3\)"),
        (lambda s: alhazen.Camera.look_at([0, 0, 0], [0, 0, 0]), "same point"),
        (lambda s: alhazen.Camera.look_at([0, 0, 0], [0, 0, 1], fov_y=4), "fov_y"),
        (lambda s: alhazen.Camera.from_opencv(np.eye(3), 2 * np.eye(4), 4, 4), "pose"),
        (lambda s: alhazen.Camera.from_opencv(np.ones((3, 3)), np.eye(4), 4, 4), "matrix"),
        (lambda s: alhazen.encode_png(np.zeros((0, 0, 3))), "pixels"),
    ],
)
def test_bad_values_are_named(change, text):
    with pytest.raises(ValueError, match=text):
        change(alhazen.Scene())


def test_transforms_must_be_affine_and_invertible():
    scene = alhazen.Scene()
    mesh = scene.add_mesh(*TRIANGLE)
    for bad in (np.zeros((4, 4)), np.eye(3), np.full((4, 4), np.nan), np.diag([1, 1, 0, 1])):
        with pytest.raises(ValueError, match="transform"):
            scene.add_instance(mesh, transform=bad)
    matrix = np.array([[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1]])
    instance = scene.add_instance(mesh, transform=matrix[:3])
    np.testing.assert_array_equal(scene.transform(instance), matrix)


def test_an_environment_can_be_computed():
    scene = alhazen.Scene()
    scene.set_environment({"node": "coordinates", "space": "world"}, intensity=2.0)
    cubemap = alhazen.Camera.with_projection("cubemap", [0, 0, 0], [0, 0, -1])
    picture = scene.render(6, 1, camera=cubemap, spp=16, integrator="path")
    # Right, left, up, down, forward (-Z), back: means over faces of twice the direction, without negative ones.
    colors = picture["color"][0]
    assert colors[0, 0] > 1.2 and colors[1, 0] == 0 and colors[2, 1] > 1.2 and colors[3, 1] == 0
    assert colors[4, 2] == 0 and colors[5, 2] > 1.2
    with pytest.raises(ValueError, match="radiance"):
        scene.set_environment({"node": "marbles"})


def test_textures_can_be_computed():
    def red(**textures):
        scene = alhazen.Scene()
        material = scene.add_material(model="unlit", base_color=1, **textures)
        corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
        mesh = scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], material=material)
        scene.add_instance(mesh)
        camera = alhazen.Camera.look_at([0, 0, 3], [0, 0, 0], fov_y=0.5)
        return scene.render(32, 32, 16, camera=camera, backend="cpu", max_depth=1)["color"][..., 0]

    squares = {"node": "checkerboard", "a": [1, 0, 0], "b": "#000000", "space": "object", "scale": 2}
    picture = red(base_color_texture=squares)
    assert abs(picture.mean() - 0.5) < 0.02 and picture.std() > 0.4
    halves = np.zeros((1, 2, 3), np.float32)
    halves[0, 1] = 1
    image = {"node": "triplanar", "image": halves, "space": "object", "scale": 0.5}
    assert red(base_color_texture={"node": "invert", "input": image}).mean() > 0.1
    for wrong, words in [
        ({"node": "nois"}, "there is no such node"),
        ({"node": "noise", "octaves": 99}, "from 1 to 16"),
        ({"node": "image", "image": "a.png"}, "an image is an array"),
        ({"node": "mix", "a": object()}, "a value is a number"),
    ]:
        with pytest.raises(ValueError, match=words):
            alhazen.Scene().add_material(base_color_texture=wrong)
