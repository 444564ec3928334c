// What all passes of the hybrid renderer know of a frame: binding 0 of group 3. A frame is one sample of each pixel, and all
// pixels take it at the same place, which a rasteriser can do.

#import film, projection
#import optics::camera, optics::clusters

struct HybridFrame {
    /// From world space, relative to `eye`, to clip space: x and y over the window, z reversed (1 near, 0 far).
    clip_from_world: mat4x4f,
    /// The same for the camera of the frame before, and this frame's place in the pixel.
    previous_clip_from_world: mat4x4f,
    eye: vec3f,
    /// Index of the sample.
    sample: u32,
    previous_eye: vec3f,
    /// Pieces of geometry to draw.
    item_count: u32,
    /// Unit vector along which `clusters` are divided by distance.
    axis: vec3f,
    /// 0 or 1: whether `light_masks` tell which lights count where.
    clustered: u32,
    /// Where in the pixel, and on the lens, as random numbers.
    jitter: vec2f,
    lens: vec2f,
    /// Clusters to the right, downwards, and along `axis`.
    clusters: vec3u,
    /// Words of a cluster's mask.
    light_words: u32,
    /// Where items of each class begin.
    class_first: array<vec4u, 2>,
    /// Pixels of a cluster's side.
    tile: u32,
    /// Where the second slice of clusters begins along `axis`, and log₂ of how much farther each of the next does.
    cluster_near: f32,
    cluster_growth: f32,
    padding: u32,
}

@group(3) @binding(0) var<uniform> frame: HybridFrame;

/// The camera ray through a pixel of the window.
fn frame_ray(pixel: vec2u) -> CameraRay {
    let at = vec2f(vec2u(view.window_x, view.window_y) + pixel) + frame.jitter;
    return film_ray(view.camera, film_position(at, vec2f(f32(view.width), f32(view.height))), frame.lens);
}

fn clip_position(world: vec3f) -> vec4f {
    return clip_from(frame.clip_from_world, frame.eye, world);
}

/// Number of the slice of clusters at a distance along `frame.axis`.
fn cluster_slice(depth: f32) -> u32 {
    return slice_at(depth, frame.cluster_near, frame.cluster_growth, frame.clusters.z);
}

/// Where a slice of clusters begins along `frame.axis`.
fn slice_start(slice: u32) -> f32 {
    return slice_begin(slice, frame.cluster_near, frame.cluster_growth);
}

/// Number of an invocation of a dispatch that is as wide as a row may be.
fn flat_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * groups.x * 64u + id.x;
}
