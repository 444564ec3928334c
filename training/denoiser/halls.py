"""Families of large rooms: halls with columns, and offices with many lamps.

Each function fills a `kit.Kit` and returns a function that draws a candidate for a camera.
"""

import numpy as np

import shapes
import textures
from rooms import clutter, hang, lamps, lens, shell, wall_frame, window
from shapes import place


def hall(kit):
    """A hall or court with columns, galleries, carving, sunlight and sky."""
    rng = kit.rng
    width, depth, height = rng.uniform(6, 13), rng.uniform(10, 22), rng.uniform(6, 11)
    roof = kit.chance(0.35)
    openings = {}
    for side in range(4):
        if kit.chance(0.5):
            _, length = wall_frame(side, width, depth)
            edges = np.linspace(-0.46, 0.46, int(rng.integers(3, 7))) * length
            low = rng.choice([0.0, 1.0, height * 0.5])
            openings[side] = [
                (a + (b - a) * 0.25, b - (b - a) * 0.25, low, height * 0.85)
                for a, b in zip(edges, edges[1:])
            ]
    if roof and not openings:
        openings[2] = [(-depth * 0.4, depth * 0.4, height * 0.5, height * 0.9)]
    shell(kit, width, depth, height, openings, roof=roof)
    stone = kit.matte(base_color=textures.color(rng, 0.35, 0.8))
    floors = int(rng.integers(1, 3))
    tall = height / floors if kit.chance(0.7) else height * 0.6
    aisle = width * rng.uniform(0.2, 0.32)
    radius = tall * rng.uniform(0.04, 0.07)
    shaft = [[radius, 0.12 * tall], [radius * 0.82, 0.86 * tall]]
    shaft = np.stack(
        [np.linspace(shaft[0][0], shaft[1][0], 12), np.linspace(shaft[0][1], shaft[1][1], 12)], 1
    )
    flutes = int(rng.choice([0, 12, 16, 20]))
    column = shapes.lathe(shaft, 40, flutes, 0.15, solid=False)
    rings = rng.uniform(0.8, 1.5, 10) * radius
    base = shapes.lathe(np.stack([rings, np.linspace(0.04, 0.12, 10) * tall], 1), 40, solid=False)
    capital = shapes.lathe(
        np.stack(
            [np.linspace(0.85, 1.9, 10) * radius + 0.1 * rings, np.linspace(0.86, 0.97, 10) * tall],
            1,
        ),
        40,
    )
    blocks = shapes.boxes(
        [((3.4 * radius, 0.04 * tall, 3.4 * radius), (0, y * tall, 0)) for y in (0.02, 0.98)]
    )
    index = kit.mesh(shapes.merge([column, base, capital, blocks]), stone)
    rows = np.linspace(-0.45, 0.45, int(rng.integers(4, 9))) * depth
    baluster = kit.mesh(
        shapes.lathe(shapes.smooth_profile(rng, 0.8, 0.09, knots=7), 20), kit.opaque()
    )
    slab = kit.matte()
    for side in (-1, 1):
        x = side * (width / 2 - aisle)
        for level in range(floors):
            for z in rows:
                kit.repeat(index, x=x, y=level * tall, z=z)
        kit.put(
            shapes.boxes(
                [
                    ((0.5, 0.25, depth), (0, 0, 0)),
                    ((0.62, 0.06, depth), (0, 0.15, 0)),
                    ((0.6, 0.05, depth), (0, -0.12, 0)),
                ]
            ),
            stone,
            x=x,
            y=tall + 0.1,
        )
        kit.put(shapes.box([aisle, 0.2, depth]), slab, x=side * (width - aisle) / 2, y=tall + 0.12)
        if floors > 1:
            kit.put(shapes.box([0.15, 0.08, depth]), stone, x=x, y=tall + 1.1)
            for z in np.arange(-0.46 * depth, 0.46 * depth, rng.uniform(0.3, 0.6)):
                kit.repeat(baluster, x=x, y=tall + 0.26, z=z)
    ornament = kit.mesh(kit.thing(), stone)
    for z in rows[:-1]:
        for side in (-1, 1):
            if kit.chance(0.8):
                kit.repeat(
                    ornament,
                    x=side * (width / 2 - 0.5),
                    y=0.0,
                    z=z + (rows[1] - rows[0]) / 2,
                    turn=-side * 1.57,
                    scale=1.4,
                )
    if kit.chance(0.4):
        for z in rows[1:-1:2]:
            sheet = shapes.moved(shapes.curtain(rng, 1.6, 2.6), place(turn=np.pi / 2))
            kit.put(
                sheet, kit.matte(), x=rng.choice([-1, 1]) * (width / 2 - aisle), y=tall - 2.7, z=z
            )
    kit.scatter(
        int(rng.integers(1, 7)),
        [-0.25 * width, -0.4 * depth],
        [0.25 * width, 0.4 * depth],
        (0.5, 2.0),
    )
    for _ in range(int(rng.integers(0, 4))):
        kit.plant(
            rng.uniform(-0.25, 0.25) * width,
            0,
            rng.uniform(-0.4, 0.4) * depth,
            rng.uniform(0.8, 2.2),
        )
    kit.sky(rng.choice(["clear", "cloudy", "overcast", "sunset"]), kit.between(0.3, 2))
    if kit.chance(0.75):
        kit.sun(kit.between(4, 60), rng.uniform(0.5, 1.35))
    if kit.chance(0.25):
        lamps(kit, width, depth, tall, rng.choice(["small", "spots", "pendants"]))

    def camera():
        eye = [
            rng.uniform(-0.45, 0.45) * width,
            rng.choice([1.2, 1.7, tall + 1.6]),
            rng.uniform(-0.45, 0.45) * depth,
        ]
        target = [
            rng.uniform(-0.35, 0.35) * width,
            rng.uniform(0.5, 0.8 * height),
            rng.uniform(-0.4, 0.4) * depth,
        ]
        return lens(kit, eye, target, wide=0.4, defocus=0.1)

    return camera


