// What the stages of the wavefront share: paths in flight, and the queues between the stages, in bind group 3.
//
// A wave is all samples of some pixels. All its paths are at the same vertex at a time:
//
//     generate → [extend → shade → connect] for each vertex but the last → extend_last → shade → accumulate
//
// `paths` has two halves of `wave.capacity` records. `shade` reads those that arrive from one half and writes those that go
// on, without gaps, to the other. Radiance stays where it is: `gathered` has a place for each path of the wave.

#import film, path_vertex, planes, scene, variant
#import optics::path, optics::random

/// Invocations of a workgroup of every stage but `shade`.
const GROUP: u32 = 64u;
/// Invocations of a workgroup of `shade`, which share their additions to the counters that all share.
const SHADE_GROUP: u32 = 128u;

/// Planes of a path on its way to the next vertex.
/// Origin, and `scramble` of its random numbers.
const PATH_ORIGIN: u32 = 0u;
/// Direction, and length of the path so far.
const PATH_DIRECTION: u32 = 1u;
/// Throughput, and density over solid angle of the direction; negative after the camera and delta lobes.
const PATH_THROUGHPUT: u32 = 2u;
/// `eta_scale`, negative while the path looks for what guides denoisers, index of its random numbers, index into `gathered`, and what light samples knew of the last surface; that only
/// where there is a LIGHT_TREE.
const PATH_REST: u32 = 3u;
const PATH_PLANES: u32 = 4u;

/// Planes of where a path arrives: distance, place on the primitive and instance; geometry, primitive, and whether the surface
/// there is what guides denoisers, which `shade` finds out.
const HIT_PLANES: u32 = 2u;

/// Planes of a shadow ray. Origin and distance; direction and salt; contribution, and which place of `gathered` that goes to.
const SHADOW_ORIGIN: u32 = 0u;
const SHADOW_DIRECTION: u32 = 1u;
const SHADOW_CONTRIBUTION: u32 = 2u;
const SHADOW_PLANES: u32 = 3u;

struct Wave {
    /// Pixels or portions of the wave, counted from the beginning of the batch.
    first_pixel: u32,
    pixel_count: u32,
    /// Records in each half of `paths`.
    capacity: u32,
    /// Segments up to the vertex that all paths are at.
    depth: u32,
    /// Paths that arrive there.
    path_count: u32,
    /// Shadow rays from there.
    shadow_rays: u32,
    /// What `shade` has handed out so far of each.
    next_path_count: atomic<u32>,
    casting: atomic<u32>,
}

/// Workgroups of the next dispatches.
struct Dispatches {
    /// For the paths that arrive.
    paths: array<u32, 3>,
    /// For `shade`, of the same paths.
    shading: array<u32, 3>,
    /// For the shadow rays.
    shadow_rays: array<u32, 3>,
}

@group(3) @binding(30) var<storage, read_write> wave: Wave;
@group(3) @binding(31) var<storage, read_write> paths: array<vec4u>;
@group(3) @binding(32) var<storage, read_write> hits: array<vec4u>;
@group(3) @binding(33) var<storage, read_write> shadow_records: array<vec4u>;
@group(3) @binding(34) var<storage, read_write> gathered: array<vec4f>;
@group(3) @binding(35) var<storage, read_write> dispatches: Dispatches;

/// Where the paths begin that arrive at vertex `depth`.
fn half_of(depth: u32) -> u32 {
    return select(wave.capacity, 0u, (depth & 1u) != 0u);
}

/// Paths of a sample that go on from the first vertex.
fn branch_count() -> u32 {
    return select(1u, view.splitting, SPLITS_PATHS);
}

/// Pixel of the window that path `index` of the camera begins at, and its sample.
fn wave_work(index: u32) -> PixelWork {
    var work = pixel_work(wave.first_pixel + index / view.sample_count);
    work.first_sample += index % view.sample_count;
    return work;
}

/// Where a plane of both halves of `paths` has its record `at`.
fn in_paths(plane: u32, at: u32) -> u32 {
    return plane * 2u * wave.capacity + at;
}

