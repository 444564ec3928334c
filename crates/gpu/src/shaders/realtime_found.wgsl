// The planes of `lights_found`, for passes that bind it.

#import lights_found, planes, realtime_frame
#import optics::signal

/// Sum of diffuse light, and how many samples that are.
const FOUND_DIFFUSE: u32 = 0u;
/// Sums of the other light, and of distances.
const FOUND_SPECULAR: u32 = 1u;
/// Sums of squares of the luminance, diffuse and specular; samples drawn so far and wanted now.
const FOUND_SQUARES: u32 = 2u;
/// What the pixel has to offer to its tile, see `realtime_tiles.wgsl`: a light, the probability with which it was chosen, 0 if none
/// was, and the pixel from which the tile's lights were chosen. Last, with REALTIME_ADAPTS, a number that has nothing to do with the
/// pixel: an entry of the list of pixels that get samples, or NONE behind the list's end.
const FOUND_OFFER: u32 = 3u;

fn found_count(at: u32) -> u32 {
    return lights_found[in_plane(FOUND_DIFFUSE, at)].w;
}

fn samples_drawn(at: u32) -> u32 {
    return lights_found[in_plane(FOUND_SQUARES, at)].z;
}

fn samples_wanted_at(at: u32) -> u32 {
    return lights_found[in_plane(FOUND_SQUARES, at)].w;
}

/// Whether the pixel has less samples of this frame than it wants.
fn wants_light(at: u32) -> bool {
    return found_count(at) < samples_wanted_at(at);
}

fn load_found_light(at: u32) -> FoundLight {
    let diffuse = lights_found[in_plane(FOUND_DIFFUSE, at)];
    let specular = lights_found[in_plane(FOUND_SPECULAR, at)];
    let squares = lights_found[in_plane(FOUND_SQUARES, at)];
    return FoundLight(plane_vector(diffuse), diffuse.w, plane_vector(specular), bitcast<f32>(specular.w),
        bitcast<vec2f>(squares.xy), squares.z, squares.w);
}
