//! Cameras: from a point on the film to a ray.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod camera {
    use crate::constants::*;
    use crate::distortion::*;
    use crate::warp::*;
    use crate::wide_projection::*;
    use wgsl_rs::std::*;

    /// Perspective projection, with a thin lens if the lens radius is not zero.
    pub const CAMERA_PERSPECTIVE: u32 = 0u32;
    /// Parallel projection.
    pub const CAMERA_ORTHOGRAPHIC: u32 = 1u32;
    /// Equirectangular panorama: 360° × 180°.
    pub const CAMERA_PANORAMA: u32 = 2u32;
    /// Equidistant fisheye: a circle of any angle.
    pub const CAMERA_FISHEYE: u32 = 3u32;
    /// Cube map: six squares side by side.
    pub const CAMERA_CUBEMAP: u32 = 4u32;

    /// A camera ready to make rays. World space, metres.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CameraFrame {
        /// Which projection: `CAMERA_…`.
        pub kind: u32,
        /// Where the pinhole, the lens' centre or the film plane's centre is.
        pub origin: Vec3f,
        /// Unit vector to the right of the picture.
        pub right: Vec3f,
        /// Unit vector to the top of the picture.
        pub up: Vec3f,
        /// From the pinhole to the centre of the film at distance 1: the unit axis, plus, for perspective, what the film is
        /// shifted aside.
        pub forward: Vec3f,
        /// Half of the film's width and height: at distance 1 for perspective, in metres for orthographic, radians for a
        /// fisheye.
        pub half_size: Vec2f,
        /// Radius of the lens; 0 is a pinhole.
        pub lens_radius: f32,
        /// Distance of the plane in focus, along `forward`, positive.
        pub focus_distance: f32,
        /// How a perspective differs from that of a pinhole.
        pub distortion: Distortion,
    }

    /// A ray that leaves the camera.
    #[derive(Clone, Copy, Debug)]
    pub struct CameraRay {
        /// Where it starts.
        pub origin: Vec3f,
        /// Unit direction.
        pub direction: Vec3f,
        /// Share of its light that reaches the film: 1, or 0 outside of a lens' field. Such a ray hits nothing.
        pub weight: f32,
    }

    /// A point along a ray, metres from its origin.
    pub fn camera_ray_point(ray: CameraRay, distance: f32) -> Vec3f {
        ray.origin + ray.direction * distance
    }

    /// Distance of a point from the eye along a unit `axis`, metres.
    pub fn view_depth(position: Vec3f, eye: Vec3f, axis: Vec3f) -> f32 {
        dot(position - eye, axis)
    }

    /// What reaches the film of the radiance that a ray sees.
    pub fn seen_radiance(ray: CameraRay, radiance: Vec3f) -> Vec3f {
        ray.weight * radiance
    }

    /// Radius of a pixel's footprint at a distance; `spread`: of [`camera_pixel_spread`].
    pub fn pixel_footprint(spread: f32, distance: f32) -> f32 {
        spread * distance
    }

    /// Position on the film of a point of a picture, both from the upper left: pixels, of `size` pixels.
    pub fn film_position(at: Vec2f, size: Vec2f) -> Vec2f {
        at / size
    }

    /// The ray through a point of the film.
    ///
    /// - `film`: position on the film, `(0, 0)` upper left to `(1, 1)` lower right.
    /// - `u_lens`: uniform numbers for the point on the lens.
    pub fn camera_ray(camera: CameraFrame, film: Vec2f, u_lens: Vec2f) -> CameraRay {
        if camera.kind != CAMERA_PERSPECTIVE || camera.distortion.model == DISTORTION_NONE {
            return undistorted_camera_ray(camera, film, u_lens);
        }
        let through_center = pinhole_direction(camera, film);
        let axis = cross(camera.up, camera.right);
        let seen = vec2f(dot(through_center, camera.right), -dot(through_center, camera.up));
        let lens = lens_direction(camera.distortion, seen);
        if !lens.valid {
            let nowhere = beyond_everything(camera.origin, axis);
            return CameraRay { origin: nowhere, direction: axis, weight: 0.0 };
        }
        let d = lens.direction;
        thin_lens_ray(camera, camera.right * d.x - camera.up * d.y + axis * d.z, u_lens)
    }

    /// As [`camera_ray`], of a camera whose distortion does not count.
    pub fn undistorted_camera_ray(camera: CameraFrame, film: Vec2f, u_lens: Vec2f) -> CameraRay {
        if camera.kind == CAMERA_PERSPECTIVE {
            return thin_lens_ray(camera, pinhole_direction(camera, film), u_lens);
        }
        if camera.kind == CAMERA_ORTHOGRAPHIC {
            let x = (2.0 * film.x - 1.0) * camera.half_size.x;
            let y = (1.0 - 2.0 * film.y) * camera.half_size.y;
            let on_film = camera.right * x + camera.up * y;
            return CameraRay { origin: camera.origin + on_film, direction: camera.forward, weight: 1.0 };
        }
        if !wide_sees(camera.kind, film, camera.half_size) {
            let nowhere = beyond_everything(camera.origin, camera.forward);
            return CameraRay { origin: nowhere, direction: camera.forward, weight: 0.0 };
        }
        let seen = wide_direction(camera.kind, film, camera.half_size);
        let direction = camera.right * seen.x + camera.up * seen.y + camera.forward * seen.z;
        CameraRay { origin: camera.origin, direction: normalize(direction), weight: 1.0 }
    }

    /// Whether a projection without a plane film shows anything at a point of its film.
    pub fn wide_sees(kind: u32, film: Vec2f, half_size: Vec2f) -> bool {
        kind != CAMERA_FISHEYE || fisheye_sees(film, half_size)
    }

    /// Unit direction (right, up, forward) that a projection without a plane film shows.
    pub fn wide_direction(kind: u32, film: Vec2f, half_size: Vec2f) -> Vec3f {
        if kind == CAMERA_FISHEYE {
            return fisheye_direction(film, half_size);
        }
        if kind == CAMERA_CUBEMAP {
            return cubemap_direction(film);
        }
        panorama_direction(film)
    }

    /// Where such a projection shows a unit direction: the way back of [`wide_direction`]. What a
    /// fisheye does not see is outside of its circle.
    pub fn wide_film(kind: u32, direction: Vec3f, half_size: Vec2f) -> Vec2f {
        if kind == CAMERA_FISHEYE {
            return fisheye_film(direction, half_size);
        }
        if kind == CAMERA_CUBEMAP {
            return cubemap_film(direction);
        }
        panorama_film(direction)
    }

    /// From the pinhole to a point of the film at distance 1.
    pub fn pinhole_direction(camera: CameraFrame, film: Vec2f) -> Vec3f {
        let x = (2.0 * film.x - 1.0) * camera.half_size.x;
        let y = (1.0 - 2.0 * film.y) * camera.half_size.y;
        camera.right * x + camera.up * y + camera.forward
    }

    /// The ray through a point of a thin lens, of the rays that a pinhole would send in direction `through_center`, which has
    /// length 1 along the axis. Kolb et al. 1995: all rays through one film point meet on the plane in focus.
    pub fn thin_lens_ray(camera: CameraFrame, through_center: Vec3f, u_lens: Vec2f) -> CameraRay {
        if camera.lens_radius <= 0.0 {
            return CameraRay { origin: camera.origin, direction: normalize(through_center), weight: 1.0 };
        }
        let lens = sample_disk(u_lens) * camera.lens_radius;
        let on_lens = camera.right * lens.x + camera.up * lens.y;
        let direction = through_center * camera.focus_distance - on_lens;
        CameraRay { origin: camera.origin + on_lens, direction: normalize(direction), weight: 1.0 }
    }

    /// How far what a ray through a pinhole meets lies along the camera's axis, metres; for a camera that sees to all
    /// sides, along the ray. `direction`: the ray's, of unit length; `distance`: along it.
    pub fn camera_depth(camera: CameraFrame, direction: Vec3f, distance: f32) -> f32 {
        if camera.kind == CAMERA_PERSPECTIVE || camera.kind == CAMERA_ORTHOGRAPHIC {
            return distance * dot(direction, cross(camera.up, camera.right));
        }
        distance
    }

    /// Where a camera shows something on its film, from `(0, 0)` at the upper left to `(1, 1)`; the third component is 1
    /// where it does, and 0 for what is behind it or outside of its field. The way back of [`camera_ray`].
    ///
    /// - `offset`: position relative to [`CameraFrame`]'s origin, or the direction of what is infinitely far away.
    pub fn shown_at(camera: CameraFrame, offset: Vec3f) -> Vec3f {
        let axis = cross(camera.up, camera.right);
        let seen = vec3f(dot(offset, camera.right), dot(offset, camera.up), dot(offset, axis));
        let mut at = vec2f(seen.x, seen.y);
        let mut shown = 1.0;
        if camera.kind == CAMERA_PERSPECTIVE {
            if camera.distortion.model == DISTORTION_NONE {
                shown = select(0.0, 1.0, seen.z > 0.0);
                at *= 1.0 / max(seen.z, 1e-30);
            } else {
                let lens = lens_film(camera.distortion, normalize(vec3f(seen.x, -seen.y, seen.z)));
                shown = select(0.0, 1.0, lens.valid);
                at = vec2f(lens.direction.x, -lens.direction.y);
            }
            // The film's centre may be off the axis.
            at -= vec2f(dot(camera.forward, camera.right), dot(camera.forward, camera.up));
        } else if camera.kind != CAMERA_ORTHOGRAPHIC {
            let wide = wide_film(camera.kind, normalize(seen), camera.half_size);
            return vec3f(wide.x, wide.y, select(0.0, 1.0, wide_sees(camera.kind, wide, camera.half_size)));
        }
        vec3f(0.5 + 0.5 * at.x / camera.half_size.x, 0.5 - 0.5 * at.y / camera.half_size.y, shown)
    }

    /// By how many pixels to the right and down something is shown off a `place` of a picture of `size` pixels;
    /// the third component and `offset` are those of [`shown_at`].
    pub fn shown_motion(camera: CameraFrame, offset: Vec3f, place: Vec2f, size: Vec2f) -> Vec3f {
        let film = shown_at(camera, offset);
        let moved = vec2f(film.x, film.y) * size - place;
        vec3f(moved.x, moved.y, film.z)
    }

    /// How bright a white surface is under a light at the camera, with some light from all around.
    ///
    /// - `cos_theta`: between the viewing direction and the shading normal.
    pub fn headlight(cos_theta: f32) -> f32 {
        0.2 + 0.8 * max(cos_theta, 0.0)
    }

    /// A surface's colour under [`headlight`]. `wo`, `normal`: unit vectors to the camera and away from the surface.
    pub fn headlit_color(color: Vec3f, wo: Vec3f, normal: Vec3f) -> Vec3f {
        color * headlight(dot(wo, normal))
    }

    /// How fast the footprint of a pixel grows with distance along its ray: metres of radius per metre. Used to filter
    /// procedural textures. `height`: picture height in pixels.
    pub fn camera_pixel_spread(camera: CameraFrame, height: f32) -> f32 {
        if camera.kind == CAMERA_ORTHOGRAPHIC {
            return 0.0;
        }
        select(camera.half_size.y, HALF_PI, camera.kind == CAMERA_PANORAMA) / height
    }
}

