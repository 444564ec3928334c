"""Families of scenes under the open sky.

Each function fills a `kit.Kit` and returns a function that draws a candidate for a camera.
"""

import numpy as np

import shapes
from rooms import TAU, lens


def orbit(kit, target, near, far, low=0.1, high=0.9, **options):
    """Cameras round a point, `near` to `far` metres away, `low` to `high` radians above it."""
    rng = kit.rng
    target = np.asarray(target, float)

    def camera():
        turn, height, distance = rng.random() * TAU, rng.uniform(low, high), kit.between(near, far)
        away = np.array(
            [np.cos(height) * np.sin(turn), np.sin(height), np.cos(height) * np.cos(turn)]
        )
        return lens(
            kit,
            target + away * distance,
            target + rng.normal(size=3) * [0.15, 0.05, 0.15] * distance,
            **options,
        )

    return camera


def daylight(kit, sun=0.6):
    """A sky of any kind, often with a sun of its own; night gets some lamps."""
    rng = kit.rng
    kind = kit.sky(strength=kit.between(0.5, 2))
    if kind == "night":
        for _ in range(int(rng.integers(2, 8))):
            place = [*(rng.uniform(-4, 4, 1)), rng.uniform(1.0, 4), *(rng.uniform(-4, 4, 1))]
            kit.balls([place], rng.uniform(0.05, 0.3), kit.glow(kit.between(5, 200), 0.4))
    elif kit.chance(sun) and kind != "overcast":
        kit.sun(kit.between(1, 15))
    return kind


def ground(kit):
    """Things on open ground under a sky."""
    rng = kit.rng
    if kit.chance(0.3):
        surface = shapes.terrain(rng, 40, rng.uniform(0.1, 0.6))
    else:
        surface = shapes.plane(60, 60, texel=rng.choice([1, 2, 4]))
    kit.put(surface, kit.opaque() if kit.chance(0.4) else kit.matte(textured=True))
    if kit.chance(0.4):
        wall = shapes.boxes(
            [((rng.uniform(4, 10), rng.uniform(1, 5), 0.3), (0, 0, -3 - rng.random()))], texel=2
        )
        kit.put(wall, kit.wall(), y=1.2, turn=rng.random() * TAU)
    reach = rng.uniform(1.5, 4)
    kit.scatter(int(rng.integers(5, 40)), [-reach, -reach], [reach, reach], (0.25, 1.4))
    daylight(kit)
    return orbit(kit, [0, 0.4, 0], 1.8, reach * 2 + 2, 0.08, 0.8)


def town(kit):
    """Blocks of houses, poles, wires and trees, from the street or from above."""
    rng = kit.rng
    kit.put(shapes.plane(120, 120, 4), kit.matte(textured=True))
    walls = [kit.wall() for _ in range(4)]
    pane = kit.opaque()
    for x in range(-3, 4):
        for z in range(-3, 4):
            if kit.chance(0.25) or x == 0:
                continue
            w, d, h = rng.uniform(4, 7.5), rng.uniform(4, 7.5), rng.uniform(2, 14)
            kit.put(shapes.box([w, h, d], 3), walls[rng.integers(4)], x=9 * x, y=h / 2, z=9 * z)
            if kit.chance(0.6):
                glass = [((w + 0.1, 0.9, d + 0.1), (0, y, 0)) for y in np.arange(1.2, h - 0.5, 2.2)]
                kit.put(shapes.boxes(glass), pane, x=9 * x, z=9 * z)
            if kit.chance(0.4):
                gable = shapes.moved(
                    shapes.extrude_up(np.array([[-0.7, -0.3], [0.7, -0.3], [0, 0.6]]) * w / 2, d),
                    shapes.place(tilt=np.pi / 2),
                )
                kit.put(gable, walls[rng.integers(4)], x=9 * x, y=h + 0.1, z=9 * z - d / 2)
    crown = kit.mesh(shapes.leaves(rng, 500, 1.3, 0.5), kit.foliage())
    trunk = kit.mesh(shapes.lathe([[0.2, 0], [0.1, 3]], 12, solid=False), kit.matte())
    lamp = kit.scene.add_spheres([[0, 0, 0]], [0.2], material=kit.glow(kit.between(5, 300)))
    for _ in range(int(rng.integers(4, 20))):
        x, z = rng.choice([-3.2, 3.2]) + rng.normal() * 0.3, rng.uniform(-25, 25)
        kit.repeat(trunk, x=x, z=z)
        kit.repeat(crown if kit.chance(0.7) else lamp, x=x, y=3.4, z=z, turn=rng.random() * TAU)
    kit.scatter(6, [-2.5, -15], [2.5, 15], (0.8, 2.5))
    daylight(kit, 0.9)
    if kit.chance(0.5):
        return orbit(kit, [0, 2, 0], 14, 40, 0.25, 0.9, defocus=0.05)

    def street():
        eye = [rng.uniform(-2.5, 2.5), rng.uniform(1.2, 4), rng.uniform(-25, 25)]
        return lens(
            kit,
            eye,
            [
                rng.uniform(-5, 5),
                rng.uniform(1, 6),
                eye[2] + rng.choice([-1, 1]) * rng.uniform(6, 18),
            ],
            wide=0.4,
            defocus=0.05,
        )

    return street
