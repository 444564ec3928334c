"""Random scenes for training: `random_scene` draws a family and everything in it by a seed."""

import numpy as np

import halls
import plain
import rooms
import shapes
import textures
from kit import Kit
from outdoors import daylight, ground, orbit, town
from rooms import TAU, lens


def table_top(kit):
    """A table with glass, drinks, metal, balls and other small things, close by."""
    rng = kit.rng
    top = kit.matte(textured=True) if kit.chance(0.7) else kit.special()
    kit.put(shapes.box([1.6, 0.05, 1.2], rng.choice([0.2, 0.5, 1.0])), top, y=-0.025)
    if kit.chance(0.7):
        rooms.shell(kit, 4, 4, 3, {2: [(-1.5, 1.5, 0.5, 2.5)]}, skip=(1,))
    else:
        kit.put(shapes.plane(20, 20, 0.5), kit.matte(textured=True), y=-0.7)
    reach = rng.uniform(0.18, 0.4)
    for _ in range(int(rng.integers(1, 7))):
        kit.vessel(
            *(rng.uniform(-reach, reach), 1e-3, rng.uniform(-reach, reach)), rng.uniform(0.08, 0.28)
        )
    kit.scatter(int(rng.integers(3, 14)), [-reach, -reach], [reach, reach], (0.05, 0.2))
    if kit.chance(0.3):
        centers = np.column_stack(
            [rng.uniform(-reach, reach, 30), np.full(30, 0.013), rng.uniform(-reach, reach, 30)]
        )
        kit.balls(centers, 0.012, kit.glass(rough=False) if kit.chance(0.6) else kit.metal())
    kit.sky(strength=kit.between(0.2, 1.5))
    for _ in range(int(rng.integers(1, 4))):
        x, z = rng.uniform(-1, 1, 2)
        side = kit.between(0.06, 0.6)
        tilt, turn = np.pi + rng.normal() * 0.3, rng.random() * TAU
        kit.area_light(
            side, side, kit.between(0.3, 4) / side**2, x, rng.uniform(0.7, 1.8), z, turn, tilt
        )
    return orbit(kit, [0, 0.08, 0], 0.35, 1.1, 0.08, 0.9, defocus=0.4)


def material_grid(kit):
    """A grid of equal objects with a different material each."""
    rng = kit.rng
    kit.put(shapes.plane(40, 40, rng.choice([0.5, 1, 2])), kit.matte(textured=True))
    columns, rows = int(rng.integers(3, 8)), int(rng.integers(2, 6))
    mesh = kit.thing()
    ball = kit.chance(0.55)
    weights = (0.18, 0.25, 0.17, 0.34, 0.06)
    upright = kit.chance(0.3)
    for i in range(columns):
        for k in range(rows):
            material = kit.any(weights, 40) if kit.chance(0.9) else kit.matte()
            x, y, z = (i - (columns - 1) / 2) * 1.15, 0.0, (k - (rows - 1) / 2) * 1.15
            if upright:
                y, z = k * 1.1, 0.0
            if ball:
                kit.balls([[x, y + 0.5, z]], 0.5, material)
            else:
                kit.put(mesh, material, x=x, y=y + 1e-3, z=z, turn=0.5 * i)
    if kit.chance(0.35):
        kit.put(shapes.box([30, 10, 0.2]), kit.wall(), y=5, z=-rows * 0.9 - 0.5)
    daylight(kit, 0.3)
    if kit.chance(0.5):
        for _ in range(int(rng.integers(1, 4))):
            kit.area_light(
                1.5,
                1.5,
                kit.between(2, 30),
                rng.uniform(-4, 4),
                rng.uniform(3.5, 6),
                rng.uniform(-1, 5),
                0,
                np.pi + 0.3,
            )

    def camera():
        x = rng.uniform(-0.4, 0.4) * columns
        distance = kit.between(2.0, 7.0)
        eye = [
            x + rng.uniform(-2, 2),
            rng.uniform(0.8, 4),
            (0 if upright else rows * 0.4) + distance,
        ]
        return lens(
            kit,
            eye,
            [x, 0.4 + upright * rng.uniform(0, rows - 1), rng.uniform(-0.3, 0.3) * rows],
            wide=0.1,
        )

    return camera


