//! From a [`Scene`] to [`SceneTables`].

use super::geometry::{BindingRecord, BlasRecord, GeometryKind, GeometryRecord, InstanceRecord};
use super::light::LightRecord;
use super::material::{MATERIAL_GRAPHS, has_layers, rules_of, texture_flags};
use super::transform::{is_upright, normal_matrix, placed_attribute, rows, scales_alike, uniform_scale};
use super::{EnvironmentTable, LightTree, MaterialRecord, SceneTables, TextureUse};
use crate::normals::normals_are_faces;
use crate::tangents::generate_and_split;
use crate::{
    Environment, Image, Instance, LightProfile, Material, Pixels, RenderDefaults, Scene, Shape, Sphere,
    TriangleMesh,
};
use exr::prelude::f16;
use glam::{Affine3A, Mat3, Vec3};
use optics::alias_table::build_alias_table;
use optics::constants::NONE;
use std::borrow::Cow;

impl SceneTables {
    /// Flattens a scene.
    ///
    /// Indices that point nowhere are tolerated: such instances are left out, such materials become the first one.
    /// Instances whose transform is not finite or cannot be inverted are left out, too.
    pub fn build(scene: &Scene) -> Self {
        let mut tables = SceneTables::default();
        tables.add_images(scene);
        tables.add_graphs(scene);
        tables.add_materials(scene);
        let usable: Vec<(u32, &Instance)> =
            (0..).zip(&scene.instances).filter(|(_, i)| is_usable(i, scene)).collect();
        let mut uses = vec![0u32; scene.meshes.len()];
        usable.iter().for_each(|(_, i)| uses[i.mesh as usize] += 1);
        let motion = scene.motion.as_deref().filter(|m| !(m.instances.is_empty() && m.lights.is_empty()));
        let moves = |object: u32| motion.is_some_and(|motion| motion.instances.contains_key(&object));
        let is_static =
            |object: u32, i: &Instance| !i.dynamic && uses[i.mesh as usize] == 1 && !moves(object);
        for kind in [GeometryKind::Triangles, GeometryKind::Spheres] {
            let members: Vec<_> = usable.iter().copied().filter(|(o, i)| is_static(*o, i)).collect();
            tables.add_static_world(scene, &members, kind);
        }
        let mut known = vec![None; scene.meshes.len()];
        for (object, instance) in usable.iter().copied().filter(|(o, i)| !is_static(*o, i)) {
            let known = &mut known[instance.mesh as usize];
            let blas = known.get_or_insert_with(|| tables.add_mesh(scene, instance)).clone();
            blas.into_iter().for_each(|(index, parts)| {
                tables.add_instance(scene, object, instance, index, &parts);
            });
        }
        if let Some(motion) = motion {
            tables.add_motion(motion);
        }
        tables.has_dynamic_instances = usable.iter().any(|(_, i)| i.dynamic);
        tables.bounding_sphere = bounding_sphere(scene);
        tables.add_lights(scene);
        tables
    }

    fn add_materials(&mut self, scene: &Scene) {
        let fallback = Material::default();
        let materials =
            if scene.materials.is_empty() { std::slice::from_ref(&fallback) } else { &scene.materials };
        for material in materials {
            self.add_material(material, &scene.defaults);
        }
        self.add_media(scene);
        self.has_alpha = self.materials.iter().any(MaterialRecord::has_alpha);
    }

    pub(super) fn add_material(&mut self, material: &Material, defaults: &RenderDefaults) {
        let mut record = self.material_record(material);
        record.flags |= rules_of(material, defaults);
        let mut has_graphs = record.textures.iter().any(TextureUse::is_graph);
        if has_layers(material) {
            record.layers = self.layers.len() as u32;
            let (layers, textures) = self.layers_record(material);
            has_graphs |= textures.iter().any(TextureUse::is_graph);
            self.layers.push(layers);
            self.layer_textures.push(textures);
        }
        record.flags |= if has_graphs { MATERIAL_GRAPHS } else { 0 };
        self.materials.push(record);
    }

