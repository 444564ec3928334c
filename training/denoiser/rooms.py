"""Families of scenes that are seen from inside: boxes and rooms, and their parts.

Each function fills a `kit.Kit` and returns a function that draws a candidate for a camera.
"""

import numpy as np

import shapes
import textures
from shapes import place

TAU = 2 * np.pi


def lens(kit, eye, target, defocus=0.2, wide=0.2, narrow=0.1):
    """A camera with a random field of view, sometimes with a lens, sometimes not level."""
    import alhazen

    rng = kit.rng
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    fov = rng.uniform(0.55, 1.0)
    kind = rng.random()
    if kind < wide:
        fov = rng.uniform(1.0, 1.6)
    elif kind < wide + narrow:
        fov = rng.uniform(0.25, 0.55)
    args = {}
    if kit.chance(defocus):
        distance = np.linalg.norm(target - eye)
        args = dict(lens_radius=float(distance * kit.between(0.003, 0.025)))
        args["focus_distance"] = float(distance * kit.between(0.8, 1.25))
    up = [rng.normal() * 0.15, 1, rng.normal() * 0.15] if kit.chance(0.12) else [0, 1, 0]
    return alhazen.Camera.look_at(eye, target, up=up, fov_y=float(fov), **args)


def panels(length, height, openings):
    """Rectangles (u0, u1, v0, v1) that cover a wall around openings that do not overlap in u."""
    parts, at = [], -length / 2
    for u0, u1, v0, v1 in sorted(openings):
        parts += [(at, u0, 0, height), (u0, u1, 0, v0), (u0, u1, v1, height)]
        at = u1
    parts.append((at, length / 2, 0, height))
    return [p for p in parts if p[1] - p[0] > 1e-3 and p[3] - p[2] > 1e-3]


def wall_frame(side, width, depth):
    """(matrix, length) of wall 0..3: x along it, y up, z into the room, inside face at z = 0."""
    turn = [0, np.pi, np.pi / 2, -np.pi / 2][side]
    x, z = [(0, -depth / 2), (0, depth / 2), (-width / 2, 0), (width / 2, 0)][side]
    return place(x, 0, z, turn), (width if side < 2 else depth)


def window(kit, frame, opening):
    """Bars, a pane and a curtain for an opening of a wall."""
    rng = kit.rng
    u0, u1, v0, v1 = opening
    width, height, center = u1 - u0, v1 - v0, (u0 + u1) / 2
    if kit.chance(0.7):
        cells = (int(rng.integers(2, 6)), int(rng.integers(2, 6)))
        bars = shapes.lattice(width, height, cells, rng.uniform(0.025, 0.07))
        kit.put(shapes.moved(bars, frame @ place(center, v0, -0.1)), kit.opaque())
    if kit.chance(0.25):
        slats = [
            ((width, 0.003, 0.04), (0, y, 0))
            for y in np.arange(0.02, height * rng.uniform(0.3, 1), 0.05)
        ]
        kit.put(
            shapes.moved(shapes.boxes(slats), frame @ place(center, v0, 0.04)), kit.matte(False)
        )
    if kit.chance(0.2):
        pane = kit.scene.add_material(
            transmission=1.0, thin_walled=True, base_color=[1.0] * 3, roughness=0.0
        )
        kit.put(shapes.moved(shapes.card(width, height), frame @ place(center, v0, -0.08)), pane)
    if kit.chance(0.45):
        cloth = kit.matte(
            roughness=1.0, diffuse_transmission=rng.uniform(0.1, 0.6), model="metallic-roughness"
        )
        wide = width * rng.uniform(0.25, 0.55)
        for side in (-1, 1):
            if kit.chance(0.8):
                sheet = shapes.curtain(rng, wide, min(v1 + 0.15, v1 + 0.3) - 0.03)
                kit.put(
                    shapes.moved(sheet, frame @ place(center + side * width * 0.5, 0.03, 0.1)),
                    cloth,
                )