def detail(kit):
    """Grass, wires, fences, needles, leaves: geometry thinner than pixels."""
    rng = kit.rng
    kit.put(shapes.terrain(rng, 30, 0.05) if kit.chance(0.5) else shapes.plane(30, 30), kit.matte())
    kinds = rng.permutation(["grass", "leaves", "fence", "wires", "needles", "sheet"])[
        : rng.integers(2, 5)
    ]
    if "grass" in kinds:
        length, width = kit.between(0.06, 0.5), kit.between(0.002, 0.012)
        tuft = shapes.blades(rng, 1200, 1.0, length, width)
        hue = rng.uniform(0.1, 0.35) if kit.chance(0.8) else rng.random()
        green = kit.scene.add_material(
            base_color=textures.hsv(hue, 0.7, rng.uniform(0.15, 0.6)),
            roughness=0.5,
            diffuse_transmission=rng.choice([0.0, 0.35]),
            diffuse_transmission_color=[0.4, 0.6, 0.1],
        )
        index = kit.mesh(tuft, green)
        for x in range(-4, 5):
            for z in range(-4, 5):
                kit.repeat(index, x=x, z=z, turn=rng.integers(4) * np.pi / 2)
    if "leaves" in kinds:
        crown = kit.mesh(
            shapes.leaves(rng, int(rng.integers(150, 900)), 0.5, rng.uniform(0.05, 0.22)),
            kit.foliage(),
        )
        for _ in range(int(rng.integers(2, 12))):
            kit.repeat(
                crown,
                x=rng.uniform(-2.5, 2.5),
                y=rng.uniform(0.4, 1.3),
                z=rng.uniform(-2.5, 2.5),
                turn=rng.random() * TAU,
                scale=rng.uniform(0.6, 1.5),
            )
    if "fence" in kinds:
        bars = shapes.lattice(
            2.4, rng.uniform(0.6, 1.5), rng.integers(8, 50, 2), rng.uniform(0.004, 0.03)
        )
        index = kit.mesh(bars, kit.opaque())
        for _ in range(int(rng.integers(1, 4))):
            kit.repeat(
                index, x=rng.uniform(-1.5, 1.5), z=rng.uniform(-1.5, 1.5), turn=rng.random() * TAU
            )
    if "wires" in kinds:
        cables = []
        for _ in range(int(rng.integers(5, 30))):
            a, b = rng.uniform(-2, 2, (2, 3)) + [0, 2.1, 0]
            t = np.linspace(0, 1, 24)[:, None]
            sag = np.array([0, 1, 0]) * 2 * t * (t - 1) * rng.uniform(0, 0.8)
            cables.append(shapes.tube(a + (b - a) * t + sag, rng.uniform(0.002, 0.015), 6))
        kit.put(shapes.merge(cables), kit.opaque())
    if "needles" in kinds:
        brush = shapes.moved(
            shapes.blades(rng, 1500, 0.7, rng.uniform(0.2, 0.6), 0.003), shapes.place()
        )
        kit.put(brush, kit.metal() if kit.chance(0.5) else kit.matte(False), turn=0.3)
    if "sheet" in kinds:
        sheet = kit.scene.add_material(
            base_color_texture=textures.holes(rng),
            base_color=[1.0] * 3,
            alpha_mode="mask",
            metallic=float(kit.chance(0.5)),
            roughness=0.4,
        )
        kit.put(
            shapes.curtain(rng, 2, 1.5),
            sheet,
            x=rng.uniform(-1, 1),
            z=rng.uniform(-1, 1),
            turn=rng.random() * TAU,
        )
    kit.scatter(int(rng.integers(2, 9)), [-1.8, -1.8], [1.8, 1.8], (0.2, 1.0))
    daylight(kit, 0.8)
    return orbit(kit, [0, 0.4, 0], 1.0, 5, 0.05, 0.8)


def many_lamps(kit):
    """Dark ground or a dark room with many lamps, tiny and bright, of all colours."""
    rng = kit.rng
    if kit.chance(0.5):
        rooms.shell(kit, 8, 8, 4, {})
    else:
        kit.put(shapes.plane(40, 40, 2), kit.opaque())
        kit.scene.set_environment(textures.color(rng, 0.0, 0.02))
    kit.scatter(int(rng.integers(8, 30)), [-3, -3], [3, 3], (0.3, 1.6))
    spread = kit.between(1, 30)
    for _ in range(int(rng.integers(2, 7))):
        radius = kit.between(0.008, 0.15)
        count = int(rng.integers(1, 40))
        radiance = kit.between(1, spread + 1) * 3 / (count * radius**2)
        places = np.column_stack(
            [
                rng.uniform(-3.5, 3.5, count),
                rng.uniform(0.1, 3.5, count),
                rng.uniform(-3.5, 3.5, count),
            ]
        )
        if kit.chance(0.3):
            t = np.linspace(0, 1, count)
            places = np.column_stack(
                [7 * t - 3.5, 1.5 + np.sin(9 * t) * 0.4, np.full(count, rng.uniform(-3, 3))]
            )
        kit.balls(places, radius, kit.glow(radiance, 0.7))
    if kit.chance(0.4):
        for _ in range(int(rng.integers(1, 5))):
            path = np.cumsum(rng.normal(size=(12, 3)) * 0.25, 0) + [
                rng.uniform(-2, 2),
                1.2,
                rng.uniform(-2, 2),
            ]
            kit.put(shapes.tube(path, 0.02, 8), kit.glow(kit.between(5, 60), 0.9))
    for _ in range(int(rng.integers(0, 6))):
        eye = [rng.uniform(-3, 3), rng.uniform(1.5, 3.8), rng.uniform(-3, 3)]
        kit.scene.add_spot_light(
            eye,
            [rng.normal(), -1.5, rng.normal()],
            textures.lamp_color(rng, 0.7) * kit.between(5, 100),
            inner_angle=0.2,
            outer_angle=rng.uniform(0.25, 0.7),
        )
    if kit.chance(0.3):
        kit.put(
            shapes.card(2, 1.2), kit.screen(kit.between(1, 20)), x=rng.uniform(-2, 2), y=0.4, z=-3
        )
    return orbit(kit, [0, 0.7, 0], 1.5, 3.9, 0.03, 0.6, wide=0.4)


