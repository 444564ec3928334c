//! Weighted first-order regression, tile by tile.
//!
//! For each shift of the window and each pixel of the tile there is a weight, and the weighted products of what the plane is
//! fitted over are summed. All loops run along rows of plain numbers, so compilers make vector instructions of them.

use super::signal::{Plane, Signal};
use elementary::exp;
use rayon::prelude::*;

/// Pixels along a tile's side.
const TILE: usize = 48;
/// Half the side of the window that is searched for pixels that show the same.
const RADIUS: isize = 9;
/// Half the side of the patches that are compared.
const PATCH: usize = 2;
/// How many standard deviations may lie between pixels that are alike.
const COLOUR_SCALE: f32 = 0.6;
/// Differences of normals and of albedos at which the weight has fallen to 1/e.
const NORMAL_SCALE: f32 = 0.35;
const ALBEDO_SCALE: f32 = 0.12;
/// Added to variances of irradiance: numbers as close as this are equal.
const VARIANCE_FLOOR: f32 = 1e-8;
/// Weights below are none.
const LEAST_WEIGHT: f32 = 1e-4;
/// How much a slope has to explain to be believed, relative to its feature's range.
const RIDGE: f32 = 0.01;

/// What the plane is fitted over: one, the normal, the place.
const TERMS: usize = 6;
/// Different products of two terms.
const PRODUCTS: usize = TERMS * (TERMS + 1) / 2;

/// The filtered irradiance.
pub fn filter(signal: &Signal) -> [Plane; 3] {
    let (width, height) = (signal.width, signal.height);
    let tiles: Vec<(usize, usize)> =
        (0..height).step_by(TILE).flat_map(|y| (0..width).step_by(TILE).map(move |x| (x, y))).collect();
    let filtered: Vec<Tile> = tiles.into_par_iter().map(|(x, y)| Tile::filter(signal, x, y)).collect();
    let mut out = [0, 1, 2].map(|_| vec![0.0; width * height]);
    for tile in filtered {
        for y in 0..tile.height {
            for x in 0..tile.width {
                for (plane, value) in out.iter_mut().zip(tile.solve(x, y, signal)) {
                    plane[(tile.y + y) * width + tile.x + x] = value;
                }
            }
        }
    }
    out
}

/// A tile and its sums.
struct Tile {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    /// Weighted products of two terms, by product and pixel.
    products: Vec<Plane>,
    /// Weighted products of a term and a colour, by colour, term and pixel.
    colours: Vec<Plane>,
}

/// A row of numbers along a tile.
type Row = [f32; TILE];

impl Tile {
    fn filter(signal: &Signal, x: usize, y: usize) -> Self {
        let (width, height) = (TILE.min(signal.width - x), TILE.min(signal.height - y));
        let plane = || vec![0.0; TILE * height];
        let products = (0..PRODUCTS).map(|_| plane()).collect();
        let colours = (0..3 * TERMS).map(|_| plane()).collect();
        let mut tile = Self { x, y, width, height, products, colours };
        let mut distances = Distances::new(width, height);
        for dy in -RADIUS..=RADIUS {
            for dx in -RADIUS..=RADIUS {
                distances.compute(signal, &tile, dx, dy);
                for row in 0..height {
                    tile.add_row(signal, row, dx, dy, &distances);
                }
            }
        }
        tile
    }

