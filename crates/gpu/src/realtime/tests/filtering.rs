//! The spatial filter by itself.

use super::*;
use testkit::Random;

/// As in `shaders/realtime_frame.wgsl`, but for variances: 16-bit numbers, the deviations last.
#[derive(Clone, Copy, Debug)]
struct Signal {
    diffuse: [f32; 3],
    diffuse_variance: f32,
    specular: [f32; 3],
    specular_variance: f32,
}

impl Signal {
    fn pack(&self) -> [u16; 8] {
        let ([r, g, b], [x, y, z]) = (self.diffuse, self.specular);
        [r, g, b, self.diffuse_variance.sqrt(), x, y, z, self.specular_variance.sqrt()]
            .map(|number| half::f16::from_f32(number).to_bits())
    }

    fn unpack(words: [u16; 8]) -> Self {
        let [r, g, b, diffuse, x, y, z, specular] = words.map(|word| half::f16::from_bits(word).to_f32());
        let (diffuse_variance, specular_variance) = (diffuse * diffuse, specular * specular);
        Self { diffuse: [r, g, b], diffuse_variance, specular: [x, y, z], specular_variance }
    }
}

impl Stage {
    /// Runs the spatial filter by itself over some signals, between the surfaces of the last frame.
    fn filtered(&mut self, signals: &[Signal]) -> Vec<Signal> {
        let passes = 5;
        let buffer = &self.buffers().signals[0];
        let packed: Vec<_> = signals.iter().map(Signal::pack).collect();
        write_buffer(&self.gpu, "signals", buffer, bytemuck::cast_slice(&packed)).expect("memory");
        let odd = self.odd();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut timer = Timer::new(&self.gpu).expect("memory");
        let kernel = &self.kernel;
        let mut recorder = Recorder {
            kernel,
            encoder: &mut encoder,
            clock: &mut timer,
            bindings: kernel.bindings.as_ref().expect("bound"),
            buffers: self.buffers(),
            odd,
        };
        (0..passes).for_each(|level| recorder.run("filter", &[RealtimePass::Filter(level)]));
        self.gpu.queue.submit([encoder.finish()]);
        self.read(&self.buffers().signals[passes as usize % 2]).into_iter().map(Signal::unpack).collect()
    }
}

/// The filter alone: constant light stays what it is, on every surface; noise gets less and keeps
/// its mean; light ends where a surface does.
pub(super) fn constant_light_stays_and_noise_keeps_its_mean(stage: &mut Stage) {
    stage.begin();
    stage.frames(&view(0.0, settings()), 1);
    let constant = Signal {
        diffuse: [0.5, 1.0, 2.0],
        diffuse_variance: 0.1,
        specular: [3.0; 3],
        specular_variance: 0.0,
    };
    for (pixel, s) in stage.filtered(&[constant; AREA]).iter().enumerate() {
        for (a, b) in [(s.diffuse, constant.diffuse), (s.specular, constant.specular)] {
            let near = a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * b);
            assert!(near, "pixel {pixel}: {a:?} instead of {b:?}");
        }
    }
    let mut random = Random::new(7);
    let noisy: Vec<Signal> = (0..AREA)
        .map(|_| {
            let x = (1.0 + 0.3 * random.normal()) as f32;
            Signal { diffuse: [x; 3], diffuse_variance: 0.09, specular: [x; 3], specular_variance: 0.09 }
        })
        .collect();
    let smooth = stage.filtered(&noisy);
    let statistics = |signals: &[Signal], of: fn(&Signal) -> f32| {
        let wall = (0..AREA).filter(|&p| wall_behind(p, 0.0, 1.2).is_some());
        let values: Vec<f64> = wall.map(|p| f64::from(of(&signals[p]))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (mean, values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64)
    };
    let (before, variance) = statistics(&noisy, |s| s.diffuse[0]);
    let (after, rest) = statistics(&smooth, |s| s.diffuse[0]);
    assert!((after / before - 1.0).abs() < 0.01, "the mean was {before} and is {after}");
    assert!(rest < 0.1 * variance, "the variance was {variance} and is {rest}");
    // Light on the ball only: none of it may leak onto the wall behind.
    let ball: Vec<bool> = (0..AREA).map(|p| !is_seen(on_wall(p, 0.0), 0.0, 0.85)).collect();
    let split: Vec<Signal> = ball
        .iter()
        .map(|&is_ball| Signal {
            diffuse: [f32::from(u8::from(is_ball)); 3],
            diffuse_variance: 1.0,
            ..constant
        })
        .collect();
    let kept = stage.filtered(&split);
    let leaked = (0..AREA).filter(|&p| wall_behind(p, 0.0, 1.2).is_some_and(|w| w.y > 0.6));
    let most = leaked.map(|p| kept[p].diffuse[0]).fold(0.0, f32::max);
    assert!(most < 0.02, "{most} of the ball's light is on the wall");
}

/// What is filtered are 16-bit numbers relative to what is shown as white: light that is more than
/// they hold becomes the most that they hold, neither infinite nor black.
pub(super) fn light_beyond_sixteen_bits_stays_finite(stage: &mut Stage) {
    let wall: Vec<usize> =
        (0..AREA).filter(|&p| wall_behind(p, 0.0, 1.2).is_some_and(|w| w.y > 0.6)).collect();
    let mut brightest = |white| {
        stage.begin();
        let allocation = AllocationSettings { white, ..AllocationSettings::default() };
        stage.frames(&view(0.0, RealtimeSettings { allocation, ..settings() }), 3);
        let film = stage.film();
        wall.iter().map(|&p| film.pixels()[p].mean()[1]).fold(0.0, f64::max)
    };
    let white = 1e-7;
    let (usual, bounded) = (brightest(1.0), brightest(white));
    let most = 65504.0 * f64::from(white);
    assert!(usual > 4.0 * most, "the light of {usual} is not more than 16 bits hold");
    assert!(bounded > 0.0 && bounded <= 1.001 * most, "{bounded} where {most} is the most");
}
