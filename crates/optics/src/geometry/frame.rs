//! Orthonormal frames around a surface normal.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod frame {
    use crate::math::*;
    use wgsl_rs::std::*;

    /// An orthonormal, right-handed frame: local +Z is the normal.
    #[derive(Clone, Copy, Debug)]
    pub struct Frame {
        /// Local +X in world space.
        pub tangent: Vec3f,
        /// Local +Y in world space.
        pub bitangent: Vec3f,
        /// Local +Z in world space.
        pub normal: Vec3f,
    }

    /// Cosine of the angle between two unit vectors.
    pub fn unit_cosine(a: Vec3f, b: Vec3f) -> f32 {
        dot(a, b)
    }

    /// A frame around a unit normal, with an arbitrary but continuous tangent except across `normal.z = −0.55`.
    ///
    /// Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017, who change signs at 0. But walls,
    /// floors and ceilings have z = 0, or what rounding makes of it, and would get one frame here and another there;
    /// few surfaces have −0.55, and the divisor is still far from zero.
    pub fn frame_from_normal(normal: Vec3f) -> Frame {
        let sign = select(-1.0, 1.0, normal.z >= -0.55);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Frame {
            tangent: vec3f(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: vec3f(b, sign + normal.y * normal.y * a, -normal.y),
            normal: normal,
        }
    }

    /// A frame around a unit normal whose +X is as near to `tangent` as possible; any frame where that is undefined.
    pub fn frame_from_tangent(normal: Vec3f, tangent: Vec3f) -> Frame {
        let projected = tangent - normal * dot(normal, tangent);
        let length2 = dot(projected, projected);
        if length2 > 1e-12 {
            let x = projected * (1.0 / sqrt(length2));
            return Frame { tangent: x, bitangent: cross(normal, x), normal: normal };
        }
        frame_from_normal(normal)
    }

    /// The frame of a tangent-space map about `normal`, which is on the viewer's side.
    ///
    /// - `tangent`: of the front. `handedness`: of the front's bitangent, 1 or −1; 0: there is no tangent, and any frame will do.
    /// - `side`: 1 at the front, −1 at the back: the map's y belongs to the front's bitangent, while the frame's normal is turned.
    pub fn tangent_space(normal: Vec3f, tangent: Vec3f, handedness: f32, side: f32) -> Frame {
        if handedness == 0.0 {
            return frame_from_normal(normal);
        }
        let f = frame_from_tangent(normal, tangent);
        Frame { tangent: f.tangent, bitangent: f.bitangent * (handedness * side), normal: f.normal }
    }

    /// A world-space vector in local coordinates.
    pub fn to_local(f: Frame, v: Vec3f) -> Vec3f {
        vec3f(dot(f.tangent, v), dot(f.bitangent, v), dot(f.normal, v))
    }

    /// A local vector in world space.
    pub fn to_world(f: Frame, v: Vec3f) -> Vec3f {
        f.tangent * v.x + f.bitangent * v.y + f.normal * v.z
    }

    /// Bends the shading normal `ns` towards the viewer until the mirror direction of `wo` is above the geometric
    /// surface, so that a perturbed normal neither turns away from the viewer nor reflects into the surface.
    ///
    /// - `wo`: unit vector towards the viewer, world space, with `dot(wo, ng) > 0`.
    /// - `ng`: unit geometric normal on the viewer's side. `ns`: unit shading normal on the same side.
    ///
    /// Returns `ns` itself where nothing needs to be mended.
    pub fn bend_normal(wo: Vec3f, ng: Vec3f, ns: Vec3f) -> Vec3f {
        let mirrored = ns * (2.0 * dot(ns, wo)) - wo;
        let lift = 0.01 - dot(mirrored, ng);
        if lift <= 0.0 {
            return ns;
        }
        // Move the mirror direction just above the horizon and take the half vector that would have produced it.
        let lifted = normalize(mirrored + ng * lift);
        let half_vector = lifted + wo;
        let length2 = dot(half_vector, half_vector);
        if length2 < 1e-6 {
            return ng;
        }
        half_vector * (1.0 / sqrt(length2))
    }

    /// Applies a tangent-space normal map value.
    ///
    /// - `f`: frame of the interpolated normal and tangent.
    /// - `texel`: RGB in `[0, 1]` as stored (0.5 is zero). `scale`: multiplies x and y.
    pub fn map_normal(f: Frame, texel: Vec3f, scale: f32) -> Vec3f {
        let local = vec3f((texel.x * 2.0 - 1.0) * scale, (texel.y * 2.0 - 1.0) * scale, texel.z * 2.0 - 1.0);
        let world = to_world(f, local);
        let length2 = dot(world, world);
        let mapped = world * (1.0 / sqrt(max(length2, 1e-20)));
        select(f.normal, mapped, length2 > 1e-12 && is_finite(length2))
    }
}

#[cfg(test)]
mod tests {
    use super::frame::*;
    use wgsl_rs::std::*;

    fn directions() -> impl Iterator<Item = Vec3f> {
        (0..2000).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
            let phi = i as f32 * 2.399_963;
            let r = (1.0 - z * z).max(0.0).sqrt();
            vec3f(r * phi.cos(), r * phi.sin(), z)
        })
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let poles =
            [vec3f(0.0, 0.0, 1.0), vec3f(0.0, 0.0, -1.0), vec3f(1.0, 0.0, 0.0), vec3f(1e-20, 0.0, -1.0)];
        for n in directions().chain(poles) {
            for f in [frame_from_normal(n), frame_from_tangent(n, vec3f(0.3, -0.5, 0.7))] {
                assert!(dot(f.tangent, f.bitangent).abs() < 1e-5, "{f:?}");
                assert!((dot(f.tangent, f.tangent) - 1.0).abs() < 1e-5, "{f:?}");
                assert!((dot(cross(f.tangent, f.bitangent), f.normal) - 1.0).abs() < 1e-5, "{f:?}");
                let v = vec3f(0.2, -0.9, 0.4);
                let back = to_world(f, to_local(f, v));
                assert!(length(back - v) < 1e-5, "{v:?} came back as {back:?}");
            }
        }
    }

    #[test]
    fn bent_normals_reflect_above_the_surface() {
        let ng = vec3f(0.0, 0.0, 1.0);
        for wo in directions().filter(|d| d.z > 1e-3) {
            for ns in directions().filter(|d| d.z > 1e-3).step_by(17) {
                let n = bend_normal(wo, ng, ns);
                let mirrored = n * (2.0 * dot(n, wo)) - wo;
                assert!((length(n) - 1.0).abs() < 1e-4, "{n:?}");
                assert!(mirrored.z > 0.0, "wo {wo:?}, ns {ns:?} → n {n:?} mirrors to {mirrored:?}");
                assert!(dot(n, wo) > 0.0, "wo {wo:?}, ns {ns:?} → n {n:?} faces away");
            }
        }
    }
}
