"""Procedural meshes.

A mesh is a tuple (vertices [n, 3], triangles [m, 3], normals [n, 3], uvs [n, 2]) in metres, float32
and int32, with triangles counter-clockwise seen from outside. +Y is up. A *flat* mesh has vertices
of its own for each face.
"""

import numpy as np

TAU = 2 * np.pi


def place(x=0.0, y=0.0, z=0.0, turn=0.0, scale=1.0, tilt=0.0, roll=0.0):
    """Matrix [4, 4]: scale (one or three), roll about z, tilt about x, turn about y, move."""
    c, s = np.cos(turn), np.sin(turn)
    about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    c, s = np.cos(tilt), np.sin(tilt)
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(roll), np.sin(roll)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_y @ about_x @ about_z * np.broadcast_to(scale, 3)
    matrix[:3, 3] = x, y, z
    return matrix


def moved(mesh, matrix):
    """The mesh under a matrix [4, 4]."""
    vertices, triangles, normals, uvs = mesh
    linear = matrix[:3, :3]
    out = normals @ np.linalg.inv(linear)
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return vertices @ linear.T + matrix[:3, 3], triangles, out, uvs


def merge(meshes):
    counts = np.cumsum([0] + [len(m[0]) for m in meshes])
    return (
        np.concatenate([m[0] for m in meshes]),
        np.concatenate([m[1] + o for m, o in zip(meshes, counts)]),
        np.concatenate([m[2] for m in meshes]),
        np.concatenate([m[3] for m in meshes]),
    )


def flat(mesh):
    """The same surface with the normals of its faces."""
    vertices, triangles, _, uvs = mesh
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(normal, axis=1) > 1e-12
    corners, normal, uv = corners[keep], normal[keep], uvs[triangles][keep]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    index = np.arange(3 * len(corners)).reshape(-1, 3)
    return corners.reshape(-1, 3), index, np.repeat(normal, 3, 0), uv.reshape(-1, 2)


def grid(points, wrap_u=False, wrap_v=False, uv=(1.0, 1.0), solid=False):
    """A smooth mesh of points [n, m, 3]; with `wrap` the last row or column repeats the first.

    `solid` turns it inside out where its volume is negative.
    """
    n, m, _ = points.shape
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    face = np.cross(c - a, d - b)
    normals = np.zeros_like(points)
    for rows in (slice(0, n - 1), slice(1, n)):
        for columns in (slice(0, m - 1), slice(1, m)):
            normals[rows, columns] += face
    if wrap_u:
        normals[0] = normals[-1] = normals[0] + normals[-1]
    if wrap_v:
        normals[:, 0] = normals[:, -1] = normals[:, 0] + normals[:, -1]
    for row in (0, -1):
        if np.ptp(points[row], axis=0).max() < 1e-7:
            normals[row] = normals[row].sum(0)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where(length > 1e-14, normals / np.maximum(length, 1e-14), [0, 1, 0])
    index = np.arange(n * m).reshape(n, m)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.stack([a, b, c, a, c, d], -1).reshape(-1, 3)
    v, u = np.meshgrid(np.linspace(0, uv[1], m), np.linspace(0, uv[0], n))
    vertices = points.reshape(-1, 3)
    normals = normals.reshape(-1, 3)
    corners = vertices[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(cross, axis=1) > 1e-12
    volume = np.einsum("ij,ij->", corners[:, 0] - vertices.mean(0), cross)
    if solid and volume < 0:
        triangles, normals = triangles[:, ::-1], -normals
    return vertices, triangles[keep], normals, np.stack([v, u], -1).reshape(-1, 2)


def box(size, texel=1.0):
    """A box [3] round the origin; a texture repeats every `texel` metres."""
    half = np.asarray(size, float) / 2
    parts = []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corner = np.zeros((4, 3))
            corner[:, axis] = sign * half[axis]
            corner[:, u] = np.array([-1, 1, 1, -1]) * half[u]
            corner[:, v] = np.array([-1, -1, 1, 1]) * half[v]
            normal = np.zeros((4, 3))
            normal[:, axis] = sign
            triangles = np.array([[0, 1, 2], [0, 2, 3]])[:, :: 1 if sign > 0 else -1]
            uvs = corner[:, [u, v]] if axis != 0 else corner[:, [v, u]]
            parts.append((corner, triangles, normal, uvs / texel))
    return merge(parts)


def boxes(sizes_and_centers, texel=1.0):
    """Merged boxes of pairs (size [3], center [3])."""
    return merge([moved(box(s, texel), place(*c)) for s, c in sizes_and_centers])


def plane(width, depth, texel=1.0):
    """A horizontal rectangle round the origin that faces up."""
    x, z = width / 2, depth / 2
    corners = np.array([[-x, 0, -z], [-x, 0, z], [x, 0, z], [x, 0, -z]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return corners, triangles, np.tile([0.0, 1, 0], (4, 1)), corners[:, [0, 2]] / texel


def card(width, height):
    """An upright rectangle on the origin that faces +z, with uvs of the whole texture."""
    x = width / 2
    corners = np.array([[-x, 0, 0], [x, 0, 0], [x, height, 0], [-x, height, 0.0]])
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0.0]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 0, 1], (4, 1)), uvs


