// The scene as every shader sees it: bind group 0. Text in front of this: the optics. Text after it: textures, surfaces,
// materials and lights; then a tracer (group 1) and a kernel (group 2).
//
// A tracer implements
//
//     fn trace_closest(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> Hit
//     fn trace_any(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32) -> bool
//     fn trace_either(origin: vec3f, direction: vec3f, t_min: f32, t_max: f32, salt: u32, any: bool) -> Hit
//
// for t_min < t < t_max, with two-sided triangles and analytic spheres. The last one finds the nearest hit or, with `any`,
// some hit if there is one. Where SCENE_HAS_ALPHA, it asks `alpha_accepts`
// about every candidate on a geometry whose binding has BINDING_ALPHA, and drops what is not accepted. `salt` is a number
// of the ray that tracers hand through to that question.

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

/// What is the same everywhere in a scene.
struct SceneInfo {
    /// Radiance of the gradient sky at the horizon, at the zenith and below.
    horizon: vec3f,
    /// Size of the environment image in pixels; width 0: there is none, the gradient counts.
    environment_width: u32,
    zenith: vec3f,
    environment_height: u32,
    ground: vec3f,
    /// Rotation of the environment image in turns.
    environment_rotation: f32,
    light_count: u32,
    /// Index of the environment image's light, or NONE.
    environment_light: u32,
    /// Where the indices of lights begin, in `words`, whose disc is seen in the sky, and how many there are.
    first_disc: u32,
    disc_count: u32,
    /// Where the alias table of the environment's rows begins, in `words`: threshold and alias each.
    row_alias: u32,
    /// log₂ of the width of a layer of `texels`, and its height.
    texel_width_log2: u32,
    texel_height: u32,
    /// Where the directional albedo of sheen begins, in `words`; only in scenes with layers.
    sheen_albedo: u32,
    /// Where the tree of lights begins, in `words`: two numbers of the tree, the lights' places, its nodes; see `lights.wgsl`.
    light_tree: u32,
    /// Where the medium between bodies begins, in `words`, or NONE, and the height below which it is.
    fog_medium: u32,
    fog_top: f32,
    /// VOLUMES_… bits.
    volume_flags: u32,
    /// Where the triangles of portals begin, in `words`, nine each: a vertex and two edges; and how many there are.
    first_portal: u32,
    portal_count: u32,
    /// Where the boxes around everything that shines begin, in `words`, six numbers each: the lowest and the highest corner; and how
    /// many there are.
    emitter_boxes: u32,
    emitter_box_count: u32,
}

/// Bodies have priorities, and refract by what is on both of their sides.
const VOLUMES_NEST: u32 = 1u;
/// There are bodies that paths and cameras may be inside of.
const VOLUMES_BODIES: u32 = 2u;

const INSTANCE_IDENTITY: u32 = 1u;
const INSTANCE_MIRRORED: u32 = 2u;

/// A bottom-level structure placed in the world.
struct Instance {
    /// Rows of the 3×4 matrices.
    object_to_world: array<vec4f, 3>,
    world_to_object: array<vec4f, 3>,
    /// Index into `bindings` of the first geometry's.
    first_binding: u32,
    /// INSTANCE_… bits.
    flags: u32,
    /// Number of the bottom-level structure.
    blas: u32,
    padding: u32,
}

const BINDING_SPHERES: u32 = 1u;
const BINDING_NORMALS: u32 = 2u;
const BINDING_UV0: u32 = 4u;
const BINDING_ALPHA: u32 = 8u;

/// One geometry of one instance: what a record of a shader binding table would hold.
struct Binding {
    /// Index into `materials`.
    material: u32,
    /// Where the lights of the geometry's primitives begin in `words`, an index into `lights` each; NONE if its light cannot be
    /// sampled.
    first_light: u32,
    /// What the user calls an instance.
    object: u32,
    /// BINDING_… bits.
    flags: u32,
    /// Number of the geometry's first primitive within its bottom-level structure.
    first_in_blas: u32,
    /// Where the geometry's indices (three a triangle) or spheres (four numbers each) begin in `words`.
    first_word: u32,
    /// Index into `vertices` of the first vertex.
    first_vertex: u32,
    /// Where attributes begin in `words`, or NONE: tangents (4 numbers), second texture coordinates (2), colours (4).
    first_tangent: u32,
    first_uv1: u32,
    first_color: u32,
    padding0: u32,
    padding1: u32,
}

