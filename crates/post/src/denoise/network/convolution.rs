//! Convolutions: the planes that they read and write, and the kernel that nearly all time goes
//! into.
//!
//! Activations are channels-last, so that one input value, which is the same in all lanes, meets
//! sixteen output channels, which lie next to each other. Each output is its bias plus products in
//! a fixed order, whatever thread and block of pixels it falls to, so neither the number of threads
//! nor tiles change a bit.

use super::lanes::{InstructionSet, LANES, Lanes, Sixteen, Stage};
use rayon::prelude::*;

/// `height × width` pixels of `channels` values each, with a border of zeros one pixel wide around
/// them: what convolutions read outside.
pub struct Activations {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<f32>,
}

impl Activations {
    /// Zeros.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        Self { width, height, channels, data: vec![0.0; (width + 2) * (height + 2) * channels] }
    }

    /// Width without border, in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height without border, in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Values from one row to the next.
    fn pitch(&self) -> usize {
        (self.width + 2) * self.channels
    }

    /// Where the values of a pixel start; both coordinates count the border.
    fn place(&self, x: usize, y: usize) -> usize {
        y * self.pitch() + x * self.channels
    }

    /// The rows of pixels, without border above and below, in groups of `rows`; each row is
    /// [`Self::row_of`] its group.
    pub fn row_groups(&mut self, rows: usize) -> rayon::slice::ChunksExactMut<'_, f32> {
        let (pitch, end) = (self.pitch(), (self.height + 1) * self.pitch());
        self.data[pitch..end].par_chunks_exact_mut(rows * pitch)
    }

    /// The values of row `y`, without border.
    #[cfg(test)]
    pub fn row(&self, y: usize) -> &[f32] {
        &self.data[self.place(1, y + 1)..][..self.width * self.channels]
    }
}

/// Outputs of a row that are computed together: what they read stays in the second cache. A
/// multiple of all numbers of pixels that go into registers.
const SEGMENT: usize = 96;

/// A row of a group of rows, without border left and right. `rows` is how many there are.
pub fn row_of(group: &mut [f32], channels: usize, rows: usize, row: usize) -> &mut [f32] {
    let pitch = group.len() / rows;
    &mut group[row * pitch + channels..(row + 1) * pitch - channels]
}

/// Sixteen numbers in one line of the cache.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Line(pub Sixteen);

/// The weights that one input of a convolution meets, block of sixteen outputs by block:
/// `[block][ky][kx][input][16]`.
#[derive(Clone, Debug)]
pub struct Weights {
    /// Rows and columns that the kernel covers.
    pub size: usize,
    /// Channels of the input.
    pub inputs: usize,
    /// The values.
    pub values: Vec<Line>,
}

/// A convolution of one input: 3×3 with zeros around the picture and a stride of one, then the
/// larger of result and zero.
#[derive(Clone, Debug)]
pub struct Convolution {
    /// Bias, in blocks of sixteen outputs.
    pub bias: Vec<Sixteen>,
    /// Weights of size three.
    pub weights: Weights,
}

/// A convolution as [`Convolution`] of two inputs, of which the first has half the resolution, and
/// is enlarged by repeating pixels.
///
/// Of the 3×3 pixels of the enlarged input some are the same: there are only 2×2, and where they
/// are depends on whether the column and the row are odd. With the weights added up for each of the
/// four cases, four products do what nine did.
#[derive(Clone, Debug)]
pub struct Merging {
    /// Bias, in blocks of sixteen outputs.
    pub bias: Vec<Sixteen>,
    /// Weights of size two of the first input, for rows even and odd, and in it for columns even
    /// and odd.
    pub coarse: [[Weights; 2]; 2],
    /// Weights of size three of the second input.
    pub fine: Weights,
}

/// A linear map of each pixel's channels.
#[derive(Clone, Debug)]
pub struct Head {
    /// Bias, in blocks of sixteen outputs.
    pub bias: Vec<Sixteen>,
    /// Weights of size one.
    pub weights: Weights,
}

