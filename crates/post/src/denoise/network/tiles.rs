//! Large pictures are filtered in tiles, so that memory stays bounded; the result is, bit for bit,
//! that of the whole picture.

/// What sides and corners of tiles are multiples of: the coarsest level of the network has one
/// pixel for so many.
pub const ALIGNMENT: usize = 32;

/// How far, in pixels, a tile reaches beyond what is kept of it: what the result depends on (see
/// the test, which derives it).
pub const OVERLAP: usize = 256;

/// The most pixels in a tile, with its overlap. A tile takes 150 bytes per pixel, so at most
/// 750 MB.
pub const MOST_PIXELS: usize = 5_000_000;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A part of a picture that is filtered by itself. All sides and corners are multiples of 32
/// pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// What is filtered.
    pub region: Region,
    /// What of that is kept. Those of all tiles make up the picture.
    pub core: Region,
}

/// Divides a picture, whose sides become multiples of [`ALIGNMENT`], into tiles of at most
/// `most_pixels`, so that as little as possible is filtered twice. If even the smallest tiles are
/// too large, they are taken.
pub fn plan(width: usize, height: usize, most_pixels: usize) -> Vec<Tile> {
    let columns = ways(width.div_ceil(ALIGNMENT));
    let rows = ways(height.div_ceil(ALIGNMENT));
    let cost = |spans: &[Span]| spans.iter().map(Span::length).sum::<usize>();
    let longest = |spans: &[Span]| spans.iter().map(Span::length).max().unwrap_or(0);
    let mut best = (usize::MAX, columns.len() - 1, rows.len() - 1);
    for (i, across) in columns.iter().enumerate() {
        // The fewest rows that fit are the best.
        if let Some(j) =
            rows.iter().position(|down| longest(across).saturating_mul(longest(down)) <= most_pixels)
        {
            best = best.min((cost(across).saturating_mul(cost(&rows[j])), i, j));
        }
    }
    let (_, i, j) = best;
    let tile = |x: Span, y: Span| Tile {
        region: Region { x: x.start, y: y.start, width: x.length(), height: y.length() },
        core: Region {
            x: x.core_start,
            y: y.core_start,
            width: x.core_end - x.core_start,
            height: y.core_end - y.core_start,
        },
    };
    rows[j].iter().flat_map(|y| columns[i].iter().map(|x| tile(*x, *y))).collect()
}

/// A tile along one axis.
#[derive(Clone, Copy)]
struct Span {
    start: usize,
    end: usize,
    core_start: usize,
    core_end: usize,
}

impl Span {
    fn length(&self) -> usize {
        self.end - self.start
    }
}

/// The ways to divide a side of `cells` times [`ALIGNMENT`]: into one part, two, and so on, as
/// equal as can be.
fn ways(cells: usize) -> Vec<Vec<Span>> {
    const MOST: usize = 512;
    let cells = cells.max(1);
    let span = |parts: usize, i: usize| {
        let [core_start, core_end] = [i, i + 1].map(|i| cells * i / parts * ALIGNMENT);
        let start = core_start.saturating_sub(OVERLAP);
        Span { start, end: (core_end + OVERLAP).min(cells * ALIGNMENT), core_start, core_end }
    };
    (1..=cells.min(MOST)).map(|parts| (0..parts).map(|i| span(parts, i)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first and the last of a run of pixels of a level; level `l` has half the resolution of
    /// level `l - 1`.
    type Run = (isize, isize);

    fn union(a: Run, b: Run) -> Run {
        (a.0.min(b.0), a.1.max(b.1))
    }

    fn grown(a: Run, by: isize) -> Run {
        (a.0 - by, a.1 + by)
    }

    fn coarser(a: Run) -> Run {
        (a.0 >> 1, a.1 >> 1)
    }

    fn finer(a: Run) -> Run {
        (2 * a.0, 2 * a.1 + 1)
    }

    /// What of the decoder's five results (1/2, 1/4, 1/8, 1/16, 1/32) a pixel of the picture depends
    /// on.
    fn reach_of_filter(pixel: isize) -> [Run; 5] {
        // Where the filter's result is needed, level by level: it is put together of the level
        // itself, of its enlarged means, and of the enlarged result of the coarser level.
        let mut filtered = [(pixel, pixel); 6];
        for level in 0..5 {
            let needed = filtered[level];
            let enlarged = ((needed.0 - 1) >> 1, (needed.1 + 1) >> 1);
            filtered[level] = union(needed, finer(enlarged));
            filtered[level + 1] = enlarged;
        }
        // Where the picture and its trust are needed: two pixels around, and all four that a pixel
        // of a coarser level is the mean of.
        let mut picture = grown(filtered[5], 2);
        for level in (0..5).rev() {
            picture = union(grown(filtered[level], 2), finer(picture));
        }
        let finest = union(coarser(picture), union(coarser(filtered[0]), filtered[1]));
        [finest, filtered[2], filtered[3], filtered[4], filtered[5]]
    }

    /// What of the picture the decoder's results depend on.
    fn reach_of_network(mut decoded: [Run; 5]) -> Run {
        for level in 0..4 {
            decoded[level] = grown(decoded[level], 2);
            decoded[level + 1] = union(decoded[level + 1], coarser(decoded[level]));
        }
        // The coarsest is the encoder's last, after two convolutions.
        let mut encoded = grown(decoded[4], 2);
        for level in (0..4).rev() {
            let convolutions = if level == 0 { 2 } else { 1 };
            encoded = grown(union(decoded[level], finer(encoded)), convolutions);
        }
        finer(encoded)
    }

    #[test]
    fn overlap_is_what_the_result_depends_on() {
        let core = (1024, 1024 + ALIGNMENT as isize - 1);
        let [first, last] = [core.0, core.1].map(|pixel| reach_of_network(reach_of_filter(pixel)));
        assert_eq!((core.0 - first.0, last.1 - core.1), (OVERLAP as isize, OVERLAP as isize));
        assert_eq!(OVERLAP % ALIGNMENT, 0);
    }

    #[test]
    fn tiles_cover_the_picture_once_and_fit() {
        for (width, height, most) in [
            (1, 1, 10),
            (1920, 1080, MOST_PIXELS),
            (3840, 2160, MOST_PIXELS),
            (7680, 4320, MOST_PIXELS),
            (900, 70, 200_000),
        ] {
            let tiles = plan(width, height, most);
            let [w, h] = [width, height].map(|side: usize| side.next_multiple_of(ALIGNMENT));
            assert_eq!(tiles.iter().map(|t| t.core.width * t.core.height).sum::<usize>(), w * h);
            let filtered: usize = tiles.iter().map(|t| t.region.width * t.region.height).sum();
            assert!(tiles.len() > 1 || filtered == w * h);
            println!("{width}x{height}: {} tiles, {:.2}", tiles.len(), filtered as f64 / (w * h) as f64);
            for Tile { region, core } in tiles {
                assert!(region.width * region.height <= most.max(ALIGNMENT * ALIGNMENT));
                for (value, side) in [(region.x, w), (region.y, h), (core.x, w), (core.y, h)] {
                    assert!(value % ALIGNMENT == 0 && value < side);
                }
            }
        }
    }
}
