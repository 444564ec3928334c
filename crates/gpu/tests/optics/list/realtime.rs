//! What real-time frames and rounds of adaptive sampling make of samples.

use super::*;

/// Differences of places in a window.
const MOTIONS: Tolerance = Tolerance {
    absolute: 0.02,
    relative: 1e-4,
    exceptions: 0.0,
    why: "places are hundreds of thousands of pixels away where clip positions are near the eye's plane",
};

/// Differences of numbers that may be much larger.
const DIFFERENCES: Tolerance = Tolerance {
    absolute: 1e-4,
    relative: 5e-4,
    exceptions: 0.0,
    why: "what is left of a difference is as uncertain as the larger numbers are",
};

functions! {
    realtime:
    // realtime/signal.rs
    signal::diffuse_share(whole: radiance, others: radiance) within ROUNDING;
    signal::divisor(reflectance: albedo) within EXACT;
    signal::demodulate(radiance: radiance, reflectance: albedo) within ROUNDING;
    signal::remodulate(light: radiance, reflectance: albedo) within ROUNDING;
    signal::compress(c: radiance) within ROUNDING;
    signal::expand(c: albedo) within ROUNDING;
    signal::limit_luminance(c: radiance, limit: positive) within ROUNDING;
    signal::demodulated_squares(sums: sizes2, count: positive, diffuse: albedo, specular: albedo) within ROUNDING;
    signal::found_mean(sum: radiance, count: depth) within ROUNDING;
    signal::split_light_add(light: split_light, share: albedo, radiance: radiance) within ROUNDING;
    signal::found_light_add(found: found_light, light: split_light) within ROUNDING;
    signal::signal_in_halves(s: signal) within EXACT;
    signal::signal_light(light: radiance, white: size) within ROUNDING;
    signal::signal_radiance(s: signal, white: size, diffuse: albedo, specular: albedo) within ROUNDING;
    signal::ycocg_encode(c: albedo) within CANCELLING;
    signal::ycocg_decode(c: albedo) within CANCELLING;
    // realtime/history.rs
    history::is_same_surface(expected: positive, found: positive, depth_tolerance: share, cos_between: signed_cosine, normal_tolerance: signed_cosine) within EDGES;
    history::bilinear_weight(fraction: unit2, corner: index) within ROUNDING;
    history::history_weight(kept: positive, new_samples: positive, most: positive) within ROUNDING;
    history::mirror_share(roughness: share) within ROUNDING;
    history::virtual_point(eye: point, surface: point, hit_distance: size, share: share) within CANCELLING;
    history::clip_to_box(value: signed_color, center: signed_color, half_size: radiance) within CANCELLING;
    history::deviation(mean: share, mean_of_squares: positive) within ROOTS;
    history::box_of_deviations(mean: albedo, squares: radiance, deviations: share) within ROOTS;
    history::cos_of_codes(a: octahedral, b: octahedral) within CANCELLING;
    history::distance_before(distance: size, point: point, eye: far_point, point_before: point, eye_before: far_point) within DIFFERENCES;
    history::history_empty() within EXACT;
    history::history_is_sound(h: any_history) within EXACT;
    history::history_sum_empty() within EXACT;
    history::history_sum_add(sum: history_sum, h: history, weight: share) within ROUNDING;
    history::history_sum_mean(sum: history_sum) within ROUNDING;
    // realtime/accumulation.rs
    accumulation::neighbourhood_empty() within EXACT;
    accumulation::neighbourhood_add(sum: neighbourhood, c: albedo, is_other: flag) within CANCELLING;
    accumulation::neighbourhood_mean(sum: neighbourhood) within ROUNDING;
    accumulation::clip_to_neighbourhood(past: albedo, around: neighbourhood, deviations: share) within ROOTS;
    accumulation::variance_of_mean(moments: share2, count: positive, fresh: size, around: neighbourhood) within DIFFERENCES;
    accumulation::signal_mean_join(past: signal_mean, now: radiance, count: positive, square: positive, most: positive) within CANCELLING;
    accumulation::hit_distance_join(past: positive, past_count: positive, sum: positive, count: positive, most: positive) within CANCELLING;
    accumulation::signal_of_means(diffuse: radiance, diffuse_variance: positive, specular: radiance, specular_variance: real, white: size) within ROUNDING;
    // realtime/antialiasing.rs
    antialiasing::shown_add(sum: radiance4, before: radiance4, weight: share) within ROUNDING;
    antialiasing::shown_colors_add(sum: shown_colors, radiance: radiance) within CANCELLING;
    antialiasing::clip_to_shown(past: albedo, around: shown_colors) within ROOTS;
    antialiasing::shown_in_motion(radiance: albedo, past: texel, frames: positive) within CANCELLING;
    antialiasing::shown_at_rest(radiance: radiance, past: radiance4) within CANCELLING;
    antialiasing::film_replacement(now: albedo, before: albedo, frames: size) within DIFFERENCES;
    // realtime/spatial_filter.rs
    spatial_filter::binomial_product(across: axis, down: axis) within EXACT;
    spatial_filter::spline_product(across: axis, down: axis) within EXACT;
    spatial_filter::weighted_variances(s: signal, weight: share) within ROUNDING;
    spatial_filter::smoothed_deviations(variances: sizes2, weights: size) within ROUNDING;
    spatial_filter::allowed_off_plane(pixel_spread: share, distance: size, step: size) within ROUNDING;
    spatial_filter::surface_weight(step: share, normal: direction, position: point, other_normal: direction, other_position: point, allowed: size) within POWERS;
    spatial_filter::signal_weights(geometry: share, differences: share2, deviations: share2, lobe: share) within POWERS;
    spatial_filter::filter_sum_add(sum: filter_sum, s: signal, weight: share2) within ROUNDING;
    spatial_filter::filter_sum_mean(sum: filter_sum) within ROUNDING;
    // realtime/reprojection.rs
    reprojection::window_place(clip: clip_in_front, size: sizes2) within MOTIONS;
    reprojection::window_motion(now: clip_position, before: clip_position, size: sizes2, otherwise: point2) within MOTIONS;
    reprojection::clip_depth(clip: clip_in_front) within ROUNDING;
    reprojection::upper_left_texel(place: point2) within EXACT;
    reprojection::nearest_texel(place: point2) within EXACT;
    // realtime/clusters.rs
    clusters::slice_at(depth: real, near: size, growth: size, count: count) within STEPS;
    clusters::slice_begin(slice: depth, near: size, growth: share) within POWERS;
    clusters::cluster_add_edge(b: axis_box, origin: point, direction: ahead, axis: ahead, start: share, end: size) within EDGES;
    clusters::cluster_with_room(b: axis_box, end: size) within CANCELLING;
    clusters::is_within_reach(b: axis_box, reach: light_reach) within SIDES;
    // realtime/edge_stops.rs
    edge_stops::spline_weight(away: axis) within EXACT;
    edge_stops::binomial_weight(away: axis) within EXACT;
    edge_stops::normal_weight(cos_between: share, power: size) within POWERS;
    edge_stops::plane_weight(off_plane: share, allowed: positive) within POWERS;
    edge_stops::luminance_weight(difference: share, deviation: share, tolerance: positive) within POWERS;
    edge_stops::lobe_share(roughness: share) within ROUNDING;
    // sampling/rounds.rs
    rounds::variance_of_sums(sum: share, sum_of_squares: positive, count: positive) within CANCELLING;
    rounds::neighbour_weight(dx: share, dy: share) within POWERS;
    rounds::round_gather(a: radiance4, b: radiance4) within ROUNDING;
    rounds::pixel_level(mean: signed_color) within ROUNDING;
    rounds::mean_of_pixels(sum: positive, pixels: count) within ROUNDING;
    rounds::error_offset(given: real, level: positive) within ROUNDING;
    rounds::variances_of_sums(sums: albedo, sums_of_squares: radiance, count: positive) within CANCELLING;
    rounds::relative_variances(mean: albedo, variance: radiance, offset: share) within ROUNDING;
    rounds::relative_error(mean: albedo, variance: radiance, count: positive, offset: share) within ROUNDING;
    rounds::neighbours_none() within EXACT;
    rounds::neighbours_add(n: neighbours, weight: share, mean: radiance, variance: radiance) within ROUNDING;
    rounds::neighbours_say(n: neighbours, offset: size) within ROUNDING;
    rounds::factor_logarithm(low: negative, high: size, number: depth, count: rows) within CANCELLING;
    rounds::factor_of(logarithm: turns) within POWERS;
    rounds::relative_variance(mean: share, variance: positive, offset: share) within ROUNDING;
    rounds::samples_deserved(scale: positive, weight: share, taken: positive) within ROUNDING;
    rounds::samples_of_round(deserved: positive, taken: share) within STEPS;
    // realtime/allocation.rs
    allocation::sample_variance(mean: share, mean_of_squares: positive, count: positive) within CANCELLING;
    allocation::seen_variance(variance: positive, mean: share, white: size) within ROUNDING;
    allocation::samples_missing(variance: positive, kept: share, tolerance: share) within CANCELLING;
    allocation::samples_wanted(missing: positive, least: depth, most: depth) within EXACT;
    allocation::samples_afforded(wanted: depth, scale: share, u: unit) within STEPS;
    allocation::mean_variance(mean: share, mean_of_squares: positive, count: positive) within CANCELLING;
    allocation::seen_noise(own: positive, around: positive, mean: share, white: size) within ROUNDING;
    allocation::spread_noise(most: share, noise: share, away: depth, radius: depth) within CANCELLING;
    allocation::noise_of_mean(noise: positive, count: positive) within ROUNDING;
    allocation::is_refreshed(u: unit, period: depth) within STEPS;
    allocation::affordable_share(affordable: count, wanted: count) within ROUNDING;
    allocation::shown_noise(noise: positive, tolerance: size) within ROUNDING;
    allocation::shown_samples(count: positive, most: positive) within ROUNDING;
}
