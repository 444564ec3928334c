// What the shaders of a ray tracing pipeline tell each other, and the record of the shader binding table.

enable wgpu_ray_tracing_pipeline;
enable primitive_index;
#import scene

// Travels with a ray. `hit.instance == NONE` says that nothing was met.
struct Payload {
    hit: Hit,
    // What the record of the shader binding table says of the surface.
    material: u32,
    material_class: u32,
    // Comes from who traces, for alpha tests.
    salt: u32,
}

// The data of a record of the shader binding table: `pipeline::HitRecord`.
struct HitRecord {
    material: u32,
    geometry: u32,
    first_in_blas: u32,
    binding: u32,
}
