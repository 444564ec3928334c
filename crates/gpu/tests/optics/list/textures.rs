//! Functions of `textures`.

use super::*;

/// Patterns of hashed cells, and octaves of noise.
const NOISES: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 1e-4,
    exceptions: 0.01,
    why: "octaves magnify the rounding of coordinates, and at a cell's edge the last bit says which cell it is",
};

/// Means over footprints: differences of integrals over a width that may be tiny.
const FILTERS: Tolerance = Tolerance {
    absolute: 1e-2,
    relative: 1e-4,
    exceptions: 0.01,
    why: "what rounding leaves of integrals is divided by a width down to 1e-4",
};

/// Nodes of graphs: all of the above.
const NODES: Tolerance = Tolerance {
    absolute: 1e-2,
    relative: 1e-3,
    exceptions: 0.02,
    why: "patterns, powers and noise, after a map of coordinates that compilers round in their own way",
};

functions! {
    textures:
    // textures/noise.rs
    noise::lattice_floor(x: real) within EXACT;
    noise::lattice_hash(x: texel_index, y: texel_index, z: texel_index, seed: bits) within EXACT;
    noise::perlin_fade(t: share) within ROUNDING;
    noise::gradient_dot(hash: bits, p: point) within ROUNDING;
    noise::lattice_corner(hash: bits, p: point, kind: axis) within ROUNDING;
    noise::lattice_noise(p: pattern_point, kind: flag_number, seed: bits) within NOISES;
    noise::simplex_corner(cell: lattice_point, offset: lattice_point, p: point, seed: bits) within NOISES;
    noise::simplex_noise(p: pattern_point, seed: bits) within NOISES;
    noise::single_noise(p: pattern_point, kind: axis, seed: bits) within NOISES;
    noise::octave_share(width: positive) within CANCELLING;
    noise::mean_magnitude(kind: axis) within EXACT;
    noise::fractal_noise(f: fractal, p: pattern_point, width: share) within NOISES;
    // textures/voronoi.rs
    voronoi::voronoi_cell(p: pattern_point, randomness: share, seed: bits) within NOISES;
    voronoi::hash_vector(hash: bits) within EXACT;
    // textures/patterns.rs
    patterns::pulse_mean(x: real, width: share, duty: share) within FILTERS;
    patterns::pulse_deviation(x: real, duty: share) within NOISES;
    patterns::saw_mean(x: real, width: share) within FILTERS;
    patterns::saw_deviation(x: real) within NOISES;
    patterns::sine_mean(x: real, width: share) within FILTERS;
    patterns::checkerboard_3d(p: pattern_point, width: share) within FILTERS;
    patterns::brick_wall(b: bricks, p: point2, width: share) within FILTERS;
    patterns::dot_share(p: point2, width: share, radius: share, share: share, seed: bits) within FILTERS;
    patterns::gradient_value(p: point, kind: gradient_kind) within ANGLES;
    // textures/color_nodes.rs
    color_nodes::rgb_to_hsv(c: albedo) within NOISES;
    color_nodes::hsv_to_rgb(c: albedo) within NOISES;
    color_nodes::hsv_component(c: albedo, n: share) within NOISES;
    color_nodes::adjust_hsv(c: albedo, hue: share, saturation: share, value: share) within NOISES;
    color_nodes::blackbody_color(kelvin: kelvin) within NODES;
    // textures/texture_point.rs
    texture_point::texture_point_at(coords: texel4, color: texel4) within EXACT;
    texture_point::sphere_uv_density(radius: positive) within ROUNDING;
    texture_point::area_density(e1: point, e2: far_point, d1: point, d2: far_point) within ROOTS;
    texture_point::barycentric_step(e1: point, e2: far_point, step: point) within GRAZING;
    texture_point::bump_step(world: point) within ROUNDING;
    texture_point::height_normal(height: share, along_tangent: share, along_bitangent: share, step: size) within CANCELLING;
    // textures/texture_node.rs
    texture_node::number_value(x: real) within EXACT;
    texture_node::color_value(c: albedo) within EXACT;
    texture_node::node_coordinates(n: texture_node, p: texture_point, offset: texel4) within CANCELLING;
    texture_node::node_footprint(n: texture_node, p: texture_point) within ROUNDING;
    texture_node::evaluate_node(n: texture_node, p: texture_point, a: texel4, b: texel4, c: texel4, offset: texel4) within NODES;
    texture_node::evaluate_source(n: texture_node, p: texture_point, a: texel4, b: texel4, c: texel4, offset: texel4) within NODES;
    texture_node::triplanar_weights(normal: direction, sharpness: size) within POWERS;
    texture_node::triplanar_coords(x: point, axis: axis) within EXACT;
    texture_node::evaluate_pattern(n: texture_node, x: pattern_point, width: share, a: texel4, b: texel4, c: texel4) within NODES;
    texture_node::node_noise(n: noise_node, x: pattern_point, width: share) within NODES;
    texture_node::voronoi_value(n: voronoi_node, x: pattern_point, width: share) within NODES;
    texture_node::evaluate_arithmetic(operation: node_operation, a: texel4, b: texel4, c: texel4) within NODES;
    texture_node::safe_power(x: share, y: size) within POWERS;
    texture_node::evaluate_color(n: texture_node, a: texel4, b: texel4, c: texel4) within NODES;
    texture_node::map_range(n: texture_node, x: share) within NODES;
    texture_node::graph_value(value: texel4, is_share: flag) within EXACT;
}
