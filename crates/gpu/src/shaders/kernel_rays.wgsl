// Rays from a list, and what they hit: for scripts and benchmarks. Nothing is shaded.
//
// The text in front of this one defines RAYS_WANT_ANY: whether it is enough to know that there is a hit.

struct Ray {
    origin: vec3f,
    t_min: f32,
    direction: vec3f,
    t_max: f32,
}

struct RayList {
    count: u32,
    // Rays in a row. Those of eight neighbours in each of eight rows are traced together.
    width: u32,
}

@group(2) @binding(0) var<uniform> ray_list: RayList;
@group(2) @binding(1) var<storage, read> rays: array<Ray>;
@group(2) @binding(2) var<storage, read_write> hits: array<Hit>;

// Of any hit only the instance is known: NONE, or something else.
fn answer_ray(at: vec2u) {
    let index = at.y * ray_list.width + at.x;
    if at.x >= ray_list.width || index >= ray_list.count {
        return;
    }
    let ray = rays[index];
    var hit = hit_nothing();
    if RAYS_WANT_ANY {
        if trace_any(ray.origin, ray.direction, ray.t_min, ray.t_max, index) {
            hit.instance = 0u;
        }
    } else {
        hit = trace_closest(ray.origin, ray.direction, ray.t_min, ray.t_max, index);
    }
    hits[index] = hit;
}
