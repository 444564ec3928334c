//! The functions that are compared: what their arguments are drawn from (`inputs.rs`) and how far results may be apart.

use crate::compare::Tolerance;
use crate::inputs::{self, Inputs};
use crate::values::Words;

/// Sums of products of numbers of very different sizes.
const FAR_APART: Tolerance = Tolerance {
    absolute: 0.05,
    relative: 1e-4,
    exceptions: 0.01,
    why: "products of numbers up to ten thousand nearly cancel each other",
};

/// One over differences that may be nearly zero.
const RECIPROCALS: Tolerance = Tolerance {
    absolute: 1e-3,
    relative: 1e-3,
    exceptions: 0.01,
    why: "one over what rounding leaves of a difference",
};

/// Integers, choices and copies.
const EXACT: Tolerance =
    Tolerance { absolute: 0.0, relative: 0.0, exceptions: 0.0, why: "nothing is rounded" };

/// Sums, products, quotients and square roots.
const ROUNDING: Tolerance = Tolerance {
    absolute: 1e-6,
    relative: 1e-5,
    exceptions: 0.0,
    why: "compilers fuse products and sums, and Vulkan allows quotients and roots 2.5 units of the last place",
};

/// What is a difference of nearly equal numbers for some inputs: vectors at right angles, chords near a sphere's limb.
const CANCELLING: Tolerance = Tolerance {
    absolute: 1e-6,
    relative: 5e-4,
    exceptions: 0.0,
    why: "where compilers fuse products and sums, what is left of a difference has other last bits",
};

/// As above, with a choice that depends on the difference's sign.
const SIDES: Tolerance =
    Tolerance { exceptions: 0.002, why: "seen edge-on, rounding says which side it is", ..CANCELLING };

/// As above, divided by what is nearly zero seen edge-on.
const EDGES: Tolerance = Tolerance {
    relative: 5e-3,
    exceptions: 0.01,
    why: "seen edge-on, rounding moves the plane's point",
    ..CANCELLING
};

/// Powers and logarithms.
const POWERS: Tolerance = Tolerance {
    absolute: 1e-6,
    relative: 2e-4,
    exceptions: 0.0,
    why: "Vulkan allows x^y = exp2(y log2(x)) an error that grows with y log2(x)",
};

/// 1 − exp(−x), where x need not be small.
const DEPTHS: Tolerance = Tolerance {
    absolute: 1e-6,
    relative: 1e-3,
    exceptions: 0.0,
    why: "Vulkan allows exp an error of some units of the last place, of which little is left beside the difference",
};

/// Logarithms of what is left of a number, and whether they are less than a length.
const DISTANCES: Tolerance = Tolerance {
    absolute: 1e-5,
    relative: 1e-3,
    exceptions: 0.002,
    why: "near the end of the way, rounding says whether it is reached",
};

/// Angles from directions.
const ANGLES: Tolerance = Tolerance {
    absolute: 2e-4,
    relative: 0.0,
    exceptions: 0.005,
    why: "Vulkan allows arc functions 4096 units of the last place; at the seam angles jump",
};

/// What is computed from half vectors and other differences of nearly equal things, or chooses among lobes.
const GRAZING: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 1e-3,
    exceptions: 0.01,
    why: "seen at a grazing angle, half vectors magnify rounding; where it changes a choice, everything differs",
};

/// What Newton's method ends at, which may take a step more or less, and angles of directions.
const LENSES: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 1e-4,
    exceptions: 0.002,
    why: "iterations stop by a comparison; Vulkan allows arc functions 4096 units of the last place",
};

/// The same as a place on a film, which half the field of view is a part of.
const FILMS: Tolerance = Tolerance { absolute: 5e-4, relative: 5e-4, ..LENSES };

/// Square roots of differences of nearly equal numbers.
const ROOTS: Tolerance = Tolerance {
    absolute: 1e-3,
    relative: 1e-5,
    exceptions: 0.0,
    why: "the root of what rounding leaves of a difference that should be zero",
};

/// Steps of numbers that are stored in few bits.
const STEPS: Tolerance = Tolerance {
    exceptions: 0.02,
    why: "at the edge between two steps, the last bit says which one it is",
    ..ROUNDING
};

/// Which texels a lookup reads, and by what weights.
const TEXELS: Tolerance = Tolerance {
    absolute: 1e-3,
    relative: 1e-5,
    exceptions: 0.02,
    why: "weights are fractions of numbers up to thousands; at a texel's edge, the last bit says which one it is",
};

