//! Half of a portal, as all back ends read it.

use crate::portal::triangle_is_passed;
use crate::spherical_triangle::{SphericalTriangle, spherical_triangle_new};
use bytemuck::NoUninit;
use wgsl_rs::std::{Vec2f, Vec3f, vec3f};

/// A triangle through which the environment is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, NoUninit)]
#[repr(C)]
pub struct PortalTriangle {
    /// First vertex, world space.
    pub first: [f32; 3],
    /// From there to the second vertex.
    pub edge1: [f32; 3],
    /// From the first vertex to the third.
    pub edge2: [f32; 3],
}

fn vector(v: [f32; 3]) -> Vec3f {
    vec3f(v[0], v[1], v[2])
}

impl PortalTriangle {
    /// The triangle of three corners, world space.
    pub fn new([a, b, c]: [[f32; 3]; 3]) -> Self {
        let edge = |to: [f32; 3]| std::array::from_fn(|i| to[i] - a[i]);
        Self { first: a, edge1: edge(b), edge2: edge(c) }
    }

    /// What a point sees of it.
    pub fn seen_from(&self, p: Vec3f) -> SphericalTriangle {
        spherical_triangle_new(vector(self.first) - p, vector(self.edge1), vector(self.edge2))
    }

    /// Whether it counts from a point, and a ray in unit direction `wi` passes it.
    pub fn is_passed(&self, p: Vec3f, wi: Vec3f) -> bool {
        let (to_first, edge1, edge2) = (vector(self.first) - p, vector(self.edge1), vector(self.edge2));
        triangle_is_passed(to_first, edge1, edge2, wi) && self.seen_from(p).solid_angle > 0.0
    }

    /// From a point to the place on the triangle with barycentric coordinates `at`.
    pub fn towards(&self, p: Vec3f, at: Vec2f) -> Vec3f {
        vector(self.first) - p + vector(self.edge1) * at.x + vector(self.edge2) * at.y
    }
}