    fn add_images(&mut self, scene: &Scene) {
        let used: std::collections::BTreeSet<u32> =
            scene.textures.iter().filter_map(|t| t.as_image()).map(|t| t.image).collect();
        let mut first = vec![0u32; scene.images.len()];
        let texels = |image: &Image| image.pixels.len() * if image.pixels.is_float() { 2 } else { 1 };
        let images = used.iter().filter_map(|&image| scene.images.get(image as usize));
        // Exactly: what grows by doubling may ask for twice the memory that it needs.
        self.texels.reserve_exact(images.map(texels).sum());
        for &image in used.iter().filter(|&&i| (i as usize) < scene.images.len()) {
            first[image as usize] = self.texels.len() as u32;
            match &scene.images[image as usize].pixels {
                Pixels::Rgba8(pixels) => self.texels.extend_from_slice(pixels),
                Pixels::Rgb32F(pixels) => {
                    self.texels.extend(pixels.iter().flat_map(|[r, g, b]| halves([*r, *g, *b, 1.0])));
                }
                Pixels::Rgba32F(pixels) => self.texels.extend(pixels.iter().flat_map(|p| halves(*p))),
            }
        }
        for (image, texture) in (0..).zip(&scene.textures) {
            let shown = texture.as_image();
            let pixels = shown.and_then(|t| scene.images.get(t.image as usize));
            let (width, height, first_texel) = match (shown, pixels) {
                (Some(t), Some(image)) => (image.width, image.height, first[t.image as usize]),
                _ => {
                    self.texels.push([255; 4]);
                    (1, 1, self.texels.len() as u32 - 1)
                }
            };
            let half = pixels.is_some_and(|i| i.pixels.is_float());
            let flags = shown.map_or(0, |t| texture_flags(t, half));
            self.textures.push(TextureUse {
                first_texel,
                flags,
                width,
                height,
                image,
                ..TextureUse::default()
            });
        }
    }

    /// One bottom-level structure, in world space, of all static parts of one kind.
    fn add_static_world(&mut self, scene: &Scene, members: &[(u32, &Instance)], kind: GeometryKind) {
        let first_geometry = self.geometries.len() as u32;
        let first_binding = self.bindings.len() as u32;
        let mut first_in_blas = 0;
        let mut left_over = Vec::new();
        for &(object, instance) in members {
            for (index, part) in scene.meshes[instance.mesh as usize].parts.iter().enumerate() {
                let added = match (&part.shape, kind) {
                    (Shape::Triangles(mesh), GeometryKind::Triangles) => {
                        let mesh = with_tangents(scene, mesh, instance, index, part.material);
                        self.add_triangles(&mesh, Some(&instance.transform), first_in_blas)
                    }
                    (Shape::Spheres(spheres), GeometryKind::Spheres) => {
                        match uniform_scale(&instance.transform) {
                            Some(scale) => {
                                self.add_spheres(spheres, &instance.transform, scale, first_in_blas)
                            }
                            None => {
                                left_over.push((object, instance, index, spheres));
                                None
                            }
                        }
                    }
                    _ => None,
                };
                if let Some(geometry) = added {
                    first_in_blas += geometry.primitive_count;
                    let material = self.material_of(instance, index, part.material);
                    let placement = self.placement_of(&instance.transform, kind, material);
                    self.bindings.push(BindingRecord { material, first_light: NONE, object, placement });
                    self.geometries.push(geometry);
                }
            }
        }
        let geometry_count = self.geometries.len() as u32 - first_geometry;
        if geometry_count > 0 {
            let blas = self.blas.len() as u32;
            self.blas.push(BlasRecord { first_geometry, geometry_count, kind });
            self.instances.push(instance_record(&Affine3A::IDENTITY, blas, first_binding));
        }
        // Spheres that a transform turns into ellipsoids stay spheres in their own space.
        for (object, instance, index, spheres) in left_over {
            let first_geometry = self.geometries.len() as u32;
            let Some(geometry) = self.add_spheres(spheres, &Affine3A::IDENTITY, 1.0, 0) else { continue };
            self.geometries.push(geometry);
            self.blas.push(BlasRecord { first_geometry, geometry_count: 1, kind });
            let blas = self.blas.len() as u32 - 1;
            self.add_instance(scene, object, instance, blas, &[index]);
        }
    }