/// Angles around any axis.
const AZIMUTHS: Tolerance = Tolerance {
    exceptions: 0.05,
    why: "along the axis, where some inputs lie, rounding says which angle it is",
    ..ANGLES
};

/// Places between rows and columns that are found by an angle.
const CELLS: Tolerance = Tolerance {
    absolute: 2e-3,
    relative: 0.0,
    exceptions: 0.05,
    why: "an angle with an error of 4096 units of the last place, in rows of a degree; next to a row or column, the error says which it is",
};

/// Powers of powers, and of what cancels.
const FIBRES: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 2e-3,
    exceptions: 0.005,
    why: "a high power of a sine near 1 magnifies what rounding makes of it, and Vulkan's powers are not exact",
};

/// Waves, and reflectances that are solved for where they are nearly 1.
const INTERFERENCE: Tolerance = Tolerance {
    absolute: 2e-3,
    relative: 2e-3,
    exceptions: 0.01,
    why: "films hundreds of waves thick magnify rounding, grazing angles divide by next to nothing, and phases jump",
};

/// A function of the optics, and one input of it as words with the result in Rust.
pub struct Function {
    /// Its name, in Rust and in WGSL.
    pub name: &'static str,
    /// Names of its arguments.
    pub arguments: &'static [&'static str],
    /// How far results may be apart.
    pub tolerance: &'static Tolerance,
    /// Draws an input; returns it and the result.
    pub case: fn(&mut Inputs) -> (Vec<u32>, Vec<u32>),
}

macro_rules! functions {
    ($list:ident: $($module:ident::$name:ident($($argument:ident: $domain:ident),*) within $tolerance:ident;)*) => {
        pub(super) fn $list() -> Vec<Function> {
            vec![$(Function {
                name: stringify!($name),
                arguments: &[$(stringify!($argument)),*],
                tolerance: &$tolerance,
                case: |_inputs| {
                    $(let $argument = inputs::$domain(_inputs);)*
                    #[allow(unused_mut, reason = "some functions have no arguments")]
                    let mut words = Vec::new();
                    $($argument.put(&mut words);)*
                    let mut result = Vec::new();
                    optics::$module::$name($($argument),*).put(&mut result);
                    (words, result)
                },
            }),*]
        }
    };
}

mod guiding;
mod motion;
mod realtime;
mod surfaces;
mod textures;
mod transport;

/// All functions of the optics.
pub fn functions() -> Vec<Function> {
    let parts = [
        others(),
        guiding::guiding(),
        motion::motion(),
        realtime::realtime(),
        surfaces::surfaces(),
        textures::textures(),
        transport::transport(),
    ];
    parts.into_iter().flatten().collect()
}

