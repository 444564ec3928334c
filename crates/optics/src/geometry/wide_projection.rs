//! Projections that show more than a plane film can: panoramas, fisheyes, cube maps.
//!
//! All rays start at one point. A direction is (right, up, forward) of the camera. A point of the
//! film is (0, 0) at its upper left and (1, 1) at its lower right.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod wide_projection {
    use crate::constants::*;
    use crate::math::*;
    use wgsl_rs::std::*;

    /// Unit direction of an equirectangular picture: 360° along its width, 180° along its height.
    pub fn panorama_direction(film: Vec2f) -> Vec3f {
        let azimuth = cos_sin_turns(film.x - 0.5);
        let elevation = cos_sin_turns(0.25 - 0.5 * film.y);
        normalize(vec3f(azimuth.y * elevation.x, elevation.y, azimuth.x * elevation.x))
    }

    /// Where a panorama shows a unit direction: the way back of [`panorama_direction`].
    pub fn panorama_film(direction: Vec3f) -> Vec2f {
        let azimuth = atan2(direction.x, direction.z);
        let elevation = asin(clamp(direction.y, -1.0, 1.0));
        vec2f(0.5 + 0.5 * azimuth / PI, 0.5 - elevation / PI)
    }

    /// The angle of a point of a fisheye's film to the axis, as a vector: to the right and up,
    /// radians. `half_angles`: those at the film's sides.
    pub fn fisheye_angles(film: Vec2f, half_angles: Vec2f) -> Vec2f {
        vec2f((2.0 * film.x - 1.0) * half_angles.x, (1.0 - 2.0 * film.y) * half_angles.y)
    }

    /// Whether a fisheye shows anything at a point of its film: within the circle that touches the
    /// nearer sides.
    pub fn fisheye_sees(film: Vec2f, half_angles: Vec2f) -> bool {
        length(fisheye_angles(film, half_angles)) <= min(half_angles.x, half_angles.y)
    }

    /// Unit direction of an equidistant fisheye: distances from the centre of its film are angles
    /// to the axis.
    pub fn fisheye_direction(film: Vec2f, half_angles: Vec2f) -> Vec3f {
        let angles = fisheye_angles(film, half_angles);
        let theta = length(angles);
        let turn = cos_sin_turns(0.5 * theta / PI);
        let scale = select(1.0, turn.y / theta, theta > 1e-6);
        vec3f(angles.x * scale, angles.y * scale, turn.x)
    }

    /// Where a fisheye shows a unit direction: the way back of [`fisheye_direction`].
    pub fn fisheye_film(direction: Vec3f, half_angles: Vec2f) -> Vec2f {
        let aside = length(vec2f(direction.x, direction.y));
        let theta = atan2(aside, direction.z);
        let scale = 0.5 * theta / max(aside, 1e-20);
        vec2f(0.5 + direction.x * scale / half_angles.x, 0.5 - direction.y * scale / half_angles.y)
    }

    /// Unit direction of a cube map: six square faces side by side, each 90° wide, in the order and
    /// with the orientation that Direct3D, Vulkan and OpenGL give them: right, left, up, down,
    /// forward, back.
    pub fn cubemap_direction(film: Vec2f) -> Vec3f {
        let column = clamp(film.x, 0.0, 1.0) * 6.0;
        let face = min(u32(column), 5u32);
        let s = 2.0 * (column - f32(face)) - 1.0;
        let t = 2.0 * film.y - 1.0;
        let side = select(1.0, -1.0, (face & 1u32) == 1u32);
        let mut direction = vec3f(side, -t, -side * s);
        if face >= 4u32 {
            direction = vec3f(side * s, -t, side);
        } else if face >= 2u32 {
            direction = vec3f(s, side, side * t);
        }
        normalize(direction)
    }

    /// Where a cube map shows a direction: the way back of [`cubemap_direction`].
    pub fn cubemap_film(direction: Vec3f) -> Vec2f {
        let size = abs(direction);
        let mut face = select(4u32, 5u32, direction.z < 0.0);
        let mut st = vec2f(select(direction.x, -direction.x, direction.z < 0.0), -direction.y)
            * (1.0 / max(size.z, 1e-20));
        if size.x >= size.y && size.x >= size.z {
            face = select(0u32, 1u32, direction.x < 0.0);
            st = vec2f(select(-direction.z, direction.z, direction.x < 0.0), -direction.y) * (1.0 / size.x);
        } else if size.y >= size.z {
            face = select(2u32, 3u32, direction.y < 0.0);
            st = vec2f(direction.x, select(direction.z, -direction.z, direction.y < 0.0)) * (1.0 / size.y);
        }
        vec2f((f32(face) + 0.5 + 0.5 * st.x) / 6.0, 0.5 + 0.5 * st.y)
    }
}

