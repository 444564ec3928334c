// What happens to a ray of a ray tracing pipeline: miss, closest-hit, any-hit and intersection shaders.
//
// WGSL has no words for some of it. `hit_attribute`, `hit_record`, `ignore_intersection`, `report_intersection` and the
// intersection shader are written as something else of the same shape; `pipeline/spirv.rs` turns them into what they are
// called, in the SPIR-V.

#import material, pipeline_numbers, pipeline_payload, scene
#import optics::constants

var<incoming_ray_payload> incoming: Payload;

// Weights of the triangle's second and third vertex; storage class HitAttributeKHR.
var<private> hit_attribute: vec2f;

// The record of the shader binding table that brought the ray here; storage class ShaderRecordBufferKHR.
@group(3) @binding(0) var<storage, read> hit_record: HitRecord;

@miss @incoming_payload(incoming)
fn miss_radiance() {
    incoming.hit.instance = NONE;
}

@miss @incoming_payload(incoming)
fn miss_shadow() {
    incoming.hit.instance = NONE;
}

fn report_hit(t: f32, weights: vec2f, instance: u32, primitive: u32, material_class: u32) {
    let first = hit_record.first_in_blas;
    incoming.hit = Hit(t, weights.x, weights.y, instance, hit_record.geometry, first + primitive);
    incoming.material = hit_record.material;
    incoming.material_class = material_class;
}

@closest_hit @incoming_payload(incoming)
fn hit_triangle_reflecting(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, hit_attribute, instance, primitive, CLASS_REFLECTING);
}

@closest_hit @incoming_payload(incoming)
fn hit_triangle_dielectric(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, hit_attribute, instance, primitive, CLASS_DIELECTRIC);
}

@closest_hit @incoming_payload(incoming)
fn hit_triangle_emissive(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, hit_attribute, instance, primitive, CLASS_EMISSIVE);
}

@closest_hit @incoming_payload(incoming)
fn hit_sphere_reflecting(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, vec2f(0.0), instance, primitive, CLASS_REFLECTING);
}

@closest_hit @incoming_payload(incoming)
fn hit_sphere_dielectric(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, vec2f(0.0), instance, primitive, CLASS_DIELECTRIC);
}

@closest_hit @incoming_payload(incoming)
fn hit_sphere_emissive(
    @builtin(ray_t_current_max) t: f32,
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
) {
    report_hit(t, vec2f(0.0), instance, primitive, CLASS_EMISSIVE);
}

// The candidate does not count; ends the shader.
fn ignore_intersection() {
}

@any_hit @incoming_payload(incoming)
fn look_for_holes(
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
    @builtin(object_ray_direction) direction: vec3f,
) {
    let in_blas = hit_record.first_in_blas + primitive;
    // A copy: pointers to hit attributes do not go into functions.
    let weights = hit_attribute;
    if !alpha_accepts(instance, hit_record.geometry, in_blas, weights.x, weights.y, direction, incoming.salt) {
        ignore_intersection();
    }
}

// Offers a hit at `t`; whether it counts.
fn report_intersection(t: f32) -> bool {
    return t > 0.0;
}

@any_hit @incoming_payload(incoming)
fn intersect_sphere_shader(
    @builtin(instance_custom_data) instance: u32,
    @builtin(primitive_index) primitive: u32,
    @builtin(object_ray_origin) origin: vec3f,
    @builtin(object_ray_direction) direction: vec3f,
    @builtin(ray_t_min) t_min: f32,
) {
    let sphere = sphere_at(bindings[hit_record.binding], primitive);
    let geometry = hit_record.geometry;
    let in_blas = hit_record.first_in_blas + primitive;
    // The driver knows where the ray ends. From inside the near crossing lies behind the ray's start.
    let t = sphere_crossing(instance, geometry, in_blas, sphere, origin, direction, t_min, FAR);
    if t > t_min {
        report_intersection(t);
    }
}