#[cfg(test)]
mod tests {
    use super::camera::*;
    use wgsl_rs::std::*;

    fn camera(kind: u32) -> CameraFrame {
        CameraFrame {
            kind,
            origin: vec3f(1.0, 2.0, 3.0),
            right: vec3f(1.0, 0.0, 0.0),
            up: vec3f(0.0, 1.0, 0.0),
            forward: vec3f(0.0, 0.0, -1.0),
            half_size: vec2f(0.8, 0.5),
            lens_radius: 0.0,
            focus_distance: 4.0,
            distortion: crate::distortion::no_distortion(),
        }
    }

    #[test]
    fn distorted_rays_are_those_of_the_lens_and_leave_the_rest_black() {
        let mut c = camera(CAMERA_PERSPECTIVE);
        c.distortion =
            crate::distortion::Distortion::brown_conrady([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2], 0.0);
        // At 0.8 · 0.25 focal lengths to the right the lens shows r (1 − r²) = 0.2: r = 0.20914.
        let ray = camera_ray(c, vec2f(0.625, 0.5), vec2f(0.0, 0.0));
        let expected = normalize(vec3f(0.209_149, 0.0, -1.0));
        assert!(ray.weight == 1.0 && length(ray.direction - expected) < 1e-5, "{ray:?}");
        let outside = camera_ray(c, vec2f(1.0, 0.5), vec2f(0.0, 0.0));
        assert!(outside.weight == 0.0 && outside.origin.z < -1e17, "{outside:?}");
        // A film that leans: what is higher is further to one side.
        c.distortion = crate::distortion::Distortion::brown_conrady([0.0; 6], [0.0; 2], 0.1);
        let ray = camera_ray(c, vec2f(0.5, 0.0), vec2f(0.0, 0.0));
        assert!(length(ray.direction - normalize(vec3f(0.05, 0.5, -1.0))) < 1e-6, "{ray:?}");
    }

