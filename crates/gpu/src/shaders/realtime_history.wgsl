// The planes of `histories`, for passes that bind it.

#import histories, realtime_frame
#import optics::history

/// Mean of diffuse light, and how many samples that is worth.
const HISTORY_DIFFUSE: u32 = 0u;
/// The same of the other light.
const HISTORY_SPECULAR: u32 = 1u;
const HISTORY_MOMENTS: u32 = 2u;
/// Whose it is: mean distance to what lights the surface specularly; the surface, its normal, its distance from the camera.
const HISTORY_OWNER: u32 = 3u;

fn diffuse_count(at: u32) -> f32 {
    return bitcast<f32>(histories[in_plane(HISTORY_DIFFUSE, at)].w);
}

fn history_moments(at: u32) -> vec4f {
    return bitcast<vec4f>(histories[in_plane(HISTORY_MOMENTS, at)]);
}

fn load_history(at: u32) -> History {
    return history_of(histories[in_plane(HISTORY_DIFFUSE, at)], histories[in_plane(HISTORY_SPECULAR, at)],
        histories[in_plane(HISTORY_MOMENTS, at)], histories[in_plane(HISTORY_OWNER, at)]);
}