impl Convolution {
    /// The result, and a copy of half the resolution that has the largest of each 2×2 (of which the
    /// sides must be even).
    pub fn apply_and_pool(&self, set: InstructionSet, input: &Activations) -> [Activations; 2] {
        let channels = self.bias.len() * LANES;
        let mut output = Activations::new(input.width, input.height, channels);
        let mut pooled = Activations::new(input.width / 2, input.height / 2, channels);
        output.row_groups(2).zip(pooled.row_groups(1)).enumerate().for_each(|(y, (rows, pooled))| {
            self.rows(set, input, 2 * y, rows, 2);
            set.run(Pool { rows, pooled, channels });
        });
        [output, pooled]
    }

    /// The result.
    pub fn apply(&self, set: InstructionSet, input: &Activations) -> Activations {
        let mut output = Activations::new(input.width, input.height, self.bias.len() * LANES);
        output.row_groups(1).enumerate().for_each(|(y, row)| self.rows(set, input, y, row, 1));
        output
    }

    /// A group of rows, of which the first is `y`.
    fn rows(&self, set: InstructionSet, input: &Activations, y: usize, group: &mut [f32], rows: usize) {
        let channels = self.bias.len() * LANES;
        for row in 0..rows {
            let output = row_of(group, channels, rows, row);
            let window = Window::new(input, [0, y + row], &self.weights, input.channels);
            set.run(Row { windows: &[window], bias: &self.bias, output, stride: channels, is_linear: false });
        }
    }
}

impl Merging {
    /// The result, at the resolution of the second input.
    pub fn apply(&self, set: InstructionSet, coarse: &Activations, fine: &Activations) -> Activations {
        let channels = self.bias.len() * LANES;
        let mut output = Activations::new(fine.width, fine.height, channels);
        output.row_groups(1).enumerate().for_each(|(y, group)| {
            let output = row_of(group, channels, 1, 0);
            for x in 0..2 {
                let weights = &self.coarse[y % 2][x];
                let windows = [
                    Window::new(coarse, [x, y / 2 + y % 2], weights, coarse.channels),
                    Window::new(fine, [x, y], &self.fine, 2 * fine.channels),
                ];
                let output = &mut output[x * channels..];
                set.run(Row {
                    windows: &windows,
                    bias: &self.bias,
                    output,
                    stride: 2 * channels,
                    is_linear: false,
                });
            }
        });
        output
    }
}

impl Head {
    /// Outputs of a pixel.
    pub fn outputs(&self) -> usize {
        self.bias.len() * LANES
    }

    /// The outputs of the pixels of row `y` from column `x` on, as many as `output` has room for.
    pub fn apply(&self, set: InstructionSet, input: &Activations, [x, y]: [usize; 2], output: &mut [f32]) {
        let window = Window::new(input, [x + 1, y + 1], &self.weights, input.channels);
        let stride = self.outputs();
        set.run(Row { windows: &[window], bias: &self.bias, output, stride, is_linear: true });
    }
}

/// What a row of outputs reads of one input.
struct Window<'a> {
    /// All values of the input.
    data: &'a [f32],
    /// Where the window of the first output starts.
    start: usize,
    /// Values from one row of the input to the next.
    pitch: usize,
    /// Values from the window of one output to the next's.
    stride: usize,
    weights: &'a Weights,
}

impl<'a> Window<'a> {
    /// The windows whose first has its top left corner at a place, which counts the border.
    fn new(input: &'a Activations, [x, y]: [usize; 2], weights: &'a Weights, stride: usize) -> Self {
        debug_assert_eq!(input.channels, weights.inputs);
        Self { data: &input.data, start: input.place(x, y), pitch: input.pitch(), stride, weights }
    }

    /// Adds what row `row` of the windows gives to a block of sixteen channels of `PIXELS`
    /// neighbouring outputs, of which `first` is the first.
    #[inline(always)]
    fn add_to<L: Lanes, const PIXELS: usize>(
        &self,
        l: L,
        [block, row]: [usize; 2],
        first: usize,
        sums: &mut [Sixteen; PIXELS],
    ) {
        // The pixels of a row of the window lie next to each other, so they are one run.
        let run = self.weights.size * self.weights.inputs;
        let weights = &self.weights.values[(block * self.weights.size + row) * run..][..run];
        let start = self.start + row * self.pitch + first * self.stride;
        let mut pixels = [&self.data[..0]; PIXELS];
        let mut registers = [l.splat(0.0); PIXELS];
        for p in 0..PIXELS {
            pixels[p] = &self.data[start + p * self.stride..][..run];
            registers[p] = l.load(&sums[p]);
        }
        for i in 0..run {
            let weights = l.load(&weights[i].0);
            for p in 0..PIXELS {
                registers[p] = l.mul_add(l.splat(pixels[p][i]), weights, registers[p]);
            }
        }
        for p in 0..PIXELS {
            l.store(registers[p], &mut sums[p]);
        }
    }

