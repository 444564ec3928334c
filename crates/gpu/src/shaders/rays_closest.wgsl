// The nearest hit of each ray.

#import ray, scene, tracer

fn ask(ray: Ray, salt: u32, wanted: bool) -> Hit {
    if !wanted {
        return hit_nothing();
    }
    return trace_closest(ray.origin, ray.direction, ray.t_min, ray.t_max, salt);
}