/// The same of `hits` and `shadow_records`.
fn in_queue(plane: u32, at: u32) -> u32 {
    return plane * wave.capacity + at;
}

fn store_path(at: u32, path: Path, slot: u32) {
    paths[in_paths(PATH_ORIGIN, at)] = plane_words(path.origin, path.sampler.scramble);
    paths[in_paths(PATH_DIRECTION, at)] = plane_floats(path.direction, path.length);
    let pdf = select(path.state.pdf, -1.0, path.state.specular);
    paths[in_paths(PATH_THROUGHPUT, at)] = plane_floats(path.state.throughput, pdf);
    let looks = WANTS_FEATURES && path.looks;
    let eta_scale = bitcast<u32>(select(path.state.eta_scale, -path.state.eta_scale, looks));
    paths[in_paths(PATH_REST, at)] = vec4u(eta_scale, path.sampler.index, slot, path.sampling_normal);
}

/// The path, with no radiance: that is in `gathered`.
fn load_path(at: u32) -> Path {
    let origin = paths[in_paths(PATH_ORIGIN, at)];
    let direction = bitcast<vec4f>(paths[in_paths(PATH_DIRECTION, at)]);
    let throughput = bitcast<vec4f>(paths[in_paths(PATH_THROUGHPUT, at)]);
    let rest = paths[in_paths(PATH_REST, at)];
    var state = path_start();
    state.throughput = throughput.xyz;
    state.pdf = throughput.w;
    state.specular = throughput.w < 0.0;
    let eta_scale = bitcast<f32>(rest.x);
    state.eta_scale = select(eta_scale, abs(eta_scale), WANTS_FEATURES);
    state.depth = wave.depth;
    let sampler = PixelSampler(SAMPLER, origin.w, rest.y);
    return Path(state, sampler, plane_vector(origin), direction.xyz, direction.w, rest.w,
        WANTS_FEATURES && eta_scale < 0.0);
}

/// The place of a path in `gathered`.
fn path_slot(at: u32) -> u32 {
    return paths[in_paths(PATH_REST, at)].z;
}

fn store_hit(at: u32, hit: Hit) {
    hits[in_queue(0u, at)] = plane_words(vec3f(hit.t, hit.u, hit.v), hit.instance);
    hits[in_queue(1u, at)] = vec4u(hit.geometry, hit.primitive, 0u, 0u);
}

/// Says that the surface where a path arrives is what guides denoisers.
fn note_features(at: u32) {
    hits[in_queue(1u, at)].z = 1u;
}

fn has_features(at: u32) -> bool {
    return hits[in_queue(1u, at)].z != 0u;
}

fn load_hit(at: u32) -> Hit {
    let place = hits[in_queue(0u, at)];
    let primitive = hits[in_queue(1u, at)];
    let t = plane_vector(place);
    return Hit(t.x, t.y, t.z, place.w, primitive.x, primitive.y);
}

/// `slot`: where its contribution goes.
fn store_shadow_ray(at: u32, ray: ShadowRay, slot: u32) {
    shadow_records[in_queue(SHADOW_ORIGIN, at)] = plane_floats(ray.origin, ray.distance);
    shadow_records[in_queue(SHADOW_DIRECTION, at)] = plane_words(ray.direction, ray.salt);
    shadow_records[in_queue(SHADOW_CONTRIBUTION, at)] = plane_words(ray.contribution, slot);
}

fn load_shadow_ray(at: u32) -> ShadowRay {
    let origin = bitcast<vec4f>(shadow_records[in_queue(SHADOW_ORIGIN, at)]);
    let direction = shadow_records[in_queue(SHADOW_DIRECTION, at)];
    let contribution = shadow_records[in_queue(SHADOW_CONTRIBUTION, at)];
    return ShadowRay(origin.xyz, origin.w, plane_vector(direction), direction.w, plane_vector(contribution));
}

fn shadow_ray_slot(at: u32) -> u32 {
    return shadow_records[in_queue(SHADOW_CONTRIBUTION, at)].w;
}
