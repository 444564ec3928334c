// The view and the film: bind group 2. Samples are summed in registers while a dispatch works on a pixel and added to the
// film at its end; the host adds the film to exact sums before rounding matters.

#import material, planes, scattering, surface, variant
#import optics::camera, optics::constants, optics::estimator, optics::random, optics::vertex
#ifdef MOTION
#import ray_time
#import optics::motion, optics::moving_camera, optics::shutter
#endif

/// What is to be rendered. Pixels count from the upper left of the whole picture.
struct View {
    camera: CameraFrame,
    /// Size of the whole picture.
    width: u32,
    height: u32,
    /// The part of it that the film covers.
    window_x: u32,
    window_y: u32,
    window_width: u32,
    window_height: u32,
    /// Rows of the window, and samples, of this dispatch.
    first_row: u32,
    row_count: u32,
    first_sample: u32,
    sample_count: u32,
    seed: u32,
    /// Radius of a pixel's footprint per metre of distance.
    pixel_spread: f32,
    /// 0 or 1: no compensation for light lost between microfacets.
    single_scatter: u32,
    /// `path` and `direct`: longest path in segments.
    max_depth: u32,
    /// `path`.
    roulette_start: u32,
    roulette_min_survival: f32,
    splitting: u32,
    /// `direct` and `hybrid`.
    shadow_samples: u32,
    soft_shadows: u32,
    reflection_samples: u32,
    ambient_samples: u32,
    ambient_distance: f32,
    /// Portions that this dispatch works on, and the first of them; 0: it works on rows.
    list_length: u32,
    first_in_list: u32,
    /// Irradiance below which a light does not count, W/m²; 0: all lights count.
    light_cutoff: f32,
    /// 0 or 1: whether anything stands in the light's way.
    shadows: u32,
    /// 0 or 1: Phong's highlights instead of microfacets.
    phong: u32,
    /// `hybrid`: least probability of reflection rays.
    reflection_survival: f32,
    /// How light fades with distance: coefficients of `falloff_factor`.
    falloff: vec3f,
    /// Samples of a portion.
    portion_samples: u32,
    /// `path`: the most that indirect light may add to a branch of a path.
    most_indirect: f32,
    padding0: u32,
    padding1: u32,
    padding2: u32,
#ifdef MOTION
    /// The optics' `Shutter`: open, duration, rise, fall; the delays of rows and columns; how many
    /// segments the camera has.
    shutter: vec4f,
    shutter_delays: vec4f,
    camera_motion: array<CameraSegment, 16>,
#endif
}

/// Sums of a pixel's samples, linear RGB radiance. In memory it is two vec4s, for the reason in module `planes`.
struct FilmPixel {
    sum: vec3f,
    /// Samples summed.
    count: u32,
    sum_of_squares: vec3f,
    /// Samples dropped because they were not finite.
    invalid: u32,
}

/// What a pixel's camera rays saw first. The first three and the last two are sums over `count` samples, the others belong to
/// sample 0.
struct AovPixel {
    normal: vec3f,
    count: u32,
    geometric_normal: vec3f,
    depth: f32,
    albedo: vec3f,
    /// Number of the material at the first hit, or NONE.
    material: u32,
    position: vec3f,
    object: u32,
    uv: vec2f,
    primitive: u32,
    /// Whether sample 0 is here.
    has_first: u32,
    /// What guides denoisers: sums as the first three.
    denoising_albedo: vec3f,
    padding0: u32,
    denoising_normal: vec3f,
    padding1: u32,
}

struct Counters {
    /// Rays traced, in two words.
    rays_low: atomic<u32>,
    rays_high: atomic<u32>,
    /// Auxiliary values dropped because they were not finite.
    invalid_aovs: atomic<u32>,
    padding: u32,
}

/// One buffer for both, because devices have few bindings.
struct Tally {
    counters: Counters,
    /// A pixel that gets many samples gets them in portions, each of which an invocation makes. For every pixel of the window, tile
    /// by tile: how many portions those before it get, and the first sample of its own.
    shares: array<vec2u>,
}

