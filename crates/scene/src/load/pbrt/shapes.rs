//! Shapes: triangle meshes, PLY files, bilinear patches, spheres and disks.

use super::parameters::Parameters;
use super::{Builder, MAX_INSTANCES, PlacedShape};
use crate::load::ply;
use crate::load::session::{TRIANGLE, instance};
use crate::subdivision::{Displacement, DisplacementSpace, Rate, Refinement, Scheme};
use crate::{Instance, LoadError, Mesh, Shape, Sphere, TextureRef, TriangleMesh};
use elementary::{cbrt, sin_cos};
use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec2, Vec3};

/// Corners of a disk.
const DISK_CORNERS: u32 = 96;

/// How a shape is subdivided.
struct Surface {
    scheme: Scheme,
    rate: Rate,
    /// Displaces it along its normals, metres.
    heights: Option<TextureRef>,
}

impl Surface {
    fn of(self, mut refinement: Refinement) -> Refinement {
        (refinement.scheme, refinement.rate) = (self.scheme, self.rate);
        // pbrt's borders are smooth all around.
        refinement.cage.round_corners = true;
        let space = DisplacementSpace::Normal;
        let displacement = |texture| Displacement { texture, scale: 1.0, midlevel: 0.0, space };
        refinement.displacement = self.heights.map(displacement);
        refinement
    }
}

