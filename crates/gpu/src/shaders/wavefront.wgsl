// What the stages of the wavefront share: paths in flight, and the queues between the stages, in bind group 3.
//
// A wave is all samples of some pixels. All its paths are at the same vertex at a time:
//
//     generate → [extend → shade → connect] for each vertex → accumulate
//
// `paths` has two halves of `wave.capacity` records. `shade` reads those that arrive from one half and writes those that go
// on, without gaps, to the other. Radiance stays where it is: `gathered` has a place for each path of the wave.

/// Invocations of a workgroup of every stage.
const GROUP: u32 = 64u;

/// A path on its way to the next vertex.
struct PathRecord {
    origin: vec3f,
    /// Of the random numbers, with `sampler_index`.
    scramble: u32,
    direction: vec3f,
    /// Length of the path so far.
    length: f32,
    throughput: vec3f,
    /// Density over solid angle of `direction`; negative after the camera and delta lobes.
    pdf: f32,
    eta_scale: f32,
    sampler_index: u32,
    /// Index into `gathered`.
    slot: u32,
    /// What light samples knew of the last surface; only where there is a LIGHT_TREE.
    receiver: u32,
}

/// A `ShadowRay`, and where its contribution goes.
struct ShadowRecord {
    origin: vec3f,
    distance: f32,
    direction: vec3f,
    salt: u32,
    contribution: vec3f,
    slot: u32,
}

struct Wave {
    /// Pixels or portions of the wave, counted from the beginning of the batch.
    first_pixel: u32,
    pixel_count: u32,
    /// Records in each half of `paths`.
    capacity: u32,
    /// Segments up to the vertex that all paths are at.
    depth: u32,
    /// Paths that arrive there.
    arriving: u32,
    /// Shadow rays from there.
    shadow_rays: u32,
    /// What `shade` has handed out so far of each.
    leaving: atomic<u32>,
    casting: atomic<u32>,
}

/// Workgroups of the next dispatches.
struct Dispatches {
    /// For the paths that arrive.
    paths: array<u32, 3>,
    /// For the shadow rays.
    shadow_rays: array<u32, 3>,
}

@group(3) @binding(30) var<storage, read_write> wave: Wave;
@group(3) @binding(31) var<storage, read_write> paths: array<PathRecord>;
@group(3) @binding(32) var<storage, read_write> hits: array<Hit>;
@group(3) @binding(33) var<storage, read_write> shadow_records: array<ShadowRecord>;
@group(3) @binding(34) var<storage, read_write> gathered: array<vec3f>;
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

fn store_path(at: u32, path: Path, slot: u32) {
    paths[at].origin = path.origin;
    paths[at].scramble = path.sampler.scramble;
    paths[at].direction = path.direction;
    paths[at].length = path.length;
    paths[at].throughput = path.state.throughput;
    paths[at].pdf = select(path.state.pdf, -1.0, path.state.specular);
    paths[at].eta_scale = path.state.eta_scale;
    paths[at].sampler_index = path.sampler.index;
    paths[at].slot = slot;
    if LIGHT_TREE {
        paths[at].receiver = path.receiver;
    }
}

/// The path, with no radiance: that is in `gathered`.
fn load_path(at: u32) -> Path {
    let record = paths[at];
    var state = path_start();
    state.throughput = record.throughput;
    state.pdf = record.pdf;
    state.specular = record.pdf < 0.0;
    state.eta_scale = record.eta_scale;
    state.depth = wave.depth;
    let sampler = PixelSampler(SAMPLER, record.scramble, record.sampler_index);
    return Path(state, sampler, record.origin, record.direction, record.length, record.receiver);
}
