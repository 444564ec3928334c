//! Light sources: sampling a direction towards them, and the density of having done so.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod light {
    use crate::constants::*;
    use crate::falloff::*;
    use crate::frame::*;
    use crate::math::*;
    use crate::spherical_rectangle::*;
    use crate::spherical_triangle::*;
    use crate::warp::*;
    use wgsl_rs::std::*;

    /// A triangle that emits.
    pub const LIGHT_TRIANGLE: u32 = 0u32;
    /// A sphere that emits.
    pub const LIGHT_SPHERE: u32 = 1u32;
    /// A point.
    pub const LIGHT_POINT: u32 = 2u32;
    /// A point that shines into a cone.
    pub const LIGHT_SPOT: u32 = 3u32;
    /// Infinitely far away, one direction or a small disc of directions.
    pub const LIGHT_DIRECTIONAL: u32 = 4u32;
    /// An environment image. Sampled by its own table, not here.
    pub const LIGHT_ENVIRONMENT: u32 = 5u32;
    /// A rectangle that emits: two triangles.
    pub const LIGHT_RECTANGLE: u32 = 6u32;
    /// A point that throws a picture.
    pub const LIGHT_PROJECTOR: u32 = 7u32;

    /// A triangle is near, and sampled by solid angle, if the squared distance to its centroid is less than this share of its longest
    /// edge's square, and a rectangle, if that to its centre is less than this share of its diagonal's square; beyond, they are
    /// sampled by area.
    ///
    /// Samples uniform over the area have a density over solid angle that goes with the cube of distance. From this distance on, it
    /// differs by a factor of two from corner to corner of a triangle or rectangle that faces the receiver, and the cheaper way is as
    /// good.
    pub const NEAR_FLAT: f32 = 0.5;

    /// The share of both edges that leads from the first corner of a triangle to its centroid.
    pub const TRIANGLE_CENTER: f32 = 0.33333334;
    /// The share of both edges that leads from the first corner of a rectangle to its centre.
    pub const RECTANGLE_CENTER: f32 = 0.5;

    /// One light, world space.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Light {
        /// Which kind: `LIGHT_…`. The other fields mean what the kind says.
        pub kind: u32,
        /// First vertex, centre, position, or unit direction towards a directional light.
        pub position: Vec3f,
        /// Triangle: second vertex minus first. Rectangle: its longer edge from the first vertex. Spot: unit direction in which it
        /// shines. Projector: the upper edge of the picture at a distance of 1, from its left to its right.
        pub edge1: Vec3f,
        /// Triangle: third vertex minus first. Rectangle: its other edge, at right angles. Spot: x and y are scale and offset of
        /// the falloff. Projector: the left edge of that picture, downwards.
        pub edge2: Vec3f,
        /// Radiance of surfaces and of directional discs, radiant intensity of points, irradiance of one direction.
        pub emission: Vec3f,
        /// Sphere: radius. Directional: 1 − cos of the disc's angular radius, 0 for one direction.
        pub size: f32,
        /// Triangle, rectangle and sphere: whether the back side emits, too.
        pub two_sided: bool,
    }

    /// A sampled direction towards a light.
    #[derive(Clone, Copy, Debug)]
    pub struct LightSample {
        /// Unit direction towards the light.
        pub wi: Vec3f,
        /// Distance to the light; [`FAR`] for what is infinitely far away.
        pub distance: f32,
        /// Radiance that arrives, before any occlusion. For delta lights it is irradiance at normal incidence.
        pub radiance: Vec3f,
        /// Density over solid angle; 1 for delta lights; 0: no light from here.
        pub pdf: f32,
        /// Whether no other technique can find this light.
        pub delta: bool,
        /// Triangle: barycentric weights of the second and third vertex of the sampled point. Rectangle: where on its edges it is.
        /// Projector: where in its picture.
        pub barycentrics: Vec2f,
    }

    /// The straight way to a light sample from where a shadow ray begins.
    #[derive(Clone, Copy, Debug)]
    pub struct LightWay {
        /// Unit direction.
        pub direction: Vec3f,
        /// Metres; [`FAR`] to what is infinitely far away.
        pub distance: f32,
    }

    /// A sphere around the points that a light matters to.
    #[derive(Clone, Copy, Debug)]
    pub struct LightReach {
        /// World position.
        pub center: Vec3f,
        /// In metres; [`FAR`] is everywhere.
        pub radius: f32,
    }

    /// Whether a point is where a light counts.
    pub fn is_reached(reach: LightReach, p: Vec3f) -> bool {
        length(reach.center - p) <= reach.radius
    }

    /// The sample of a light that does not shine here.
    pub fn no_light_sample() -> LightSample {
        LightSample {
            wi: vec3f(0.0, 0.0, 1.0),
            distance: 0.0,
            radiance: vec3f(0.0, 0.0, 0.0),
            pdf: 0.0,
            delta: true,
            barycentrics: vec2f(0.0, 0.0),
        }
    }

    /// Samples a direction from `p` towards a light; `u`: two uniform numbers in `[0, 1)`.
    pub fn light_sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        if light.kind == LIGHT_TRIANGLE {
            return triangle_light_sample(light, p, u);
        }
        if light.kind == LIGHT_RECTANGLE {
            return rectangle_light_sample(light, p, u);
        }
        if light.kind == LIGHT_SPHERE {
            return sphere_light_sample(light, p, u);
        }
        if light.kind == LIGHT_DIRECTIONAL {
            return directional_light_sample(light, u);
        }
        if light_is_point(light.kind) {
            return point_light_sample(light, p);
        }
        no_light_sample()
    }

    /// What arrives of a sampled light that has a texture, before any occlusion.
    ///
    /// - `emission`: its radiance at the sampled point, or a point's radiant intensity in the sample's
    ///   direction.
    pub fn textured_radiance(light: Light, distance: f32, emission: Vec3f) -> Vec3f {
        let falloff = 1.0 / max(distance * distance, 1e-20);
        emission * select(1.0, falloff, light_is_point(light.kind))
    }

    /// The way to a sampled point from an origin beside the point that it was sampled for.
    ///
    /// A ray in the sample's own direction passes the sampled point by as much as its origin is
    /// moved. It may then meet the light earlier than the sample says, so that lights hide
    /// themselves: a sphere near its outline, a panel that is close or slanted.
    ///
    /// - `wi`, `distance`: of the sample. `offset`: from the point that it was made for to the
    ///   ray's origin, metres.
    pub fn light_way(wi: Vec3f, distance: f32, offset: Vec3f) -> LightWay {
        // Relative to the receiver: world coordinates would lose digits far from the world's
        // origin.
        let to_light = wi * distance - offset;
        let length2 = dot(to_light, to_light);
        let length = sqrt(length2);
        // From everywhere, what is infinitely far away is in one direction.
        let turns = length2 > 0.0 && distance < FAR;
        LightWay {
            direction: select(wi, to_light * (1.0 / max(length, 1e-30)), turns),
            distance: select(distance, length, turns),
        }
    }

    /// Where a light can give more irradiance than `cutoff` (W/m², positive) to a surface that faces it.
    ///
    /// Bounds, the same for all directions: a point gives I/d², a sphere at most π L r²/d², a triangle or rectangle at most
    /// L A/d² from its nearest point. The channel that shines most counts. `falloff`: coefficients of [`falloff_factor`], which stand for the d²;
    /// what is seen of
    /// a sphere is nearer than its centre, and light over physics grows with distance, so the bound holds.
    pub fn light_reach(light: Light, cutoff: f32, falloff: Vec3f) -> LightReach {
        let strength = max_component(light.emission);
        let mut center = light.position;
        let mut radius = FAR;
        if light_is_point(light.kind) {
            radius = falloff_distance(falloff, strength / cutoff);
        }
        if light.kind == LIGHT_SPHERE {
            radius = max(falloff_distance(falloff, PI * sqr(light.size) * strength / cutoff), light.size);
        }
        if light_is_flat(light.kind) {
            let rectangle = light.kind == LIGHT_RECTANGLE;
            let to_center =
                (light.edge1 + light.edge2) * select(TRIANGLE_CENTER, RECTANGLE_CENTER, rectangle);
            // A rectangle's corners are all as far away from its centre.
            let sides =
                vec3f(length(to_center), length(light.edge1 - to_center), length(light.edge2 - to_center));
            let area = length(cross(light.edge1, light.edge2)) * select(0.5, 1.0, rectangle);
            center = light.position + to_center;
            radius = max_component(sides) + falloff_distance(falloff, strength * area / cutoff);
        }
        LightReach { center: center, radius: min(radius, FAR) }
    }

    /// Whether a light is at one point, and so falls with the square of distance.
    pub fn light_is_point(kind: u32) -> bool {
        kind == LIGHT_POINT || kind == LIGHT_SPOT || kind == LIGHT_PROJECTOR
    }

    /// Whether a light is flat: a triangle or a rectangle, given by two edges.
    pub fn light_is_flat(kind: u32) -> bool {
        kind == LIGHT_TRIANGLE || kind == LIGHT_RECTANGLE
    }

    /// Whether any of a flat light's corners is on the side of a plane that its `normal` points to; `to_first`: from a point of
    /// the plane to the light's first corner.
    pub fn flat_light_is_above(light: Light, to_first: Vec3f, normal: Vec3f) -> bool {
        let first = dot(to_first, normal);
        let second = first + dot(light.edge1, normal);
        let third = first + dot(light.edge2, normal);
        let fourth = second + third - first;
        let corners = max(max(first, second), third);
        corners > 0.0 || (fourth > 0.0 && light.kind == LIGHT_RECTANGLE)
    }

    /// Whether a flat light is so near that it is sampled by solid angle, if that is possible.
    ///
    /// - `to_first`: from the receiver to the first corner. `edge1`, `edge2`: from there to the next ones.
    /// - `center`: [`TRIANGLE_CENTER`] or [`RECTANGLE_CENTER`].
    pub fn flat_light_is_near(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f, center: f32) -> bool {
        let to_center = to_first + (edge1 + edge2) * center;
        // A triangle's third edge, and as long as a rectangle's diagonal.
        let edge3 = edge2 - edge1;
        let longest2 = max(max(dot(edge1, edge1), dot(edge2, edge2)), dot(edge3, edge3));
        dot(to_center, to_center) < NEAR_FLAT * longest2
    }

    /// Whether a triangle is near: see [`flat_light_is_near`].
    pub fn triangle_is_near(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f) -> bool {
        flat_light_is_near(to_first, edge1, edge2, TRIANGLE_CENTER)
    }

    /// Whether a rectangle is near: see [`flat_light_is_near`].
    pub fn rectangle_is_near(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f) -> bool {
        flat_light_is_near(to_first, edge1, edge2, RECTANGLE_CENTER)
    }

    /// Uniform over the solid angle of a triangle that is near, else over its area.
    pub fn triangle_light_sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        let to_first = light.position - p;
        if triangle_is_near(to_first, light.edge1, light.edge2) {
            let seen = spherical_triangle_new(to_first, light.edge1, light.edge2);
            if seen.solid_angle > 0.0 {
                return flat_light_at(light, p, sample_spherical_triangle(seen, u), 1.0 / seen.solid_angle);
            }
        }
        flat_light_sample_by_area(light, p, u)
    }

    /// Uniform over the solid angle of a rectangle that is near, else over its area.
    pub fn rectangle_light_sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        let to_first = light.position - p;
        if rectangle_is_near(to_first, light.edge1, light.edge2) {
            let seen = spherical_rectangle_new(to_first, light.edge1, light.edge2);
            if seen.solid_angle > 0.0 {
                return flat_light_at(light, p, sample_spherical_rectangle(seen, u), 1.0 / seen.solid_angle);
            }
        }
        flat_light_sample_by_area(light, p, u)
    }

    /// Uniform over the area of a triangle or rectangle, with the density converted to solid angle.
    pub fn flat_light_sample_by_area(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        let of_triangle = sample_triangle(u);
        let rectangle = light.kind == LIGHT_RECTANGLE;
        let place = vec2f(select(of_triangle.x, u.x, rectangle), select(of_triangle.y, u.y, rectangle));
        flat_light_at(light, p, place, 0.0)
    }

    /// The sample of a triangle or rectangle at a point of it, given by its shares of both edges from the first corner.
    ///
    /// - `pdf`: density over solid angle with which the point was chosen; 0: it was uniform over the area.
    pub fn flat_light_at(light: Light, p: Vec3f, place: Vec2f, pdf: f32) -> LightSample {
        let to_light = light.position + light.edge1 * place.x + light.edge2 * place.y - p;
        let distance2 = dot(to_light, to_light);
        let distance = sqrt(distance2);
        // The front normal times the area of a rectangle, or twice that of a triangle.
        let normal = cross(light.edge1, light.edge2);
        let facing = -dot(normal, to_light);
        let per_area = select(2.0, 1.0, light.kind == LIGHT_RECTANGLE);
        let density = select(pdf, distance2 * distance * per_area / abs(facing), pdf <= 0.0);
        // Edge-on, without area or at the receiver: the density has no finite value.
        let shines =
            (facing > 0.0 || light.two_sided) && facing != 0.0 && distance2 > 0.0 && is_finite(density);
        if !shines {
            return no_light_sample();
        }
        LightSample {
            wi: to_light * (1.0 / distance),
            distance: distance,
            radiance: light.emission,
            pdf: density,
            delta: false,
            barycentrics: place,
        }
    }

    /// Density over solid angle with which [`triangle_light_sample`] finds a point of the triangle.
    ///
    /// - `to_first`: from the receiver to the first vertex. `edge1`, `edge2`: from there to the others.
    /// - `wi`: unit direction towards the point. `distance`: to the point.
    pub fn triangle_light_pdf(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f, wi: Vec3f, distance: f32) -> f32 {
        if triangle_is_near(to_first, edge1, edge2) {
            let solid_angle = spherical_triangle_new(to_first, edge1, edge2).solid_angle;
            if solid_angle > 0.0 {
                return 1.0 / solid_angle;
            }
        }
        flat_light_pdf_by_area(LIGHT_TRIANGLE, edge1, edge2, wi, distance)
    }

    /// Density over solid angle with which [`rectangle_light_sample`] finds a point of the rectangle; arguments as for
    /// [`triangle_light_pdf`].
    pub fn rectangle_light_pdf(to_first: Vec3f, edge1: Vec3f, edge2: Vec3f, wi: Vec3f, distance: f32) -> f32 {
        if rectangle_is_near(to_first, edge1, edge2) {
            let solid_angle = spherical_rectangle_new(to_first, edge1, edge2).solid_angle;
            if solid_angle > 0.0 {
                return 1.0 / solid_angle;
            }
        }
        flat_light_pdf_by_area(LIGHT_RECTANGLE, edge1, edge2, wi, distance)
    }

    /// Density over solid angle with which [`flat_light_sample_by_area`] finds a point of a triangle or rectangle.
    ///
    /// - `kind`: which of both. `edge1`, `edge2`: from its first corner to the next ones.
    /// - `wi`: unit direction towards the point. `distance`: to the point.
    pub fn flat_light_pdf_by_area(kind: u32, edge1: Vec3f, edge2: Vec3f, wi: Vec3f, distance: f32) -> f32 {
        let projected = abs(dot(cross(edge1, edge2), wi));
        let per_area = select(2.0, 1.0, kind == LIGHT_RECTANGLE);
        distance * distance * per_area / max(projected, 1e-20)
    }

    /// 1 − cos of the half angle under which a sphere is seen; 2 (all directions) from inside, and from so close to it
    /// that rounding does not know.
    pub fn sphere_one_minus_cos(distance2_to_center: f32, radius: f32) -> f32 {
        let sin2 = radius * radius / distance2_to_center;
        if sin2 >= 0.9999 {
            return 2.0;
        }
        // 1 − cos = sin² / (1 + cos) does not cancel for far spheres.
        sin2 / (1.0 + sqrt(1.0 - sin2))
    }

    /// Uniform over the cone of directions under which the sphere is seen; over all directions from inside.
    /// Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 6.2.4.
    pub fn sphere_light_sample(light: Light, p: Vec3f, u: Vec2f) -> LightSample {
        let to_center = light.position - p;
        let distance2 = dot(to_center, to_center);
        let one_minus_cos = sphere_one_minus_cos(distance2, light.size);
        // Of less than 10⁻³⁶ the density would overflow.
        if distance2 <= 0.0 || one_minus_cos < 1e-36 {
            return no_light_sample();
        }
        let center_distance = sqrt(distance2);
        let frame = frame_from_normal(to_center * (1.0 / center_distance));
        let wi = to_world(frame, sample_cone(u, one_minus_cos));
        let along = dot(to_center, wi);
        let closest = to_center - wi * along;
        let radius2 = light.size * light.size;
        let half_chord = safe_sqrt(radius2 - dot(closest, closest));
        let inside = one_minus_cos >= 2.0;
        let from_behind = inside && light.two_sided;
        let distance = select(along - half_chord, along + half_chord, from_behind);
        if inside {
            // Not every direction hits from just outside; what is inside is lit by the back only, and from the
            // surface itself it is not seen along itself.
            let outside_only = !light.two_sided && distance2 <= radius2;
            let too_near = distance < light.size * select(0.0001, 0.001, from_behind);
            if outside_only || too_near || dot(closest, closest) > radius2 {
                return no_light_sample();
            }
        }
        LightSample {
            wi: wi,
            distance: max(distance, 0.0),
            radiance: light.emission,
            pdf: pdf_cone(one_minus_cos),
            delta: false,
            barycentrics: vec2f(0.0, 0.0),
        }
    }

    /// Density over solid angle with which [`sphere_light_sample`] finds any direction that hits the sphere.
    pub fn sphere_light_pdf(center: Vec3f, radius: f32, p: Vec3f) -> f32 {
        let to_center = center - p;
        pdf_cone(sphere_one_minus_cos(dot(to_center, to_center), radius))
    }

    /// The same of a hit: only what is seen first from outside is sampled there. Through the holes of a sphere paths find the
    /// far side by themselves. `front`: whether the hit is on the outside.
    pub fn sphere_light_side_pdf(center: Vec3f, radius: f32, p: Vec3f, front: bool) -> f32 {
        let to_center = center - p;
        let one_minus_cos = sphere_one_minus_cos(dot(to_center, to_center), radius);
        if !front && one_minus_cos < 2.0 {
            return 0.0;
        }
        pdf_cone(one_minus_cos)
    }

    /// One direction, or uniform over the disc.
    pub fn directional_light_sample(light: Light, u: Vec2f) -> LightSample {
        let frame = frame_from_normal(light.position);
        let wi = to_world(frame, sample_cone(u, light.size));
        let disc = light.size > 0.0;
        LightSample {
            wi: select(light.position, wi, disc),
            distance: FAR,
            radiance: light.emission,
            pdf: select(1.0, pdf_cone(max(light.size, 1e-20)), disc),
            delta: !disc,
            barycentrics: vec2f(0.0, 0.0),
        }
    }

    /// Whether unit direction `wi` points into a directional light's disc.
    ///
    /// |wi − d|² = 2 (1 − cos): differences keep small discs exact where a dot product near 1 would not.
    pub fn directional_light_contains(light: Light, wi: Vec3f) -> bool {
        let difference = wi - light.position;
        dot(difference, difference) <= 2.0 * light.size && light.size > 0.0
    }

    /// The one direction towards a point, with the inverse square law, a spot's falloff and the bounds of a projector's picture.
    pub fn point_light_sample(light: Light, p: Vec3f) -> LightSample {
        let to_light = light.position - p;
        let distance2 = dot(to_light, to_light);
        // At the point itself, the inverse square has no finite value.
        if distance2 < 1e-30 {
            return no_light_sample();
        }
        let distance = sqrt(distance2);
        let wi = to_light * (1.0 / distance);
        let mut falloff = 1.0;
        let mut place = vec2f(0.0, 0.0);
        if light.kind == LIGHT_SPOT {
            falloff = spot_falloff(-dot(wi, light.edge1), light.edge2.x, light.edge2.y);
        }
        if light.kind == LIGHT_PROJECTOR {
            place = projected_place(light, -wi);
            if place.x < 0.0 {
                return no_light_sample();
            }
        }
        LightSample {
            wi: wi,
            distance: distance,
            radiance: light.emission * (falloff / distance2),
            pdf: 1.0,
            delta: true,
            barycentrics: place,
        }
    }

    /// Where in a projector's picture its light in unit direction `d` comes from, both in `[0, 1]`: from the left and from the
    /// top. Negative outside of the picture.
    pub fn projected_place(light: Light, d: Vec3f) -> Vec2f {
        // To the right and down: where the projector is aimed, as a camera would be.
        let along = dot(d, normalize(cross(light.edge1, light.edge2)));
        let across = vec2f(
            dot(d, light.edge1) / dot(light.edge1, light.edge1),
            dot(d, light.edge2) / dot(light.edge2, light.edge2),
        );
        let reached = along > 0.0 && max(abs(across.x), abs(across.y)) <= 0.5 * along;
        let place = across * (1.0 / max(along, 1e-30)) + vec2f(0.5, 0.5);
        vec2f(select(-1.0, saturate(place.x), reached), select(-1.0, saturate(place.y), reached))
    }

    /// Falloff of a spot light, in `[0, 1]`: `saturate(cos · scale + offset)²` (KHR_lights_punctual).
    pub fn spot_falloff(cos_axis: f32, scale: f32, offset: f32) -> f32 {
        sqr(saturate(cos_axis * scale + offset))
    }

    /// Scale (x) and offset (y) of [`spot_falloff`] for the cosines of the inner and outer angle.
    pub fn spot_falloff_parameters(cos_inner: f32, cos_outer: f32) -> Vec2f {
        let scale = 1.0 / max(cos_inner - cos_outer, 0.001);
        vec2f(scale, -cos_outer * scale)
    }
}
