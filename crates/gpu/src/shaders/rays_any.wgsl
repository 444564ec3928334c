// Whether each ray hits anything.

#import ray, scene, tracer

fn ask(ray: Ray, salt: u32, wanted: bool) -> Hit {
    var hit = hit_nothing();
    if wanted && trace_any(ray.origin, ray.direction, ray.t_min, ray.t_max, salt) {
        hit.instance = 0u;
    }
    return hit;
}
