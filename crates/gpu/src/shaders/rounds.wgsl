// Which pixels get samples in a round, and how many: the rule of `film::Allocation`, applied to the film on the device.
//
// Pixels are dealt with in tiles of eight by eight, a workgroup each; what is summed over the picture is summed by tile first,
// always in the same order.

#import optics::estimator, optics::rounds

/// Sums of a pixel's samples, as in `film.wgsl`.
struct FilmPixel {
    sum: vec3f,
    count: u32,
    sum_of_squares: vec3f,
    invalid: u32,
}

/// What a round is to do.
struct Round {
    /// The window's pixels.
    size: vec2u,
    /// Of the picture.
    first_sample: u32,
    /// Which size of portions is to be shared out.
    size_number: u32,
    /// Samples of all pixels when the round is over.
    total: f32,
    /// What is added to the squared radiance that errors are relative to; below zero: it follows the picture's level.
    offset: f32,
    padding: vec2u,
}

/// What is known of a pixel's samples.
struct Estimate {
    mean: vec3f,
    /// Valid ones.
    count: f32,
    /// Of one of them.
    variance: vec3f,
    padding: f32,
}

/// What becomes of a pixel.
struct Plan {
    /// The root of the relative variance that its neighbours have.
    weight: f32,
    /// Samples that it has, valid or not.
    taken: u32,
    /// Samples that it gets.
    extra: u32,
    padding: u32,
}

/// Numbers of the whole picture, which the host reads.
struct Picture {
    /// See `Round.offset`.
    offset: f32,
    /// Mean of the relative variances of the pixels' means, over the colours.
    squared_error: f32,
    /// Valid samples of the pixel that has fewest, and all samples of the one that has fewest of those.
    least_valid: f32,
    least_taken: f32,
    /// Logarithms to base 2 between which the factor on the weights is.
    low: f32,
    high: f32,
    /// Samples of the pixel that gets most.
    most_extra: atomic<u32>,
    /// Portions of each size.
    portions: array<atomic<u32>, SIZES>,
}

/// Samples of portions, and how many such sizes there are. What a pixel gets is made up of as few portions as possible.
const LARGE_PORTION: u32 = 16u;
const SMALL_PORTION: u32 = 4u;
const SIZES: u32 = 2u;
/// Most samples that a pixel gets in a round.
const MOST_EXTRA: u32 = 16384u;
/// Factors that are tried at a time, and pixels that one workgroup tries them on: invocations take a factor and every
/// `STRIPS`th pixel each.
const CANDIDATES: u32 = 8u;
const STRIPS: u32 = 8u;
const TRIED_PIXELS: u32 = 1024u;
/// Pixels in a row of a window of neighbours.
const WINDOW: u32 = 2u * ROUND_RADIUS + 1u;
/// Between which powers of two the factor on the weights is looked for.
const LEAST_FACTOR: f32 = -32.0;
const MOST_FACTOR: f32 = 96.0;

@group(3) @binding(0) var<uniform> task: Round;
/// Samples since the host has read the film, and those before.
@group(3) @binding(1) var<storage, read> film: array<FilmPixel>;
@group(3) @binding(2) var<storage, read> base: array<FilmPixel>;
/// Four words of counters, then a share for each pixel, tile by tile: portions of pixels before it, and its first sample.
@group(3) @binding(3) var<storage, read_write> tally: array<vec2u>;
@group(3) @binding(4) var<storage, read_write> estimates: array<Estimate>;
@group(3) @binding(5) var<storage, read_write> plans: array<Plan>;
/// Of tiles, by fours; or of candidates; or the portions of tiles, then of tiles before them. The bits of floats, or whole numbers.
@group(3) @binding(6) var<storage, read_write> sums: array<u32>;
@group(3) @binding(7) var<storage, read_write> picture: Picture;

var<workgroup> gathered: array<vec4f, 64>;
var<workgroup> counted: array<u32, 64>;
var<workgroup> group_most: atomic<u32>;
var<workgroup> group_portions: array<atomic<u32>, SIZES>;
var<workgroup> window_weights: array<f32, WINDOW * WINDOW>;

const WORDS_BEFORE_SHARES: u32 = 2u;

fn is_in_window(at: vec2u) -> bool {
    return all(at < task.size);
}

fn index_of(at: vec2u) -> u32 {
    return at.y * task.size.x + at.x;
}

fn tiles() -> u32 {
    let across = (task.size + vec2u(7u)) / 8u;
    return across.x * across.y;
}

/// What `round_gather` joins to anything without changing it.
const NOTHING: vec4f = vec4f(0.0, 0.0, 3e38, 3e38);

/// Gathers the values of a workgroup; all invocations must come here. The result is in `gathered[0]`.
fn gather_workgroup(local: u32, value: vec4f) {
    gathered[local] = value;
    workgroupBarrier();
    for (var stride = 32u; stride > 0u; stride /= 2u) {
        if local < stride {
            gathered[local] = round_gather(gathered[local], gathered[local + stride]);
        }
        workgroupBarrier();
    }
}