def office(kit):
    """A large room with many lamps, desks, screens and partitions."""
    rng = kit.rng
    width, depth, height = rng.uniform(6, 13), rng.uniform(6, 13), rng.uniform(2.6, 3.2)
    openings = {2: [(-0.4 * depth, 0.4 * depth, 0.8, 2.3)]} if kit.chance(0.5) else {}
    shell(kit, width, depth, height, openings)
    if openings:
        kit.sky(None, kit.between(0.02, 1))
        window(kit, wall_frame(2, width, depth)[0], openings[2][0])
    side = rng.choice([0.05, 0.12, 0.3, 0.6])
    columns, rows = int(rng.integers(3, 8)), int(rng.integers(3, 8))
    strength = kit.between(0.5, 3) * width * depth / (columns * rows * side * side)
    colors = [kit.glow(strength, c) for c in (0.0, 0.1, 0.6)]
    long = rng.choice([1, 1, 4])
    mesh = shapes.plane(side, side * long)
    lamp = [kit.mesh(mesh, c) for c in colors]
    for i in range(columns):
        for k in range(rows):
            if kit.chance(0.85):
                x, z = ((i + 0.5) / columns - 0.5) * width, ((k + 0.5) / rows - 0.5) * depth
                kit.repeat(
                    lamp[rng.choice(3, p=[0.8, 0.15, 0.05])], x=x, y=height - 0.01, z=z, tilt=np.pi
                )
    top, seat, wall = kit.opaque(), kit.opaque(), kit.opaque()
    screens = [kit.screen(kit.between(0.3, 6)) for _ in range(2)]
    for x in np.arange(-0.4 * width, 0.4 * width, rng.uniform(1.8, 2.6)):
        for z in np.arange(-0.38 * depth, 0.38 * depth, rng.uniform(1.8, 2.8)):
            if kit.chance(0.2):
                continue
            kit.table(1.4, 0.7, 0.73, top, x=x, z=z)
            kit.chair(seat, x=x + rng.normal() * 0.1, z=z + 0.6, turn=np.pi + rng.normal() * 0.4)
            kit.put(
                shapes.boxes(
                    [((0.5, 0.32, 0.02), (0, 0.3, -0.012)), ((0.05, 0.2, 0.03), (0, 0.1, -0.03))]
                ),
                wall,
                x=x,
                y=0.73,
                z=z - 0.2,
            )
            kit.put(shapes.card(0.48, 0.3), screens[rng.integers(2)], x=x, y=0.88, z=z - 0.195)
            if kit.chance(0.5):
                clutter(kit, x, z, 0.73, 1.3, 0.5, glass=0.15)
            if kit.chance(0.35):
                kit.put(shapes.box([1.5, 1.3, 0.04]), wall, x=x, y=0.65, z=z - 0.45)
    for s in (0, 1, 3):
        frame, length = wall_frame(s, width, depth)
        hang(kit, frame, length, height, list(openings.get(s, [])))
    for _ in range(3):
        kit.plant(
            rng.uniform(-0.45, 0.45) * width,
            0,
            rng.uniform(-0.45, 0.45) * depth,
            rng.uniform(0.6, 1.6),
        )

    def camera():
        eye = [
            rng.uniform(-0.46, 0.46) * width,
            rng.uniform(1.1, 2.2),
            rng.uniform(-0.46, 0.46) * depth,
        ]
        target = [
            rng.uniform(-0.3, 0.3) * width,
            rng.uniform(0.5, 1.2),
            rng.uniform(-0.3, 0.3) * depth,
        ]
        return lens(kit, eye, target, wide=0.3, defocus=0.12)

    return camera