def shell(kit, width, depth, height, openings, skip=(), roof=True):
    """Floor, walls and ceiling; `openings` maps a wall 0..3 to rectangles."""
    rng = kit.rng
    floor = kit.matte(textured=kit.chance(0.9))
    if kit.chance(0.2):
        floor = kit.special()
    texel = float(rng.choice([0.5, 1, 2]))
    kit.put(shapes.box([width + 0.4, 0.1, depth + 0.4], texel), floor, y=-0.05)
    walls = kit.wall()
    if roof:
        white = [rng.uniform(0.55, 0.88)] * 3
        ceiling = kit.matte(False, base_color=white) if kit.chance(0.8) else walls
        kit.put(shapes.box([width + 0.4, 0.1, depth + 0.4], texel), ceiling, y=height + 0.05)
    trim = kit.opaque() if kit.chance(0.6) else None
    for side in range(4):
        if side in skip:
            continue
        frame, length = wall_frame(side, width, depth)
        parts = []
        for u0, u1, v0, v1 in panels(
            length + (0.4 if side < 2 else 0), height, openings.get(side, [])
        ):
            parts.append(((u1 - u0, v1 - v0, 0.2), ((u0 + u1) / 2, (v0 + v1) / 2, -0.1)))
        paint = kit.wall() if kit.chance(0.25) else walls
        kit.put(shapes.moved(shapes.boxes(parts, texel), frame), paint)
        if trim is not None:
            rails = [((length, 0.1, 0.02), (0, 0.05, 0.01))]
            if kit.chance(0.4):
                rails.append(((length, 0.06, 0.05), (0, height - 0.03, 0.025)))
            kit.put(shapes.moved(shapes.boxes(rails), frame), trim)


def hang(kit, frame, length, height, blocked):
    """Frames with pictures, a door, or a shelf with books on a wall, beside its openings."""
    rng = kit.rng
    for _ in range(int(rng.integers(0, 5))):
        wide = rng.uniform(0.3, 1.2)
        u = rng.uniform(-length / 2 + wide / 2 + 0.1, length / 2 - wide / 2 - 0.1)
        if any(u - wide / 2 < b[1] and u + wide / 2 > b[0] for b in blocked):
            continue
        blocked.append((u - wide / 2, u + wide / 2, 0, 0))
        kind = rng.random()
        if kind < 0.5:
            tall = rng.uniform(0.3, 0.9)
            y = rng.uniform(1.1, 1.5)
            kit.put(
                shapes.moved(shapes.box([wide, tall, 0.03]), frame @ place(u, y + tall / 2, 0.015)),
                kit.opaque(),
            )
            picture = shapes.moved(
                shapes.card(wide - 0.08, tall - 0.08), frame @ place(u, y + 0.04, 0.032)
            )
            kit.put(picture, kit.matte(textured=True))
        elif kind < 0.65:
            door = [
                ((0.85, 2.0, 0.05), (u, 1.0, 0.025)),
                ((0.6, 0.6, 0.07), (u, 0.5, 0.03)),
                ((0.6, 0.8, 0.07), (u, 1.4, 0.03)),
            ]
            kit.put(shapes.moved(shapes.boxes(door), frame), kit.opaque())
        else:
            shelves = int(rng.integers(2, 7))
            tall, deep = min(0.35 * shelves, height - 0.2), 0.28
            step = tall / shelves
            parts = [
                ((wide, 0.02, deep), (u, step * i + 0.01, deep / 2)) for i in range(shelves + 1)
            ]
            parts += [((0.02, tall, deep), (u + s * wide / 2, tall / 2, deep / 2)) for s in (-1, 1)]
            kit.put(shapes.moved(shapes.boxes(parts), frame), kit.opaque())
            turn = float(np.arctan2(frame[0, 2], frame[2, 2]))
            for i in range(shelves):
                x, y, z, _ = frame @ [u - wide / 2 + 0.03, step * i + 0.02, deep / 2, 1]
                if kit.chance(0.75):
                    kit.books(x, y, z, wide - 0.06, min(step - 0.04, 0.3), deep, turn)


