// What passes hand on from one to the next: a record for each pixel of the window.

struct HybridPixel {
    /// Radiance gathered so far in this frame.
    radiance: vec3f,
    /// The first hit along the camera's ray; see `Hit`.
    t: f32,
    u: f32,
    v: f32,
    instance: u32,
    geometry: u32,
    primitive: u32,
    /// From where the same point of the surface was in the frame before to where it is, in pixels to the right and down.
    motion_x: f32,
    motion_y: f32,
    /// What reflection rays count for: 1 over the probability with which they are sent, 0 where none are.
    reflection_weight: f32,
}

@group(3) @binding(6) var<storage, read_write> pixels: array<HybridPixel>;
/// Rays that were traced for each pixel after its first hit was found. The first pass that lights it begins with none, each pass adds
/// its own, and the last one adds them to the device's counter: counting within workgroups takes barriers, which software drivers compile slowly in shaders that trace.
@group(3) @binding(10) var<storage, read_write> ray_counts: array<u32>;
/// The instances as they stood in the frame before.
@group(3) @binding(7) var<storage, read> previous_instances: array<Instance>;

/// Whether an invocation has a pixel: of the dispatch's rows.
fn is_in_rows(id: vec3u) -> bool {
    return id.x < view.window_width && id.y < view.row_count;
}

fn pixel_in_rows(id: vec3u) -> vec2u {
    return vec2u(id.x, view.first_row + id.y);
}

fn pixel_number(pixel: vec2u) -> u32 {
    return pixel.y * view.window_width + pixel.x;
}

fn first_hit(at: u32) -> Hit {
    return Hit(pixels[at].t, pixels[at].u, pixels[at].v, pixels[at].instance, pixels[at].geometry, pixels[at].primitive);
}

/// Where a clip position lies in the window, in pixels to the right and down.
fn window_position(clip: vec4f) -> vec2f {
    return vec2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w)
        * vec2f(f32(view.window_width), f32(view.window_height));
}

/// How the point at a hit has moved in the window; zero where nothing was hit, and where it was not in front of the camera.
fn hit_motion(hit: Hit, world: vec3f) -> vec2f {
    let local = transform_point(instances[hit.instance].world_to_object, world);
    let before = transform_point(previous_instances[hit.instance].object_to_world, local);
    let clip = frame.previous_clip_from_world * vec4f(before - frame.previous_eye, 1.0);
    let now = clip_position(world);
    if clip.w <= 0.0 || now.w <= 0.0 {
        return vec2f(0.0);
    }
    return window_position(now) - window_position(clip);
}

/// Begins a pixel's record with what its ray hit.
fn store_first_hit(pixel: vec2u, ray: CameraRay, hit: Hit) {
    let at = pixel_number(pixel);
    var motion = vec2f(0.0);
    if hit.instance != NONE {
        motion = hit_motion(hit, ray.origin + ray.direction * hit.t);
    }
    pixels[at] = HybridPixel(vec3f(0.0), hit.t, hit.u, hit.v, hit.instance, hit.geometry, hit.primitive, motion.x, motion.y, 0.0);
}