def volumes(kit):
    """Fog, smoke, milk, wax and lamps in them."""
    import alhazen

    rng = kit.rng
    closed = kit.chance(0.5)
    if closed:
        rooms.shell(kit, 7, 7, 3.5, {})
    else:
        kit.put(shapes.plane(60, 60, 2), kit.opaque())
        daylight(kit, 0.7)
    fog = kit.chance(0.6)
    if fog:
        sigma = kit.between(0.01, 0.25)
        tint = rng.uniform(0.7, 1.0, 3) if kit.chance(0.3) else np.ones(3)
        medium = alhazen.Medium(
            scattering=sigma * tint,
            absorption=sigma * rng.uniform(0, 0.3),
            anisotropy=rng.uniform(0, 0.8),
        )
        if closed:
            kit.scene.set_fog(medium)
        else:
            kit.scene.set_fog(medium, top=rng.uniform(1.0, 6.0))
    for _ in range(int(rng.integers(0 if fog else 1, 3))):
        low = np.array([rng.uniform(-2, 0.5), 0.02, rng.uniform(-2, 0.5)])
        kit.smoke(low, low + rng.uniform(1, 2.4, 3), kit.between(0.5, 12))
    kit.scatter(int(rng.integers(4, 14)), [-2.8, -2.8], [2.8, 2.8], (0.3, 1.6))
    for _ in range(int(rng.integers(1, 4))):
        wax = kit.thing()
        kit.put(
            wax,
            kit.subsurface(),
            x=rng.uniform(-2, 2),
            z=rng.uniform(-2, 2),
            scale=rng.uniform(0.3, 0.9),
        )
    if kit.chance(0.4):
        sigma = kit.between(3, 40)
        milk = alhazen.Medium(
            scattering=sigma * rng.uniform(0.5, 1, 3), absorption=sigma * rng.uniform(0, 0.1, 3)
        )
        body = kit.scene.add_material(model="dielectric", ior=1.35, medium=milk)
        r = rng.uniform(0.2, 0.5)
        kit.balls([[rng.uniform(-2, 2), r + 1e-3, rng.uniform(-2, 2)]], r, body)
    if closed or kit.chance(0.4):
        for _ in range(int(rng.integers(1, 5))):
            at = [rng.uniform(-2.5, 2.5), rng.uniform(1.5, 3.3), rng.uniform(-2.5, 2.5)]
            if kit.chance(0.5):
                kit.scene.add_spot_light(
                    at,
                    [rng.normal() * 0.7, -1, rng.normal() * 0.7],
                    textures.lamp_color(rng, 0.4) * kit.between(10, 80),
                    inner_angle=0.1,
                    outer_angle=rng.uniform(0.2, 0.6),
                )
            else:
                radius = rng.uniform(0.04, 0.2)
                kit.balls([at], radius, kit.glow(kit.between(0.5, 4) / radius**2, 0.4))
    return orbit(kit, [0, 0.8, 0], 1.6, 3.4 if closed else 6, 0.02, 0.5, wide=0.35, defocus=0.1)