    /// The same for all of `sums`, however many there are.
    #[inline(always)]
    fn add_to_all<L: Lanes, const PIXELS: usize>(
        &self,
        l: L,
        part: [usize; 2],
        mut first: usize,
        sums: &mut [Sixteen],
    ) {
        let (whole, rest) = sums.as_chunks_mut::<PIXELS>();
        for sums in whole {
            self.add_to(l, part, first, sums);
            first += PIXELS;
        }
        let (few, rest) = rest.as_chunks_mut::<3>();
        for sums in few {
            self.add_to(l, part, first, sums);
            first += 3;
        }
        for sums in rest.as_chunks_mut::<1>().0 {
            self.add_to(l, part, first, sums);
            first += 1;
        }
    }
}

/// Computes a row of outputs.
struct Row<'a> {
    windows: &'a [Window<'a>],
    bias: &'a [Sixteen],
    /// Where the outputs go.
    output: &'a mut [f32],
    /// Values from one output to the next.
    stride: usize,
    /// Whether negative results stay.
    is_linear: bool,
}

impl Stage for Row<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
        let width = self.output.len().div_ceil(self.stride);
        let least = l.splat(if self.is_linear { f32::NEG_INFINITY } else { 0.0 });
        let mut sums = [[0.0; LANES]; SEGMENT];
        for first in (0..width).step_by(SEGMENT) {
            let sums = &mut sums[..SEGMENT.min(width - first)];
            for block in 0..self.bias.len() {
                sums.fill(self.bias[block]);
                // The weights of one row of windows stay in the nearest cache while all of the
                // segment meets them.
                for window in self.windows {
                    for row in 0..window.weights.size {
                        window.add_to_all::<L, PIXELS>(l, [block, row], first, sums);
                    }
                }
                for (i, sums) in sums.iter().enumerate() {
                    let place = (first + i) * self.stride + block * LANES;
                    if let Some(to) = self.output[place..].first_chunk_mut() {
                        l.store(l.max(l.load(sums), least), to);
                    }
                }
            }
        }
    }
}

/// The largest of each 2×2 of two rows.
struct Pool<'a> {
    rows: &'a [f32],
    pooled: &'a mut [f32],
    channels: usize,
}