def clutter(kit, x, z, y, width, depth, glass=0.3):
    """Small things on a table top."""
    rng = kit.rng
    for _ in range(int(rng.integers(1, 6))):
        u, v = x + rng.uniform(-0.4, 0.4) * width, z + rng.uniform(-0.4, 0.4) * depth
        kind = rng.random()
        if kind < glass:
            kit.vessel(u, y + 1e-3, v, rng.uniform(0.1, 0.25))
        elif kind < 0.6:
            kit.put(
                kit.thing(),
                kit.any(),
                x=u,
                y=y + 1e-3,
                z=v,
                turn=rng.random() * TAU,
                scale=rng.uniform(0.06, 0.25),
            )
        elif kind < 0.75:
            r = rng.uniform(0.03, 0.09)
            kit.balls([[u, y + r + 1e-3, v]], r, kit.any())
        elif kind < 0.9:
            stack = [
                ((0.2, 0.03, 0.14), (0, 0.015 + 0.03 * i, 0))
                for i in range(int(rng.integers(1, 6)))
            ]
            kit.put(shapes.boxes(stack, 0.2), kit.opaque(), x=u, y=y, z=v, turn=rng.random() * TAU)
        else:
            kit.plant(u, y, v, rng.uniform(0.2, 0.5))


def furniture(kit, width, depth):
    """Things on the floor, with free places between them."""
    rng = kit.rng
    taken = []
    for _ in range(int(rng.integers(3, 4 + int(width * depth / 3)))):
        x, z = rng.uniform(-0.42, 0.42) * width, rng.uniform(-0.42, 0.42) * depth
        reach = rng.uniform(0.35, 0.8)
        if any(np.hypot(x - t[0], z - t[1]) < reach + t[2] for t in taken):
            continue
        taken.append((x, z, reach))
        kind, turn = rng.random(), rng.choice(4) * np.pi / 2 + rng.normal() * 0.1
        if kind < 0.3:
            w, d, h = rng.uniform(0.7, 1.5), rng.uniform(0.5, 0.9), rng.uniform(0.4, 0.8)
            kit.table(w, d, h, kit.opaque(), x=x, z=z)
            clutter(kit, x, z, h, w, d)
            if kit.chance(0.6):
                kit.chair(kit.opaque(), x=x, z=z + d / 2 + 0.3, turn=np.pi + rng.normal() * 0.3)
        elif kind < 0.45:
            kit.sofa(kit.opaque(), x=x, z=z, turn=turn)
        elif kind < 0.55:
            kit.chair(kit.opaque(), x=x, z=z, turn=turn)
        elif kind < 0.67:
            kit.plant(x, 0, z, rng.uniform(0.6, 1.7))
        elif kind < 0.8:
            kit.put(shapes.box(rng.uniform(0.3, 1.1, 3)), kit.opaque(), x=x, y=0.56, z=z, turn=turn)
        else:
            kit.put(
                kit.thing(), kit.any(), x=x, y=1e-3, z=z, turn=turn, scale=rng.uniform(0.4, 1.2)
            )
        if kit.chance(0.15):
            kit.put(
                shapes.box([1.8, 0.01, 1.2], 1.8),
                kit.matte(textured=True),
                x=x,
                y=0.006,
                z=z,
                turn=turn,
            )
    return taken


