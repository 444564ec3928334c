// What the passes of the real-time path tracer know of a frame, and what they hand on from one to the next: for each pixel of
// the window, row by row.

#import planes
#import optics::history, optics::scatter, optics::signal

struct RealtimeFrame {
    /// From world space, relative to `eye`, to clip space, as in `HybridFrame`.
    clip_from_world: mat4x4f,
    /// The same for the camera of the frame before.
    previous_clip_from_world: mat4x4f,
    eye: vec3f,
    /// Number of the frame since the past was forgotten.
    number: u32,
    previous_eye: vec3f,
    /// REALTIME_… bits.
    flags: u32,
    /// The window, in pixels.
    size: vec2u,
    /// Samples of a pixel in a frame.
    least_samples: u32,
    most_samples: u32,
    /// See `HistorySettings`.
    depth_tolerance: f32,
    normal_tolerance: f32,
    most_history: f32,
    clip: f32,
    /// See `AllocationSettings`.
    tolerance: f32,
    white: f32,
    noise_radius: u32,
    blur_radius: u32,
    refresh: u32,
    /// Samples that the frame can afford in all; 0: as many as are wanted.
    affordable: u32,
    /// SHOW_…
    show: u32,
    /// Frames on the film, this one included.
    on_film: u32,
    /// Radius of a pixel's footprint per metre of distance.
    pixel_spread: f32,
    seed: u32,
    /// Lights of its tile that a first surface looks at; 0: it chooses one as `path` does.
    light_candidates: u32,
    /// Number of the frame among the samples of the picture.
    sample: u32,
}

/// There is a frame before.
const REALTIME_HAS_PAST: u32 = 1u;
/// Nothing has moved since.
const REALTIME_STANDS_STILL: u32 = 2u;
/// The picture is made of what frames have found together, not of the frame's own samples alone.
const REALTIME_GATHERS: u32 = 4u;
/// Pixels have different numbers of samples.
const REALTIME_ADAPTS: u32 = 8u;
/// There is a spatial filter behind, and samples that stand out are held back.
const REALTIME_SMOOTHS: u32 = 16u;

const SHOW_PICTURE: u32 = 0u;
const SHOW_VARIANCE: u32 = 1u;
const SHOW_HISTORY: u32 = 2u;
const SHOW_NOISE: u32 = 3u;
const SHOW_BLURRED_NOISE: u32 = 4u;
const SHOW_MASK: u32 = 5u;
const SHOW_SAMPLES: u32 = 6u;
const SHOW_DIFFUSE: u32 = 7u;
const SHOW_SPECULAR: u32 = 8u;

// A pixel's records, as passes compute with them: those below, and `FoundLight`, `History` and `Signal` of the optics. In
// memory they lie in planes, which the modules of the same names describe.

/// What a pixel sees first; `realtime_guides.wgsl`.
struct Guide {
    /// What it emits, and what lies behind everything where nothing is hit: W·sr⁻¹·m⁻².
    emitted: vec3f,
    /// From the camera, in metres; 0 where nothing is hit.
    distance: f32,
    position: vec3f,
    /// From the camera of the frame before to where the same point was then.
    distance_before: f32,
    /// Colours of the diffuse and the specular lobes and the roughness.
    colors: LobeColors,
    /// Shading normal, by `octahedral_encode`.
    normal: u32,
    /// Tells surfaces apart.
    surface: u32,
    /// From where the same point was in the frame before to where it is, in pixels to the right and down.
    motion: vec2f,
}

/// A history from its planes.
fn history_of(diffuse: vec4u, specular: vec4u, moments: vec4u, owner: vec4u) -> History {
    return History(plane_vector(diffuse), bitcast<f32>(diffuse.w), plane_vector(specular), bitcast<f32>(specular.w),
        bitcast<vec4f>(moments), bitcast<f32>(owner.x));
}

fn pack_signal(s: Signal) -> vec4u {
    let held = signal_in_halves(s);
    return vec4u(pack2x16float(held.diffuse.xy), pack2x16float(vec2f(held.diffuse.z, held.diffuse_deviation)),
        pack2x16float(held.specular.xy), pack2x16float(vec2f(held.specular.z, held.specular_deviation)));
}

fn unpack_signal(packed: vec4u) -> Signal {
    let blue_diffuse = unpack2x16float(packed.y);
    let blue_specular = unpack2x16float(packed.w);
    return Signal(vec3f(unpack2x16float(packed.x), blue_diffuse.x), blue_diffuse.y,
        vec3f(unpack2x16float(packed.z), blue_specular.x), blue_specular.y);
}

fn pack_colors(c: LobeColors) -> vec4u {
    return vec4u(pack2x16float(c.diffuse.xy), pack2x16float(vec2f(c.diffuse.z, c.specular.x)),
        pack2x16float(c.specular.yz), pack2x16float(vec2f(c.roughness, 0.0)));
}

fn unpack_colors(packed: vec4u) -> LobeColors {
    let middle = unpack2x16float(packed.y);
    return LobeColors(vec3f(unpack2x16float(packed.x), middle.x), vec3f(middle.y, unpack2x16float(packed.z)),
        unpack2x16float(packed.w).x);
}

@group(3) @binding(9) var<uniform> realtime: RealtimeFrame;

fn is_set(flag: u32) -> bool {
    return (realtime.flags & flag) != 0u;
}

/// The window, for places between pixels.
fn picture_size() -> vec2f {
    return vec2f(realtime.size);
}

fn is_in_picture(pixel: vec2u) -> bool {
    return pixel.x < realtime.size.x && pixel.y < realtime.size.y;
}

fn place_of(pixel: vec2u) -> u32 {
    return pixel.y * realtime.size.x + pixel.x;
}

/// Where a plane of pixels' records has that of the pixel `at`.
fn in_plane(plane: u32, at: u32) -> u32 {
    return plane * (realtime.size.x * realtime.size.y) + at;
}
