//! Functions of light transport.

use super::*;

functions! {
    transport:
    // transport/medium.rs
    medium::transmittance(extinction: albedo, distance: size) within POWERS;
    medium::transmitted_radiance(radiance: radiance, extinction: albedo, distance: size) within POWERS;
    // transport/volume.rs
    volume::vacuum() within EXACT;
    volume::medium_extinction(m: medium) within ROUNDING;
    volume::medium_scatters(m: medium) within EXACT;
    volume::channel_probabilities(throughput: albedo) within ROUNDING;
    volume::choose_channel(values: radiance, probabilities: albedo, u: unit) within EXACT;
    volume::medium_sample(m: medium, throughput: albedo, end: size, u: unit2) within DISTANCES;
    volume::medium_emitted(m: medium, distance: size) within DEPTHS;
    volume::effective_length(extinction: positive, distance: size) within DEPTHS;
    volume::medium_survival(path: path, start: depth, min_survival: share) within ROUNDING;
    volume::diluted(m: medium, density: share) within ROUNDING;
    volume::collide(m: medium, majorant: size, throughput: albedo, u: unit) within STEPS;
    volume::ratio_tracking_factor(extinction: coefficients, majorant: size) within CANCELLING;
    volume::below_height(height: real, slope: signed_cosine, top: real, end: size) within CANCELLING;
    volume::grid_majorant(m: medium, largest: positive, diagonal: size) within ROUNDING;
    volume::grid_place(x: real, low: negative, high: size, cells: count) within STEPS;
    volume::collision_distance(majorant: size, u: unit) within DISTANCES;
    volume::stream_start(sampler: sampler, segment: bits, purpose: index) within EXACT;
    volume::stream_next(state: bits) within EXACT;
    volume::stopping_distance(origin: point, distance: size, end: size) within CANCELLING;
    volume::phase_value(wo: direction, wi: direction, g: anisotropy) within CANCELLING;
    volume::phase_scatter(wo: direction, g: anisotropy, alone: flag, u: unit2) within GRAZING;
    volume::phase_eval(cos_theta: signed_cosine, g: anisotropy) within CANCELLING;
    volume::phase_sample(wo: direction, g: anisotropy, u: unit2) within GRAZING;
    volume::grid_mix(p: between_cells, cell: share, next: share) within ROUNDING;
    volume::ior_across(inside: ior, around: ior) within ROUNDING;
    volume::segment_pair(segment: depth) within EXACT;
    volume::continue_in_medium(path: path, s: scattered, walk: body, roulette: roulette, u: unit) within SIDES;
    // transport/interiors.rs
    interiors::interiors_nothing() within EXACT;
    interiors::interiors_contain(i: interiors, material: body) within EXACT;
    interiors::interiors_are_full(i: interiors) within EXACT;
    interiors::interiors_enter(i: interiors, material: body, priority: priority) within EXACT;
    interiors::interiors_leave(i: interiors, material: body) within EXACT;
    interiors::interiors_cross(i: interiors, material: body, priority: priority, front: flag) within EXACT;
    interiors::interiors_current(i: interiors) within EXACT;
    interiors::interiors_hide(i: interiors, priority: priority) within EXACT;
    interiors::interiors_along(i: interiors, seen: body_or_none) within EXACT;
    interiors::surroundings_unknown() within EXACT;
    interiors::surroundings_past(s: surroundings, material: body, priority: priority, front: flag) within EXACT;
    interiors::surroundings_direction() within ROUNDING;
    // transport/mis.rs
    mis::mis_weight(pdf_a: density, pdf_b: density, squared: flag) within ROUNDING;
    mis::light_sample_weight(h: mis_heuristic, light_pdf: density, bsdf_pdf: density) within ROUNDING;
    mis::bsdf_sample_weight(h: mis_heuristic, bsdf_pdf: density, light_pdf: density) within ROUNDING;
    // transport/path.rs
    path::path_start() within EXACT;
    path::path_add_emission(path: path, emitted: radiance, light_pdf: density, mis: mis_heuristic) within ROUNDING;
    path::limit_indirect(found: radiance, segments: depth, most: unit) within ROUNDING;
    path::path_limit_found(path: path, before: albedo, most: unit) within CANCELLING;
    path::path_light_contribution(throughput: albedo, bsdf: bsdf_value, radiance: radiance, light_pdf: density, delta: flag, mis: mis_heuristic) within ROUNDING;
    path::path_scatter(path: path, s: scattered, eta: eta) within ROUNDING;
    path::roulette_survival(path: path, start: depth, min_survival: share) within ROUNDING;
    // transport/photons.rs
    photons::photon_sampler(seed: bits, pass_index: bits, photon: bits) within EXACT;
    photons::photon_pass(sample_index: bits) within EXACT;
    photons::photon_radius2(first: size, pass_index: count) within POWERS;
    photons::photon_kernel(distance2: share, radius2: size) within CANCELLING;
    photons::expected_photons(count: size, radius2: size, cos_theta: signed_cosine, pdf: density) within ROUNDING;
    photons::photon_share(expected: density) within ROUNDING;
    photons::chance_share(expected: density) within ROUNDING;
    photons::etendue_scale(eta: eta, bends: flag) within ROUNDING;
    photons::adjoint_factor(wo: direction, wi: direction, shading: direction, normal: direction) within EDGES;
    photons::target_solid_angle(center: point, radius: size, p: point) within SIDES;
    photons::target_direction(center: point, radius: size, p: point, u: unit2) within GRAZING;
    photons::target_is_ahead(center: point, radius: size, p: point, direction: direction) within SIDES;
    photons::target_is_crossed(center: point, radius: size, p: point, direction: direction) within SIDES;
    photons::target_disc_point(center: point, radius: size, direction: direction, u: unit2) within CANCELLING;
    photons::photon_cell(p: point, per_metre: size) within STEPS;
    photons::photon_bucket(cell: point, count: count) within EXACT;
    // transport/direct_light.rs
    direct_light::direct_contribution(value_cos: albedo, light: light_sample, falloff: falloff) within ROUNDING;
    direct_light::share_of_samples(contribution: radiance, count: depth) within ROUNDING;
    direct_light::reflection_roulette(reflected: share, least: size, u: unit) within ROUNDING;
    direct_light::with_reflection(radiance: radiance, weight: positive, seen: radiance) within ROUNDING;
    // transport/vertex.rs
    vertex::vertex_pair(depth: depth) within EXACT;
    vertex::is_last_segment(depth: depth, max_depth: depth) within EXACT;
    vertex::path_branch(path: path, branches: depth) within ROUNDING;
    vertex::seen_albedo(throughput: albedo, depth: depth, branches: depth, albedo: albedo) within ROUNDING;
    vertex::light_side(wi: direction, pdf: density, frame: frame, horizon: direction, transmits: flag) within CANCELLING;
    vertex::light_is_possible(wi: direction, pdf: density, normal: direction, horizon: direction, transmits: flag) within SIDES;
    vertex::shadow_way(wi: direction, distance: size, offset: point) within CANCELLING;
    vertex::leaves_surface(s: scattered, above: flag) within EXACT;
    vertex::continue_from_surface(path: path, s: scattered, frame: frame, horizon: direction, eta: eta, roulette: roulette, u: unit) within SIDES;
    // transport/estimator.rs
    estimator::moments_empty() within EXACT;
    estimator::moments_add(m: moments, x: positive) within ROUNDING;
    estimator::moments_merge(a: moments, b: moments) within ROUNDING;
    estimator::moments_variance(m: moments) within ROUNDING;
    estimator::variance_of_means(means: moments, samples: positive) within ROUNDING;
    estimator::is_valid_radiance(c: anything3) within EXACT;
    estimator::squared(c: signed_color) within ROUNDING;
    estimator::mean_of_sum(sum: radiance, count: positive) within ROUNDING;
    estimator::moments_standard_error(m: moments) within ROUNDING;
}