@group(2) @binding(0) var<uniform> view: View;
/// The pixels of the window, row by row, then those that this dispatch's portions are summed in.
/// Two words of four for each; see `FilmPixel`.
@group(2) @binding(1) var<storage, read_write> film: array<array<vec4u, 2>>;
@group(2) @binding(2) var<storage, read_write> tally: Tally;
@group(2) @binding(3) var<storage, read_write> aovs: array<AovPixel>;

/// A pixel of the window, and the first of its samples in this dispatch.
struct PixelWork {
    pixel: vec2u,
    first_sample: u32,
    /// Which of this dispatch's portions they are; NONE: the dispatch works on rows.
    portion: u32,
}

/// Whether this invocation records what camera rays see: of those that make portions of one pixel side by side, one does.
var<private> records_layers: bool = true;

/// The work at `index` of this dispatch's rows, or portion `index` of it.
fn pixel_work(index: u32) -> PixelWork {
    if view.list_length == 0u {
        let pixel = vec2u(index % view.window_width, view.first_row + index / view.window_width);
        return PixelWork(pixel, view.first_sample, NONE);
    }
    let portion = view.first_in_list + index;
    let number = pixel_of_portion(portion);
    let share = tally.shares[number];
    records_layers = portion == share.x;
    let first_sample = share.y + (portion - share.x) * view.portion_samples + view.first_sample;
    return PixelWork(pixel_in_tiles(number), first_sample, index);
}

/// Number of the pixel, tile by tile, that a portion belongs to: the last one with no more portions before it.
fn pixel_of_portion(portion: u32) -> u32 {
    var first = 0u;
    var end = arrayLength(&tally.shares);
    while end - first > 1u {
        let middle = (first + end) / 2u;
        if tally.shares[middle].x <= portion {
            first = middle;
        } else {
            end = middle;
        }
    }
    return first;
}

/// Pixel `number`, counted by tiles of eight by eight, row by row in them and of them.
fn pixel_in_tiles(number: u32) -> vec2u {
    let across = (view.window_width + 7u) / 8u;
    let tile = number / 64u;
    return 8u * vec2u(tile % across, tile / across) + vec2u(number % 8u, number / 8u % 8u);
}

/// Where in `film` a pixel's samples are.
fn film_place(pixel: vec2u) -> u32 {
    return pixel.y * view.window_width + pixel.x;
}

/// Where a pixel of the window is in its picture. Views of a batch lie below each other in one window.
fn picture_pixel(pixel: vec2u) -> vec2u {
    if MANY_VIEWS {
        return vec2u(pixel.x, pixel.y % view.height);
    }
    return vec2u(view.window_x + pixel.x, view.window_y + pixel.y);
}

/// The camera that sees a pixel of the window.
fn pixel_camera(pixel: vec2u) -> CameraFrame {
    if MANY_VIEWS {
        return stored_camera(pixel.y / view.height);
    }
    return view.camera;
}

/// Radius of the footprint, per metre of distance, of the pixel that this invocation works on.
fn pixel_spread() -> f32 {
    if MANY_VIEWS {
        return stored_spread;
    }
    return view.pixel_spread;
}

/// Of a batch of views: that of the last camera ray.
var<private> stored_spread: f32;

/// Words of a camera among `tally.shares`, two by two; `StoredCamera` in Rust.
const STORED_PAIRS: u32 = 16u;

fn stored_number(number: u32, word: u32) -> f32 {
    let pair = tally.shares[STORED_PAIRS * number + word / 2u];
    return bitcast<f32>(select(pair.x, pair.y, (word & 1u) != 0u));
}

fn stored_vector(number: u32, word: u32) -> vec3f {
    return vec3f(stored_number(number, word), stored_number(number, word + 1u), stored_number(number, word + 2u));
}

