"""A scene under construction: random materials, objects and lamps that all families share."""

import numpy as np

import alhazen

import shapes
import textures
from shapes import place

METALS = [
    [1.0, 0.77, 0.34],
    [0.95, 0.93, 0.88],
    [0.95, 0.64, 0.54],
    [0.91, 0.92, 0.92],
    [0.56, 0.57, 0.58],
]


class Kit:
    """A scene and a random number generator. Methods draw from `rng`, so their order matters."""

    def __init__(self, rng):
        self.rng = rng
        self.scene = alhazen.Scene()
        self.pools = {}
        self.texture_share = rng.choice([0.2, 0.55, 0.85])
        self.texture_count = 0

    def chance(self, p):
        return self.rng.random() < p

    def between(self, low, high):
        """A number between, with a uniform logarithm."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    # Geometry

    def mesh(self, mesh, material):
        """Adds a mesh (see shapes) for `repeat`; returns its index."""
        vertices, triangles, normals, uvs = mesh
        f = lambda a: np.ascontiguousarray(a, np.float32)
        return self.scene.add_mesh(
            f(vertices),
            np.ascontiguousarray(triangles, np.int32),
            normals=f(normals),
            uvs=f(uvs),
            material=material,
        )

    def repeat(self, index, **where):
        self.scene.add_instance(index, transform=place(**where))

    def put(self, mesh, material, **where):
        """Adds a mesh once; `where` are the arguments of `shapes.place`."""
        self.repeat(self.mesh(mesh, material), **where)

    def balls(self, centers, radii, material):
        centers = np.asarray(centers, np.float32).reshape(-1, 3)
        radii = np.broadcast_to(np.asarray(radii, np.float32), len(centers)).copy()
        self.scene.add_instance(self.scene.add_spheres(centers, radii, material=material))

    # Materials

    def maps(self, color=True):
        """Arguments of `add_material` for textures of colour, roughness and relief."""
        rng = self.rng
        if self.texture_count > 9:
            return {}
        self.texture_count += 1
        field, owner = textures.pattern(rng, textures.size_of(rng))
        out = {}
        if color:
            out["base_color_texture"] = textures.srgb_bytes(textures.paint(rng, field, owner))
            out["base_color"] = [1.0, 1.0, 1.0]
        if self.chance(0.3):
            out["normal_texture"] = textures.normal_map(rng, field)
        if self.chance(0.25):
            out["metallic_roughness_texture"] = textures.roughness_map(rng, field)
            out["roughness"] = 1.0
        return out

    def matte(self, textured=None, **extra):
        """A diffuse or slightly glossy material, perhaps textured."""
        rng = self.rng
        args = dict(base_color=textures.color(rng), roughness=rng.uniform(0.3, 1.0))
        if self.chance(self.texture_share) if textured is None else textured:
            args.update(self.maps())
        if (
            self.chance(0.3)
            and "normal_texture" not in args
            and "metallic_roughness_texture" not in args
        ):
            args = {k: v for k, v in args.items() if k != "roughness"}
            args["model"] = "lambert"
        return self.scene.add_material(**{**args, **extra})

    def wall(self):
        """Paint, paper, plaster or bricks: mostly bright."""
        if self.chance(0.35):
            return self.matte(textured=True)
        bright = textures.color(self.rng, 0.45, 0.88)
        if self.chance(0.7):  # off-white more often than a strong colour
            bright = bright + 0.8 * (bright.max() - bright)
        return self.matte(textured=False, base_color=bright)

    def metal(self):
        rng = self.rng
        tint = METALS[rng.integers(5)] if self.chance(0.7) else textures.color(rng, 0.4)
        args = dict(
            base_color=tint, metallic=1.0, roughness=rng.choice([0.0, 0.1, 0.25, 0.5, 0.7]) + 0.02
        )
        if self.chance(0.3):
            args.update(anisotropy=rng.uniform(0.3, 0.95), anisotropy_rotation=rng.uniform(0, 3.1))
            args["roughness"] = rng.uniform(0.2, 0.5)
        elif self.chance(0.3):
            args.update(self.maps(color=False))
        return self.scene.add_material(**args)

    def glass(self, rough=None):
        rng = self.rng
        rough = self.chance(0.25) if rough is None else rough
        args = dict(ior=rng.uniform(1.3, 1.8), roughness=0.0)
        if self.chance(0.4):
            args.update(
                attenuation_color=textures.color(rng, 0.3),
                attenuation_distance=self.between(0.02, 1),
            )
        if self.chance(0.1):
            args.update(dispersion=rng.uniform(0.2, 1))
        if rough:
            args["roughness"] = rng.uniform(0.1, 0.6)
        if rough or self.chance(0.5):
            return self.scene.add_material(transmission=1.0, base_color=[1.0, 1, 1], **args)
        del args["roughness"]
        return self.scene.add_material(model="dielectric", **args)

    def special(self):
        """A coat, cloth, film, mirror or translucent material."""
        rng = self.rng
        base = dict(base_color=textures.color(rng), roughness=rng.uniform(0.1, 0.9))
        if self.chance(self.texture_share * 0.6):
            base.update(self.maps())
        kind = rng.integers(7)
        if kind in (0, 1):
            base.update(
                clearcoat=rng.uniform(0.4, 1), clearcoat_roughness=rng.choice([0, 0.05, 0.2])
            )
            base["metallic"] = float(self.chance(0.3))
        elif kind == 2:
            base.update(sheen_color=textures.color(rng, 0.3), sheen_roughness=rng.uniform(0.2, 0.8))
        elif kind == 3:
            base.update(iridescence=1.0, iridescence_thickness=rng.uniform(150, 800))
            base.update(metallic=float(self.chance(0.5)), roughness=rng.uniform(0.05, 0.4))
        elif kind == 4:
            base = dict(model="mirror", base_color=[rng.uniform(0.7, 0.97)] * 3)
        elif kind == 5:
            base.update(
                diffuse_transmission=rng.uniform(0.3, 0.9),
                diffuse_transmission_color=textures.color(rng),
            )
        else:
            base.update(
                specular_color=textures.color(rng, 0.3), ior=rng.uniform(1.3, 2.2), roughness=0.15
            )
        return self.scene.add_material(**base)

    def subsurface(self):
        rng = self.rng
        radius = self.between(0.004, 0.06) * rng.uniform(0.4, 1.0, 3)
        return self.scene.add_material(
            model="dielectric",
            base_color=textures.color(rng, 0.3),
            roughness=rng.choice([0.1, 0.3, 0.6]),
            subsurface_radius=radius,
        )

    def any(self, weights=(0.5, 0.18, 0.1, 0.19, 0.03), pool=14):
        """A material of a shared pool: matte, metal, glass, special or subsurface."""
        made = self.pools.setdefault(weights, [])
        if len(made) >= pool or (made and self.chance(0.3)):
            return made[self.rng.integers(len(made))]
        kinds = [self.matte, self.metal, self.glass, self.special, self.subsurface]
        material = kinds[self.rng.choice(5, p=weights)]()
        made.append(material)
        return material

    def opaque(self):
        return self.any((0.62, 0.18, 0.0, 0.2, 0.0))

    def screen(self, radiance):
        picture = textures.screen(self.rng) * np.float32(radiance)
        return self.scene.add_material(
            base_color=[0.02] * 3, emission=[1.0] * 3, emission_texture=picture.astype(np.float32)
        )

    def glow(self, radiance, colored=0.2, two_sided=False):
        """A lamp's material; `radiance` in W/(sr·m²) of its strongest channel."""
        emission = textures.lamp_color(self.rng, colored) * radiance
        return self.scene.add_material(
            base_color=[0.0] * 3, emission=emission, emission_two_sided=two_sided
        )

    def foliage(self):
        rng = self.rng
        return self.scene.add_material(
            base_color_texture=textures.leaf(rng),
            base_color=[1.0] * 3,
            alpha_mode="mask",
            roughness=0.6,
            diffuse_transmission=rng.choice([0.0, 0.4]),
            diffuse_transmission_color=[0.4, 0.6, 0.1],
        )

    # Objects

    def thing(self):
        """A random object with its base at y = 0 and a largest extent of 1."""
        rng = self.rng
        kind = rng.choice(11, p=[0.1, 0.14, 0.12, 0.06, 0.06, 0.12, 0.05, 0.07, 0.14, 0.07, 0.07])
        if kind == 0:
            mesh = shapes.box(rng.uniform(0.3, 1, 3), texel=rng.choice([0.5, 1]))
        elif kind == 1:
            mesh = shapes.lathe(
                shapes.smooth_profile(rng, rng.uniform(0.6, 1.6), knots=int(rng.integers(3, 9)))
            )
        elif kind == 2:
            mesh = shapes.moved(
                shapes.torus(0.7, rng.uniform(0.1, 0.4)), place(tilt=rng.choice([0, 1.2, 1.57]))
            )
        elif kind == 3:
            mesh = shapes.moved(shapes.knot(rng), place(tilt=rng.uniform(0, 1.57)))
        elif kind == 4:
            mesh = shapes.moved(shapes.gear(rng), place(tilt=rng.choice([0, 1.57])))
        elif kind == 5:
            mesh = shapes.superquadric(rng)
        elif kind == 6:
            mesh = shapes.polygon(rng)
        elif kind == 7:
            mesh = shapes.rock(rng)
        elif kind == 8:
            angle = np.linspace(0, np.pi, 40)
            mesh = shapes.lathe(np.stack([np.sin(angle), -np.cos(angle)], 1), 72)
        elif kind == 9:
            flutes = int(rng.integers(8, 20))
            mesh = shapes.lathe(
                [[0, 0], [0.3, 0], [0.3, 0], [0.26, 1.6], [0.26, 1.6], [0, 1.6]], 48, flutes, 0.12
            )
        else:
            n = int(rng.integers(2, 6))
            parts = [
                shapes.moved(
                    shapes.box([1.0 - 0.15 * i, 0.2, 1.0 - 0.15 * i]), place(0, 0.2 * i, 0, 0.4 * i)
                )
                for i in range(n)
            ]
            mesh = shapes.merge(parts)
        if self.chance(0.07):
            mesh = shapes.flat(mesh)
        low, high = mesh[0].min(0), mesh[0].max(0)
        scale = 1 / (high - low).max()
        center = (low + high) / 2
        return shapes.moved(
            mesh, place(*(-scale * np.array([center[0], low[1], center[2]])), scale=scale)
        )

    def scatter(self, count, low, high, size, material=None, y=0.0, apart=1.0):
        """Things at random places of the rectangle low..high ([2] each: x, z) that do not overlap.

        `size` are the least and greatest extents in metres. Returns the places [n, 4]: x, y of the
        top, z, radius.
        """
        rng = self.rng
        taken = []
        for _ in range(count * 4):
            if len(taken) == count:
                break
            extent = self.between(*size)
            x, z = rng.uniform(low, high)
            radius = 0.55 * extent * apart
            if any(np.hypot(x - t[0], z - t[2]) < radius + t[3] for t in taken):
                continue
            mat = self.any() if material is None else material()
            top = y + extent
            if self.chance(0.2):
                self.balls([[x, y + extent / 2 + 1e-3, z]], extent / 2, mat)
            else:
                mesh = self.thing()
                top = y + extent * mesh[0][:, 1].max()
                self.put(mesh, mat, x=x, y=y + 1e-3, z=z, turn=rng.random() * 6.28, scale=extent)
            taken.append((x, top, z, radius))
        return np.array(taken).reshape(-1, 4)

    def books(self, x, y, z, width, height, depth, turn=0.0):
        """A row of books along x from the point (x, y, z), one mesh for each of three covers."""
        rng = self.rng
        rows = [[], [], []]
        at = 0.0
        while at < width - 0.05:
            thick = rng.uniform(0.012, 0.05)
            tall = height * rng.uniform(0.55, 0.95)
            if rng.random() < 0.9:
                rows[rng.integers(3)].append(
                    ((thick * 0.96, tall, depth * rng.uniform(0.6, 0.9)), (at, tall / 2, 0))
                )
            at += thick
        for row in rows:
            if row:
                self.put(shapes.boxes(row, texel=0.3), self.opaque(), x=x, y=y, z=z, turn=turn)

    def table(self, width, depth, height, material, **where):
        leg = self.rng.uniform(0.03, 0.09)
        x, z = width / 2 - leg, depth / 2 - leg
        parts = [((width, 0.04, depth), (0, height - 0.02, 0))]
        parts += [
            ((leg, height - 0.04, leg), (i, height / 2 - 0.02, k)) for i in (-x, x) for k in (-z, z)
        ]
        self.put(shapes.boxes(parts), material, **where)

    def chair(self, material, **where):
        leg, w, h = 0.035, 0.42, 0.45
        x = w / 2 - leg
        parts = [((w, 0.04, w), (0, h, 0)), ((w, self.rng.uniform(0.08, 0.3), 0.03), (0, 0.82, -x))]
        parts += [((leg, h, leg), (i, h / 2, x)) for i in (-x, x)]
        parts += [((leg, 0.95, leg), (i, 0.475, -x)) for i in (-x, x)]
        self.put(shapes.boxes(parts), material, **where)

    def sofa(self, material, **where):
        width = self.rng.uniform(0.9, 2.2)
        parts = []
        rounded = shapes.superquadric(np.random.default_rng(3), 24)
        soft = shapes.moved(rounded, place())
        low, high = soft[0].min(0), soft[0].max(0)
        soft = shapes.moved(soft, place(scale=2 / (high - low)))
        for size, center in (
            ((width, 0.25, 0.8), (0, 0.25, 0)),
            ((width, 0.5, 0.2), (0, 0.6, -0.35)),
            ((0.2, 0.45, 0.85), (-width / 2, 0.35, 0)),
            ((0.2, 0.45, 0.85), (width / 2, 0.35, 0)),
        ):
            parts.append(shapes.moved(soft, place(*center, scale=np.array(size) / 2)))
        self.put(shapes.merge(parts), material, **where)

    def plant(self, x, y, z, height):
        rng = self.rng
        pot = shapes.lathe([[0, 0], [0.11, 0], [0.16, 0.3], [0.14, 0.3], [0.13, 0.26], [0, 0.26]])
        self.put(pot, self.opaque(), x=x, y=y, z=z, scale=height * 0.9)
        crown = shapes.leaves(rng, int(rng.integers(30, 250)), 0.32, rng.uniform(0.1, 0.3))
        self.put(crown, self.foliage(), x=x, y=y + 0.62 * height, z=z, scale=height)

    def floor_lamp(self, x, y, z, height, radiance):
        """A stand with a ball of light in a shade."""
        rng = self.rng
        stand = shapes.lathe(
            [[0, 0], [0.14, 0], [0.14, 0.02], [0.012, 0.03], [0.012, height], [0, height]], 24
        )
        self.put(stand, self.opaque(), x=x, y=y, z=z)
        self.balls([[x, y + height + 0.06, z]], 0.05, self.glow(radiance))
        if self.chance(0.75):
            low, high = rng.uniform(0.14, 0.25), rng.uniform(0.08, 0.2)
            shade = shapes.lathe([[low, height - 0.1], [high, height + 0.2]], 32, solid=False)
            cloth = self.scene.add_material(
                base_color=textures.color(rng, 0.4),
                diffuse_transmission=rng.uniform(0.3, 0.8),
                diffuse_transmission_color=textures.color(rng, 0.5),
                roughness=1.0,
            )
            self.put(shade, cloth, x=x, y=y, z=z)

    def vessel(self, x, y, z, height, liquid=0.5):
        """A glass, perhaps with a drink in it whose body overlaps the wall."""
        rng = self.rng
        radius = height * rng.uniform(0.25, 0.5)
        outline, inside = shapes.vessel(rng, height, radius, 0.03 * height)
        self.put(shapes.lathe(outline, 56), self.glass(rough=self.chance(0.08)), x=x, y=y, z=z)
        if self.chance(liquid) and len(inside) > 6:
            level = inside[: int(len(inside) * rng.uniform(0.4, 0.9))].copy()
            level[:, 0] += 0.004 * height
            body = np.concatenate([[[0, level[0, 1]]], level, [[0, level[-1, 1]]]])
            drink = self.scene.add_material(
                model="dielectric",
                ior=1.33,
                attenuation_color=textures.color(rng, 0.3),
                attenuation_distance=height * rng.uniform(0.05, 0.6),
                priority=-1 if self.chance(0.5) else 1,
            )
            self.put(shapes.lathe(body, 56), drink, x=x, y=y, z=z)

    # Light

    def sun(self, strength, height=None):
        """A sun of `strength` W/m²; returns the direction towards it."""
        rng = self.rng
        height = rng.uniform(0.1, 1.4) if height is None else height
        turn = rng.random() * 2 * np.pi
        towards = np.array(
            [np.cos(height) * np.sin(turn), np.sin(height), np.cos(height) * np.cos(turn)]
        )
        tint = np.array([1, 0.9, 0.75]) if height > 0.4 else np.array([1, 0.65, 0.35])
        self.scene.add_directional_light(
            -towards, strength * tint, angular_diameter=float(rng.choice([0.0, 0.0093, 0.05, 0.15]))
        )
        return towards

    def sky(self, kind=None, strength=1.0):
        picture, kind = textures.sky(self.rng, kind)
        self.scene.set_environment(
            picture, intensity=float(strength), rotation=float(self.rng.random() * 6.28)
        )
        return kind

    def area_light(self, width, depth, radiance, x, y, z, turn=0.0, tilt=np.pi):
        """A rectangle that shines down, or where `tilt` turns it."""
        self.put(
            shapes.plane(width, depth), self.glow(radiance), x=x, y=y, z=z, turn=turn, tilt=tilt
        )

    def smoke(self, low, high, optical):
        """A cloud between two corners [3] with an optical thickness of about `optical`."""
        rng = self.rng
        n = int(rng.choice([24, 40]))
        axis = np.linspace(-1, 1, n)
        z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
        p = np.stack([x, y, z], -1)
        density = np.clip(1 - (p**2).sum(-1) + 0.9 * shapes.waves(rng, p, 10, 2, 14), 0, 2)
        density *= np.clip(3 * (1 - np.abs(p).max(-1)), 0, 1)
        low, high = np.asarray(low, float), np.asarray(high, float)
        sigma = optical / (high - low).mean()
        albedo = (
            rng.uniform(0.5, 0.99, 3) if self.chance(0.3) else np.full(3, rng.uniform(0.5, 0.99))
        )
        args = {}
        if self.chance(0.2):
            args["emission"] = textures.lamp_color(rng) * self.between(0.1, 10) * sigma
        medium = alhazen.Medium(
            scattering=sigma * albedo,
            absorption=sigma * (1 - albedo),
            anisotropy=rng.uniform(-0.3, 0.8),
            density=density.astype(np.float32),
            bounds=[low, high],
            **args
        )
        ends = self.scene.add_material(model="boundary", medium=medium)
        self.put(shapes.box(high - low), ends, **dict(zip("xyz", (low + high) / 2)))

    def ballast(self):
        """A speck far below the floor with all that shaders are made for.

        A GPU's shaders leave out what a scene does not have, and compiling them takes longer than
        rendering. With the speck all scenes have the same shaders, and the driver keeps them.
        """
        scene, below = self.scene, -40.0
        holes = np.zeros((4, 4, 4), np.uint8)
        holes[::2, :, 3] = 255
        add = scene.add_material
        materials = [
            add(base_color_texture=holes, base_color=[1.0] * 3, alpha_mode="mask"),
            add(clearcoat=1.0, anisotropy=0.5, anisotropy_rotation=0.7),
            add(normal_texture=np.full((2, 2, 3), 0.5, np.float32)),
            add(
                transmission=1.0,
                attenuation_color=[0.5, 0.6, 0.7],
                attenuation_distance=1.0,
            ),
        ]
        # The number of textures in a shader is a power of two.
        for i in range(34):
            texel = np.full((1, 1, 3), i, np.uint8)
            materials.append(add(base_color_texture=texel, base_color=[1.0] * 3))
        angle = np.linspace(0, np.pi, 6)
        ball = shapes.lathe(np.stack([np.sin(angle), -np.cos(angle)], 1) * 0.01, 6)
        for i, material in enumerate(materials):
            self.put(ball, material, x=0.03 * i, y=below)
        for i, material in enumerate(materials[:2]):
            self.balls([[0.03 * i, below, 0.1]], 0.01, material)
        # More lights than fit into a list, of two kinds, near to other things, and nearly dark.
        glow = add(base_color=[0.0] * 3, emission=[1e-5] * 3)
        self.put(shapes.box([0.01] * 3), glow, y=below, z=0.2)
        self.balls([[0.03, below, 0.2]], 0.01, glow)
