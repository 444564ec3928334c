//! What a path is inside of.
//!
//! Bodies may overlap: where they do, the one of the highest priority is there, and surfaces of others are not.
//! Source: Schmidt and Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod interiors {
    use crate::constants::*;
    use wgsl_rs::std::*;

    /// Surfaces that are looked through to find out what a camera stands in.
    pub const MOST_AROUND_CAMERA: u32 = 1024u32;

    /// The bodies that a point is inside of, in the order in which a path has entered them. Four are remembered; those
    /// entered beyond that count as parts of these.
    #[derive(Clone, Copy, Debug)]
    pub struct Interiors {
        /// Their materials; [`NONE`] behind the last.
        pub materials: Vec4u,
        /// The priorities of those.
        pub priorities: Vec4i,
    }

    /// What is known of the bodies around a point after looking away from it, past some surfaces.
    #[derive(Clone, Copy, Debug)]
    pub struct Surroundings {
        /// Bodies around the point: their backs were seen, but not their fronts.
        pub around: Interiors,
        /// Bodies that the look is inside of, and the point is not.
        pub passed: Interiors,
        /// How many more of those there are than can be remembered.
        pub forgotten: u32,
    }

    /// Inside of nothing.
    pub fn interiors_nothing() -> Interiors {
        Interiors { materials: vec4u(NONE, NONE, NONE, NONE), priorities: vec4i(0, 0, 0, 0) }
    }

    /// Whether the body of a material is among them.
    pub fn interiors_contain(i: Interiors, material: u32) -> bool {
        let m = i.materials;
        m.x == material || m.y == material || m.z == material || m.w == material
    }

    /// Whether no more are remembered.
    pub fn interiors_are_full(i: Interiors) -> bool {
        i.materials.w != NONE
    }

    /// After going into the body of a material.
    pub fn interiors_enter(i: Interiors, material: u32, priority: i32) -> Interiors {
        let m = i.materials;
        let p = i.priorities;
        if m.x == NONE {
            return Interiors {
                materials: vec4u(material, NONE, NONE, NONE),
                priorities: vec4i(priority, 0, 0, 0),
            };
        }
        if m.y == NONE {
            return Interiors {
                materials: vec4u(m.x, material, NONE, NONE),
                priorities: vec4i(p.x, priority, 0, 0),
            };
        }
        if m.z == NONE {
            return Interiors {
                materials: vec4u(m.x, m.y, material, NONE),
                priorities: vec4i(p.x, p.y, priority, 0),
            };
        }
        if m.w == NONE {
            return Interiors {
                materials: vec4u(m.x, m.y, m.z, material),
                priorities: vec4i(p.x, p.y, p.z, priority),
            };
        }
        i
    }

    /// After going out of the body of a material: of several, the one entered last. The same if it is not among them.
    pub fn interiors_leave(i: Interiors, material: u32) -> Interiors {
        let m = i.materials;
        let p = i.priorities;
        if m.w == material {
            return Interiors { materials: vec4u(m.x, m.y, m.z, NONE), priorities: vec4i(p.x, p.y, p.z, 0) };
        }
        if m.z == material {
            return Interiors { materials: vec4u(m.x, m.y, m.w, NONE), priorities: vec4i(p.x, p.y, p.w, 0) };
        }
        if m.y == material {
            return Interiors { materials: vec4u(m.x, m.z, m.w, NONE), priorities: vec4i(p.x, p.z, p.w, 0) };
        }
        if m.x == material {
            return Interiors { materials: vec4u(m.y, m.z, m.w, NONE), priorities: vec4i(p.y, p.z, p.w, 0) };
        }
        i
    }

    /// After crossing the surface of a body, from its front into it or from its back out of it.
    pub fn interiors_cross(i: Interiors, material: u32, priority: i32, front: bool) -> Interiors {
        if front {
            return interiors_enter(i, material, priority);
        }
        interiors_leave(i, material)
    }

    /// The material of the body that counts, or [`NONE`]: the one of the highest priority, and among equals the one
    /// entered last.
    pub fn interiors_current(i: Interiors) -> u32 {
        let m = i.materials;
        let p = i.priorities;
        let mut current = m.x;
        let mut highest = p.x;
        if m.y != NONE && p.y >= highest {
            current = m.y;
            highest = p.y;
        }
        if m.z != NONE && p.z >= highest {
            current = m.z;
            highest = p.z;
        }
        if m.w != NONE && p.w >= highest {
            current = m.w;
        }
        current
    }

    /// Whether the surface of a body of some priority is inside of another one of higher priority, and so is not there.
    pub fn interiors_hide(i: Interiors, priority: i32) -> bool {
        let m = i.materials;
        let p = i.priorities;
        (m.x != NONE && p.x > priority)
            || (m.y != NONE && p.y > priority)
            || (m.z != NONE && p.z > priority)
            || (m.w != NONE && p.w > priority)
    }

    /// The material of the body that a ray is in on its way to a surface, or [`NONE`].
    ///
    /// - `seen`: material of the body whose back the ray ends at, or [`NONE`]. It is around the ray, also where its front is
    ///   missing.
    pub fn interiors_along(i: Interiors, seen: u32) -> u32 {
        if seen != NONE && !interiors_contain(i, seen) {
            return seen;
        }
        interiors_current(i)
    }

    /// Nothing is known yet.
    pub fn surroundings_unknown() -> Surroundings {
        Surroundings { around: interiors_nothing(), passed: interiors_nothing(), forgotten: 0u32 }
    }

    /// After looking past the surface of a body. Of more bodies than are remembered, the outermost are.
    pub fn surroundings_past(s: Surroundings, material: u32, priority: i32, front: bool) -> Surroundings {
        let mut next = s;
        if front && interiors_are_full(s.passed) {
            next.forgotten = s.forgotten + 1u32;
        } else if front {
            next.passed = interiors_enter(s.passed, material, priority);
        } else if interiors_contain(s.passed, material) {
            next.passed = interiors_leave(s.passed, material);
        } else if s.forgotten > 0u32 {
            next.forgotten = s.forgotten - 1u32;
        } else {
            let m = s.around.materials;
            let p = s.around.priorities;
            next.around = Interiors {
                materials: vec4u(material, m.x, m.y, m.z),
                priorities: vec4i(priority, p.x, p.y, p.z),
            };
        }
        next
    }

    /// The direction in which a camera looks for what is around it: not quite up, because vertical walls should not be
    /// seen edge-on.
    pub fn surroundings_direction() -> Vec3f {
        normalize(vec3f(0.0108, 0.9999, 0.0089))
    }
}

