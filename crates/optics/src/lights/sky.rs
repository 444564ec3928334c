//! What is seen infinitely far away: the gradient sky and equirectangular images.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod sky {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Radiance of a two-colour sky, without its sun.
    ///
    /// - `direction`: unit. `horizon`, `zenith`: radiance at y = 0 and y = 1, linear in the sine of the elevation between.
    /// - `ground`: radiance below the horizon.
    pub fn gradient_sky(direction: Vec3f, horizon: Vec3f, zenith: Vec3f, ground: Vec3f) -> Vec3f {
        let above = horizon + (zenith - horizon) * saturate(direction.y);
        // A narrow blend hides the step where ground and horizon differ.
        let blend = saturate(direction.y * 100.0 + 1.0);
        ground + (above - ground) * blend
    }

    /// Where on an equirectangular image a unit direction is: `(0, 0)` upper left, `(1, 1)` lower right. The centre
    /// column looks towards −Z; `rotation` turns the image counter-clockwise seen from above, in turns.
    pub fn direction_to_equirect(direction: Vec3f, rotation: f32) -> Vec2f {
        let azimuth = atan2(direction.x, -direction.z) * (1.0 / TAU) + rotation + 0.5;
        let polar = acos(clamp(direction.y, -1.0, 1.0)) * INV_PI;
        vec2f(azimuth - floor(azimuth), polar)
    }

    /// The inverse of [`direction_to_equirect`].
    pub fn equirect_to_direction(uv: Vec2f, rotation: f32) -> Vec3f {
        let azimuth = cos_sin_turns(uv.x - 0.5 - rotation);
        let polar = cos_sin_turns(uv.y * 0.5);
        vec3f(polar.y * azimuth.y, polar.x, -polar.y * azimuth.x)
    }

    /// Density over solid angle of a direction chosen with density `pdf_image` over the unit square of the image;
    /// `polar` is v, in `[0, 1]`. The image's rows shrink towards the poles: dω = 2π² sin θ du dv.
    pub fn equirect_pdf(pdf_image: f32, polar: f32) -> f32 {
        let sin_theta = cos_sin_turns(polar * 0.5).y;
        select(0.0, pdf_image / (2.0 * PI * PI * sin_theta), sin_theta > 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::sky::*;
    use wgsl_rs::std::*;

    #[test]
    fn equirect_round_trip() {
        for i in 1..40 {
            for j in 1..20 {
                let uv = vec2f(i as f32 / 40.0, j as f32 / 20.0);
                for rotation in [0.0, 0.3, -0.7] {
                    let back = direction_to_equirect(equirect_to_direction(uv, rotation), rotation);
                    assert!(length(back - uv) < 2e-6, "{uv:?} came back as {back:?}");
                }
            }
        }
        let forward = direction_to_equirect(vec3f(0.0, 0.0, -1.0), 0.0);
        assert!(length(forward - vec2f(0.5, 0.5)) < 1e-6, "{forward:?}");
    }
}