#[cfg(test)]
mod tests {
    use super::wide_projection::*;
    use wgsl_rs::std::*;

    const HALF_ANGLES: Vec2f = vec2f(2.4, 1.6);

    #[test]
    fn films_are_the_way_back_of_directions() {
        for i in 0..41 {
            for k in 0..31 {
                let film = vec2f((i as f32 + 0.37) / 41.0, (k as f32 + 0.61) / 31.0);
                let mut ways = vec![
                    ("panorama", panorama_direction(film), panorama_film(panorama_direction(film))),
                    ("cube map", cubemap_direction(film), cubemap_film(cubemap_direction(film))),
                ];
                if fisheye_sees(film, HALF_ANGLES) {
                    let direction = fisheye_direction(film, HALF_ANGLES);
                    ways.push(("fisheye", direction, fisheye_film(direction, HALF_ANGLES)));
                }
                for (name, direction, back) in ways {
                    assert!(
                        (length(direction) - 1.0).abs() < 1e-6,
                        "{name}: {direction:?} is not a unit vector"
                    );
                    assert!(length(back - film) < 2e-5, "{name}: {film:?} came back as {back:?}");
                }
            }
        }
    }

    #[test]
    fn a_fisheye_shows_angles_as_distances_within_its_circle() {
        // 90° aside at half of the height's angle of 180°: the upper edge.
        let half = vec2f(std::f32::consts::PI, std::f32::consts::FRAC_PI_2);
        let close = |film: Vec2f, expected: Vec3f| {
            let direction = fisheye_direction(film, half);
            assert!(length(direction - expected) < 1e-6, "{film:?} shows {direction:?}, not {expected:?}");
        };
        close(vec2f(0.5, 0.5), vec3f(0.0, 0.0, 1.0));
        close(vec2f(0.5, 0.0), vec3f(0.0, 1.0, 0.0));
        close(vec2f(0.625, 0.5), vec3f(0.5f32.sqrt(), 0.0, 0.5f32.sqrt()));
        assert!(fisheye_sees(vec2f(0.74, 0.5), half) && !fisheye_sees(vec2f(0.76, 0.5), half));
        assert!(!fisheye_sees(vec2f(0.74, 0.2), half));
    }

    #[test]
    fn faces_of_a_cube_map_are_those_of_graphics_interfaces() {
        // The middle of each face, and what is to the right of it and below it, by the tables of
        // the Vulkan specification, 16.5.4 "Cube Map Face Selection": +Z is forward.
        let faces = [
            ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]),
            ([-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]),
            ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
            ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
            ([0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ];
        let vector = |v: [f32; 3]| vec3f(v[0], v[1], v[2]);
        for (i, (middle, right, down)) in faces.into_iter().enumerate() {
            let at = |s: f32, t: f32| cubemap_direction(vec2f((i as f32 + s) / 6.0, t));
            let expected = [
                (at(0.5, 0.5), vector(middle)),
                (at(0.75, 0.5), normalize(vector(middle) + vector(right) * 0.5)),
                (at(0.5, 0.75), normalize(vector(middle) + vector(down) * 0.5)),
            ];
            for (direction, expected) in expected {
                assert!(length(direction - expected) < 1e-5, "face {i}: {direction:?}, not {expected:?}");
            }
        }
    }
}
