// Where compute shaders begin that make exact layers of many views.

#import views_layers

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    answer_pixel(id.xy);
}
