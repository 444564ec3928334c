// Adds portions to their pixels: an invocation for each pixel, in the order of the portions.

struct Task {
    /// The window's pixels.
    size: vec2u,
    /// The portions that were made, and how many there are of all pixels.
    first: u32,
    count: u32,
    all: u32,
    padding: u32,
}

/// As in `film.wgsl`.
struct FilmPixel {
    sum: vec3f,
    count: u32,
    sum_of_squares: vec3f,
    invalid: u32,
}

@group(3) @binding(0) var<uniform> task: Task;
/// The pixels of the window, row by row, then those that portions are summed in.
@group(3) @binding(1) var<storage, read_write> film: array<FilmPixel>;
/// Words of counters, then the pixels' shares, tile by tile: portions before a pixel's, and its first sample.
@group(3) @binding(2) var<storage, read> tally: array<vec2u>;

const WORDS_BEFORE_SHARES: u32 = 2u;

/// Portions of pixels before the one that this invocation is for and, if it is not the last, of those up to it.
fn portions_before(number: u32) -> u32 {
    let at = WORDS_BEFORE_SHARES + number;
    if at < arrayLength(&tally) {
        return tally[at].x;
    }
    return task.all;
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if any(id.xy >= task.size) {
        return;
    }
    let across = (task.size.x + 7u) / 8u;
    let number = 64u * (id.y / 8u * across + id.x / 8u) + local;
    let begin = max(portions_before(number), task.first);
    let end = min(portions_before(number + 1u), task.first + task.count);
    if begin >= end {
        return;
    }
    let area = task.size.x * task.size.y;
    let pixel = id.y * task.size.x + id.x;
    var sums = film[pixel];
    for (var portion = begin; portion < end; portion += 1u) {
        let place = area + portion - task.first;
        let made = film[place];
        sums.sum += made.sum;
        sums.count += made.count;
        sums.sum_of_squares += made.sum_of_squares;
        sums.invalid += made.invalid;
        // The next portion that is summed here begins with nothing.
        film[place] = FilmPixel(vec3f(0.0), 0u, vec3f(0.0), 0u);
    }
    film[pixel] = sums;
}
