"""Procedural textures, height maps and environments.

A *field* is a float32 array [n, n] in [0, 1] that tiles. Fields become colours through palettes,
normal maps through their slopes, and roughness maps directly. Colours are linear RGB in [0, 1]
unless a function says sRGB. `rng` is a `numpy.random.Generator` everywhere.
"""

import numpy as np


def hsv(h, s, v):
    """Linear RGB [3] of hue (turns), saturation and value."""
    k = (np.array([5.0, 3.0, 1.0]) + 6 * h) % 6
    return v - v * s * np.clip(np.minimum(k, 4 - k), 0, 1)


def color(rng, low=0.03, high=0.9):
    """A random albedo: grey, muted or saturated, with each channel in [0, `high`]."""
    value = low + (high - low) * rng.random() ** 0.8
    saturation = rng.choice(
        [0.0, rng.uniform(0.05, 0.4), rng.uniform(0.5, 1)], p=[0.28, 0.44, 0.28]
    )
    hue = rng.random()
    if rng.random() < 0.5:  # wood, skin, brick, stone and sand are the commonest colours
        hue = rng.uniform(0.0, 0.15)
    return hsv(hue, saturation, value)


def lamp_color(rng, colored=0.2):
    """A tint of lamp light with a greatest channel of 1: mostly from warm to cool white."""
    if rng.random() < colored:
        return hsv(rng.random(), rng.uniform(0.4, 1), 1.0)
    warm, cool = np.array([1, 0.62, 0.3]), np.array([0.75, 0.88, 1])
    return warm + (cool - warm) * rng.random()


def unit(field):
    """The field stretched to [0, 1]."""
    low, high = field.min(), field.max()
    return ((field - low) / max(high - low, 1e-9)).astype(np.float32)


def noise(rng, n, beta=None):
    """Fractal noise: white noise with amplitude 1 / frequency^`beta`, 0.8 rough to 2 smooth."""
    beta = rng.uniform(0.9, 1.9) if beta is None else beta
    fy, fx = np.fft.fftfreq(n)[:, None], np.fft.rfftfreq(n)[None]
    radius = np.hypot(fx, fy) * n
    low = rng.choice([1, 2, 4, 8])
    gain = np.where(radius >= low, np.maximum(radius, 1) ** -beta, 0)
    spectrum = np.fft.rfft2(rng.standard_normal((n, n), dtype=np.float32)) * gain
    field = np.fft.irfft2(spectrum, s=(n, n))
    return np.clip(0.5 + field / (5 * field.std() + 1e-9), 0, 1).astype(np.float32)


def pixel_grid(n):
    """Coordinates (x, y) of the texel centres in [0, 1), each [n, n] or broadcastable to it."""
    axis = ((np.arange(n) + 0.5) / n).astype(np.float32)
    return axis[None, :], axis[:, None]


def voronoi(rng, n):
    """Cells round random points: (edge distance, random number of the cell), both fields."""
    cells = int(rng.choice([4, 6, 10, 16, 28]))
    jitter = rng.random((cells, cells, 2)).astype(np.float32)
    ids = rng.random((cells, cells)).astype(np.float32)
    x, y = pixel_grid(n)
    x, y = np.broadcast_to(x * cells, (n, n)), np.broadcast_to(y * cells, (n, n))
    cx, cy = x.astype(int), y.astype(int)
    first = np.full((n, n), 9, np.float32)
    second, owner = first.copy(), np.zeros((n, n), np.float32)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            j, i = (cy + dy) % cells, (cx + dx) % cells
            d = np.hypot(cx + dx + jitter[j, i, 0] - x, cy + dy + jitter[j, i, 1] - y)
            nearer = d < first
            second = np.where(nearer, first, np.minimum(second, d))
            owner = np.where(nearer, ids[j, i], owner)
            first = np.where(nearer, d, first)
    return np.clip((second - first) * 1.6, 0, 1), owner


def bricks(rng, n):
    """Bricks or tiles with joints: (1 on a brick and 0 in a joint, random number of the brick)."""
    rows = int(rng.choice([1, 2, 4, 6, 8, 12, 16]))
    columns = max(1, int(rows / rng.choice([1, 1, 2, 2.5, 4])))
    shift = rng.choice([0, 0.5, 0.33])
    x, y = pixel_grid(n)
    row = np.floor(y * rows)
    u, v = x * columns + shift * (row % 2 if shift == 0.5 else row), y * rows
    joint = rng.uniform(0.01, 0.06)
    fu, fv = u % 1, np.broadcast_to(v % 1, (n, n))
    edge = np.minimum(np.minimum(fu, 1 - fu) * rows / columns, np.minimum(fv, 1 - fv))
    ids = rng.random((rows, columns)).astype(np.float32)
    owner = ids[row.astype(int) % rows, np.floor(u).astype(int) % columns]
    return np.clip(edge / joint - 0.5, 0, 1).astype(np.float32), owner