def jumble(kit):
    """Objects of all sizes that float in a box or under a sky, near the camera and far."""
    rng = kit.rng
    if kit.chance(0.5):
        rooms.shell(kit, 6, 6, 6, {}, skip=(1,) if kit.chance(0.5) else ())
        rooms.lamps(kit, 6, 6, 6, rng.choice(["panels", "pendants", "small", "indirect"]))
        if kit.chance(0.5):
            kit.sky(strength=0.3)
    else:
        daylight(kit, 0.7)
    meshes = []
    for _ in range(int(rng.integers(3, 9))):
        meshes.append(kit.mesh(kit.thing(), kit.any()))
    for _ in range(int(rng.integers(15, 120))):
        x, y, z = rng.uniform(-2.6, 2.6, 3) + [0, 3, 0]
        kit.repeat(
            meshes[rng.integers(len(meshes))],
            x=x,
            y=y,
            z=z,
            turn=rng.random() * TAU,
            tilt=rng.random() * TAU,
            roll=rng.random() * TAU,
            scale=kit.between(0.15, 1.5),
        )
    return orbit(
        kit,
        [0, 3, 0],
        1.2,
        5 if kit.scene.bounds is None else 2.9,
        -0.9,
        0.9,
        wide=0.4,
        defocus=0.3,
    )


# Families and how often they are drawn.
FAMILIES = {
    rooms.room: 0.18,
    plain.bodies: 0.12,
    plain.bare_rooms: 0.08,
    plain.dim_rooms: 0.08,
    table_top: 0.1,
    halls.hall: 0.08,
    ground: 0.07,
    rooms.cornell: 0.07,
    halls.office: 0.07,
    material_grid: 0.05,
    many_lamps: 0.07,
    detail: 0.04,
    volumes: 0.03,
    town: 0.02,
    jumble: 0.01,
}


def interest(scene, camera):
    """How much a camera sees: the share of edges between objects and faces, 0 if it is unusable.

    Unusable are cameras in solids, close to a wall, or with little but background in view.
    """
    origins, directions = camera.rays(28, 28)
    hits = scene.intersect(origins, directions)
    distance = hits.t[np.isfinite(hits.t)]
    if len(distance) < 0.35 * hits.t.size:
        return 0.0
    typical = np.median(distance)
    inside = (np.einsum("ijk,ijk->ij", hits.normals, directions)[np.isfinite(hits.t)] > 0).mean()
    if np.quantile(distance, 0.1) < 0.12 * typical or typical < 0.06 or inside > 0.35:
        return 0.0
    counts = np.unique(hits.instance, return_counts=True)[1]
    if len(counts) < 4 or counts.max() > 0.8 * hits.instance.size:
        return 0.0
    edges = 0.0
    for axis in (0, 1):
        object_edge = np.diff(hits.instance, axis=axis) != 0
        turned = np.abs(np.diff(hits.normals, axis=axis)).sum(-1) > 0.3
        edges += (object_edge | turned).mean() / 2
    return float(edges)


def preview_is_fine(scene, camera, max_depth):
    """Whether a tiny picture is neither black nor uniform nor dark nearly everywhere."""
    settings = dict(camera=camera, max_depth=max_depth, backend="cpu", threads=1)
    picture = scene.render(32, 32, 16, **settings)["color"]
    light = picture @ np.float32([0.2126, 0.7152, 0.0722])
    if not np.isfinite(light).all() or light.mean() <= 1e-6:
        return False
    lit = (light > 0.01 * light.mean()).mean()
    return lit > 0.5 and light.std() > 0.05 * light.mean()


def random_scene(seed, views=3, family=None):
    """Draws a scene.

    - `seed`: an integer; the same seed gives the same scene.
    - `views`: how many cameras, each of which sees something lit.
    - `family`: the name of a family; random if None.

    Returns (scene, cameras, settings); settings has "max_depth" and "family".
    """
    names = [f.__name__ for f in FAMILIES]
    builders = list(FAMILIES)
    if family is None:
        weights = np.array(list(FAMILIES.values()))
        family = names[
            np.random.default_rng([seed, 77]).choice(len(names), p=weights / weights.sum())
        ]
    for attempt in range(20):
        kit = Kit(np.random.default_rng([seed, attempt]))
        draw = builders[names.index(family)](kit)
        max_depth = int(kit.rng.choice([5, 8, 12, 16], p=[0.15, 0.35, 0.3, 0.2]))
        cameras = []
        for _ in range(3 * views + 3):
            # Mostly the best of a few candidates, so that bare walls are rare but do occur.
            tried = [draw() for _ in range(kit.rng.choice([4, 10], p=[0.25, 0.75]))]
            score, best = max(((interest(kit.scene, c), i) for i, c in enumerate(tried)))
            if score > 0.04 and preview_is_fine(kit.scene, tried[best], max_depth):
                cameras.append(tried[best])
                if len(cameras) == views:
                    break
        if cameras:
            kit.ballast()
            return kit.scene, cameras, {"max_depth": max_depth, "family": family}
    raise ValueError(f"no usable scene of family {family} for seed {seed}")