    /// Bottom-level structures of a mesh in object space, one for each kind; with the parts that each holds.
    fn add_mesh(&mut self, scene: &Scene, instance: &Instance) -> Vec<(u32, Vec<usize>)> {
        let mesh = &scene.meshes[instance.mesh as usize];
        let mut out = Vec::new();
        for kind in [GeometryKind::Triangles, GeometryKind::Spheres] {
            let first_geometry = self.geometries.len() as u32;
            let (mut first_in_blas, mut parts) = (0, Vec::new());
            for (index, part) in mesh.parts.iter().enumerate() {
                let added = match (&part.shape, kind) {
                    (Shape::Triangles(mesh), GeometryKind::Triangles) => {
                        let mesh = with_tangents(scene, mesh, instance, index, part.material);
                        self.add_triangles(&mesh, None, first_in_blas)
                    }
                    (Shape::Spheres(s), GeometryKind::Spheres) => {
                        self.add_spheres(s, &Affine3A::IDENTITY, 1.0, first_in_blas)
                    }
                    _ => None,
                };
                if let Some(geometry) = added {
                    first_in_blas += geometry.primitive_count;
                    self.geometries.push(geometry);
                    parts.push(index);
                }
            }
            if !parts.is_empty() {
                self.blas.push(BlasRecord { first_geometry, geometry_count: parts.len() as u32, kind });
                out.push((self.blas.len() as u32 - 1, parts));
            }
        }
        out
    }

    fn add_instance(&mut self, scene: &Scene, object: u32, instance: &Instance, blas: u32, parts: &[usize]) {
        let first_binding = self.bindings.len() as u32;
        for &index in parts {
            let own = scene.meshes[instance.mesh as usize].parts[index].material;
            let material = self.material_of(instance, index, own);
            self.bindings.push(BindingRecord { material, first_light: NONE, object, placement: NONE });
        }
        self.instances.push(instance_record(&instance.transform, blas, first_binding));
    }

    /// The placement of geometry that is moved into world space, or `NONE` where nothing lies in the space of its object.
    fn placement_of(&mut self, to_world: &Affine3A, kind: GeometryKind, material: u32) -> u32 {
        // Whatever their material, spheres have texture coordinates, which auxiliary layers show.
        let turned = kind == GeometryKind::Spheres && !is_upright(to_world);
        let patterned = self.materials[material as usize].is_patterned() && *to_world != Affine3A::IDENTITY;
        if !turned && !patterned {
            return NONE;
        }
        self.placements.push(rows(&to_world.inverse()));
        self.placements.len() as u32 - 1
    }

    fn material_of(&self, instance: &Instance, part: usize, own: u32) -> u32 {
        let material = instance.materials.as_ref().and_then(|m| m.get(part).copied()).unwrap_or(own);
        if (material as usize) < self.materials.len() { material } else { 0 }
    }

    fn add_triangles(
        &mut self,
        mesh: &TriangleMesh,
        to: Option<&Affine3A>,
        first_in_blas: u32,
    ) -> Option<GeometryRecord> {
        let vertex_count = mesh.positions.len();
        if mesh.indices.is_empty() || vertex_count == 0 {
            return None;
        }
        let first_vertex = self.positions.len() as u32;
        let first_primitive = self.indices.len() as u32;
        let flip = to.is_some_and(|t| t.matrix3.determinant() < 0.0);
        let ordered = |t: &[u32; 3]| if flip { [t[0], t[2], t[1]] } else { *t };
        // A loader has checked indices; a scene built by hand may hold bad ones.
        let valid = mesh.indices.iter().filter(|t| t.iter().all(|&i| (i as usize) < vertex_count));
        self.indices.extend(valid.map(ordered));
        let present = |n: usize| n == vertex_count;
        // Normals that say nothing new cost every ray that arrives.
        let normals: &[Vec3] = if normals_are_faces(mesh) { &[] } else { &mesh.normals };
        let first = |n: usize, at: usize| if present(n) { at as u32 } else { NONE };
        let record = GeometryRecord {
            kind: GeometryKind::Triangles,
            first_primitive,
            primitive_count: self.indices.len() as u32 - first_primitive,
            first_in_blas,
            first_vertex,
            vertex_count: vertex_count as u32,
            first_normal: first(normals.len(), self.normals.len()),
            first_tangent: first(mesh.tangents.len(), self.tangents.len()),
            first_uv0: first(mesh.uv0.len(), self.uv0.len()),
            first_uv1: first(mesh.uv1.len(), self.uv1.len()),
            first_color: first(mesh.colors.len(), self.colors.len()),
        };
        self.add_vertices(mesh, normals, to.unwrap_or(&Affine3A::IDENTITY));
        (record.primitive_count > 0).then_some(record)
    }