    #[test]
    fn what_a_ray_sees_is_shown_where_the_ray_began() {
        let lens =
            crate::distortion::Distortion::brown_conrady([-0.1, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2], 0.05);
        let plain = crate::distortion::no_distortion();
        let kinds =
            [CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA, CAMERA_FISHEYE, CAMERA_CUBEMAP];
        for (kind, distortion) in kinds.into_iter().flat_map(|kind| [(kind, plain), (kind, lens)]) {
            let mut c = camera(kind);
            c.distortion = distortion;
            if kind == CAMERA_PERSPECTIVE {
                c.forward = vec3f(0.1, -0.05, -1.0);
            }
            // Not on an edge between faces of a cube.
            for (x, y) in [(0.45, 0.5), (0.3, 0.6), (0.7, 0.25)] {
                let ray = camera_ray(c, vec2f(x, y), vec2f(0.0, 0.0));
                let offset = camera_ray_point(ray, 4.0) - c.origin;
                let back = shown_at(c, offset);
                assert!(
                    (back.x - x).abs() < 1e-4 && (back.y - y).abs() < 1e-4,
                    "{kind}: ({x}, {y}) as {back:?}"
                );
                assert_eq!(back.z, 1.0);
                let moved = shown_motion(c, offset, vec2f(x * 40.0 - 3.0, y * 20.0 + 2.0), vec2f(40.0, 20.0));
                assert!((moved.x - 3.0).abs() < 0.01 && (moved.y + 2.0).abs() < 0.01, "{moved:?}");
                let flat = kind == CAMERA_PERSPECTIVE || kind == CAMERA_ORTHOGRAPHIC;
                let along = if flat { -offset.z } else { 4.0 };
                assert!((camera_depth(c, ray.direction, 4.0) - along).abs() < 1e-5, "{kind}");
            }
        }
        assert_eq!(shown_at(camera(CAMERA_PERSPECTIVE), vec3f(0.1, 0.2, 3.0)).z, 0.0, "behind the camera");
    }