impl Stage for Pool<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
        let channels = self.channels;
        let (above, below) = self.rows.split_at(self.rows.len() / 2);
        let (above, below) = (above.as_chunks::<LANES>().0, below.as_chunks::<LANES>().0);
        let blocks = channels / LANES;
        let pooled = row_of(self.pooled, channels, 1, 0);
        for (i, to) in pooled.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            // The rows have their border.
            let (x, block) = (1 + i / blocks * 2, i % blocks);
            let [left, right] = [x, x + 1].map(|x| x * blocks + block);
            let above = l.max(l.load(&above[left]), l.load(&above[right]));
            let below = l.max(l.load(&below[left]), l.load(&below[right]));
            l.store(l.max(above, below), to);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::weights::uniform;
    use super::super::weights::Plain;
    use super::*;

    /// Noise of both signs.
    fn noise(seed: u32, width: usize, height: usize, channels: usize) -> Activations {
        let mut noise = Activations::new(width, height, channels);
        for y in 0..height {
            let (start, length) = (noise.place(1, y + 1), width * channels);
            for (i, value) in noise.data[start..][..length].iter_mut().enumerate() {
                *value = uniform(seed, (y * length + i) as u32) as f32;
            }
        }
        noise
    }

    /// A layer with weights of both signs.
    fn layer(size: usize, inputs: usize, outputs: usize) -> Plain {
        let values = |seed, count| (0..count).map(|k| uniform(seed, k as u32) as f32).collect();
        let weights = values(1, outputs * inputs * size * size);
        Plain { size, inputs, outputs, weights, bias: values(2, outputs) }
    }

    /// One output of a layer, by its definition.
    fn naive(layer: &Plain, input: impl Fn(isize, isize, usize) -> f32, [x, y, c]: [usize; 3]) -> f64 {
        let mut sum = f64::from(layer.bias[c]);
        for (ky, kx) in (0..layer.size).flat_map(|ky| (0..layer.size).map(move |kx| (ky, kx))) {
            let place = |at: usize, k: usize| (at + k) as isize - (layer.size / 2) as isize;
            for i in 0..layer.inputs {
                let value = input(place(x, kx), place(y, ky), i);
                sum += f64::from(value) * f64::from(layer.weight(c, i, ky, kx));
            }
        }
        sum
    }

    /// A value, zero outside.
    fn at(input: &Activations, x: isize, y: isize, c: usize) -> f32 {
        let inside = |at: isize, length: usize| (0..length as isize).contains(&at);
        if !inside(x, input.width) || !inside(y, input.height) {
            return 0.0;
        }
        input.data[input.place(x as usize + 1, y as usize + 1) + c]
    }

    fn assert_is(output: &Activations, expected: impl Fn([usize; 3]) -> f64) {
        for (y, x) in (0..output.height).flat_map(|y| (0..output.width).map(move |x| (y, x))) {
            for c in 0..output.channels {
                let (found, expected) = (at(output, x as isize, y as isize, c), expected([x, y, c]));
                assert!((f64::from(found) - expected).abs() < 1e-4, "{x} {y} {c}: {found} is not {expected}");
            }
        }
        let sum = |data: &[f32]| data.iter().map(|v| v.abs()).sum::<f32>();
        let inside: f32 = (0..output.height).map(|y| sum(output.row(y))).sum();
        assert!((sum(&output.data) - inside).abs() <= 1e-3 * inside, "the border stays zero");
    }

    const WIDTHS: [usize; 6] = [2, 4, 6, 14, 98, 194];

    #[test]
    fn convolutions_are_what_they_are_defined_as() {
        let layer = layer(3, 5, 32);
        for (set, width) in InstructionSet::available().into_iter().flat_map(|set| WIDTHS.map(|w| (set, w))) {
            let input = noise(3, width, 4, 5);
            let expected = |place| naive(&layer, |x, y, c| at(&input, x, y, c), place).max(0.0);
            let [output, pooled] = layer.convolution().apply_and_pool(set, &input);
            assert_is(&output, expected);
            assert_is(&layer.convolution().apply(set, &input), expected);
            assert_is(&pooled, |[x, y, c]| {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
                four.map(|(i, j)| expected([2 * x + i, 2 * y + j, c])).into_iter().fold(0.0, f64::max)
            });
        }
    }

    #[test]
    fn merging_enlarges_the_coarse_input() {
        let layer = layer(3, 7 + 4, 16);
        for (set, width) in InstructionSet::available().into_iter().flat_map(|set| WIDTHS.map(|w| (set, w))) {
            let (coarse, fine) = (noise(3, width / 2, 3, 7), noise(4, width, 6, 4));
            let input = |x: isize, y: isize, c: usize| match c.checked_sub(7) {
                None => at(&coarse, x >> 1, y >> 1, c),
                Some(c) => at(&fine, x, y, c),
            };
            let expected = |place| naive(&layer, input, place).max(0.0);
            assert_is(&layer.merging(7).apply(set, &coarse, &fine), expected);
        }
    }

    #[test]
    fn heads_are_linear() {
        let (layer, input) = (layer(1, 9, 32), noise(3, 50, 3, 9));
        for set in InstructionSet::available() {
            let mut output = vec![0.0; 40 * 32];
            layer.linear(32, Some).apply(set, &input, [10, 2], &mut output);
            for (i, found) in output.into_iter().enumerate() {
                let expected = naive(&layer, |x, y, c| at(&input, x, y, c), [10 + i / 32, 2, i % 32]);
                assert!((f64::from(found) - expected).abs() < 1e-4);
            }
        }
    }
}