fn store_tile(tile: u32, value: vec4f) {
    let bits = bitcast<vec4u>(value);
    for (var i = 0u; i < 4u; i += 1u) {
        sums[4u * tile + i] = bits[i];
    }
}

/// Gathers what the tiles have stored, into `gathered[0]`.
fn gather_tiles(local: u32) {
    var value = NOTHING;
    for (var tile = local; tile < tiles(); tile += 64u) {
        let at = 4u * tile;
        value = round_gather(value, bitcast<vec4f>(vec4u(sums[at], sums[at + 1u], sums[at + 2u], sums[at + 3u])));
    }
    gather_workgroup(local, value);
}

/// What the samples of each pixel say.
@compute @workgroup_size(8, 8)
fn estimate(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    var value = NOTHING;
    if is_in_window(id.xy) {
        let index = index_of(id.xy);
        let count = f32(film[index].count + base[index].count);
        let sum = film[index].sum + base[index].sum;
        let squares = film[index].sum_of_squares + base[index].sum_of_squares;
        let taken = film[index].count + base[index].count + film[index].invalid + base[index].invalid;
        let mean = mean_of_sum(sum, count);
        estimates[index] = Estimate(mean, count, variances_of_sums(sum, squares, count), 0.0);
        plans[index].taken = taken;
        value = vec4f(pixel_level(mean), 0.0, count, f32(taken));
    }
    gather_workgroup(local, value);
    if local == 0u {
        store_tile(group.y * groups.x + group.x, gathered[0]);
    }
}

/// What errors are relative to.
@compute @workgroup_size(64)
fn set_level(@builtin(local_invocation_index) local: u32) {
    gather_tiles(local);
    if local == 0u {
        let level = mean_of_pixels(gathered[0].x, task.size.x * task.size.y);
        picture.offset = error_offset(task.offset, level);
        picture.least_valid = gathered[0].z;
        picture.least_taken = gathered[0].w;
    }
}

/// What a pixel's neighbours say of it, and its share of the picture's error.
@compute @workgroup_size(8, 8)
fn weigh(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    // The same for all pixels: each invocation finds one.
    if local < WINDOW * WINDOW {
        let middle = f32(ROUND_RADIUS);
        window_weights[local] = neighbour_weight(f32(local % WINDOW) - middle, f32(local / WINDOW) - middle);
    }
    workgroupBarrier();
    var value = NOTHING;
    if is_in_window(id.xy) {
        let low = max(id.xy, vec2u(ROUND_RADIUS)) - vec2u(ROUND_RADIUS);
        let high = min(id.xy + vec2u(ROUND_RADIUS), task.size - vec2u(1u));
        var neighbours = neighbours_none();
        for (var y = low.y; y <= high.y; y += 1u) {
            for (var x = low.x; x <= high.x; x += 1u) {
                let weight = window_weights[(y + ROUND_RADIUS - id.y) * WINDOW + x + ROUND_RADIUS - id.x];
                let neighbour = index_of(vec2u(x, y));
                neighbours =
                    neighbours_add(neighbours, weight, estimates[neighbour].mean, estimates[neighbour].variance);
            }
        }
        let index = index_of(id.xy);
        plans[index].weight = neighbours_say(neighbours, picture.offset);
        let own = estimates[index];
        value.x = relative_error(own.mean, own.variance, own.count, picture.offset);
    }
    gather_workgroup(local, value);
    if local == 0u {
        store_tile(group.y * groups.x + group.x, gathered[0]);
    }
}

/// The picture's error, and where the search for the factor begins.
@compute @workgroup_size(64)
fn set_range(@builtin(local_invocation_index) local: u32) {
    gather_tiles(local);
    if local == 0u {
        picture.squared_error = mean_of_pixels(gathered[0].x, task.size.x * task.size.y);
        picture.low = LEAST_FACTOR;
        picture.high = MOST_FACTOR;
    }
}

/// The logarithm of a factor that is tried: the last one is the upper end.
fn candidate(number: u32) -> f32 {
    return factor_logarithm(picture.low, picture.high, number, CANDIDATES);
}

/// Adds up what the strips of a candidate have gathered; the first invocations come out with the sums of the candidates.
fn sum_strips(local: u32, value: f32) -> f32 {
    gathered[local] = vec4f(value);
    workgroupBarrier();
    var sum = 0.0;
    if local < CANDIDATES {
        for (var strip = 0u; strip < STRIPS; strip += 1u) {
            sum += gathered[strip * CANDIDATES + local].x;
        }
    }
    return sum;
}

/// Samples that some pixels deserve, for each candidate.
@compute @workgroup_size(64)
fn try_factors(
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let tile = group.y * groups.x + group.x;
    let area = task.size.x * task.size.y;
    let first = tile * TRIED_PIXELS;
    let factor = factor_of(candidate(local % CANDIDATES));
    var sum = 0.0;
    for (var index = first + local / CANDIDATES; index < min(first + TRIED_PIXELS, area); index += STRIPS) {
        sum += samples_deserved(factor, plans[index].weight, f32(plans[index].taken));
    }
    sum = sum_strips(local, sum);
    if local < CANDIDATES && first < area {
        sums[tile * CANDIDATES + local] = bitcast<u32>(sum);
    }
}

