//! Portals: openings that the environment is seen through, as triangles.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod portal {
    use wgsl_rs::std::*;

    /// Share of the environment's samples that its image chooses where there are portals, too.
    ///
    /// Portals know where light comes in, the image where it is bright, as the sun is. Neither is far from the better of both if each
    /// has half of the samples.
    pub const IMAGE_SHARE: f32 = 0.5;

    /// Probability with which a direction towards the environment is chosen by its image, not by portals.
    ///
    /// - `has_image`: whether the environment is an image. `solid_angle`: of all portals, as seen from the receiver.
    pub fn image_share(has_image: bool, solid_angle: f32) -> f32 {
        select(0.0, select(1.0, IMAGE_SHARE, solid_angle > 0.0), has_image)
    }

    /// Density over solid angle of a direction towards the environment that either technique may have chosen.
    ///
    /// - `share`: of the image, by [`image_share`]. `image_pdf`: its density in this direction.
    /// - `passed`: portals in this direction, one behind the other. `solid_angle`: the sum of what is seen of all portals.
    pub fn portal_mixture(share: f32, image_pdf: f32, passed: u32, solid_angle: f32) -> f32 {
        let by_portals = select(0.0, f32(passed) / solid_angle, passed > 0u32);
        share * image_pdf + (1.0 - share) * by_portals
    }

    /// Whether a ray from a point in direction `wi` goes through a triangle.
    ///
    /// - `to_first`: from the point to the first vertex. `edge1`, `edge2`: from there to the others.
    pub fn triangle_is_passed(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f, wi: Vec3f) -> bool {
        // On which side of the planes through the point and an edge, and whether the triangle is ahead.
        let first = dot(wi, cross(to_first, edge1));
        let second = dot(wi, cross(to_first + edge1, edge2 - edge1));
        let third = dot(wi, cross(edge2, to_first));
        let normal = cross(edge1, edge2);
        let ahead = dot(wi, normal) * dot(to_first, normal) > 0.0;
        let left = first >= 0.0 && second >= 0.0 && third >= 0.0;
        let right = first <= 0.0 && second <= 0.0 && third <= 0.0;
        ahead && (left || right)
    }
}