    #[test]
    fn perspective_corners_span_the_field_of_view() {
        let ray = camera_ray(camera(CAMERA_PERSPECTIVE), vec2f(0.0, 0.0), vec2f(0.3, 0.4));
        let expected = normalize(vec3f(-0.8, 0.5, -1.0));
        assert!(length(ray.direction - expected) < 1e-6, "upper left ray {ray:?}");
        assert_eq!(ray.origin, vec3f(1.0, 2.0, 3.0));
    }

    #[test]
    fn rays_through_a_lens_meet_on_the_plane_in_focus() {
        let mut c = camera(CAMERA_PERSPECTIVE);
        c.lens_radius = 0.2;
        let film = vec2f(0.8, 0.3);
        let sharp = camera_ray(camera(CAMERA_PERSPECTIVE), film, vec2f(0.0, 0.0));
        let focus = sharp.origin + sharp.direction * (c.focus_distance / -sharp.direction.z);
        for i in 0..64 {
            let ray = camera_ray(c, film, vec2f(i as f32 / 64.0, (i * 7 % 64) as f32 / 64.0));
            let at = ray.origin + ray.direction * ((focus.z - ray.origin.z) / ray.direction.z);
            assert!(length(at - focus) < 1e-4, "ray {ray:?} passes the focus at {at:?}, not {focus:?}");
            assert!(length(ray.origin - c.origin) <= 0.2 + 1e-6);
        }
    }

    #[test]
    fn fisheyes_are_black_outside_of_their_circle() {
        let mut c = camera(CAMERA_FISHEYE);
        c.half_size = vec2f(3.0, 1.5);
        let top = camera_ray(c, vec2f(0.5, 0.001), vec2f(0.0, 0.0));
        assert!(top.weight == 1.0 && top.direction.y > 0.99, "{top:?}");
        let corner = camera_ray(c, vec2f(0.05, 0.05), vec2f(0.0, 0.0));
        assert!(corner.weight == 0.0 && corner.origin.z < -1e17, "{corner:?}");
    }

    #[test]
    fn orthographic_rays_are_parallel_and_panorama_covers_the_sphere() {
        let a = camera_ray(camera(CAMERA_ORTHOGRAPHIC), vec2f(0.1, 0.9), vec2f(0.0, 0.0));
        assert_eq!(a.direction, vec3f(0.0, 0.0, -1.0));
        let center = camera_ray(camera(CAMERA_PANORAMA), vec2f(0.5, 0.5), vec2f(0.0, 0.0)).direction;
        assert!(length(center - vec3f(0.0, 0.0, -1.0)) < 1e-6, "{center:?}");
        let right = camera_ray(camera(CAMERA_PANORAMA), vec2f(0.75, 0.5), vec2f(0.0, 0.0)).direction;
        assert!(length(right - vec3f(1.0, 0.0, 0.0)) < 1e-6, "{right:?}");
        let top = camera_ray(camera(CAMERA_PANORAMA), vec2f(0.3, 0.0), vec2f(0.0, 0.0)).direction;
        assert!(length(top - vec3f(0.0, 1.0, 0.0)) < 1e-6, "{top:?}");
    }
}
