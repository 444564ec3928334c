// Exact layers of many views: a ray through the centre of each pixel, and of what it meets only what is wanted, as the host
// hands it out. Nothing is summed.
//
// `view_layers` says what is wanted at all, so that what only wants distances fetches no surface.

#import rays, scattering, scene, surface, view_layers
#import optics::camera, optics::constants

struct ViewsTask {
    /// Size of each view, in pixels.
    width: u32,
    height: u32,
    count: u32,
    /// Rows of invocations for a view: whole workgroups.
    rows: u32,
    /// Where in `values` the first view's first pixel is, layer by layer; NONE: not wanted.
    depth: u32,
    normal: u32,
    position: u32,
    albedo: u32,
    flow: u32,
    instance: u32,
    material: u32,
    primitive: u32,
}

@group(2) @binding(0) var<uniform> views: ViewsTask;
/// One for each view, without lenses; then, if flow is wanted, that of each view's next picture.
@group(2) @binding(1) var<storage, read> cameras: array<CameraFrame>;
/// Layer by layer, view by view, row by row, the channels of a pixel together.
@group(2) @binding(2) var<storage, read_write> values: array<u32>;

/// A number that is none.
const NOT_A_NUMBER: u32 = 0x7fc00000u;

fn store_number(first: u32, place: u32, value: f32) {
    if first != NONE {
        values[first + place] = bitcast<u32>(value);
    }
}

fn store_vector(first: u32, place: u32, value: vec3f) {
    if first != NONE {
        let at = first + 3u * place;
        values[at] = bitcast<u32>(value.x);
        values[at + 1u] = bitcast<u32>(value.y);
        values[at + 2u] = bitcast<u32>(value.z);
    }
}

fn store_id(first: u32, place: u32, id: u32) {
    if first != NONE {
        values[first + place] = id;
    }
}

/// The pixel of the invocation `id`: views lie below each other.
fn answer_pixel(id: vec2u) {
    let number = id.y / views.rows;
    let pixel = vec2u(id.x, id.y % views.rows);
    if pixel.x >= views.width || pixel.y >= views.height || number >= views.count {
        return;
    }
    let index = pixel.y * views.width + pixel.x;
    let place = number * views.width * views.height + index;
    let camera = cameras[number];
    let center = vec2f(f32(pixel.x) + 0.5, f32(pixel.y) + 0.5);
    let size = vec2f(f32(views.width), f32(views.height));
    let ray = camera_ray(camera, film_position(center, size), vec2f(0.5));
    // The same as in a batch of one view.
    let hit = closest(ray.origin, ray.direction, index);
    if hit.instance == NONE {
        store_nothing(place);
        if WANTS_FLOW {
            store_flow(number, place, ray, center, size, ray.direction);
        }
        return;
    }
    let binding = hit_binding(hit);
    store_number(views.depth, place, camera_depth(camera, ray.direction, hit.t));
    store_id(views.instance, place, binding.object);
    store_id(views.material, place, binding.material);
    store_id(views.primitive, place, hit.primitive - binding.first_in_blas);
    if WANTS_SURFACE {
        let s = surface_at(ray.origin, ray.direction, hit);
        store_vector(views.normal, place, s.shading_normal);
        store_vector(views.position, place, s.position);
        if WANTS_ALBEDO {
            let spread = camera_pixel_spread(camera, f32(views.height));
            store_vector(views.albedo, place, surface_albedo(s, pixel_footprint(spread, hit.t)));
        }
        if WANTS_FLOW {
            store_flow(number, place, ray, center, size, s.position - cameras[views.count + number].origin);
        }
    }
}

/// What a ray leaves behind that meets nothing.
fn store_nothing(place: u32) {
    store_number(views.depth, place, 0.0);
    store_vector(views.normal, place, vec3f(0.0));
    store_vector(views.position, place, vec3f(0.0));
    store_vector(views.albedo, place, vec3f(0.0));
    store_id(views.instance, place, NONE);
    store_id(views.material, place, NONE);
    store_id(views.primitive, place, NONE);
}

fn store_flow(number: u32, place: u32, ray: CameraRay, center: vec2f, size: vec2f, offset: vec3f) {
    let moved = shown_motion(cameras[views.count + number], offset, center, size);
    let shown = moved.z > 0.0 && ray.weight > 0.0;
    let at = views.flow + 2u * place;
    values[at] = select(NOT_A_NUMBER, bitcast<u32>(moved.x), shown);
    values[at + 1u] = select(NOT_A_NUMBER, bitcast<u32>(moved.y), shown);
}
