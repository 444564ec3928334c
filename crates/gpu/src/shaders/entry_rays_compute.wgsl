// Where compute shaders begin that answer rays from a list.

#import ray_list

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    answer_ray(id.xy);
}