/// The search goes on between the two candidates around the total.
@compute @workgroup_size(64)
fn narrow(@builtin(local_invocation_index) local: u32) {
    let area = task.size.x * task.size.y;
    var sum = 0.0;
    for (var at = local; at < (area + TRIED_PIXELS - 1u) / TRIED_PIXELS * CANDIDATES; at += CANDIDATES * STRIPS) {
        sum += bitcast<f32>(sums[at]);
    }
    sum = sum_strips(local, sum);
    workgroupBarrier();
    if local < CANDIDATES {
        gathered[local] = vec4f(sum);
    }
    workgroupBarrier();
    if local == 0u {
        var below = 0u;
        while below < CANDIDATES && gathered[below].x < task.total {
            below += 1u;
        }
        // If even the upper end is too small, all get as much as they may.
        let low = select(picture.low, candidate(max(below, 1u) - 1u), below > 0u);
        let high = candidate(min(below, CANDIDATES - 1u));
        picture.low = low;
        picture.high = high;
    }
}

/// Portions of a size among a pixel's samples.
fn portions_of(extra: u32, size_number: u32) -> u32 {
    return select(extra % LARGE_PORTION / SMALL_PORTION, extra / LARGE_PORTION, size_number == 0u);
}

/// Samples for each pixel, and how many portions that makes.
@compute @workgroup_size(8, 8)
fn choose(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if local < SIZES {
        atomicStore(&group_portions[local], 0u);
    }
    if local == 0u {
        atomicStore(&group_most, 0u);
    }
    workgroupBarrier();
    if is_in_window(id.xy) {
        let index = index_of(id.xy);
        let taken = f32(plans[index].taken);
        let deserved = samples_deserved(factor_of(picture.low), plans[index].weight, taken);
        let extra = min(samples_of_round(deserved, taken), MOST_EXTRA);
        plans[index].extra = extra;
        atomicMax(&group_most, extra);
        for (var size = 0u; size < SIZES; size += 1u) {
            atomicAdd(&group_portions[size], portions_of(extra, size));
        }
    }
    workgroupBarrier();
    if local < SIZES {
        atomicAdd(&picture.portions[local], atomicLoad(&group_portions[local]));
    }
    if local == 0u {
        atomicMax(&picture.most_extra, atomicLoad(&group_most));
    }
}

/// Portions of the size that is shared out, of the pixel of this invocation.
fn own_portions(at: vec2u) -> u32 {
    if is_in_window(at) {
        return portions_of(plans[index_of(at)].extra, task.size_number);
    }
    return 0u;
}

/// Adds up the values of all invocations of a workgroup up to and with each: `counted[local]`. All must come here.
/// Source: Hillis and Steele, "Data Parallel Algorithms", 1986.
fn count_workgroup(local: u32, value: u32) {
    counted[local] = value;
    workgroupBarrier();
    for (var stride = 1u; stride < 64u; stride *= 2u) {
        var before = 0u;
        if local >= stride {
            before = counted[local - stride];
        }
        workgroupBarrier();
        counted[local] += before;
        workgroupBarrier();
    }
}

/// How many portions each tile has.
@compute @workgroup_size(8, 8)
fn count_portions(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    count_workgroup(local, own_portions(id.xy));
    if local == 63u {
        sums[group.y * groups.x + group.x] = counted[63];
    }
}

/// How many portions the tiles before each have: an invocation adds up a row of tiles, then knows where its row begins.
@compute @workgroup_size(64)
fn place_tiles(@builtin(local_invocation_index) local: u32) {
    let each = (tiles() + 63u) / 64u;
    let begin = min(local * each, tiles());
    let end = min(begin + each, tiles());
    var own = 0u;
    for (var tile = begin; tile < end; tile += 1u) {
        own += sums[tile];
    }
    count_workgroup(local, own);
    var before = counted[local] - own;
    for (var tile = begin; tile < end; tile += 1u) {
        let of_tile = sums[tile];
        sums[tile] = before;
        before += of_tile;
    }
}

/// Tells kernels which portions are whose.
@compute @workgroup_size(8, 8)
fn share_out(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let own = own_portions(id.xy);
    count_workgroup(local, own);
    let tile = group.y * groups.x + group.x;
    var first_sample = 0u;
    if is_in_window(id.xy) {
        let plan = plans[index_of(id.xy)];
        // Those of the larger size come first.
        let given = select(plan.extra / LARGE_PORTION * LARGE_PORTION, 0u, task.size_number == 0u);
        first_sample = task.first_sample + plan.taken + given;
    }
    tally[WORDS_BEFORE_SHARES + 64u * tile + local] = vec2u(sums[tile] + counted[local] - own, first_sample);
}