impl Builder<'_> {
    pub(super) fn add_shape(&mut self, kind: &str, p: &Parameters) -> Result<(), LoadError> {
        if let Some(alpha) = p.number("alpha").filter(|a| *a < 1.0) {
            self.report.ignored(format!("{}: the shape's alpha {alpha} is taken as 1", p.place));
        }
        let mut anchor = DVec3::ZERO;
        let mut refine = None;
        let shape = match kind {
            "trianglemesh" | "loopsubdiv" => {
                if kind == "loopsubdiv" {
                    let levels = p.number_or("levels", 3.0).clamp(0.0, Rate::MOST_LEVELS as f32);
                    refine = Some(Surface {
                        scheme: Scheme::Loop,
                        rate: Rate::Levels(levels as u32),
                        heights: None,
                    });
                }
                Some(Shape::Triangles(self.triangle_mesh(p)?))
            }
            "bilinearmesh" => Some(Shape::Triangles(self.bilinear_mesh(p)?)),
            "plymesh" => match self.ply_mesh(p)? {
                Some((mesh, own)) => {
                    anchor = own;
                    refine = self.displaced(p);
                    Some(Shape::Triangles(mesh))
                }
                None => None,
            },
            "sphere" => Some(self.sphere(p)),
            "disk" => Some(Shape::Triangles(self.disk(p))),
            other => {
                self.report.ignored(format!("{}: the shape {other} is not drawn", p.place));
                None
            }
        };
        let Some(mut shape) = shape else { return Ok(()) };
        let two_sided_material = match &mut shape {
            Shape::Triangles(mesh) if mesh.indices.is_empty() => return Ok(()),
            Shape::Triangles(mesh) => {
                face_normals(mesh);
                if self.state.reversed {
                    mesh.indices.iter_mut().for_each(|t| t.swap(1, 2));
                    mesh.normals.iter_mut().for_each(|n| *n = -*n);
                }
                true
            }
            Shape::Spheres(_) => false,
        };
        let is_sphere = matches!(shape, Shape::Spheres(_));
        let material = self.shape_material(two_sided_material);
        let mesh = self.scene.meshes.len() as u32;
        let name = format!("{kind} {mesh}");
        let triangles = if let Shape::Triangles(mesh) = &shape { mesh.indices.len() as u64 } else { 1 };
        self.options.budget().take(triangles * TRIANGLE + instance(name.len()), "shapes")?;
        let mut stored = Mesh::single(name.clone(), shape, material);
        let own = stored.anchor();
        stored.subtract(own);
        if let Some(surface) = refine {
            let refinement = Refinement::of_mesh(mesh, &stored, false);
            self.scene.refinements.extend(refinement.map(|refinement| surface.of(refinement)));
        }
        self.scene.meshes.push(stored);
        // Texture coordinates of pbrt's spheres go around z from x to y, ours around y from z to x.
        let axes = if is_sphere { DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X) } else { DMat3::IDENTITY };
        let stored = DAffine3::from_translation(own);
        self.place(name, mesh, &(DAffine3::from_translation(anchor) * DAffine3::from_mat3(axes) * stored), p)
    }

    /// Puts a mesh into the object that is being defined, or into the world.
    ///
    /// - `anchor`: from the mesh as it is stored to the space of the shape.
    fn place(&mut self, name: String, mesh: u32, anchor: &DAffine3, p: &Parameters) -> Result<(), LoadError> {
        let transform = self.state.transform * *anchor;
        if let Some((_, shapes)) = &mut self.object {
            shapes.push(PlacedShape { name, mesh, transform });
            if self.state.moves() {
                self.report
                    .approximated(format!("{}: shapes inside of objects do not move; objects do", p.place));
            }
            return Ok(());
        }
        if self.scene.instances.len() >= MAX_INSTANCES {
            return Err(self.parser.error(&p.place, format!("there are more than {MAX_INSTANCES} shapes")));
        }
        self.worlds.push(self.mirror * transform);
        self.ends.push(self.state.moves().then(|| self.mirror * self.state.end * *anchor));
        self.scene.instances.push(Instance::new(name, mesh, Affine3A::IDENTITY));
        Ok(())
    }

    /// The displacement of a mesh along its normals, if it has one. Edges are as short as `edgelength` in the world.
    fn displaced(&mut self, p: &Parameters) -> Option<Surface> {
        let length = p.number_or("edgelength", 1.0);
        p.texture("displacement")?;
        let heights = self.value(p, "displacement", Vec3::ZERO);
        let heights = self.graph_of(heights)?;
        let volume = self.state.transform.matrix3.determinant().abs();
        let unit = if volume > 0.0 { cbrt(volume) as f32 } else { 1.0 };
        let most = if length > 0.0 { length / unit } else { 1.0 };
        let rate = Rate::Length { most, levels: Rate::USUAL_LEVELS };
        Some(Surface { scheme: Scheme::Linear, rate, heights: Some(heights) })
    }

    fn triangle_mesh(&mut self, p: &Parameters) -> Result<TriangleMesh, LoadError> {
        let positions = p.vectors("P");
        let corners = self.indices(p, positions.len())?;
        let corners = if corners.is_empty() && positions.len() == 3 { vec![0, 1, 2] } else { corners };
        let indices = corners.as_chunks::<3>().0.to_vec();
        Ok(self.mesh(p, positions, indices))
    }

    /// Patches whose corners are in the order (0, 0), (1, 0), (0, 1), (1, 1).
    fn bilinear_mesh(&mut self, p: &Parameters) -> Result<TriangleMesh, LoadError> {
        let positions = p.vectors("P");
        let corners = self.indices(p, positions.len())?;
        let corners = if corners.is_empty() && positions.len() == 4 { vec![0, 1, 2, 3] } else { corners };
        let triangles =
            corners.as_chunks::<4>().0.iter().flat_map(|[a, b, c, d]| [[*a, *b, *d], [*a, *d, *c]]);
        let indices = triangles.collect();
        self.report.approximated("bilinear patches are drawn as two triangles each");
        Ok(self.mesh(p, positions, indices))
    }

    fn mesh(&mut self, p: &Parameters, positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> TriangleMesh {
        let count = positions.len();
        let normals: Vec<Vec3> = p.vectors("N").iter().map(|n| n.normalize_or(Vec3::Y)).collect();
        let uvs = if p.numbers("uv").is_empty() { p.numbers("st") } else { p.numbers("uv") };
        // v grows upwards in pbrt.
        let uv0: Vec<Vec2> = uvs.as_chunks::<2>().0.iter().map(|[u, v]| Vec2::new(*u, 1.0 - v)).collect();
        if p.numbers("S").len() / 3 == count && count > 0 {
            self.report.info("tangents of meshes are not used");
        }
        let fits = |n: usize| n == count;
        let mut mesh = TriangleMesh {
            normals: if fits(normals.len()) { normals } else { Vec::new() },
            uv0: if fits(uv0.len()) { uv0 } else { Vec::new() },
            positions,
            indices,
            ..TriangleMesh::default()
        };
        let before = mesh.indices.len();
        let finite = &mesh.positions;
        mesh.indices.retain(|t| t.iter().all(|i| finite[*i as usize].is_finite()));
        mesh.positions.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = Vec3::ZERO);
        mesh.uv0.iter_mut().filter(|uv| !uv.is_finite()).for_each(|uv| *uv = Vec2::ZERO);
        if mesh.indices.len() < before {
            self.report.repaired(format!("{}: triangles that are not finite were left out", p.place));
        }
        mesh
    }

    /// The shape's indices, each less than `count`.
    fn indices(&self, p: &Parameters, count: usize) -> Result<Vec<u32>, LoadError> {
        let index = |number: &f32| {
            let index = *number as u32;
            if index as f32 == *number && (index as usize) < count {
                return Ok(index);
            }
            Err(self.parser.error(&p.place, format!("{number} is not the index of one of {count} points")))
        };
        p.numbers("indices").iter().map(index).collect()
    }

    /// A mesh, and the point of the shape's space that it is stored relative to.
    fn ply_mesh(&mut self, p: &Parameters) -> Result<Option<(TriangleMesh, DVec3)>, LoadError> {
        let Some(name) = p.text("filename") else {
            return Err(self.parser.error(&p.place, "plymesh has no filename"));
        };
        let path = self.parser.resolve(&p.place, name);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
            self.report.ignored(format!("{}: {name} is compressed by gzip, which is not read", p.place));
            return Ok(None);
        }
        // Meshes without normals are flat in pbrt.
        let options = crate::LoadOptions { crease_angle: 0.0, ..self.options.clone() };
        let loaded = ply::load_mesh(&path, &options)?;
        self.report.absorb(name, loaded.report);
        let instance = loaded.scene.instances.first();
        let anchor = instance.map(|i| loaded.scene.to_world(i.transform.translation.into()));
        let mesh = loaded.scene.meshes.into_iter().next().and_then(|mesh| mesh.parts.into_iter().next());
        Ok(mesh.and_then(|part| match part.shape {
            Shape::Triangles(mesh) => Some((mesh, anchor.unwrap_or_default())),
            Shape::Spheres(_) => None,
        }))
    }

    fn sphere(&mut self, p: &Parameters) -> Shape {
        let radius = p.number_or("radius", 1.0).abs();
        let cut = p.number_or("zmin", -radius) > -radius
            || p.number_or("zmax", radius) < radius
            || p.number_or("phimax", 360.0) < 360.0;
        if cut {
            self.report.approximated(format!("{}: a part of a sphere is drawn as a whole one", p.place));
        }
        if self.state.reversed && self.state.area_light.is_some_and(|light| !light.two_sided) {
            self.report.approximated(format!("{}: a sphere that shines inwards shines outwards", p.place));
        }
        Shape::Spheres(vec![Sphere { center: Vec3::ZERO, radius }])
    }

    fn disk(&mut self, p: &Parameters) -> TriangleMesh {
        let (height, radius) = (p.number_or("height", 0.0), p.number_or("radius", 1.0));
        let inner = p.number_or("innerradius", 0.0).clamp(0.0, radius.max(0.0));
        if p.number_or("phimax", 360.0) < 360.0 {
            self.report.approximated(format!("{}: a sector of a disk is drawn as a whole disk", p.place));
        }
        self.report.approximated(format!("disks are drawn with {DISK_CORNERS} corners"));
        let mut mesh = TriangleMesh::default();
        for corner in 0..DISK_CORNERS {
            let (sin, cos) = sin_cos(corner as f32 / DISK_CORNERS as f32 * std::f32::consts::TAU);
            mesh.positions.push(Vec3::new(cos * radius, sin * radius, height));
            mesh.positions.push(Vec3::new(cos * inner, sin * inner, height));
            let next = (corner + 1) % DISK_CORNERS;
            let (a, b, c, d) = (2 * corner, 2 * corner + 1, 2 * next, 2 * next + 1);
            mesh.indices.push([a, c, d]);
            if inner > 0.0 {
                mesh.indices.push([a, d, b]);
            }
        }
        mesh
    }
}

/// Turns triangles round whose winding opposes their normals: in pbrt the normals say which side is outside, where
/// lamps shine and dielectrics begin.
fn face_normals(mesh: &mut TriangleMesh) {
    if mesh.normals.is_empty() {
        return;
    }
    for triangle in &mut mesh.indices {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        let normals = triangle.map(|i| mesh.normals[i as usize].as_dvec3());
        if (b - a).cross(c - a).dot(normals[0] + normals[1] + normals[2]) < 0.0 {
            triangle.swap(1, 2);
        }
    }
}
