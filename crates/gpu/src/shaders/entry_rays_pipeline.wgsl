// Where ray tracing pipelines begin that answer rays from a list.

#import ray_list

@ray_generation
fn main(@builtin(ray_invocation_id) id: vec3u) {
    answer_ray(id.xy);
}
