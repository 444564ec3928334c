// The scene as every shader sees it: bind group 0. Binding 0 and the texels are in `texels_layers.wgsl` and
// `texels_images.wgsl`.
//
// A module that stands for `tracer` (group 1) implements
//
//     fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit
//     fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool
//     fn trace_either(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit
//
// for t_min < t < t_max, with two-sided triangles and analytic spheres. The last one finds the nearest hit or, with `any`,
// some hit if there is one. Where SCENE_HAS_ALPHA, it asks `alpha_accepts`
// about every candidate on a geometry whose binding has BINDING_ALPHA, and drops what is not accepted. `salt` is a number
// of the ray that tracers hand through to that question.

#import scene_records, variant
#import optics::constants, optics::material

/// What a ray hit. `instance` is NONE if nothing.
struct Hit {
    /// Distance along the ray, in units of its direction's length.
    t: f32,
    /// Barycentric weights of the second and third vertex; zero on spheres.
    u: f32,
    v: f32,
    /// Index into `instances`.
    instance: u32,
    /// Number of the geometry within the instance's bottom-level structure.
    geometry: u32,
    /// Number of the primitive within the bottom-level structure, all geometries counted.
    primitive: u32,
}

// Bindings 0 (`scene`) and 7: see `texels_layers.wgsl` and `texels_images.wgsl`.
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> bindings: array<Binding>;
@group(0) @binding(3) var<storage, read> materials: array<MaterialRecord>;
@group(0) @binding(4) var<storage, read> lights: array<LightRecord>;
@group(0) @binding(5) var<storage, read> vertices: array<Vertex>;
/// Whatever is looked up by word: vertex indices, spheres, rare attributes, small tables.
@group(0) @binding(6) var<storage, read> words: array<u32>;
/// Radiance of the environment image, and the probability of sampling each pixel.
@group(0) @binding(8) var environment_texels: texture_2d<f32>;
/// Alias table of each row of the environment image: threshold (as bits) and alias.
@group(0) @binding(9) var environment_alias: texture_2d<u32>;
/// Directional albedo of the GGX reflection lobe.
@group(0) @binding(10) var ggx_albedo: texture_2d<f32>;
/// Directional albedo of a rough dielectric; its planes one below the other.
@group(0) @binding(11) var dielectric_albedo: texture_2d<f32>;

/// A number from `words`.
fn word_f32(at: u32) -> f32 {
    return bitcast<f32>(words[at]);
}

fn words_vec2(at: u32) -> vec2f {
    return vec2f(word_f32(at), word_f32(at + 1u));
}

fn words_vec3(at: u32) -> vec3f {
    return vec3f(word_f32(at), word_f32(at + 1u), word_f32(at + 2u));
}

fn words_vec4(at: u32) -> vec4f {
    return vec4f(word_f32(at), word_f32(at + 1u), word_f32(at + 2u), word_f32(at + 3u));
}

/// The binding that a hit leads to.
fn hit_binding(hit: Hit) -> Binding {
    var binding = bindings[instances[hit.instance].first_binding + hit.geometry];
    binding.flags &= FLAGS_OF_GEOMETRIES;
    if !SCENE_HAS_VERTEX_COLORS {
        binding.first_color = NONE;
    }
    return binding;
}

/// INSTANCE_… bits of an instance.
fn instance_flags(instance: u32) -> u32 {
    return (instances[instance].flags & FLAGS_OF_INSTANCES) | FLAGS_OF_ALL_INSTANCES;
}

/// A material, in which what all of the scene's have in common is a constant, so that compilers leave out the rest.
fn material_at(index: u32) -> MaterialRecord {
    var material = materials[index];
    material.flags &= FLAGS_OF_MATERIALS;
    if ALL_MODELS_ARE != NONE {
        material.model = ALL_MODELS_ARE;
    }
    if !SCENE_MIXES_MODELS {
        material.transmission = 0.0;
    }
    return material;
}

/// Whether a material has a texture at `SLOT_…`.
fn has_texture(material: u32, slot: u32) -> bool {
    return (SLOTS_WITH_TEXTURES & (1u << slot)) != 0u && materials[material].textures[slot].first_texel != NONE;
}

/// Vertex numbers of a triangle, relative to the geometry's first vertex. `primitive`: number within its geometry.
fn triangle_corners(binding: Binding, primitive: u32) -> vec3u {
    let at = binding.first_word + 3u * primitive;
    return vec3u(words[at], words[at + 1u], words[at + 2u]);
}

/// Centre and radius. `primitive`: number within its geometry.
fn sphere_at(binding: Binding, primitive: u32) -> vec4f {
    return words_vec4(binding.first_word + 4u * primitive);
}

/// A hit on nothing.
fn hit_nothing() -> Hit {
    return Hit(0.0, 0.0, 0.0, NONE, 0u, 0u);
}
