// Where ray tracing pipelines begin that make exact layers of many views.

#import views_layers

@ray_generation
fn main(@builtin(ray_invocation_id) id: vec3u) {
    answer_pixel(id.xy);
}