    /// Adds the vertices of a mesh, moved by `to`, with those attributes that all of them have.
    fn add_vertices(&mut self, mesh: &TriangleMesh, normals: &[Vec3], to: &Affine3A) {
        let present = |n: usize| n == mesh.positions.len();
        let flip = to.matrix3.determinant() < 0.0;
        let linear = Mat3::from(to.matrix3);
        let normal_matrix = normal_matrix(to);
        self.positions.extend(mesh.positions.iter().map(|p| to.transform_point3(*p).to_array()));
        if present(normals.len()) {
            let keeps_shapes = scales_alike(&normal_matrix).is_some();
            let placed = |n: &Vec3| placed_attribute(&normal_matrix, keeps_shapes, *n).to_array();
            self.normals.extend(normals.iter().map(placed));
        }
        if present(mesh.tangents.len()) {
            let handedness = if flip { -1.0 } else { 1.0 };
            let keeps_shapes = scales_alike(&linear).is_some();
            self.tangents.extend(mesh.tangents.iter().map(|t| {
                let direction = placed_attribute(&linear, keeps_shapes, t.truncate());
                direction.extend(t.w * handedness).to_array()
            }));
        }
        if present(mesh.uv0.len()) {
            self.uv0.extend(mesh.uv0.iter().map(|uv| uv.to_array()));
        }
        if present(mesh.uv1.len()) {
            self.uv1.extend(mesh.uv1.iter().map(|uv| uv.to_array()));
        }
        if present(mesh.colors.len()) {
            self.colors.extend(mesh.colors.iter().map(|c| c.to_array()));
        }
    }

    fn add_spheres(
        &mut self,
        spheres: &[Sphere],
        to: &Affine3A,
        scale: f32,
        first_in_blas: u32,
    ) -> Option<GeometryRecord> {
        let first_primitive = self.spheres.len() as u32;
        let valid = spheres.iter().filter(|s| s.center.is_finite() && s.radius.is_finite() && s.radius > 0.0);
        self.spheres.extend(valid.map(|s| to.transform_point3(s.center).extend(s.radius * scale).to_array()));
        let primitive_count = self.spheres.len() as u32 - first_primitive;
        (primitive_count > 0).then_some(GeometryRecord {
            kind: GeometryKind::Spheres,
            first_primitive,
            primitive_count,
            first_in_blas,
            first_vertex: 0,
            vertex_count: 0,
            first_normal: NONE,
            first_tangent: NONE,
            first_uv0: NONE,
            first_uv1: NONE,
            first_color: NONE,
        })
    }

    fn add_lights(&mut self, scene: &Scene) {
        for i in 0..self.instances.len() {
            let first = self.lights.len();
            self.add_surface_lights(scene, i);
            self.bind_lights(i, first);
        }
        let first = self.lights.len();
        let radius = self.bounding_sphere[3].max(1e-3);
        let mut places: Vec<(&LightProfile, u32)> = Vec::new();
        for light in &scene.lights {
            let record = self.light_record(scene, light.kind, radius);
            let profile = light.profile.as_ref().filter(|_| !light.kind.is_infinitely_far());
            let record = match profile {
                Some(photometry) => {
                    let profile = &*photometry.profile;
                    // Lamps of a row share theirs.
                    let is_same = |other: &LightProfile| std::ptr::eq(other, profile) || other == profile;
                    let known = places.iter().find(|known| is_same(known.0)).map(|known| known.1);
                    let place = known.unwrap_or_else(|| self.add_profile(profile));
                    if known.is_none() {
                        places.push((profile, place));
                    }
                    record.with_profile(photometry, place)
                }
                None => record,
            };
            self.lights.push(record);
        }
        let image = match &scene.environment {
            Environment::Image { image, .. } => scene.images.get(*image as usize),
            _ => None,
        };
        if let Some(sun) = scene.environment.sun() {
            self.lights.push(LightRecord::directional(
                sun.direction,
                sun.irradiance,
                sun.angular_radius,
                true,
                radius,
            ));
        }
        self.environment = EnvironmentTable::new(&scene.environment, image, &scene.portals);
        let mean = self.environment.mean_radiance();
        if !self.environment.portals.is_empty() {
            self.environment.light = self.lights.len() as u32;
            self.lights.push(LightRecord::portals(mean, &scene.portals));
        } else if self.environment.width > 0 {
            self.environment.light = self.lights.len() as u32;
            self.lights.push(LightRecord::environment(mean, radius));
        }
        if let Some(motion) = scene.motion.as_deref() {
            self.add_light_motions(motion, first);
        }
        self.choose_lights_with(LightTree::of_moving(&self.lights, self.motion.as_deref()));
        self.add_emitter_boxes();
    }

