//! Sampling the environment through portals, and the density of all its techniques together.

use super::EnvironmentTable;
use crate::Portal;
use optics::constants::NONE;
use optics::equirect::rest_of_choice;
use optics::light_tree::light_branch;
use optics::portal::{image_share, portal_mixture};
use optics::portal_triangle::PortalTriangle;
use optics::spherical_triangle::sample_spherical_triangle;
use optics::vector::normalize;
use optics::{Vec3f, vec2f, vec3f};

/// Both halves of a portal.
pub(super) fn halves(portal: &Portal) -> [PortalTriangle; 2] {
    let [a, b, c, d] = portal.corners();
    [[a, b, c], [a, c, d]].map(|corners| PortalTriangle::new(corners.map(|corner| corner.to_array())))
}

impl EnvironmentTable {
    /// Density over solid angle with which [`EnvironmentTable::sample`] chooses unit direction `wi` at `p`; 0 where it is not sampled.
    pub fn pdf(&self, p: Vec3f, wi: Vec3f) -> f32 {
        if self.light == NONE {
            return 0.0;
        }
        if self.portals.is_empty() {
            return self.image_pdf(wi);
        }
        let passed = self.portals.iter().filter(|t| t.is_passed(p, wi)).count();
        self.mixture(wi, passed as u32, self.portal_solid_angle(p))
    }

    /// Samples a unit direction from `p` and its density over solid angle, 0 if there is nothing to sample; `u`: two uniform numbers
    /// in `[0, 1)`.
    ///
    /// By portals, a triangle is chosen in proportion to its solid angle, and then a direction uniform over that. So the density of a
    /// direction is the number of triangles in it, one behind the other, over the sum of all solid angles.
    pub fn sample(&self, p: Vec3f, u: [f32; 2]) -> (Vec3f, f32) {
        if self.portals.is_empty() {
            return self.sample_image(u);
        }
        let solid_angle = self.portal_solid_angle(p);
        let share = image_share(self.width > 0, solid_angle);
        let branch = light_branch(share, 1.0 - share, u[0]);
        let u = [branch.remainder, u[1]];
        if !branch.second {
            let (wi, _) = self.sample_image(u);
            let passed = self.portals.iter().filter(|t| t.is_passed(p, wi)).count();
            return (wi, self.mixture(wi, passed as u32, solid_angle));
        }
        let Some(wi) = self.sample_portals(p, solid_angle, u) else { return (vec3f(0.0, 1.0, 0.0), 0.0) };
        let passed = self.portals.iter().filter(|t| t.is_passed(p, wi)).count();
        // Rounding may put a direction outside of the triangle that it was chosen from.
        (wi, self.mixture(wi, passed.max(1) as u32, solid_angle))
    }

    fn mixture(&self, wi: Vec3f, passed: u32, solid_angle: f32) -> f32 {
        let share = image_share(self.width > 0, solid_angle);
        let image_pdf = if self.width > 0 { self.image_pdf(wi) } else { 0.0 };
        portal_mixture(share, image_pdf, passed, solid_angle)
    }

    /// What is seen of all portals from a point, steradians.
    fn portal_solid_angle(&self, p: Vec3f) -> f32 {
        self.portals.iter().map(|t| t.seen_from(p).solid_angle).sum()
    }

    /// A unit direction through a portal.
    fn sample_portals(&self, p: Vec3f, solid_angle: f32, [u, v]: [f32; 2]) -> Option<Vec3f> {
        let mut left = u * solid_angle;
        let mut chosen = None;
        for triangle in &self.portals {
            let seen = triangle.seen_from(p);
            if seen.solid_angle > 0.0 {
                chosen = Some((triangle, seen, left));
                if left < seen.solid_angle {
                    break;
                }
                left -= seen.solid_angle;
            }
        }
        let (triangle, seen, left) = chosen?;
        let u = rest_of_choice(left, seen.solid_angle);
        let at = sample_spherical_triangle(seen, vec2f(u, v));
        Some(normalize(triangle.towards(p, at)))
    }
}