    /// Adds the pixels that are (`dx`, `dy`) away from those of a row.
    fn add_row(&mut self, signal: &Signal, row: usize, dx: isize, dy: isize, distances: &Distances) {
        let Some(y) = (self.y + row).checked_add_signed(dy).filter(|y| *y < signal.height) else { return };
        let first = (-dx - self.x as isize).max(0) as usize;
        let last = (signal.width as isize - dx - self.x as isize).clamp(0, self.width as isize) as usize;
        if first >= last {
            return;
        }
        let n = last - first;
        let here = (self.y + row) * signal.width + self.x + first;
        let there = y * signal.width + (self.x + first).wrapping_add_signed(dx);
        let mut weight: Row = [0.0; TILE];
        let mut terms: [Row; TERMS] = [[0.0; TILE]; TERMS];
        let mut feature = [0.0; TILE];
        for c in 0..3 {
            let (a, b) = (&signal.normal[c][here..here + n], &signal.normal[c][there..there + n]);
            let (e, f) = (&signal.albedo[c][here..here + n], &signal.albedo[c][there..there + n]);
            for i in 0..n {
                let (normal, albedo) = (b[i] - a[i], f[i] - e[i]);
                terms[1 + c][i] = normal;
                feature[i] += normal * normal * (1.0 / (NORMAL_SCALE * NORMAL_SCALE))
                    + albedo * albedo * (1.0 / (ALBEDO_SCALE * ALBEDO_SCALE));
            }
        }
        let colour = distances.of_row(row, first, n);
        let mut any = false;
        for i in 0..n {
            // Past this the exponential is below the least weight.
            let distance = colour[i].max(0.0) + feature[i];
            if distance < 9.2 {
                let w = exp(-distance);
                if w > LEAST_WEIGHT {
                    weight[i] = w;
                    any = true;
                }
            }
        }
        if !any {
            return;
        }
        terms[0][..n].fill(1.0);
        terms[4][..n].fill(dx as f32 / RADIUS as f32);
        terms[5][..n].fill(dy as f32 / RADIUS as f32);
        let at = row * TILE + first;
        let mut product = 0;
        for a in 0..TERMS {
            let mut weighted: Row = [0.0; TILE];
            for i in 0..n {
                weighted[i] = weight[i] * terms[a][i];
            }
            for term in &terms[a..] {
                let sums = &mut self.products[product][at..at + n];
                for i in 0..n {
                    sums[i] += weighted[i] * term[i];
                }
                product += 1;
            }
            for c in 0..3 {
                let values = &signal.irradiance[c][there..there + n];
                let sums = &mut self.colours[c * TERMS + a][at..at + n];
                for i in 0..n {
                    sums[i] += weighted[i] * values[i];
                }
            }
        }
    }

    /// The planes' values at a pixel.
    fn solve(&self, x: usize, y: usize, signal: &Signal) -> [f32; 3] {
        let at = y * TILE + x;
        let mut matrix = [[0.0f64; TERMS]; TERMS];
        let pairs = (0..TERMS).flat_map(|a| (a..TERMS).map(move |b| (a, b)));
        for ((a, b), sums) in pairs.zip(&self.products) {
            let sum = f64::from(sums[at]);
            (matrix[a][b], matrix[b][a]) = (sum, sum);
        }
        let weights = matrix[0][0];
        for (term, row) in matrix.iter_mut().enumerate().skip(1) {
            row[term] += f64::from(RIDGE) * weights;
        }
        let sums: [[f64; TERMS]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|t| f64::from(self.colours[c * TERMS + t][at])));
        let Some(factor) = cholesky(&matrix) else {
            let pixel = (self.y + y) * signal.width + self.x + x;
            return std::array::from_fn(|c| signal.irradiance[c][pixel]);
        };
        // A plane may fall below zero where light ends; there is no such light.
        sums.map(|sums| solve_cholesky(&factor, &sums)[0].max(0.0) as f32)
    }
}

