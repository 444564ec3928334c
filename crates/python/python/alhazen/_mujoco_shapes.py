"""Triangles of MuJoCo's shapes, in the space of their geoms."""

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

#: Pieces of a circle: a cylinder of 10 cm is round to a tenth of a millimetre.
_AROUND = 96


@dataclass
class Triangles:
    """A mesh: vertices and, if it is smooth, normals of shape (n, 3), corners (m, 3), texture coordinates (n, 2)."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: Optional[NDArray[np.float64]] = None
    uvs: Optional[NDArray[np.float64]] = None


def plane() -> Triangles:
    """From -1 to 1 in x and y."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return Triangles(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def box() -> Triangles:
    """From -1 to 1 in all axes; each side has corners of its own."""
    vertices, triangles = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            first = len(vertices)
            normal = side * np.eye(3)[axis]
            vertices += [normal + a * u + b * v for a, b in [(-1, -1), (1, -1), (1, 1), (-1, 1)]]
            order = [(0, 1, 2), (0, 2, 3)] if side > 0 else [(0, 2, 1), (0, 3, 2)]
            triangles += [[first + i for i in corners] for corners in order]
    return Triangles(np.array(vertices), np.array(triangles))


def _grid(rows: int, columns: int, first: int = 0) -> NDArray[np.int64]:
    """Triangles of vertices in rows, front towards the viewer of rows that go up and columns that go right."""
    row, column = np.mgrid[: rows - 1, : columns - 1]
    a = (first + row * columns + column).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def _turned(profile: NDArray[np.float64], normals: NDArray[np.float64]) -> Triangles:
    """What a profile of (radius, z), from below to above, leaves when it is turned about z."""
    angle = np.linspace(0, 2 * np.pi, _AROUND + 1)
    around = np.stack([np.cos(angle), np.sin(angle)], 1)

    def turn(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        aside = rows[:, None, :1] * around[None]
        up = np.broadcast_to(rows[:, None, 1:], (*aside.shape[:2], 1))
        return np.concatenate([aside, up], 2).reshape(-1, 3)

    triangles = _grid(len(profile), _AROUND + 1)
    vertices = turn(profile)
    corners = vertices[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Triangles(vertices, triangles[area > 1e-12], turn(normals))


def ball() -> Triangles:
    """Of radius 1."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _AROUND // 2 + 1)
    profile = np.stack([np.cos(angle), np.sin(angle)], 1)
    return _turned(profile, profile)


def capsule(half_length: float) -> Triangles:
    """Of radius 1; the cylinder in the middle goes from -half_length to half_length in z."""
    angle = np.linspace(0, 0.5 * np.pi, _AROUND // 4 + 1)
    above = np.stack([np.cos(angle), np.sin(angle)], 1)
    normals = np.concatenate([above[::-1] * [1, -1], above])
    return _turned(normals + np.repeat([[0, -half_length], [0, half_length]], len(above), axis=0), normals)


def cylinder() -> Triangles:
    """Of radius 1, from -1 to 1 in z."""
    profile = np.array([[0.0, -1], [1, -1], [1, -1], [1, 1], [1, 1], [0, 1]])
    normals = np.array([[0.0, -1], [0, -1], [1, 0], [1, 0], [0, 1], [0, 1]])
    return _turned(profile, normals)


def height_field(model: Any, number: int) -> Triangles:
    """The surface of a height field and its base."""
    rows, columns = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
    half_x, half_y, top, base = (float(x) for x in model.hfield_size[number])
    first = int(model.hfield_adr[number])
    heights = np.array(model.hfield_data[first : first + rows * columns], float).reshape(rows, columns) * top
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    surface = np.stack([x, y, heights], 2)
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    edge = np.concatenate([surface[0], surface[1:, -1], surface[-1, -2::-1], surface[-2::-1, 0]])
    skirt = np.concatenate([edge * [1, 1, 0] - [0, 0, base], edge])
    corners = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    floor = np.concatenate([corners, np.full((4, 1), -base)], 1)
    count = rows * columns
    vertices = np.concatenate([surface.reshape(-1, 3), skirt, floor])
    below = count + len(skirt) + np.array([[0, 2, 1], [0, 3, 2]])
    triangles = np.concatenate([_grid(rows, columns), _grid(2, len(edge), count), below])
    uvs = np.concatenate([np.stack([u, v], 2).reshape(-1, 2), np.zeros((len(vertices) - count, 2))])
    return Triangles(vertices, triangles, None, uvs)


def mesh(model: Any, number: int) -> Triangles:
    """A mesh of the model. Corners that share a vertex may have normals and texture coordinates of their own."""
    faces = _rows(model.mesh_face, model.mesh_faceadr, model.mesh_facenum, number)
    vertices = _rows(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum, number)
    corners = [faces.ravel()]
    has_uvs = int(model.mesh_texcoordadr[number]) >= 0
    if hasattr(model, "mesh_facenormal"):
        corners.append(_rows(model.mesh_facenormal, model.mesh_faceadr, model.mesh_facenum, number).ravel())
        normals = _rows(model.mesh_normal, model.mesh_normaladr, model.mesh_normalnum, number)
    else:
        corners.append(corners[0])
        normals = _rows(model.mesh_normal, model.mesh_vertadr, model.mesh_vertnum, number)
    if has_uvs:
        places = getattr(model, "mesh_facetexcoord", model.mesh_face)
        corners.append(_rows(places, model.mesh_faceadr, model.mesh_facenum, number).ravel())
        count = getattr(model, "mesh_texcoordnum", model.mesh_vertnum)
        uvs = _rows(model.mesh_texcoord, model.mesh_texcoordadr, count, number)
    different, triangles = np.unique(np.stack(corners, 1), axis=0, return_inverse=True)
    return Triangles(
        vertices[different[:, 0]].astype(float),
        triangles.reshape(-1, 3),
        normals[different[:, 1]].astype(float),
        uvs[different[:, 2]].astype(float) if has_uvs else None,
    )


def _rows(values: Any, first: Any, count: Any, number: int) -> NDArray[Any]:
    return np.array(values[int(first[number]) : int(first[number]) + int(count[number])])


def with_cube_coordinates(made: Triangles) -> Triangles:
    """Coordinates in a picture of a cube's six faces below each other, as OpenGL has them: right, left, up, down, front,
    back. A triangle is on the face that its middle looks at."""
    corners = made.vertices[made.triangles]
    middle = corners.mean(axis=1)
    axis = np.abs(middle).argmax(axis=1)
    side = np.take_along_axis(middle, axis[:, None], 1)[:, 0] < 0
    face = 2 * axis + side
    uvs = np.stack([_on_face(corners[:, i], face) for i in range(3)], 1)
    # Not quite to the edge of a face: texels of the next one would be mixed in.
    uvs[..., 1] = (face[:, None] + np.clip(uvs[..., 1], 0.002, 0.998)) / 6
    normals = None if made.normals is None else made.normals[made.triangles].reshape(-1, 3)
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    return Triangles(corners.reshape(-1, 3), triangles, normals, uvs.reshape(-1, 2))


#: For each face: the axes of s and t and their signs, as the specification of OpenGL has them.
_FACES = np.array([[2, -1, 1, -1], [2, 1, 1, -1], [0, 1, 2, 1], [0, 1, 2, -1], [0, 1, 1, -1], [0, -1, 1, -1]])


def _on_face(points: NDArray[np.float64], face: NDArray[np.int64]) -> NDArray[np.float64]:
    """Where on its face each point is, from 0 to 1."""
    s_axis, s_sign, t_axis, t_sign = _FACES[face].T

    def along(axis: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.take_along_axis(points, axis[:, None], 1)[:, 0]

    depth = np.maximum(np.abs(along(face // 2)), 1e-12)
    s, t = s_sign * along(s_axis) / depth, t_sign * along(t_axis) / depth
    return np.clip(0.5 + 0.5 * np.stack([s, t], 1), 0, 1)