def lamps(kit, width, depth, height, kind):
    """The lamps of a room by kind; powers are comparable between kinds."""
    rng = kit.rng
    level = kit.between(0.5, 4)
    if kind == "panels":
        columns, rows = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        side = rng.uniform(0.2, 0.8)
        material = kit.glow(level * width * depth / (columns * rows * side * side), 0.1)
        index = kit.mesh(shapes.plane(side, side), material)
        for i in range(columns):
            for k in range(rows):
                x, z = ((i + 0.5) / columns - 0.5) * width, ((k + 0.5) / rows - 0.5) * depth
                kit.repeat(index, x=x, y=height - rng.uniform(0.01, 0.03), z=z, tilt=np.pi)
    elif kind == "pendants":
        count = int(rng.integers(1, 5))
        radius = rng.uniform(0.04, 0.2)
        material = kit.glow(level * width * depth / (count * 12 * radius**2))
        for _ in range(count):
            x, z, y = (
                rng.uniform(-0.35, 0.35) * width,
                rng.uniform(-0.35, 0.35) * depth,
                height - rng.uniform(0.4, 1),
            )
            kit.balls([[x, y, z]], radius, material)
            kit.put(
                shapes.box([0.01, height - y - radius, 0.01]),
                kit.opaque(),
                x=x,
                y=(height + y + radius) / 2,
                z=z,
            )
            if kit.chance(0.5):
                shade = shapes.lathe(
                    [[radius * 2.2, y - radius], [radius * 0.6, y + radius * 1.5]], 32, solid=False
                )
                kit.put(shade, kit.opaque(), x=x, z=z)
    elif kind == "small":
        count = int(rng.integers(5, 40))
        radius = rng.uniform(0.01, 0.04)
        for i in range(min(count, 4)):
            places = rng.uniform(-0.48, 0.48, (count // 4 + 1, 3)) * [width, height, depth] + [
                0,
                height / 2,
                0,
            ]
            kit.balls(
                places, radius, kit.glow(level * width * depth / (count * 10 * radius**2), 0.5)
            )
    elif kind == "spots":
        for _ in range(int(rng.integers(1, 9))):
            x, z = rng.uniform(-0.45, 0.45) * width, rng.uniform(-0.45, 0.45) * depth
            inner = rng.uniform(0.1, 0.6)
            kit.scene.add_spot_light(
                [x, height - 0.05, z],
                [rng.normal() * 0.3, -1, rng.normal() * 0.3],
                textures.lamp_color(rng) * level * height * rng.uniform(1, 10),
                inner_angle=inner * rng.uniform(0.2, 1),
                outer_angle=inner + 0.1,
            )
    elif kind == "indirect":
        for _ in range(int(rng.integers(1, 4))):
            x, z = rng.uniform(-0.4, 0.4) * width, rng.uniform(-0.4, 0.4) * depth
            y = rng.uniform(min(1.5, height - 0.6), height - 0.5)
            kit.put(shapes.box([0.6, 0.03, 0.4]), kit.opaque(), x=x, y=y, z=z)
            kit.put(
                shapes.plane(0.5, 0.3), kit.glow(level * width * depth * 2.5), x=x, y=y + 0.02, z=z
            )
    elif kind == "floor":
        for _ in range(int(rng.integers(1, 4))):
            x, z = rng.uniform(-0.44, 0.44) * width, rng.uniform(-0.44, 0.44) * depth
            kit.floor_lamp(x, 0, z, rng.uniform(0.5, 1.6), level * width * depth * 10)


def cornell(kit):
    """An open box with coloured walls."""
    rng = kit.rng
    width, depth, height = rng.uniform(1.6, 2.6, 3)
    for side in ([0, 2, 3] if kit.chance(0.6) else [0, 1, 2, 3]):
        frame, length = wall_frame(side, width, depth)
        color = (
            textures.color(rng, 0.3)
            if side > 1 or kit.chance(0.2)
            else [rng.uniform(0.5, 0.85)] * 3
        )
        wall = kit.matte(textured=kit.chance(0.25), base_color=color)
        kit.put(
            shapes.moved(
                shapes.box([length + 0.2, height, 0.1]), frame @ place(0, height / 2, -0.05)
            ),
            wall,
        )
    plain = kit.matte(textured=kit.chance(0.35), base_color=[rng.uniform(0.5, 0.85)] * 3)
    kit.put(shapes.box([width + 0.2, 0.1, depth + 0.2]), plain, y=-0.05)
    kit.put(
        shapes.box([width + 0.2, 0.1, depth + 0.2]),
        kit.matte(False, base_color=[0.75] * 3),
        y=height + 0.05,
    )
    if kit.chance(0.65):
        side = width * rng.uniform(0.05, 0.4)
        kit.area_light(side, side * rng.uniform(0.5, 2), 3 / side**2, 0, height - 0.01, 0)
    else:
        lamps(kit, width, depth, height, rng.choice(["pendants", "spots", "small", "indirect"]))
    kit.scatter(
        int(rng.integers(2, 7)),
        [-0.38 * width, -0.38 * depth],
        [0.38 * width, 0.3 * depth],
        (0.35, 1.2),
    )
    if kit.chance(0.3):
        kit.sky(strength=0.1)

    def camera():
        eye = [
            rng.uniform(-0.3, 0.3) * width,
            rng.uniform(0.25, 0.8) * height,
            depth * rng.uniform(0.3, 1.4),
        ]
        return lens(kit, eye, [rng.normal() * 0.2, height * rng.uniform(0.2, 0.5), -0.2 * depth])

    return camera


def room(kit):
    """A furnished room with windows or lamps."""
    rng = kit.rng
    width, depth, height = rng.uniform(2.5, 8), rng.uniform(2.5, 8), rng.uniform(2.3, 3.6)
    main = rng.choice(
        ["window", "panels", "pendants", "small", "spots", "indirect", "floor"],
        p=[0.3, 0.12, 0.15, 0.15, 0.09, 0.07, 0.12],
    )
    openings = {}
    for side in rng.permutation(4)[
        : rng.integers(1, 4) if main == "window" or kit.chance(0.3) else 0
    ]:
        _, length = wall_frame(side, width, depth)
        count = int(rng.integers(1, 1 + max(1, int(length / 1.6))))
        low = rng.choice([0.05, 0.6, 0.9])
        high = rng.uniform(max(low + 0.6, 1.6), height - 0.1)
        share = rng.uniform(0.35, 0.85)
        edges = np.linspace(-0.46, 0.46, count + 1) * length
        openings[int(side)] = [
            ((a + b) / 2 - share * (b - a) / 2, (a + b) / 2 + share * (b - a) / 2, low, high)
            for a, b in zip(edges, edges[1:])
        ]
    shell(kit, width, depth, height, openings)
    daylight = main == "window"
    if openings:
        kind = None if daylight else "night"
        kit.sky(kind, 1.0 if daylight else 0.3)
        if daylight and kit.chance(0.6):
            kit.sun(kit.between(3, 40), rng.uniform(0.15, 0.9))
            side = list(openings)[0]
            frame, _ = wall_frame(side, width, depth)
            if kit.chance(0.5):
                into = frame[:3, 2] * 1.2 + rng.normal(size=3) * 0.4
                into[1] = -rng.uniform(0.3, 1.2)
                kit.scene.add_directional_light(
                    into, kit.between(3, 40) * np.array([1, 0.9, 0.75]), angular_diameter=0.0093
                )
        if kit.chance(0.5):
            kit.put(shapes.plane(200, 200), kit.matte(False), y=-3.0)
    for side in range(4):
        frame, length = wall_frame(side, width, depth)
        blocked = list(openings.get(side, []))
        for opening in openings.get(side, []):
            window(kit, frame, opening)
        if kit.chance(0.7):
            hang(kit, frame, length, height, blocked)
    if kit.chance(0.25):
        beam = kit.opaque()
        for x in np.linspace(-0.5, 0.5, int(rng.integers(3, 8))) * width:
            kit.put(shapes.box([0.12, 0.18, depth]), beam, x=x, y=height - 0.09)
    furniture(kit, width, depth)
    if not daylight:
        lamps(kit, width, depth, height, main)
    for kind in ("floor", "pendants", "spots", "small"):
        if kit.chance(0.12):
            lamps(kit, width, depth, height, kind)
    if kit.chance(0.3):
        wall = wall_frame(int(rng.integers(4)), width, depth)[0]
        kit.put(
            shapes.moved(shapes.card(1.0, 0.6), wall @ place(rng.uniform(-0.3, 0.3), 0.9, 0.12)),
            kit.screen(kit.between(0.5, 10)),
        )

    def camera():
        angle = rng.random() * TAU
        reach = rng.uniform(0.3, 0.47)
        eye = np.array(
            [
                np.cos(angle) * reach * width,
                rng.uniform(0.7, 0.75 * height),
                np.sin(angle) * reach * depth,
            ]
        )
        target = np.array(
            [rng.uniform(-0.3, 0.3) * width, rng.uniform(0.3, 1.4), rng.uniform(-0.3, 0.3) * depth]
        )
        if kit.chance(0.2):
            target = eye + (target - eye) * 0.4
        return lens(kit, eye, target, wide=0.45, narrow=0.1)

    return camera