/// Lower triangle `l` with `l·lᵀ = matrix`; `None` if the matrix is not positive definite.
fn cholesky(matrix: &[[f64; TERMS]; TERMS]) -> Option<[[f64; TERMS]; TERMS]> {
    let mut l = [[0.0; TERMS]; TERMS];
    for i in 0..TERMS {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = matrix[i][j] - sum;
            if i == j {
                if rest.is_nan() || rest <= 1e-12 * matrix[0][0] {
                    return None;
                }
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    Some(l)
}

fn solve_cholesky(l: &[[f64; TERMS]; TERMS], right: &[f64; TERMS]) -> [f64; TERMS] {
    let mut x = *right;
    for i in 0..TERMS {
        let sum: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (x[i] - sum) / l[i][i];
    }
    for i in (0..TERMS).rev() {
        let sum: f64 = (i + 1..TERMS).map(|k| l[k][i] * x[k]).sum();
        x[i] = (x[i] - sum) / l[i][i];
    }
    x
}

/// How different patches are, for all pixels of a tile and one shift.
struct Distances {
    /// With a margin for the patches.
    width: usize,
    height: usize,
    single: Plane,
    along: Plane,
    patches: Plane,
}

impl Distances {
    fn new(width: usize, height: usize) -> Self {
        let (width, height) = (width + 2 * PATCH, height + 2 * PATCH);
        let plane = || vec![0.0; width * height];
        Self { width, height, single: plane(), along: plane(), patches: plane() }
    }

    /// The distances of a row's pixels from `first` on.
    fn of_row(&self, row: usize, first: usize, count: usize) -> &[f32] {
        &self.patches[row * self.width + first..][..count]
    }

    /// Compares all pixels of the tile with those that are (`dx`, `dy`) away. Beyond its edges the picture goes on with
    /// its last pixels.
    fn compute(&mut self, signal: &Signal, tile: &Tile, dx: isize, dy: isize) {
        let clamped = |v: isize, end: usize| v.clamp(0, end as isize - 1) as usize;
        let scale = COLOUR_SCALE * COLOUR_SCALE;
        for row in 0..self.height {
            let y = tile.y as isize + row as isize - PATCH as isize;
            let (y0, y1) = (clamped(y, signal.height), clamped(y + dy, signal.height));
            let out = &mut self.single[row * self.width..][..self.width];
            let left = tile.x as isize - PATCH as isize;
            let inside = left >= 0
                && left + dx >= 0
                && (left + self.width as isize + dx.max(0)) <= signal.width as isize;
            out.fill(0.0);
            for c in 0..3 {
                let (value, variance) = (&signal.irradiance[c], &signal.variance[c]);
                let mut add = |i: usize, p: usize, q: usize| {
                    let difference = value[p] - value[q];
                    let (vp, vq) = (variance[p], variance[q]);
                    out[i] +=
                        (difference * difference - (vp + vp.min(vq))) / (VARIANCE_FLOOR + scale * (vp + vq));
                };
                if inside {
                    let p = y0 * signal.width + left as usize;
                    let q = y1 * signal.width + (left + dx) as usize;
                    (0..self.width).for_each(|i| add(i, p + i, q + i));
                } else {
                    for i in 0..self.width {
                        let x = left + i as isize;
                        let p = y0 * signal.width + clamped(x, signal.width);
                        let q = y1 * signal.width + clamped(x + dx, signal.width);
                        add(i, p, q);
                    }
                }
            }
        }
        self.sum_patches();
    }

    /// Means over patches and colours of what single pixels say.
    fn sum_patches(&mut self) {
        const SIDE: usize = 2 * PATCH + 1;
        let width = self.width;
        for row in 0..self.height {
            let single = &self.single[row * width..][..width];
            let along = &mut self.along[row * width..][..width];
            for (i, sum) in along[..width + 1 - SIDE].iter_mut().enumerate() {
                *sum = single[i..i + SIDE].iter().sum();
            }
        }
        let share = 1.0 / (3 * SIDE * SIDE) as f32;
        for row in 0..self.height + 1 - SIDE {
            let patches = &mut self.patches[row * width..][..width];
            patches.fill(0.0);
            for k in 0..SIDE {
                let along = &self.along[(row + k) * width..][..width];
                patches.iter_mut().zip(along).for_each(|(sum, v)| *sum += share * v);
            }
        }
    }
}
