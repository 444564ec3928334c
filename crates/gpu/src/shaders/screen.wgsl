// The film on a window: one triangle that covers all of it, a pixel of the film for each of its pixels.

#import optics::estimator, optics::tonemap

/// Sums of a pixel's samples, as in `film.wgsl`.
struct FilmPixel {
    sum: vec3f,
    count: u32,
    sum_of_squares: vec3f,
    invalid: u32,
}

struct Shown {
    /// Pixels of the film, across and down.
    film_size: vec2u,
    /// Pixels of the window.
    screen_size: vec2u,
    /// TONEMAP_… of the optics.
    mapper: u32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
}

@group(0) @binding(0) var<uniform> shown: Shown;
@group(0) @binding(1) var<storage, read> film: array<FilmPixel>;

/// The corners (−1, −1), (3, −1) and (−1, 3).
@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

/// Where sizes differ, the nearest pixel.
@fragment
fn film_pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let place = vec2u(at.xy * vec2f(shown.film_size) / vec2f(shown.screen_size));
    let pixel = min(place, shown.film_size - 1u);
    let sums = film[pixel.y * shown.film_size.x + pixel.x];
    return vec4f(tonemap(shown.mapper, mean_of_sum(sums.sum, f32(sums.count)), 1.0, 1.0), 1.0);
}