#[cfg(test)]
mod tests {
    use super::interiors::*;
    use crate::constants::NONE;

    fn entered(i: Interiors) -> Vec<u32> {
        let m = i.materials;
        [m.x, m.y, m.z, m.w].into_iter().filter(|&m| m != NONE).collect()
    }

    #[test]
    fn bodies_are_left_in_any_order_and_too_many_are_forgotten() {
        let enter = |i, m: &[u32]| m.iter().fold(i, |i, &m| interiors_enter(i, m, 0));
        let leave = |i, m: &[u32]| m.iter().fold(i, |i, &m| interiors_leave(i, m));
        let i = leave(enter(interiors_nothing(), &[7, 8, 7]), &[8]);
        assert_eq!(entered(i), [7, 7]);
        let i = leave(i, &[7, 3]);
        assert_eq!(entered(i), [7]);
        let i = enter(i, &[1, 2, 3, 4, 5]);
        assert_eq!(entered(i), [7, 1, 2, 3]);
        for (material, left) in [(7, [1, 2, 3]), (1, [7, 2, 3]), (2, [7, 1, 3]), (3, [7, 1, 2])] {
            assert_eq!(entered(leave(i, &[material])), left);
        }
        assert!(entered(leave(i, &[5, 4, 3, 2, 1, 7])).is_empty());
    }

    #[test]
    fn the_highest_priority_counts_and_among_equals_the_last() {
        let of = |bodies: &[(u32, i32)]| {
            bodies.iter().fold(interiors_nothing(), |i, &(m, p)| interiors_enter(i, m, p))
        };
        assert_eq!(interiors_current(interiors_nothing()), NONE);
        for (bodies, current) in [
            (&[(4, -1)][..], 4),
            (&[(4, 0), (5, 0)], 5),
            (&[(4, 1), (5, 0)], 4),
            (&[(4, 1), (5, 0), (6, 1)], 6),
            (&[(4, 1), (5, 3), (6, 1), (7, 2)], 5),
            (&[(4, -3), (5, -2), (6, -2), (7, -2)], 7),
        ] {
            let i = of(bodies);
            assert_eq!(interiors_current(i), current, "{bodies:?}");
            let highest = bodies.iter().map(|b| b.1).max().expect("one");
            assert!(interiors_hide(i, highest - 1) && !interiors_hide(i, highest), "{bodies:?}");
            assert_eq!(interiors_along(i, current), current);
            assert_eq!(interiors_along(i, 9), 9, "the back of a body whose front is missing");
        }
    }

    #[test]
    fn what_is_around_a_point_is_seen_from_within_only() {
        let look = |past: &[(u32, bool)]| {
            past.iter()
                .fold(surroundings_unknown(), |s, &(m, front)| surroundings_past(s, m, 0, front))
                .around
        };
        let (front, back) = (true, false);
        // Another body stands above; the point is in 2, which is in 1.
        assert_eq!(entered(look(&[(8, front), (8, back), (2, back), (1, back)])), [1, 2]);
        assert_eq!(entered(look(&[(2, back), (9, front), (1, back), (9, back)])), [1, 2]);
        // The outermost four.
        assert_eq!(entered(look(&[(5, back), (4, back), (3, back), (2, back), (1, back)])), [1, 2, 3, 4]);
        // Six bodies one in the other, which the point is below.
        let through: Vec<_> = (0..6).map(|m| (m, front)).chain((0..6).rev().map(|m| (m, back))).collect();
        assert!(entered(look(&through)).is_empty());
    }
}