def lathe(profile, steps=48, flutes=0, depth=0.0, solid=True):
    """A profile [n, 2] of (radius, height) turned round y, with grooves where `flutes` says."""
    profile = np.asarray(profile, float)
    angle = np.linspace(0, TAU, max(steps, flutes * 8) + 1)
    groove = 1 - depth * np.abs(np.sin(angle * flutes / 2)) if flutes else np.ones_like(angle)
    radius = profile[:, :1] * groove
    points = np.stack(
        [radius * np.cos(angle), profile[:, 1:] + 0 * radius, radius * np.sin(angle)], -1
    )
    points[:, -1] = points[:, 0]
    return grid(points, wrap_v=True, uv=(2, 3), solid=solid)


def smooth_profile(rng, height=1.0, radius=0.35, closed=True, knots=6, samples=40):
    """A random profile of a vase, from the axis at the bottom to the axis at the top."""
    radii = radius * rng.uniform(0.35, 1.0, knots)
    h = np.linspace(0, 1, samples)
    position = h * (knots - 1)
    index = np.minimum(position.astype(int), knots - 2)
    t = position - index
    t = t * t * (3 - 2 * t)
    r = radii[index] * (1 - t) + radii[index + 1] * t
    rows = np.stack([r, h * height], 1)
    if closed:
        rows = np.concatenate([[[0, 0]], rows, [[0, height]]])
    return rows


def vessel(rng, height, radius, wall):
    """A profile of a glass with a wall: outside up, round the rim, inside down to the axis."""
    outside = smooth_profile(rng, height, radius, closed=False, knots=rng.integers(3, 6))
    if rng.random() < 0.4:  # a stem and a foot
        stem = rng.uniform(0.3, 0.5)
        h = outside[:, 1] / height
        bowl = radius * np.clip(
            np.sin(np.clip((h - stem) / (1 - stem), 0, 1) * rng.uniform(1.8, 2.6)), 0, 1
        )
        foot = 0.7 * radius * np.exp(-((h / 0.05) ** 2))
        outside[:, 0] = np.maximum(np.maximum(bowl, foot), 0.09 * radius)
        keep = h > stem + 0.05
    else:
        keep = outside[:, 1] > wall * 1.5
    inside = outside[keep][::-1].copy()
    inside[:, 0] = np.maximum(inside[:, 0] - wall, 0.02 * radius)
    bottom = [[0, inside[-1, 1]]]
    return np.concatenate([[[0, 0]], outside, inside, bottom]), inside[::-1]


def torus(major=0.7, minor=0.3, steps=(64, 32)):
    u, v = np.meshgrid(
        np.linspace(0, TAU, steps[0] + 1), np.linspace(0, TAU, steps[1] + 1), indexing="ij"
    )
    r = major + minor * np.cos(v)
    points = np.stack([r * np.cos(u), minor * np.sin(v), r * np.sin(u)], -1)
    return grid(points, True, True, uv=(6, 2), solid=True)