functions! {
    others:
    // base/math.rs
    math::sqr(x: real) within ROUNDING;
    math::pow5(x: signed_cosine) within ROUNDING;
    math::safe_sqrt(x: real) within ROUNDING;
    math::max_component(v: signed_color) within EXACT;
    math::mean_component(v: signed_color) within CANCELLING;
    math::luminance(c: signed_color) within ROUNDING;
    math::nearest_integer(x: real) within EXACT;
    math::cos_sin_turns(turns: turns) within ROUNDING;
    math::upper_angle_turns(x: real, y: size) within ROUNDING;
    math::is_finite(x: anything) within EXACT;
    math::is_finite3(v: anything3) within EXACT;
    // sampling/random.rs
    random::pcg_hash(x: bits) within EXACT;
    random::hash_combine(hash: bits, value: bits) within EXACT;
    random::unit_float(bits: bits) within EXACT;
    random::stratified_number(index: depth, jitter: unit, count: rows) within ROUNDING;
    random::dither(a: unit, b: unit) within ROUNDING;
    random::sampler_new(kind: sampler_kind, x: bits, y: bits, width: bits, sample_index: bits, seed: bits) within EXACT;
    random::z_order(x: bits, y: bits) within EXACT;
    random::spread_bits(x: bits) within EXACT;
    random::permute_quarters(place: bits, seed: bits) within EXACT;
    random::sobol_point(index: bits, seed: bits) within EXACT;
    random::laine_karras(x: bits, seed: bits) within EXACT;
    random::sobol_second_reversed(index: bits) within EXACT;
    random::sample_2d(s: sampler, pair: index) within ROUNDING;
    // sampling/spherical_rectangle.rs
    spherical_rectangle::strip_half_angle(x: real, y: point2, depth: size, height: size) within CANCELLING;
    spherical_rectangle::spherical_rectangle_new(to_first: far_point, edge1: point, edge2: point) within SIDES;
    spherical_rectangle::sample_spherical_rectangle(r: spherical_rectangle, u: unit2) within GRAZING;
    // sampling/spherical_triangle.rs
    spherical_triangle::spherical_triangle_new(to_first: far_point, edge1: point, edge2: point) within CANCELLING;
    spherical_triangle::sample_spherical_triangle(t: spherical_triangle, u: unit2) within ROOTS;
    // sampling/warp.rs
    warp::sample_disk(u: unit2) within ROUNDING;
    warp::sample_cosine_hemisphere(u: unit2) within ROUNDING;
    warp::pdf_cosine_hemisphere(cos_theta: cosine) within ROUNDING;
    warp::sample_sphere(u: unit2) within ROUNDING;
    warp::sample_cone(u: unit2, one_minus_cos: one_minus_cos) within ROUNDING;
    warp::pdf_cone(one_minus_cos: one_minus_cos) within ROUNDING;
    warp::sample_triangle(u: unit2) within ROUNDING;
    warp::alias_slot(u: unit, count: count) within ROUNDING;
    warp::alias_choose(u: unit, count: count, slot: index, threshold: share, other: index) within ROUNDING;
    warp::alias_choose_dithered(u: unit, count: count, slot: index, threshold: share, other: index, dither: share) within ROUNDING;
    // geometry/frame.rs
    frame::frame_from_normal(normal: direction) within ROUNDING;
    frame::frame_from_tangent(normal: direction, tangent: signed_color) within CANCELLING;
    frame::tangent_space(normal: direction, tangent: signed_color, handedness: sign_or_none, side: sign) within CANCELLING;
    frame::unit_cosine(a: direction, b: direction) within CANCELLING;
    frame::to_local(f: frame, v: signed_color) within ROUNDING;
    frame::to_world(f: frame, v: signed_color) within CANCELLING;
    frame::bend_normal(wo: direction, ng: direction, ns: direction) within GRAZING;
    frame::map_normal(f: frame, texel: texel, scale: share) within ROUNDING;
    // geometry/offset.rs
    offset::largest_components(a: point, b: point, c: point) within EXACT;
    offset::rounding_clearance(coordinates: point, n: direction, size: positive, transformed: positive) within ROUNDING;
    offset::triangle_clearance(p0: point, p1: point, p2: point, n: direction, transformed: positive) within CANCELLING;
    offset::sphere_clearance(p: point, center: point, radius: positive, n: direction, transformed: positive) within ROUNDING;
    offset::offset_ray_origin(p: point, n: direction, clearance: positive) within ROUNDING;
    // geometry/shape.rs
    shape::sphere_uv(outward: off_pole) within ANGLES;
    shape::sphere_tangent(u: turns) within ROUNDING;
    shape::sphere_tangent_turned(uv: point2, turn: turns) within CANCELLING;
    terminator::terminator_share(cos_deviation: cosine) within ROUNDING;
    terminator::tangent_plane_lift(from_vertex: point, normal: direction) within CANCELLING;
    terminator::terminator_lift(p: point, p0: point, p1: point, p2: point, n0: direction, n1: direction, n2: direction, side: side, normal: direction, weights: weights) within GRAZING;
    shape::turned_direction(row_x: direction, row_y: direction, row_z: direction, direction: direction) within GRAZING;
    // geometry/intersect.rs
    intersect::axis_last(v: signed_color, axis: axis) within EXACT;
    intersect::ray_shear(direction: direction) within ROUNDING;
    intersect::intersect_triangle(origin: point, ray: shear, p0: point, p1: point, p2: point, t_min: share, t_max: positive) within ROUNDING;
    intersect::intersect_triangle_plane(origin: point, direction: direction, p0: point, p1: point, p2: point, t_min: share, t_max: positive) within SIDES;
    intersect::nearest_triangle_point(origin: point, direction: direction, p0: point, p1: point, p2: point) within EDGES;
    intersect::intersect_sphere(origin: point, direction: direction, center: point, radius: share) within ROUNDING;
    intersect::nearest_to_point(origin: point, direction: direction, point: far_point) within CANCELLING;
    intersect::inverse_direction(direction: direction) within ROUNDING;
    intersect::intersect_box(origin: point, inverse_direction: signed_color, low: point, high: far_point, t_min: share, t_max: positive) within ROUNDING;
    // geometry/distortion.rs
    distortion::no_distortion() within EXACT;
    distortion::brown_conrady(d: distortion, p: film_point) within CANCELLING;
    distortion::brown_conrady_derivatives(d: distortion, p: film_point) within CANCELLING;
    distortion::undistort_brown_conrady(d: distortion, seen: film_point) within LENSES;
    distortion::fisheye_radius(d: distortion, theta: unit) within ROUNDING;
    distortion::fisheye_slope(d: distortion, theta: unit) within ROUNDING;
    distortion::undistort_fisheye(d: distortion, seen: film_point) within LENSES;
    distortion::lens_direction(d: distortion, film: film_point) within LENSES;
    distortion::lens_film(d: distortion, direction: ahead) within LENSES;
    distortion::beyond_everything(origin: direction, axis: direction) within ROUNDING;
    // geometry/wide_projection.rs
    wide_projection::panorama_direction(film: unit2) within ROUNDING;
    wide_projection::panorama_film(direction: ahead) within LENSES;
    wide_projection::fisheye_angles(film: unit2, half_angles: sizes2) within CANCELLING;
    wide_projection::fisheye_sees(film: unit2, half_angles: half_angles) within EXACT;
    wide_projection::fisheye_direction(film: unit2, half_angles: half_angles) within CANCELLING;
    wide_projection::fisheye_film(direction: direction, half_angles: half_angles) within CANCELLING;
    wide_projection::cubemap_direction(film: unit2) within CANCELLING;
    wide_projection::cubemap_film(direction: direction) within CANCELLING;
    // geometry/camera.rs
    camera::wide_sees(kind: wide_kind, film: unit2, half_size: half_angles) within EXACT;
    camera::wide_direction(kind: wide_kind, film: unit2, half_size: half_angles) within CANCELLING;
    camera::wide_film(kind: wide_kind, direction: ahead, half_size: half_angles) within LENSES;
    camera::camera_ray(camera: camera, film: unit2, u_lens: unit2) within ROUNDING;
    camera::undistorted_camera_ray(camera: camera, film: unit2, u_lens: unit2) within ROUNDING;
    camera::pinhole_direction(camera: camera, film: unit2) within ROUNDING;
    camera::thin_lens_ray(camera: camera, through_center: direction, u_lens: unit2) within ROUNDING;
    camera::headlight(cos_theta: signed_cosine) within ROUNDING;
    camera::camera_pixel_spread(camera: camera, height: size) within ROUNDING;
    camera::camera_depth(camera: camera, direction: direction, distance: size) within CANCELLING;
    camera::shown_at(camera: camera, offset: ahead) within FILMS;
    camera::shown_motion(camera: camera, offset: ahead, place: unit2, size: unit2) within FILMS;
    camera::camera_ray_point(ray: camera_ray, distance: share) within CANCELLING;
    camera::view_depth(position: point, eye: far_point, axis: direction) within CANCELLING;
    camera::headlit_color(color: albedo, wo: direction, normal: direction) within CANCELLING;
    camera::seen_radiance(ray: camera_ray, radiance: radiance) within ROUNDING;
    camera::pixel_footprint(spread: share, distance: size) within ROUNDING;
    camera::film_position(at: sizes2, size: sizes2) within ROUNDING;
    // geometry/bounds.rs
    bounds::box_of_nothing() within EXACT;
    bounds::box_of_two(a: point, b: point) within EXACT;
    bounds::grid_point(corner: point, scale: albedo, steps: point) within CANCELLING;
    bounds::sphere_box_corner(center: point, radius: share, cube: direction) within CANCELLING;
    // lights/light.rs
    light::no_light_sample() within EXACT;
    light::light_is_point(kind: index) within EXACT;
    light::textured_radiance(light: light, distance: size, emission: radiance) within ROUNDING;
    light::light_sample(light: light, p: point, u: unit2) within CANCELLING;
    light::light_way(wi: direction, distance: size, offset: point) within CANCELLING;
    light::light_reach(light: light, cutoff: size, falloff: falloff) within ROUNDING;
    light::is_reached(reach: light_reach, p: point) within SIDES;
    // lights/falloff.rs
    falloff::falloff_factor(coefficients: falloff, distance: size) within ROUNDING;
    falloff::falloff_distance(coefficients: falloff, ratio: size) within CANCELLING;
    light::light_is_flat(kind: index) within EXACT;
    light::flat_light_is_above(light: light, to_first: far_point, normal: direction) within SIDES;
    light::flat_light_is_near(to_first: far_point, edge1: point, edge2: point, center: share) within SIDES;
    light::triangle_light_sample(light: light, p: point, u: unit2) within CANCELLING;
    light::triangle_is_near(to_first: far_point, edge1: point, edge2: point) within SIDES;
    light::rectangle_light_sample(light: rectangle, p: point, u: unit2) within GRAZING;
    light::rectangle_is_near(to_first: far_point, edge1: point, edge2: point) within SIDES;
    light::rectangle_light_pdf(to_first: far_point, edge1: point, edge2: point, wi: direction, distance: size) within SIDES;
    light::flat_light_sample_by_area(light: light, p: point, u: unit2) within CANCELLING;
    light::flat_light_pdf_by_area(kind: index, edge1: point, edge2: point, wi: direction, distance: size) within CANCELLING;
    light::flat_light_at(light: light, p: point, place: unit2, pdf: unit) within CANCELLING;
    light::triangle_light_pdf(to_first: far_point, edge1: point, edge2: point, wi: direction, distance: size) within CANCELLING;
    light::sphere_one_minus_cos(distance2_to_center: positive, radius: share) within ROUNDING;
    light::sphere_light_sample(light: light, p: point, u: unit2) within CANCELLING;
    light::sphere_light_pdf(center: far_point, radius: share, p: point) within ROUNDING;
    light::sphere_light_side_pdf(center: far_point, radius: share, p: point, front: flag) within ROUNDING;
    light::directional_light_sample(light: sun, u: unit2) within ROUNDING;
    light::directional_light_contains(light: sun, wi: direction) within ROUNDING;
    light::point_light_sample(light: light, p: point) within ROUNDING;
    light::projected_place(light: projector, d: direction) within ROUNDING;
    light::spot_falloff(cos_axis: signed_cosine, scale: real, offset: real) within ROUNDING;
    light::spot_falloff_parameters(cos_inner: cosine, cos_outer: cosine) within ROUNDING;
    // lights/portal.rs
    portal::image_share(has_image: flag, solid_angle: positive) within EXACT;
    portal::portal_mixture(share: share, image_pdf: positive, passed: index, solid_angle: size) within ROUNDING;
    portal::triangle_is_passed(to_first: far_point, edge1: point, edge2: point, wi: direction) within SIDES;
    // lights/profile.rs
    light_profile::profile_azimuth(axis: direction, zero: turns, direction: direction) within AZIMUTHS;
    light_profile::profile_cell(axis: direction, zero: turns, direction: direction, rows: rows, columns: columns) within CELLS;
    light_profile::profile_mix(cell: profile_cell, first: unit, second: unit, third: unit, fourth: unit) within ROUNDING;
    // lights/shaft.rs
    shaft::light_shaft(light: light, low: point, high: point, extent: point) within CANCELLING;
    shaft::shaft_ends(s: shaft) within ROUNDING;
    shaft::shaft_row(row: reals4, s: shaft, size: radiance) within FAR_APART;
    shaft::shaft_ends_in(s: shaft, row_x: reals4, row_y: reals4, row_z: reals4) within FAR_APART;
    shaft::shaft_ray(e: ends_of_shaft, extent: albedo) within RECIPROCALS;
    shaft::never_zero(x: real) within EXACT;
    shaft::never_zero3(v: signed_color) within EXACT;
    shaft::shaft_crossing(scale: size, corner: real, side: real, inverse: real) within ROUNDING;
    shaft::shaft_within(interval: shaft_interval, over: reals4, under: reals4, low_inverse: real, high_inverse: real) within EXACT;
    // lights/sky.rs
    sky::gradient_sky(direction: direction, horizon: radiance, zenith: radiance, ground: radiance) within CANCELLING;
    sky::direction_to_equirect(direction: off_pole, rotation: turns) within ANGLES;
    sky::equirect_to_direction(uv: unit2, rotation: turns) within ROUNDING;
    sky::equirect_pdf(pdf_image: density, polar: unit) within ROUNDING;
    // lights/equirect.rs
    equirect::equirect_place(uv: unit2, width: count, height: count) within TEXELS;
    equirect::equirect_mix(p: equirect_place, top_left: albedo, top_right: albedo, bottom_left: albedo, bottom_right: albedo) within ROUNDING;
    equirect::equirect_pixel(uv: unit2, width: count, height: count) within STEPS;
    equirect::equirect_pixel_pdf(probability: share, pixels: count, polar: unit) within ROUNDING;
    equirect::equirect_point(pixel: pixel, within: unit2, width: count, height: count) within ROUNDING;
    equirect::rest_of_choice(rest: share, size: size) within ROUNDING;
    // lights/reservoir.rs
    reservoir::candidate_weight(contribution: radiance) within EXACT;
    reservoir::candidate_pdf(pdf: density, probability: share, count: depth) within ROUNDING;
    reservoir::candidate_place(u: unit2, number: depth) within CANCELLING;
    reservoir::candidate_fraction(u: unit, count: count) within TEXELS;
    reservoir::candidates_pdf(count: depth, probability: share, pdf: density) within ROUNDING;
    reservoir::expected_candidates(count: depth, probability: share) within ROUNDING;
    reservoir::tile_light_probability(tree_share: share, by_importance: share, uniform: share) within ROUNDING;
    reservoir::tile_uniform_probability(tree_share: share, count: count) within ROUNDING;
    reservoir::reservoir_empty(u: unit) within EXACT;
    reservoir::reservoir_add(r: reservoir, number: depth, weight: positive) within GRAZING;
    reservoir::reservoir_factor(r: reservoir) within ROUNDING;
    reservoir::reservoir_contribution(r: reservoir, contribution: radiance) within ROUNDING;
    // lights/tree.rs
    light_tree::cos_of_difference(cos_a: signed_cosine, sin_a: share, cos_b: signed_cosine, sin_b: share) within CANCELLING;
    light_tree::sin_of_difference(cos_a: signed_cosine, sin_a: share, cos_b: signed_cosine, sin_b: share) within CANCELLING;
    light_tree::light_importance(lights: light_group, p: point, normal: receiver) within GRAZING;
    light_tree::light_branch(first: positive, second: positive, u: unit) within ROUNDING;
    light_tree::node_importance_zero() within EXACT;
    light_tree::node_importance_add(node: node_importance, importance: positive) within ROUNDING;
    light_tree::child_weight(importance: positive, node: node_importance, defends: flag) within ROUNDING;
    light_tree::node_weight(node: node_importance, defends: flag) within ROUNDING;
    light_tree::light_share(weight: positive, sum: positive) within ROUNDING;
    light_tree::child_choice_none() within EXACT;
    light_tree::child_choice_add(choice: child_choice, child: depth, weight: positive, chosen: positive) within ROUNDING;
    light_tree::child_remainder(choice: child_choice, chosen: positive) within CANCELLING;
    light_tree::light_choice_probability(by_importance: share, uniform_share: share, count: size) within ROUNDING;
    light_tree::uniform_light(u: unit, count: rows) within EXACT;
    light_tree::uniform_remainder(u: unit, count: rows) within CANCELLING;
    light_tree::octahedral_encode(v: direction) within STEPS;
    light_tree::sampling_normal(normal: direction, transmits: flag) within STEPS;
    light_tree::octahedral_decode(code: octahedral) within ROUNDING;
    light_tree::refill(remainder: unit, probability: share, rest: unit) within STEPS;
    // display/tonemap.rs
    tonemap::srgb_encode_channel(x: share) within POWERS;
    tonemap::srgb_decode_channel(x: share) within POWERS;
    tonemap::srgb_encode(c: albedo) within POWERS;
    tonemap::srgb_decode(c: albedo) within POWERS;
    tonemap::saturate_color(c: radiance, saturation: share) within CANCELLING;
    tonemap::reinhard(c: radiance) within ROUNDING;
    tonemap::aces_channel(x: positive) within ROUNDING;
    tonemap::aces(c: radiance) within ROUNDING;
    tonemap::agx_contrast(x: share) within POWERS;
    tonemap::agx_channel(x: positive) within POWERS;
    tonemap::agx(c: radiance) within POWERS;
    tonemap::neutral(c: radiance) within ROUNDING;
    tonemap::tonemap(mapper: tone_mapper, radiance: radiance, exposure: exposure, saturation: share) within POWERS;
}