/// The camera of a view of a batch. A batch has no portions; in the place of their shares lie its cameras.
fn stored_camera(number: u32) -> CameraFrame {
    var camera: CameraFrame;
    camera.kind = bitcast<u32>(stored_number(number, 0u));
    camera.origin = stored_vector(number, 1u);
    camera.right = stored_vector(number, 4u);
    camera.up = stored_vector(number, 7u);
    camera.forward = stored_vector(number, 10u);
    camera.half_size = stored_vector(number, 13u).xy;
    camera.lens_radius = stored_number(number, 15u);
    camera.focus_distance = stored_number(number, 16u);
    if LENS_DISTORTS {
        camera.distortion.model = bitcast<u32>(stored_number(number, 17u));
        camera.distortion.skew = stored_number(number, 18u);
        camera.distortion.limit = stored_number(number, 19u);
        camera.distortion.radial = vec4f(stored_vector(number, 20u), stored_number(number, 23u));
        camera.distortion.rest = vec4f(stored_vector(number, 24u), stored_number(number, 27u));
    }
    stored_spread = stored_number(number, 28u);
    return camera;
}

/// The random numbers of a sample of a pixel of the window.
fn pixel_sampler(pixel: vec2u, sample: u32) -> PixelSampler {
    let at = picture_pixel(pixel);
    return sampler_new(SAMPLER, at.x, at.y, view.width, sample, view.seed);
}

/// The camera ray of a sample of a pixel of the window.
fn pixel_ray(pixel: vec2u, sampler: PixelSampler) -> CameraRay {
    let jitter = sample_2d(sampler, PAIR_FILM);
#ifdef MOTION
    let lens = sample_2d(sampler, PAIR_LENS);
    let shutter = Shutter(view.shutter.x, view.shutter.y, view.shutter.z, view.shutter.w,
        view.shutter_delays.x, view.shutter_delays.y);
    let on_film = vec2f(f32(view.window_x + pixel.x), f32(view.window_y + pixel.y));
    let size = vec2f(f32(view.width), f32(view.height));
    ray_time = shutter_time(shutter, on_film, size, sample_2d(sampler, PAIR_TIME).x);
    // Batches of views show the middle of the shutter, and so have no times.
    let camera = camera_now();
#else
    let camera = pixel_camera(pixel);
    var lens = jitter;
    if camera.lens_radius > 0.0 {
        lens = sample_2d(sampler, PAIR_LENS);
    }
#endif
    let place = picture_pixel(pixel);
    let at = vec2f(f32(place.x) + jitter.x, f32(place.y) + jitter.y);
    return film_ray(camera, film_position(at, vec2f(f32(view.width), f32(view.height))), lens);
}

#ifdef MOTION
/// The camera as it is now.
fn camera_now() -> CameraFrame {
    let segments = u32(view.shutter_delays.z);
    if segments == 0u {
        return view.camera;
    }
    let place = motion_place(ray_time, segments);
    return camera_in_motion(view.camera, view.camera_motion[place.segment], place.fraction);
}
#endif

/// The camera's ray through a point of the film: see `camera_ray`.
fn film_ray(camera: CameraFrame, film: vec2f, u_lens: vec2f) -> CameraRay {
    if LENS_DISTORTS {
        return camera_ray(camera, film, u_lens);
    }
    return undistorted_camera_ray(camera, film, u_lens);
}

/// A pixel's samples in this dispatch.
struct SampleSums {
    sum: vec3f,
    sum_of_squares: vec3f,
    count: u32,
    invalid: u32,
}

fn is_valid_sample(c: vec3f) -> bool {
    return is_valid_radiance(c);
}

fn add_sample(sums: SampleSums, radiance: vec3f) -> SampleSums {
    var next = sums;
    if is_valid_sample(radiance) {
        next.sum += radiance;
        next.sum_of_squares += squared(radiance);
        next.count += 1u;
    } else {
        next.invalid += 1u;
    }
    return next;
}

/// Adds what this invocation has made to the film, or to the sums of its portion. Where those are is found only now: NVIDIA's
/// driver 580 has ray generation shaders store to another pixel if it was found before the rays were traced.
fn store_samples(work: PixelWork, sums: SampleSums) {
    let portion = view.window_width * view.window_height + work.portion;
    add_to_film(select(portion, film_place(work.pixel), work.portion == NONE), sums);
}