    /// Adds a profile; returns where it begins.
    fn add_profile(&mut self, profile: &LightProfile) -> u32 {
        let place = self.profiles.len() as u32;
        self.profiles.extend([profile.rows(), profile.columns()]);
        self.profiles.extend(profile.values().iter().map(|v| v.to_bits()));
        place
    }

    /// The same scene, whose lights are chosen by power alone, wherever they are: what a tree of lights is compared with.
    #[must_use]
    pub fn with_lights_by_power(mut self) -> Self {
        self.choose_lights_with(LightTree::default());
        self
    }

    fn choose_lights_with(&mut self, tree: LightTree) {
        let powers: Vec<f64> = self.lights.iter().map(|l| f64::from(l.power)).collect();
        self.light_alias = build_alias_table(&powers);
        self.light_tree = tree;
    }
}

/// A part's mesh with the tangents that its material needs: loaders make them, who builds a scene by hand may not have.
fn with_tangents<'m>(
    scene: &Scene,
    mesh: &'m TriangleMesh,
    instance: &Instance,
    part: usize,
    own: u32,
) -> Cow<'m, TriangleMesh> {
    let material = instance.materials.as_ref().and_then(|m| m.get(part).copied()).unwrap_or(own);
    let has_coordinates = |set: u32| [&mesh.uv0, &mesh.uv1][set as usize & 1].len() == mesh.positions.len();
    let in_range = || mesh.indices.as_flattened().iter().all(|&i| (i as usize) < mesh.positions.len());
    match scene.materials.get(material as usize).and_then(Material::tangent_coordinates) {
        Some((uv_set, transform)) if mesh.tangents.is_empty() && has_coordinates(uv_set) && in_range() => {
            let mut mesh = mesh.clone();
            generate_and_split(&mut mesh, uv_set, &transform);
            Cow::Owned(mesh)
        }
        _ => Cow::Borrowed(mesh),
    }
}

fn is_usable(instance: &Instance, scene: &Scene) -> bool {
    let matrix = &instance.transform;
    instance.visible
        && (instance.mesh as usize) < scene.meshes.len()
        && matrix.is_finite()
        && matrix.matrix3.determinant().abs() > f32::MIN_POSITIVE
}

fn instance_record(transform: &Affine3A, blas: u32, first_binding: u32) -> InstanceRecord {
    InstanceRecord {
        object_to_world: rows(transform),
        world_to_object: rows(&transform.inverse()),
        blas,
        first_binding,
        identity: *transform == Affine3A::IDENTITY,
    }
}

fn bounding_sphere(scene: &Scene) -> [f32; 4] {
    let Some((mut low, mut high)) = scene.bounds() else { return [0.0; 4] };
    for (object, instance) in (0..).zip(&scene.instances).filter(|(_, i)| i.visible) {
        let motion = scene.motion.as_ref().map_or(Vec::new(), |motion| motion.transforms(object));
        let mesh = || scene.meshes.get(instance.mesh as usize)?.bounds();
        let Some((a, b)) = (!motion.is_empty()).then(mesh).flatten() else { continue };
        for (corner, pose) in (0..8u32).flat_map(|corner| motion.iter().map(move |pose| (corner, pose))) {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { a[axis] } else { b[axis] };
            let at = pose.transform_point3(Vec3::new(pick(0), pick(1), pick(2)));
            (low, high) = (low.min(at), high.max(at));
        }
    }
    let center = (low + high) * 0.5;
    center.extend((high - low).length() * 0.5).to_array()
}

/// Four half floats, two in a place. What is beyond their range is the last number in it.
fn halves(pixel: [f32; 4]) -> [[u8; 4]; 2] {
    let largest = f16::MAX.to_f32();
    let [[r0, r1], [g0, g1], [b0, b1], [a0, a1]] =
        pixel.map(|v| f16::from_f32(v.clamp(-largest, largest)).to_le_bytes());
    [[r0, r1, g0, g1], [b0, b1, a0, a1]]
}