/// Position, normal (zero if there is none) and first texture coordinates.
struct Vertex {
    position: vec3f,
    u: f32,
    normal: vec3f,
    v: f32,
}

const TEXTURE_UV1: u32 = 1u;
const TEXTURE_BILINEAR: u32 = 2u;
const TEXTURE_SRGB: u32 = 4u;
const TEXTURE_WRAP_U_SHIFT: u32 = 4u;
const TEXTURE_WRAP_V_SHIFT: u32 = 6u;
const WRAP_REPEAT: u32 = 0u;
const WRAP_MIRRORED_REPEAT: u32 = 1u;
const WRAP_CLAMP: u32 = 2u;

/// The use of a texture by a material.
struct TextureUse {
    /// Rows of the affine map of texture coordinates.
    row_u: vec3f,
    /// Number of the first texel, or NONE for no texture.
    first_texel: u32,
    row_v: vec3f,
    /// TEXTURE_… bits; the wrap modes from their shifts on, two bits each.
    flags: u32,
    /// Size in pixels.
    width: u32,
    height: u32,
    /// The image among those of all textures: its place in a binding array.
    image: u32,
    padding: u32,
}

/// Places in a material's `textures`.
const SLOT_BASE_COLOR: u32 = 0u;
const SLOT_METALLIC_ROUGHNESS: u32 = 1u;
const SLOT_TRANSMISSION: u32 = 2u;
const SLOT_EMISSION: u32 = 3u;
const SLOT_NORMAL: u32 = 4u;

struct Material {
    /// Linear base colour and alpha.
    base_color: vec4f,
    emission: vec3f,
    /// MODEL_….
    model: u32,
    metallic: f32,
    roughness: f32,
    specular: f32,
    ior: f32,
    transmission: f32,
    normal_scale: f32,
    alpha_cutoff: f32,
    /// MATERIAL_… bits.
    flags: u32,
    checkerboard_even: vec3f,
    /// 1 / side of a square.
    checkerboard_scale: f32,
    checkerboard_odd: vec3f,
    padding: u32,
    /// Distances between which coverage falls from 1 to 0.
    checkerboard_fade: vec2f,
    /// Where the medium of what is inside begins, in `words`, or NONE.
    medium: u32,
    /// Which body is there where bodies overlap: the one of the highest.
    priority: i32,
    /// Absorption coefficient of what is inside, m⁻¹.
    absorption: vec3f,
    /// Where the layers begin, in `words`; NONE if there are none.
    layers: u32,
    textures: array<TextureUse, 5>,
}

const LIGHT_TWO_SIDED: u32 = 1u;
const LIGHT_VISIBLE: u32 = 2u;
const LIGHT_PROFILE: u32 = 4u;

/// A light and its slot of the alias table that chooses among lights.
struct LightRecord {
    position: vec3f,
    /// LIGHT_… of the optics.
    kind: u32,
    edge1: vec3f,
    size: f32,
    edge2: vec3f,
    /// LIGHT_TWO_SIDED, LIGHT_VISIBLE, LIGHT_PROFILE.
    flags: u32,
    emission: vec3f,
    /// Material whose textures modulate the light, or NONE.
    textured_material: u32,
    threshold: f32,
    alias_index: u32,
    probability: f32,
    /// Where the texture coordinates of a textured triangle's vertices are, in `words`: both sets of three pairs. Where the profile of a
    /// point or spot is, with LIGHT_PROFILE: rows, columns, values row by row.
    first_uv: u32,
}

// Bindings 0 (`scene`) and 7: see `texels_layers.wgsl` and `texels_images.wgsl`.
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> bindings: array<Binding>;
@group(0) @binding(3) var<storage, read> materials: array<Material>;
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
    return bindings[instances[hit.instance].first_binding + hit.geometry];
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
