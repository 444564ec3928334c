//! How fast it is: `cargo test --release -p post --lib network::tests::speed -- --ignored
//! --nocapture`.

use super::super::convolution::Activations;
use super::super::lanes::{InstructionSet, Lanes, Sixteen, Stage};
use super::super::tiles::Region;
use super::pictures::Picture;
use super::*;
use rayon::ThreadPoolBuilder;
use std::time::Instant;

/// Seconds that this program has spent on processors: a busy machine does not count. Linux only.
fn processor_seconds() -> Option<f64> {
    let nanoseconds = |task: std::fs::DirEntry| -> Option<f64> {
        let statistics = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        statistics.split_whitespace().next()?.parse().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    Some(tasks.flatten().filter_map(nanoseconds).sum::<f64>() / 1e9)
}

/// Runs something five times and gives the fewest seconds: by the clock, and of processors.
fn seconds<T>(mut run: impl FnMut() -> T) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..5 {
        let (start, before) = (Instant::now(), processor_seconds());
        std::hint::black_box(run());
        let elapsed = start.elapsed().as_secs_f64();
        let spent = processor_seconds().zip(before).map_or(elapsed, |(after, before)| after - before);
        least = [least[0].min(elapsed), least[1].min(spent)];
    }
    least
}

/// Multiplies and adds in registers only, as often as `0` says.
struct Peak<'a>(usize, &'a mut [Sixteen; 12]);

impl Stage for Peak<'_> {
    #[inline(always)]
    fn run<L: Lanes, const PIXELS: usize>(self, l: L) {
        let mut sums = [l.splat(0.0); PIXELS];
        let (a, b) = (l.load(&self.1[0]), l.load(&self.1[1]));
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = l.mul_add(*sum, a, b);
            }
        }
        for (sum, to) in sums.into_iter().zip(self.1) {
            l.store(sum, to);
        }
    }
}

/// The most that a thread can do, in 10⁹ products per second.
fn peak() -> f64 {
    const TIMES: usize = 20_000_000;
    let time = seconds(|| {
        let mut sums = std::hint::black_box([[0.5; 16]; 12]);
        InstructionSet::best().run(Peak(TIMES, &mut sums));
        sums
    });
    let vectors = match InstructionSet::best() {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512(_) => 12,
        InstructionSet::Portable => 2,
        _ => 6,
    };
    (TIMES * vectors * 16) as f64 / time[0] / 1e9
}

/// Prints 10⁹ products per second; those that the specification counts, of which merging layers do
/// fewer.
#[test]
#[ignore = "measures"]
fn layers() {
    let (set, layers) = (InstructionSet::best(), network().layers);
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (width, height) = (960, 288);
    let zeros = |level: usize, channels| Activations::new(width >> level, height >> level, channels);
    let peak = peak();
    println!("peak: {peak:.1} GMAC/s");
    let print = |name: &str, level: usize, products: usize, time: [f64; 2]| {
        let products = ((width >> level) * (height >> level) * products) as f64;
        let speed = products / time[0] / 1e9;
        println!("{name}: {speed:.1} GMAC/s, {:.0} % of the peak", 100.0 * speed / peak);
    };
    pool.install(|| {
        for (name, level, layer) in [
            ("e0a", 0, &layers.e0a),
            ("e0b", 0, &layers.e0b),
            ("e1", 1, &layers.e1),
            ("e2", 2, &layers.e2),
            ("e3", 3, &layers.e3),
            ("e4b", 4, &layers.e4b),
            ("d3b", 3, &layers.d3b),
            ("d2b", 2, &layers.d2b),
            ("d1b", 1, &layers.d1b),
            ("d0b", 0, &layers.d0b),
        ] {
            let input = zeros(level, layer.weights.inputs);
            let products = 9 * layer.weights.inputs * layer.bias.len() * 16;
            print(name, level, products, seconds(|| layer.apply(set, &input)));
        }
        for (name, level, layer) in [
            ("d3a", 3, &layers.d3a),
            ("d2a", 2, &layers.d2a),
            ("d1a", 1, &layers.d1a),
            ("d0a", 0, &layers.d0a),
        ] {
            let (coarse, fine) = (layer.coarse[0][0].inputs, layer.fine.inputs);
            let inputs = [zeros(level + 1, coarse), zeros(level, fine)];
            let products = (4 * coarse + 9 * fine) * layer.bias.len() * 16;
            let time = seconds(|| layer.apply(set, &inputs[0], &inputs[1]));
            print(&format!("{name} (done)"), level, products, time);
            print(&format!("{name} (as 3×3)"), level, 9 * (coarse + fine) * layer.bias.len() * 16, time);
        }
    });
}

/// Prints the seconds of a picture of 1920×1080.
#[test]
#[ignore = "measures"]
fn whole() {
    let network = network();
    let picture = Picture::noisy(1920, 1080);
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let input = picture.input();
            let scaled = Scaled::new(&input);
            let region = Region { x: 0, y: 0, width: 1920, height: 1088 };
            let set = InstructionSet::best();
            let print = |what: &str, [elapsed, spent]: [f64; 2]| {
                println!("{threads} threads: {what} {elapsed:.3} s, {spent:.3} s of processors");
            };
            print("scale", seconds(|| Scaled::new(&input).scale));
            print("features", seconds(|| scaled.unshuffled(region)));
            print("features and network", seconds(|| network.layers.decode(set, scaled.unshuffled(region))));
            for tile in tiles::plan(1920, 1080, tiles::MOST_PIXELS) {
                let decoded = network.layers.decode(set, scaled.unshuffled(tile.region));
                let mut to = vec![0.0; 1920 * 1080 * 3];
                let start = Instant::now();
                filter::filter(set, &network.layers, decoded, scaled, tile, 1920, &mut to);
                println!("{threads} threads: heads and filter {:.3} s", start.elapsed().as_secs_f64());
            }
            print("all", seconds(|| network.denoise(&input)));
        });
    }
}