def tube(path, radius, sides=8, closed=False):
    """A tube of `radius` (one number or one for each point) round a path [n, 3]."""
    path = np.asarray(path, float)
    tangent = np.gradient(path, axis=0)
    if closed:
        tangent[0] = tangent[-1] = path[1] - path[-2]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-12
    helper = np.eye(3)[np.argmin(np.abs(tangent).mean(0))]
    side = np.cross(tangent, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-12
    other = np.cross(tangent, side)
    angle = np.linspace(0, TAU, sides + 1)[None, :, None]
    ring = side[:, None] * np.cos(angle) + other[:, None] * np.sin(angle)
    points = path[:, None] + np.broadcast_to(radius, len(path))[:, None, None] * ring
    return grid(points, closed, True, uv=(8, 1), solid=True)


def knot(rng):
    p, q = [(2, 3), (3, 2), (2, 5), (3, 4), (1, 4)][rng.integers(5)]
    t = np.linspace(0, TAU, 257)
    r = 0.6 + 0.25 * np.cos(q * t)
    path = np.stack([r * np.cos(p * t), 0.3 * np.sin(q * t), r * np.sin(p * t)], 1)
    return tube(path, rng.uniform(0.05, 0.14), 14, closed=True)


def superquadric(rng, steps=40):
    """A form between box, ball and star, within [-1, 1]^3."""
    e1, e2 = 10 ** rng.uniform(-0.9, 0.35, 2)
    power = lambda x, e: np.sign(x) * np.abs(x) ** e
    u, v = np.meshgrid(
        np.linspace(-np.pi / 2, np.pi / 2, steps), np.linspace(0, TAU, 2 * steps), indexing="ij"
    )
    x = power(np.cos(u), e1) * power(np.cos(v), e2)
    z = power(np.cos(u), e1) * power(np.sin(v), e2)
    return grid(np.stack([x, power(np.sin(u), e1), z], -1), wrap_v=True, uv=(2, 4), solid=True)


def extrude(outline, height):
    """A star-shaped outline [n, 2] in xz round the origin, extruded from 0 to `height`; flat."""
    n = len(outline)
    bottom = np.column_stack([outline[:, 0], np.zeros(n), outline[:, 1]])
    top = bottom + [0, height, 0]
    vertices = np.concatenate([bottom, top, [[0, 0, 0], [0, height, 0]]])
    i = np.arange(n)
    j = (i + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    triangles = np.concatenate(
        [
            np.stack(c, 1)
            for c in ((i, n + i, n + j), (i, n + j, j), (low, i, j), (high, n + j, n + i))
        ]
    )
    return flat((vertices, triangles, vertices, vertices[:, [0, 2]] + vertices[:, [1, 1]]))


def gear(rng):
    teeth = int(rng.integers(6, 24))
    angle = -np.linspace(0, TAU, teeth * 4, endpoint=False)
    radius = np.tile([1, 1, 0.8, 0.8], teeth) * np.ones(teeth * 4)
    return extrude_up(
        np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1), rng.uniform(0.2, 0.6)
    )


def polygon(rng):
    n = int(rng.integers(3, 9))
    angle = -np.linspace(0, TAU, 2 * n, endpoint=False)
    radius = np.tile([1, rng.uniform(0.4, 1.0)], n)
    return extrude_up(
        np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1), rng.uniform(0.3, 2)
    )


def extrude_up(outline, height):
    mesh = extrude(outline, height)
    corners = mesh[0][mesh[1]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if np.einsum("ij,ij->", corners[:, 0] - mesh[0].mean(0), cross) < 0:
        mesh = (mesh[0], mesh[1][:, ::-1], -mesh[2], mesh[3])
    return mesh


def waves(rng, p, count=7, low=1.0, high=9.0):
    """A sum of random sine waves at points [..., 3], about in [-1, 1]."""
    total = 0
    for _ in range(count):
        k = rng.normal(size=3)
        frequency = np.exp(rng.uniform(np.log(low), np.log(high)))
        total = (
            total
            + np.sin(p @ (k / np.linalg.norm(k) * frequency) + TAU * rng.random()) / frequency**0.7
        )
    return total * low**0.7 / 2


def rock(rng, steps=64):
    """A displaced ball of about radius 1."""
    u, v = np.meshgrid(np.linspace(0, np.pi, steps), np.linspace(0, TAU, 2 * steps), indexing="ij")
    d = np.stack([np.sin(u) * np.cos(v), np.cos(u), np.sin(u) * np.sin(v)], -1)
    d[0], d[-1], d[:, -1] = [0, 1, 0], [0, -1, 0], d[:, 0]
    shape = waves(rng, d, low=rng.uniform(1, 5), high=25)
    if rng.random() < 0.3:
        shape = np.abs(shape) * 1.5
    mesh = grid(
        d * (1 + rng.uniform(0.1, 0.35) * shape)[..., None], wrap_v=True, uv=(2, 4), solid=True
    )
    return flat(mesh) if rng.random() < 0.2 else mesh


def terrain(rng, size, height, n=110):
    """Hills that face up, `size` metres wide round the origin."""
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, n), np.linspace(-0.5, 0.5, n), indexing="ij")
    p = np.stack([x, 0 * x, z], -1)
    y = waves(rng, p, 12, 6, 60) * height
    y *= np.clip(np.hypot(x, z) * 6, 0.1, 1)
    points = np.stack([x * size, y, z * size], -1)
    mesh = grid(points, uv=(size / 2, size / 2))
    return mesh if mesh[2][:, 1].mean() > 0 else (mesh[0], mesh[1][:, ::-1], -mesh[2], mesh[3])