def glyphs(rng, n):
    """Lines of small random signs, like print: 1 on ink."""
    rows = int(rng.choice([8, 16, 24]))
    cell = n // rows
    page = np.zeros((n, n), np.float32)
    alphabet = rng.random((24, 7, 5)) < 0.45
    pixel = max(1, cell // 10)
    for row in range(rows):
        x, end = pixel * 3, n * rng.uniform(0.5, 1) - 6 * pixel
        while x < end:
            if rng.random() > 0.16:
                sign = np.kron(alphabet[rng.integers(24)], np.ones((pixel, pixel)))
                y = row * cell + pixel
                height, width = page[y : y + 7 * pixel, x : x + 5 * pixel].shape
                page[y : y + 7 * pixel, x : x + 5 * pixel] = sign[:height, :width]
            x += 6 * pixel
    return page


def wood(rng, n):
    """Planks with rings."""
    x, y = pixel_grid(n)
    planks = int(rng.choice([1, 3, 5, 8]))
    plank = np.floor(y * planks)
    offset = rng.random(planks)[plank.astype(int)]
    warp = noise(rng, n, 1.8)
    warp = warp[:, (np.arange(n) // 6) % n]
    rings = 0.5 + 0.5 * np.sin(40 * (y + 0.15 * warp + offset) + 5 * warp)
    gap = np.abs((y * planks) % 1 - 0.5) > 0.5 - 0.012 * planks
    return np.where(gap & (planks > 1), 0, 0.3 * offset + 0.5 * rings + 0.2 * warp).astype(
        np.float32
    )


def marble(rng, n):
    x, y = pixel_grid(n)
    turns = rng.integers(1, 6, 2)
    field = np.sin(
        2 * np.pi * (turns[0] * x + turns[1] * y) + rng.uniform(3, 14) * noise(rng, n, 1.7)
    )
    return (1 - np.abs(field)) ** rng.uniform(0.3, 3)


def stripes(rng, n):
    """Stripes, checks, dots, tartan or weave."""
    x, y = pixel_grid(n)
    count = int(rng.choice([2, 4, 8, 16, 32, 64]))
    duty = rng.uniform(0.15, 0.85)
    kind = rng.integers(6)
    a, b = (x * count) % 1, (y * count) % 1
    if kind == 0:
        field = np.broadcast_to(a < duty, (n, n))
    elif kind == 1:
        field = (a < 0.5) ^ (b < 0.5)
    elif kind == 2:
        field = np.hypot(a - 0.5, b - 0.5) < 0.15 + 0.3 * duty
    elif kind == 3:
        bars = rng.random(count).astype(np.float32)
        field = bars[(x * count).astype(int)] * 0.5 + bars[(y * count).astype(int)] * 0.5
    elif kind == 4:
        over = (np.floor(x * count) + np.floor(y * count)) % 2 == 0
        field = np.where(over, np.sin(np.pi * b), np.sin(np.pi * a))
    else:
        field = 0.5 + 0.5 * np.sin(2 * np.pi * (count * x + rng.integers(0, 3) * y * count))
    return np.asarray(field, np.float32) * np.ones((n, n), np.float32)


def blocks(rng, n):
    """Squares of random grey, such as pixels, mosaic or windows of a far house."""
    cells = int(rng.choice([4, 8, 16, 32, 64]))
    values = rng.random((cells, cells)) ** rng.uniform(0.5, 4)
    index = np.arange(n) * cells // n
    return values[index][:, index].astype(np.float32)


def scratches(rng, n):
    field = np.zeros((n, n), np.float32)
    t = np.arange(n)
    for _ in range(int(rng.integers(10, 80))):
        angle, bend = rng.random() * 2 * np.pi, rng.normal() * 0.3
        length = t[: int(n * rng.uniform(0.1, 1))]
        x = rng.random() * n + np.cos(angle) * length + bend * length**2 / n
        y = rng.random() * n + np.sin(angle) * length
        field[y.astype(int) % n, x.astype(int) % n] = rng.random()
    return field


def pattern(rng, n):
    """Any of the patterns: (field, random number of the cell or None)."""
    kind = rng.choice(12, p=[0.16, 0.06, 0.09, 0.14, 0.1, 0.08, 0.13, 0.05, 0.05, 0.05, 0.04, 0.05])
    if kind == 0:
        return noise(rng, n), None
    if kind == 1:
        edge, owner = voronoi(rng, n)
        return owner, owner
    if kind == 2:
        edge, owner = voronoi(rng, n)
        return np.clip(edge * rng.uniform(2, 12), 0, 1), owner
    if kind in (3, 4):
        return bricks(rng, n)
    if kind == 5:
        return marble(rng, n), None
    if kind == 6:
        return stripes(rng, n), None
    if kind == 7:
        return glyphs(rng, n), None
    if kind == 8:
        return blocks(rng, n), None
    if kind == 9:
        return scratches(rng, n), None
    if kind == 10:
        return np.abs(2 * noise(rng, n) - 1) ** 0.5, None
    return wood(rng, n), None


def srgb_bytes(linear):
    """uint8 sRGB of linear colours."""
    c = np.clip(linear, 0, 1)
    c = np.where(c < 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)
    return np.round(255 * c).astype(np.uint8)


def paint(rng, field, owner=None):
    """Colours [n, n, 3] of a field through a palette of two to five colours."""
    count = int(rng.integers(2, 6))
    base = color(rng)
    related = rng.random() < 0.6
    contrast = rng.choice([0.15, 0.5, 1.0])
    palette = []
    for _ in range(count):
        if related:
            palette.append(
                np.clip(
                    base * (1 + contrast * rng.uniform(-1, 1.2)) + 0.06 * rng.normal(size=3),
                    0.01,
                    0.92,
                )
            )
        else:
            palette.append(color(rng))
    palette = np.array(palette)
    stops = np.linspace(0, 1, count)
    levels = np.linspace(0, 1, 256)
    table = np.stack([np.interp(levels, stops, palette[:, k]) for k in range(3)], 1).astype(
        np.float32
    )
    picture = table[(np.clip(field, 0, 1) * 255).astype(int)]
    if owner is not None:
        picture = picture * (1 - rng.uniform(0, 0.7) * owner[..., None])
    if rng.random() < 0.5:
        picture = picture * (1 - rng.uniform(0.1, 0.6) * noise(rng, len(field))[..., None])
    return picture


def normal_map(rng, field):
    """Tangent-space normals [n, n, 3] as float32 in [0, 1] of a height field."""
    strength = 10 ** rng.uniform(0.2, 1.2) * len(field) / 512
    x = np.roll(field, -1, 1) - np.roll(field, 1, 1)
    y = np.roll(field, -1, 0) - np.roll(field, 1, 0)
    normal = np.stack([-strength * x, strength * y, np.ones_like(x)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return (0.5 + 0.5 * normal).astype(np.float32)


def roughness_map(rng, field):
    """Roughness in G and metalness in B, both factors in [0, 1]."""
    low, high = np.sort(rng.random(2))
    rough = low + (high - low) * field
    metal = (field > 0.5) if rng.random() < 0.2 else np.ones_like(field)
    return np.stack([np.zeros_like(rough), rough, metal], -1).astype(np.float32)


def size_of(rng):
    return int(rng.choice([128, 256, 512, 1024], p=[0.2, 0.45, 0.31, 0.04]))


def leaf(rng, n=128):
    """A leaf or a flower with an alpha mask: uint8 [n, n, 4], sRGB."""
    x, y = pixel_grid(n)
    x, y = 2 * x - 1, 2 * y - 1
    angle, radius = np.arctan2(y, x), np.hypot(x, y)
    kind = rng.integers(3)
    if kind == 0:
        inside = np.abs(x) < 0.45 * np.cos(np.pi / 2 * y) ** rng.uniform(0.7, 2)
    elif kind == 1:
        lobes = rng.integers(3, 9)
        inside = radius < 0.6 + 0.35 * np.cos(lobes * angle)
    else:
        side = np.abs((y - 0.5 * np.abs(x)) * rng.integers(4, 9) % 1 - 0.5)
        inside = ((side < 0.3) & (np.abs(x) < 0.8 * (1 - 0.6 * np.abs(y)))) | (np.abs(x) < 0.05)
    hue = rng.uniform(0.2, 0.38) if rng.random() < 0.75 else rng.random()
    base = hsv(hue, rng.uniform(0.4, 0.9), rng.uniform(0.1, 0.7))
    veins = 0.7 + 0.3 * np.abs(np.sin(12 * (y - np.abs(x))))
    picture = base * (veins * (0.6 + 0.4 * noise(rng, n)))[..., None]
    alpha = np.where(inside, 255, 0).astype(np.uint8)[..., None]
    return np.concatenate([srgb_bytes(picture), alpha], -1)


def holes(rng, n=256):
    """A sheet with holes (perforated metal, lace, wire mesh): uint8 [n, n, 4], sRGB."""
    x, y = pixel_grid(n)
    count = int(rng.choice([4, 8, 16]))
    a, b = (x * count) % 1 - 0.5, (y * count) % 1 - 0.5
    kind = rng.integers(3)
    if kind == 0:
        solid = np.hypot(a, b) > rng.uniform(0.2, 0.45)
    elif kind == 1:
        solid = np.maximum(np.abs(a), np.abs(b)) > rng.uniform(0.3, 0.46)
    else:
        solid = np.clip(voronoi(rng, n)[0], 0, 1) < rng.uniform(0.1, 0.5)
    picture = np.broadcast_to(color(rng), (n, n, 3))
    return np.concatenate(
        [srgb_bytes(picture), np.where(solid, 255, 0).astype(np.uint8)[..., None]], -1
    )


def screen(rng, n=256):
    """What a screen or a sign shows, as emission in [0, 1]: float32 [n, n, 3]."""
    back, front = color(rng, 0.0, 0.5), color(rng, 0.5, 1)
    field = [glyphs, blocks, stripes, noise][rng.integers(4)](rng, n)
    picture = back + (front - back) * field[..., None]
    if rng.random() < 0.5:
        half = n // 2
        picture[:half, : half // 2] = paint(rng, noise(rng, n))[:half, : half // 2]
    return picture.astype(np.float32)


def sky(rng, kind=None):
    """An equirectangular environment, float32 [128 or 256, twice that, 3], and its kind.

    The kinds are "clear", "cloudy", "overcast", "sunset", "studio", "night" and "colors". The
    mean radiance of the bright ones is near 1; a sun in the picture can have 1e5.
    """
    kind = kind or rng.choice(
        ["clear", "cloudy", "overcast", "sunset", "studio", "night", "colors"],
        p=[0.22, 0.2, 0.12, 0.13, 0.2, 0.08, 0.05],
    )
    h = 256 if kind in ("clear", "sunset", "studio") else 128
    theta = (np.arange(h) + 0.5)[:, None] / h * np.pi
    phi = (np.arange(2 * h) + 0.5)[None] / h * np.pi
    up = np.cos(theta) * np.ones_like(phi)
    direction = np.stack([np.sin(theta) * np.sin(phi), up, np.sin(theta) * np.cos(phi)], -1)
    elevation = np.clip(up, 0, 1)[..., None]
    if kind == "studio":
        picture = np.ones((h, 2 * h, 3)) * color(rng, 0.005, 0.3)
        for _ in range(int(rng.integers(1, 6))):
            y, x = int(rng.uniform(0.05, 0.5) * h), int(rng.random() * 2 * h)
            size = (rng.uniform(0.03, 0.3, 2) * h).astype(int) + 1
            columns = np.arange(x, x + size[1] * 2) % (2 * h)
            picture[y : y + size[0], columns] += lamp_color(rng) * 10 ** rng.uniform(0.3, 2)
        return picture.astype(np.float32), kind
    zenith = {"sunset": [0.12, 0.2, 0.45], "night": [0.004, 0.006, 0.015]}.get(
        kind, [0.18, 0.38, 0.9]
    )
    horizon = {"sunset": [1.4, 0.6, 0.25], "night": [0.03, 0.025, 0.03]}.get(
        kind, [0.85, 0.95, 1.1]
    )
    if kind == "overcast":
        zenith, horizon = [1.1, 1.15, 1.2], [0.6, 0.63, 0.68]
    if kind == "colors":
        zenith, horizon = color(rng, 0.1, 1), color(rng, 0.1, 1)
    zenith, horizon = np.array(zenith), np.array(horizon) * rng.uniform(0.6, 1.3)
    picture = horizon + (zenith - horizon) * elevation ** rng.uniform(0.3, 0.7)
    if kind in ("cloudy", "sunset", "night"):
        cloud = noise(rng, 2 * h, 1.6)[:h]
        cover = np.clip((cloud - rng.uniform(0.35, 0.6)) * 4, 0, 1)[..., None]
        bright = {"cloudy": 1.6, "sunset": 0.9, "night": 0.02}[kind]
        picture = picture * (1 - cover) + cover * bright * (0.4 + cloud[..., None])
    ground = color(rng, 0.03, 0.4) * picture[h // 2].mean(0)
    picture = np.where(up[..., None] < 0, ground, picture)
    if kind in ("clear", "sunset", "colors") and rng.random() < 0.7:
        height = rng.uniform(0.02, 0.3) if kind == "sunset" else rng.uniform(0.25, 1.4)
        turn = rng.random() * 2 * np.pi
        sun = np.array(
            [np.cos(height) * np.sin(turn), np.sin(height), np.cos(height) * np.cos(turn)]
        )
        cosine = direction @ sun
        glow = np.exp((cosine - 1) * rng.uniform(20, 300))[..., None]
        tint = np.array([1, 0.6, 0.3]) if kind == "sunset" else np.array([1, 0.95, 0.85])
        radius = rng.choice([0.012, 0.02, 0.06])
        disc = (cosine > np.cos(max(radius, 1.2 * np.pi / h)))[..., None]
        share = disc.mean()
        picture = picture + tint * (
            glow * rng.uniform(0, 3) + disc * rng.uniform(0.15, 1.2) / max(share, 1e-6)
        )
    return np.maximum(picture, 0).astype(np.float32), kind
