//! Texture graphs as programs, and their evaluation where images are not at hand.

use super::{GeometryKind, GeometryRecord, SceneTables, TextureUse};
use crate::texture_graph::{Program, evaluate};
use crate::{Scene, Texture};
use glam::Affine3A;
use optics::constants::NONE;
use optics::image_texture::{TEXTURE_GRAPH, TEXTURE_SHARES};
use optics::shape::sphere_uv;
use optics::texture_node::{NODE_IMAGE, NODE_TRIPLANAR};
use optics::texture_point::{TexturePoint, texture_point_at};
use optics::vector::dot;
use optics::{Vec3f, Vec4f, vec4f};

pub use optics::texture_node::TextureNode;

impl SceneTables {
    /// The programs of all graphs. What cannot be evaluated stays the white image that it has been until now: loaders
    /// refuse such graphs.
    pub(super) fn add_graphs(&mut self, scene: &Scene) {
        let world_to_camera =
            scene.cameras.first().map_or(Affine3A::IDENTITY, |camera| camera.world_to_camera());
        for (i, texture) in scene.textures.iter().enumerate() {
            let Texture::Graph(graph) = texture else { continue };
            let Ok(program) = Program::new(graph, world_to_camera) else { continue };
            let first_image = self.graph_textures.len() as u32;
            // Images that graphs show are read as they are: their value is limited at the end.
            let shown = |reference| {
                let shown = self.texture_use(&Some(reference), super::material::Range::Radiance);
                if shown.is_graph() { TextureUse::default() } else { shown }
            };
            let images: Vec<_> = program.images.into_iter().map(shown).collect();
            self.textures[i] = TextureUse {
                first_texel: self.graph_nodes.len() as u32,
                flags: TEXTURE_GRAPH,
                width: program.nodes.len() as u32,
                height: 1,
                image: i as u32,
                ..TextureUse::default()
            };
            self.graph_textures.extend(images);
            self.graph_nodes.extend(program.nodes.into_iter().map(|node| {
                let has_image = matches!(node.operation, NODE_IMAGE | NODE_TRIPLANAR);
                TextureNode { texture: if has_image { first_image + node.texture } else { 0 }, ..node }
            }));
        }
    }

    /// The nodes of a graph.
    #[inline]
    pub fn graph(&self, texture: &TextureUse) -> &[TextureNode] {
        &self.graph_nodes[texture.first_texel as usize..][..texture.width as usize]
    }

    /// The value of a graph at a point. `image`: the texel of one of `graph_textures` at both sets of texture coordinates.
    pub fn evaluate_graph(
        &self,
        texture: &TextureUse,
        point: &TexturePoint,
        image: impl Fn(&TextureUse, Vec4f) -> Vec4f,
    ) -> Vec4f {
        let shown = |index: u32, coords: Vec4f| image(&self.graph_textures[index as usize], coords);
        evaluate(self.graph(texture), point, shown, texture.flags & TEXTURE_SHARES != 0)
    }

    /// Mean of the strongest channel of a graph over primitives of a geometry, for the choice among lights: images in it
    /// count as white.
    pub(super) fn mean_of_graph(
        &self,
        texture: &TextureUse,
        geometry: &GeometryRecord,
        binding: usize,
    ) -> f32 {
        /// So many primitives stand for all.
        const MOST: u32 = 512;
        let step = geometry.primitive_count.div_ceil(MOST).max(1);
        let (mut sum, mut count) = (0.0f64, 0.0f64);
        for primitive in (0..geometry.primitive_count).step_by(step as usize) {
            let index = (geometry.first_primitive + primitive) as usize;
            let points = match geometry.kind {
                GeometryKind::Triangles => vec![self.middle_of(geometry, binding, index)],
                GeometryKind::Spheres => self.around(binding, index).to_vec(),
            };
            for point in points {
                let value = self.evaluate_graph(texture, &point, |_, _| vec4f(1.0, 1.0, 1.0, 1.0));
                sum += f64::from(value.x.max(value.y).max(value.z));
                count += 1.0;
            }
        }
        (sum / count.max(1.0)) as f32
    }

    /// Where the axes of its object leave a sphere: the same points whether it is moved into world space or not.
    fn around(&self, binding: usize, sphere: usize) -> [TexturePoint; 6] {
        let [x, y, z, radius] = self.spheres[sphere];
        let center = self.in_object(binding, Vec3f { x, y, z });
        let edge = self.in_object(binding, Vec3f { x: x + radius, y, z }) - center;
        let radius = dot(edge, edge).sqrt();
        std::array::from_fn(|i| {
            let mut normal = [0.0; 3];
            normal[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
            let normal = Vec3f::from_array(normal);
            let uv = sphere_uv(normal);
            let coords = vec4f(uv.x, uv.y, uv.x, uv.y);
            let point = texture_point_at(coords, vec4f(1.0, 1.0, 1.0, 1.0));
            TexturePoint { position: center + normal * radius, normal, ..point }
        })
    }

    /// The middle of a triangle.
    fn middle_of(&self, geometry: &GeometryRecord, binding: usize, index: usize) -> TexturePoint {
        let ones = vec4f(1.0, 1.0, 1.0, 1.0);
        let place = |p: [f32; 3]| self.in_object(binding, Vec3f::from_array(p));
        let corners = self.indices[index];
        let mean = |values: [[f32; 3]; 3]| -> [f32; 3] {
            std::array::from_fn(|k| (values[0][k] + values[1][k] + values[2][k]) / 3.0)
        };
        let uv = |set: &[[f32; 2]], first: u32| {
            let at = |c: u32| {
                if first == NONE {
                    [0.0; 3]
                } else {
                    let [u, v] = set[(first + c) as usize];
                    [u, v, 0.0]
                }
            };
            mean(corners.map(at))
        };
        let (uv0, uv1) = (uv(&self.uv0, geometry.first_uv0), uv(&self.uv1, geometry.first_uv1));
        let position = mean(corners.map(|c| self.positions[(geometry.first_vertex + c) as usize]));
        let coords = vec4f(uv0[0], uv0[1], uv1[0], uv1[1]);
        TexturePoint { position: place(position), ..texture_point_at(coords, ones) }
    }

    /// A point in the space of a bottom-level structure, in that of the user's object.
    pub(super) fn in_object(&self, binding: usize, p: Vec3f) -> Vec3f {
        let Some(rows) = self.placement(&self.bindings[binding]) else { return p };
        let along = |[a, b, c, d]: [f32; 4]| a * p.x + b * p.y + c * p.z + d;
        let [x, y, z] = rows.map(along);
        Vec3f { x, y, z }
    }
}
