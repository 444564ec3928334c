//! Pictures of GPU back ends beside the CPU's.

use super::*;

/// Samples a pixel of what is compared.
pub const SPP: u32 = 16;

/// Renders a scene; with what was noted on the way.
pub fn render(renderer: &mut Renderer, scene: &Scene, job: &Job, spp: u32) -> (Film, Summary) {
    renderer.load(scene).unwrap_or_else(|e| panic!("{}: {e:?}", renderer.backend_name()));
    let limits = Limits { spp, ..Limits::default() };
    let summary = renderer
        .render(job, &limits, &Control::new())
        .unwrap_or_else(|e| panic!("{}: {e:?}", renderer.backend_name()));
    (renderer.film().expect("film").expect("rendered").clone(), summary)
}

/// Share of pixels that differ by more than rounding.
pub fn differing_share(a: &Film, b: &Film) -> f64 {
    let level = b.mean().iter().sum::<f64>() / 3.0;
    let differs = |(a, b): (&film::PixelStats, &film::PixelStats)| {
        let pairs = a.mean().into_iter().zip(b.mean());
        pairs.into_iter().any(|(a, b)| (a - b).abs() > 2e-3 * (a.abs() + b.abs()) + 2e-4 * level)
    };
    let differing = a.pixels().iter().zip(b.pixels()).filter(|&pair| differs(pair)).count();
    differing as f64 / a.pixels().len() as f64
}

/// Compares renderers, which know their shaders already, with the CPU; `share` of the pixels may differ by more than rounding.
pub fn compare_on(renderers: &mut [Renderer], test: &str, scene: &Scene, job: &Job, share: f64) {
    if renderers.is_empty() {
        return;
    }
    let (expected, on_cpu) = render(&mut Renderer::cpu(None).expect("threads"), scene, job, SPP);
    for renderer in renderers {
        let name = format!("{test} on {}", renderer.backend_name());
        let (film, summary) = render(renderer, scene, job, SPP);
        assert_eq!(summary.spp, SPP, "{name}");
        assert_eq!(
            film.total_samples() + film.invalid_samples(),
            expected.total_samples() + expected.invalid_samples()
        );
        assert_eq!(film.invalid_samples(), expected.invalid_samples(), "{name}: NaN");
        let differing = differing_share(&film, &expected);
        let rays = summary.rays as f64 / on_cpu.rays as f64;
        println!("{name}: {:.2} % of pixels differ, {rays:.4} of the CPU's rays", 100.0 * differing);
        for block in [8, WHOLE_IMAGE] {
            let comparison = Comparison::new(name.replace(' ', "-"), block);
            comparison.assert(&Estimate::from_film(&film), &Estimate::from_film(&expected));
        }
        assert!(differing <= share, "{name}: {:.1} % of the pixels differ", 100.0 * differing);
        assert!((rays - 1.0).abs() < 0.02, "{name}: {rays} times the CPU's rays");
    }
}
