"""Families of plain scenes: smooth bodies on a floor, and bare rooms with small or hidden lamps.

Little hides the noise here, and blotches and halos are seen most. Each function fills a `kit.Kit`
and returns a function that draws a candidate for a camera.
"""

import numpy as np

import shapes
import textures
from outdoors import orbit
from rooms import TAU, lens


def chequered(kit):
    """A floor of squares of two colours, or of one."""
    rng = kit.rng
    pair = np.stack([textures.color(rng), textures.color(rng)])
    if kit.chance(0.5):
        pair = np.outer([rng.uniform(0.4, 0.85), rng.uniform(0.02, 0.35)], np.ones(3))
    n = 128
    cell = (np.arange(n) * 2 // n)[:, None] ^ (np.arange(n) * 2 // n)[None]
    return kit.scene.add_material(
        base_color_texture=textures.srgb_bytes(pair[cell]),
        base_color=[1.0, 1.0, 1.0],
        roughness=rng.uniform(0.05, 1.0),
    )


def gradient_sky(kit, strength):
    """An environment that only fades from the horizon to the zenith."""
    rng = kit.rng
    up = np.clip(np.cos((np.arange(64) + 0.5) / 64 * np.pi), 0, 1)[:, None, None]
    horizon, zenith = textures.color(rng, 0.3, 1.0), textures.color(rng, 0.1, 1.0)
    if kit.chance(0.6):
        horizon, zenith = np.array([0.8, 0.9, 1.0]), np.array([0.25, 0.5, 1.0])
    picture = horizon + (zenith - horizon) * up ** rng.uniform(0.3, 1.2)
    picture = np.broadcast_to(picture, (64, 128, 3)).astype(np.float32)
    kit.scene.set_environment(np.ascontiguousarray(picture), intensity=float(strength))


def body(kit, glossy):
    """A material of one colour, mostly smooth."""
    rng = kit.rng
    kind = rng.random()
    if kind < 0.12:
        return kit.glass(rough=False)
    if kind < 0.3:
        return kit.metal()
    if kind < 0.4:
        return kit.special()
    roughness = rng.uniform(0.02, 0.2) if kit.chance(glossy) else rng.uniform(0.2, 1.0)
    return kit.scene.add_material(base_color=textures.color(rng, 0.05, 0.9), roughness=roughness)


def bodies(kit):
    """Balls, boxes and other simple bodies on a floor, under a sun or small strong lamps."""
    rng = kit.rng
    size = rng.choice([1.0, 1.0, 2.0, 4.0])
    floor = [chequered, lambda k: k.matte(textured=False), lambda k: k.matte(textured=True)]
    ground = floor[rng.choice(3, p=[0.5, 0.3, 0.2])](kit)
    level = kit.chance(0.35)  # the floor is seen up to the horizon
    kit.put(shapes.plane(400, 400, size) if level else shapes.plane(80, 80, size), ground)
    if kit.chance(0.1 if level else 0.2):
        kit.put(shapes.box([30, 12, 0.2]), kit.wall(), y=5, z=-rng.uniform(3, 6))
    glossy = rng.choice([0.2, 0.6, 0.95])
    taken = []
    for _ in range(int(rng.integers(1, 12))):
        r = kit.between(0.25, 1.3)
        x, z = rng.uniform(-3.5, 3.5, 2)
        if any(np.hypot(x - a, z - b) < r + c for a, b, c in taken):
            continue
        taken.append((x, z, r))
        kind = rng.random()
        material = body(kit, glossy)
        if kind < 0.55:
            kit.balls([[x, r + 1e-3, z]], r, material)
        elif kind < 0.7:
            side = r * rng.uniform(0.6, 1.4, 3)
            turn = rng.random() * TAU
            kit.put(shapes.box(side), material, x=x, y=side[1] / 2 + 1e-3, z=z, turn=turn)
        else:
            kit.put(
                kit.thing(), material, x=x, y=1e-3, z=z, turn=rng.random() * TAU, scale=1.6 * r
            )
    light = rng.choice(["sun", "sky", "lamps", "night"], p=[0.45, 0.15, 0.2, 0.2])
    if light == "night":
        kit.scene.set_environment(textures.color(rng, 0.0, 0.05))
    elif kit.chance(0.55):
        gradient_sky(kit, kit.between(0.2, 1.0))
    elif kit.chance(0.4):
        kit.scene.set_environment(textures.color(rng, 0.1, 0.8))
    else:
        kit.sky(strength=kit.between(0.3, 1.5))
    if light == "sun":
        kit.sun(kit.between(2, 20), rng.uniform(0.25, 1.4))
    if light in ("lamps", "night"):
        for _ in range(int(rng.integers(1, 6))):
            at = [*rng.uniform(-5, 5, 1), rng.uniform(1.5, 6), *rng.uniform(-5, 5, 1)]
            radius = kit.between(0.03, 0.6)
            power = kit.between(4, 40) / radius**2
            if kit.chance(0.5):
                kit.balls([at], radius, kit.glow(power))
            else:
                kit.area_light(radius * 2, radius * 2, power, *at, tilt=np.pi + rng.normal() * 0.4)
    low, high = (0.02, 0.22) if level else (0.1, 0.7)
    return orbit(kit, [0, 0.6, 0], 3.5, 12, low, high, defocus=0.1)


def bare_rooms(kit):
    """Rooms one behind the other with open doors, painted walls and a few small bulbs each."""
    return suite(kit, False)


def dim_rooms(kit):
    """The same, but few places see a lamp: most pixels of a single sample are black."""
    return suite(kit, True)


def fixture(kit, radius):
    """An opaque thing round a bulb of that radius at the origin, most of whose light it keeps."""
    rng = kit.rng
    wide, top = radius * rng.uniform(1.3, 2.2), radius * rng.uniform(1.2, 2.5)
    below = radius * rng.uniform(-0.5, 3.0)
    kind = rng.choice(["can", "bowl", "shade"])
    if kind == "can":
        profile = [[wide, -below], [wide, top], [wide, top], [0, top]]
    elif kind == "bowl":
        profile = [[0, -1.2 * radius], [wide, -1.2 * radius], [wide, -1.2 * radius], [wide, top]]
    else:
        profile = [[wide * rng.uniform(1.0, 1.6), -radius - max(below, 0)], [wide, top]]
    paint = kit.matte(False, base_color=textures.color(rng, 0.1, 0.85))
    return kit.mesh(shapes.lathe(profile, 24, solid=False), paint)


def suite(kit, dim):
    """Rooms one behind the other; `dim`: their bulbs are in fixtures, or there are very many."""
    rng = kit.rng
    columns, rows = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    width, depth, height = rng.uniform(2.8, 5.5), rng.uniform(2.8, 5.5), rng.uniform(2.3, 3.2)
    across, along = columns * width, rows * depth
    floor = kit.opaque() if kit.chance(0.5) else kit.matte()
    paint, ceiling = kit.wall(), kit.matte(False, base_color=[rng.uniform(0.5, 0.88)] * 3)
    kit.put(shapes.box([across + 0.3, 0.1, along + 0.3], rng.choice([0.5, 1, 2])), floor, y=-0.05)
    kit.put(shapes.box([across + 0.3, 0.1, along + 0.3]), ceiling, y=height + 0.05)
    door, tall = rng.uniform(0.8, 1.6), height * rng.uniform(0.75, 1.0)

    def wall(x, z, turn, length, open_door):
        parts = [((length, height, 0.12), (0, height / 2, 0))]
        if open_door:
            side = (length - door) / 2
            places = [s * (door + side) / 2 for s in (-1, 1)]
            parts = [((side, height, 0.12), (at, height / 2, 0)) for at in places]
            if tall < height - 0.05:
                top = ((door, height - tall, 0.12), (0, (height + tall) / 2, 0))
                parts.append(top)
        colour = kit.wall() if kit.chance(0.15) else paint
        kit.put(shapes.boxes(parts), colour, x=x, z=z, turn=turn)

    for i in range(columns + 1):
        for k in range(rows):
            x, z = i * width - across / 2, (k + 0.5) * depth - along / 2
            wall(x, z, np.pi / 2, depth, 0 < i < columns)
    for k in range(rows + 1):
        for i in range(columns):
            x, z = (i + 0.5) * width - across / 2, k * depth - along / 2
            wall(x, z, 0.0, width, 0 < k < rows)
    bulbs = int(rng.integers(1, 7))
    radius = kit.between(0.03, 0.12) if dim else kit.between(0.015, 0.15)
    hidden = [fixture(kit, radius) for _ in range(2)] if dim and kit.chance(0.8) else []
    if dim and not hidden:
        bulbs *= 4
    level = kit.between(0.5, 4) * width * depth / (bulbs * 12 * radius**2)
    glows = [kit.glow(level * kit.between(0.5, 2), colored=0.1) for _ in range(3)]
    bulb = None
    if kit.chance(0.4):  # of flat triangles
        angle = np.linspace(0, np.pi, 5)
        profile = np.stack([np.sin(angle), -np.cos(angle)], 1) * radius
        bulb = [kit.mesh(shapes.flat(shapes.lathe(profile, 8)), glow) for glow in glows]
    hang = height - rng.uniform(0.05, 0.7) - radius
    regular = kit.chance(0.5)
    for i in range(columns):
        for k in range(rows):
            middle = np.array([(i + 0.5) * width - across / 2, (k + 0.5) * depth - along / 2])
            for b in range(bulbs):
                step = rng.uniform(-0.4, 0.4, 2)
                if regular:
                    step = np.array([(b % 2) - 0.5, (b // 2) / 2 - 0.5]) * 0.5
                x, z = middle + step * [width, depth]
                which = rng.integers(3)
                y = hang if regular else rng.uniform(0.3, hang)
                if hidden:
                    kit.repeat(hidden[b % 2], x=x, y=y, z=z)
                if bulb:
                    kit.repeat(bulb[which], x=x, y=y, z=z)
                else:
                    kit.balls([[x, y, z]], radius, glows[which])
            if dim and kit.chance(0.6):
                # A board on a wall, of its own colour.
                wide, tall_as = rng.uniform(0.3, 0.8) * width, rng.uniform(0.2, 0.6) * height
                aside, wall_side = rng.uniform(-0.1, 0.1) * width, rng.choice([-1, 1])
                x, z = middle + [aside, wall_side * (depth / 2 - 0.08)]
                y = rng.uniform(0.3, 0.7) * height
                kit.put(shapes.box([wide, tall_as, 0.05]), kit.matte(False), x=x, y=y, z=z)
            for _ in range(int(rng.integers(0, 5))):
                x, z = middle + rng.uniform(-0.38, 0.38, 2) * [width, depth]
                kind = rng.random()
                if kind < 0.3:
                    wide, deep = rng.uniform(0.6, 1.5), rng.uniform(0.5, 0.8)
                    kit.table(wide, deep, 0.74, kit.opaque(), x=x, z=z)
                elif kind < 0.5:
                    side = rng.uniform(0.2, 0.9, 3)
                    kit.put(shapes.box(side), kit.opaque(), x=x, y=side[1] / 2 + 1e-3, z=z)
                elif kind < 0.7:
                    r, tall_as = rng.uniform(0.1, 0.3), rng.uniform(0.3, 0.8)
                    top = tall_as
                    drum = [[0, 0], [r, 0], [r, 0], [r, top], [r, top], [0, top]]
                    kit.put(shapes.lathe(drum), kit.opaque(), x=x, y=1e-3, z=z)
                elif kind < 0.85:
                    r = rng.uniform(0.1, 0.45)
                    kit.balls([[x, r + 1e-3, z]], r, kit.any())
                else:
                    kit.chair(kit.opaque(), x=x, z=z, turn=rng.random() * TAU)

    def camera():
        i, k = rng.integers(columns), rng.integers(rows)
        middle = np.array([(i + 0.5) * width - across / 2, (k + 0.5) * depth - along / 2])
        x, z = middle + rng.uniform(-0.44, 0.44, 2) * [width, depth]
        target = [
            rng.uniform(-0.4, 0.4) * across, rng.uniform(0.3, 1.6), rng.uniform(-0.4, 0.4) * along,
        ]
        return lens(kit, [x, rng.uniform(0.8, 2.0), z], target, wide=0.4, defocus=0.05)

    return camera