def curtain(rng, width, height):
    """A wavy hanging sheet, from y = 0 to `height`."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, 120), np.linspace(0, 1, 14), indexing="ij")
    folds = rng.uniform(4, 14) * TAU
    depth = 0.045 * (1 - 0.4 * v)
    z = depth * np.sin(u * folds + 0.7 * np.sin(3 * u + 2 * v)) * (1 + 0.3 * np.sin(u * 11))
    return grid(np.stack([u * width, v * height, z], -1), uv=(width, height))


def blades(rng, count, spread, length, width):
    """Blades of grass or hairs on a square `spread` wide, each of 3 quads that bend."""
    base = (
        np.stack([rng.uniform(-0.5, 0.5, count), np.zeros(count), rng.uniform(-0.5, 0.5, count)], 1)
        * spread
    )
    turn = rng.random(count) * TAU
    side = np.stack([np.cos(turn), np.zeros(count), np.sin(turn)], 1)
    lean = np.stack([-side[:, 2], np.zeros(count), side[:, 0]], 1) * rng.uniform(0, 0.8, (count, 1))
    long = length * rng.uniform(0.5, 1.2, (count, 1))
    rows = []
    for t in (0.0, 0.4, 0.75, 1.0):
        middle = base + long * (t * np.array([0, 1, 0]) * (1 - 0.2 * t) + lean * t * t)
        half = 0.5 * width * (1 - 0.9 * t)
        rows.append(np.stack([middle - half * side, middle + half * side], 1))
    points = np.stack(rows, 1)  # [count, 4, 2, 3]
    index = np.arange(count * 8).reshape(count, 4, 2)
    a, b, c, d = index[:, :-1, 0], index[:, :-1, 1], index[:, 1:, 1], index[:, 1:, 0]
    triangles = np.stack([a, b, c, a, c, d], -1).reshape(-1, 3)
    normal = np.cross(side, [0, 1, 0] + lean)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    uvs = np.tile(
        np.array([[0, 1], [1, 1], [0, 0.6], [1, 0.6], [0, 0.3], [1, 0.3], [0, 0], [1, 0]]),
        (count, 1),
    )
    return points.reshape(-1, 3), triangles, np.repeat(normal, 8, 0), uvs


def leaves(rng, count, radius, size):
    """Leaf cards in a ball round the origin, turned at random, for a texture with a mask."""
    d = rng.normal(size=(count, 3))
    d *= radius * rng.random((count, 1)) ** 0.4 / np.linalg.norm(d, axis=1, keepdims=True)
    u = rng.normal(size=(count, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    w = np.cross(u, rng.normal(size=(count, 3)))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    half = size * rng.uniform(0.3, 0.6, (count, 1))
    points = np.stack(
        [
            d - half * u - half * w,
            d + half * u - half * w,
            d + half * u + half * w,
            d - half * u + half * w,
        ],
        1,
    )
    index = np.arange(count * 4).reshape(count, 4)
    triangles = np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]])
    uvs = np.tile(np.array([[0, 1], [1, 1], [1, 0], [0, 0.0]]), (count, 1))
    return points.reshape(-1, 3), triangles, np.repeat(np.cross(u, w), 4, 0), uvs


def lattice(width, height, cells, thickness):
    """An upright lattice of thin bars on the origin: a fence, blinds, bars of a window."""
    columns, rows = cells
    bars = [
        ((thickness, height, thickness), (x, height / 2, 0))
        for x in np.linspace(-0.5, 0.5, columns) * width
    ]
    bars += [
        ((width, thickness, thickness * 0.8), (0, y, 0))
        for y in np.linspace(0.02, 1, rows) * height
    ]
    return boxes(bars)