/// The sums at a place of the film.
fn load_film_pixel(index: u32) -> FilmPixel {
    let sum = film[index][0];
    let squares = film[index][1];
    return FilmPixel(plane_vector(sum), sum.w, plane_vector(squares), squares.w);
}

/// Adds to a place of the film.
fn add_to_film(index: u32, sums: SampleSums) {
    let before = load_film_pixel(index);
    film[index][0] = plane_words(before.sum + sums.sum, before.count + sums.count);
    film[index][1] = plane_words(before.sum_of_squares + sums.sum_of_squares, before.invalid + sums.invalid);
}

/// A mean layer's value, or zero if it is not finite, which is counted.
fn valid_layer(value: vec3f) -> vec3f {
    if is_valid_sample(value) {
        return value;
    }
    atomicAdd(&tally.counters.invalid_aovs, 1u);
    return vec3f(0.0);
}

/// Records that a camera ray hit nothing.
fn record_miss(pixel: vec2u, sample: u32) {
    if !records_layers {
        return;
    }
    let index = film_place(pixel);
    aovs[index].count += 1u;
    if sample == 0u {
        aovs[index].has_first = 1u;
        aovs[index].depth = 0.0;
        aovs[index].position = vec3f(0.0);
        aovs[index].uv = vec2f(0.0);
        aovs[index].material = NONE;
        aovs[index].object = NONE;
        aovs[index].primitive = NONE;
    }
}

/// Records what a camera ray hit at distance `depth`, and takes it for what guides denoisers.
fn record_hit(pixel: vec2u, sample: u32, s: Surface, depth: f32) {
    record_first_hit(pixel, sample, s, depth);
    if WANTS_FEATURES {
        record_features(pixel, vec3f(1.0), 1u, s, pixel_footprint(pixel_spread(), depth));
    }
}

/// Records what guides denoisers: the first surface on the way of a path that is neither mirror nor clear glass.
/// `throughput`: of the path as it arrives, `depth` its segments.
fn record_features(pixel: vec2u, throughput: vec3f, depth: u32, s: Surface, footprint: f32) {
    if !records_layers {
        return;
    }
    var albedo = vec3f(1.0);
    // What shines in mirrors is white: radiance is divided by albedo.
    if depth == 1u || !may_shine(s.material) {
        albedo = surface_albedo(s, footprint);
    }
    record_seen(pixel, throughput, depth, albedo);
    aovs[film_place(pixel)].denoising_normal += valid_layer(s.shading_normal);
}

/// The same where a path leaves the scene after mirrors and clear glass.
fn record_sky(pixel: vec2u, throughput: vec3f, depth: u32) {
    if records_layers && depth > 1u {
        record_seen(pixel, throughput, depth, vec3f(1.0));
    }
}

fn record_seen(pixel: vec2u, throughput: vec3f, depth: u32, albedo: vec3f) {
    let branches = select(1u, view.splitting, SPLITS_PATHS);
    let seen = valid_layer(seen_albedo(throughput, depth, branches, albedo));
    aovs[film_place(pixel)].denoising_albedo += seen;
}

/// Records what a camera ray hit at distance `depth`.
fn record_first_hit(pixel: vec2u, sample: u32, s: Surface, depth: f32) {
    if !records_layers {
        return;
    }
    let index = film_place(pixel);
    aovs[index].count += 1u;
    aovs[index].normal += valid_layer(s.shading_normal);
    aovs[index].geometric_normal += valid_layer(s.normal);
    aovs[index].albedo += valid_layer(surface_albedo(s, pixel_footprint(pixel_spread(), depth)));
    if sample == 0u {
        aovs[index].has_first = 1u;
        aovs[index].depth = depth;
        aovs[index].position = s.position;
        aovs[index].uv = s.coords.xy;
        aovs[index].material = s.material;
        aovs[index].object = s.object;
        aovs[index].primitive = s.primitive;
    }
}

/// Adds to the rays counted, with a carry into the upper word.
fn count_rays(rays: u32) {
    let before = atomicAdd(&tally.counters.rays_low, rays);
    if before + rays < before {
        atomicAdd(&tally.counters.rays_high, 1u);
    }
}
