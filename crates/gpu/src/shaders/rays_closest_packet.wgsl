// The nearest hit of each ray, of rays that go nearly the same way.

#import ray, scene, tracer_bvh_packets

fn ask(ray: Ray, salt: u32, wanted: bool) -> Hit {
    return trace_closest_packet(ray.origin, ray.direction, ray.t_min, ray.t_max, salt, wanted);
}
