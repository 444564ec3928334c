// What passes hand on from one to the next: a record for each pixel of the window, in planes.

#import film, hybrid_frame, planes, primitive, projection, scene, scene_records
#import optics::camera, optics::constants, optics::reprojection

/// Radiance gathered so far in this frame, and what reflection rays count for: 1 over the probability with which they are sent, 0
/// where none are.
const PIXEL_RADIANCE: u32 = 0u;
/// The first hit along the camera's ray: distance, place on the primitive and instance; see `Hit`.
const PIXEL_HIT: u32 = 1u;
/// Its geometry and primitive, and the motion.
const PIXEL_MOTION: u32 = 2u;
const PIXEL_PLANES: u32 = 3u;

@group(3) @binding(6) var<storage, read_write> pixels: array<vec4u>;
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

/// Where a plane of `pixels` has the record of the pixel `at`.
fn in_pixels(plane: u32, at: u32) -> u32 {
    return plane * (view.window_width * view.window_height) + at;
}

fn first_hit(at: u32) -> Hit {
    let place = pixels[in_pixels(PIXEL_HIT, at)];
    let primitive = pixels[in_pixels(PIXEL_MOTION, at)];
    let t = plane_vector(place);
    return Hit(t.x, t.y, t.z, place.w, primitive.x, primitive.y);
}

/// From where the same point of the surface was in the frame before to where it is, in pixels to the right and down.
fn first_motion(at: u32) -> vec2f {
    return bitcast<vec2f>(pixels[in_pixels(PIXEL_MOTION, at)].zw);
}

/// Radiance gathered so far; w: what reflection rays count for.
fn pixel_radiance(at: u32) -> vec4f {
    return bitcast<vec4f>(pixels[in_pixels(PIXEL_RADIANCE, at)]);
}

fn store_radiance(at: u32, radiance: vec3f, reflection_weight: f32) {
    pixels[in_pixels(PIXEL_RADIANCE, at)] = plane_floats(radiance, reflection_weight);
}

/// How the point at a hit has moved in the window; zero where nothing was hit, and where it was not in front of the camera.
fn hit_motion(hit: Hit, world: vec3f) -> vec2f {
    let local = transform_point(instances[hit.instance].world_to_object, world);
    let before = transform_point(previous_instances[hit.instance].object_to_world, local);
    let clip = clip_from(frame.previous_clip_from_world, frame.previous_eye, before);
    let size = vec2f(f32(view.window_width), f32(view.window_height));
    return window_motion(clip_position(world), clip, size, vec2f(0.0));
}

/// Begins a pixel's record with what its ray hit.
fn store_first_hit(pixel: vec2u, ray: CameraRay, hit: Hit) {
    let at = pixel_number(pixel);
    var motion = vec2f(0.0);
    if hit.instance != NONE {
        motion = hit_motion(hit, camera_ray_point(ray, hit.t));
    }
    store_radiance(at, vec3f(0.0), 0.0);
    pixels[in_pixels(PIXEL_HIT, at)] = plane_words(vec3f(hit.t, hit.u, hit.v), hit.instance);
    pixels[in_pixels(PIXEL_MOTION, at)] = vec4u(hit.geometry, hit.primitive, bitcast<vec2u>(motion));
}
