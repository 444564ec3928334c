//! `alhazen bench adaptive`: what adaptive sampling is worth.

use super::around::{AroundArgs, Frames};
use super::report::{Percentiles, Plot, Report, ReportArgs, Scale, Table};
use super::views::{View, ViewArgs, render};
use crate::console::{print_result, say};
use alhazen::{
    Adaptive, FrameSamples, Image, Job, Limits, RealtimeSettings, Renderer, SamplerKind, Sampling, metrics,
};
use clap::Args;

/// Adaptive against uniform sampling, at equal error and at equal time.
///
/// Both render the same pictures with several budgets; relMSE and FLIP are measured against a converged reference. The
/// gain in rays is how many rays uniform sampling needs for the error that adaptive sampling has reached, divided by those
/// that adaptive sampling took; it is read off the uniform curve, log-linearly between its points. The gain in time is the
/// same with seconds, all work on rounds included.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  alhazen bench adaptive
  alhazen bench adaptive cornell room.glb --spp 64,256 --backend gpu --width 1920 --height 1080
  alhazen bench adaptive atrium --around 8 --width 1920 --height 1080")]
pub struct AdaptiveArgs {
    #[command(flatten)]
    views: ViewArgs,
    /// Budgets: samples per pixel on average, separated by commas. Uniform sampling is measured at twice and four times the
    /// largest, too, so that its curve reaches as far.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [32, 64, 128, 256])]
    spp: Vec<u32>,
    /// Samples that adaptive sampling gives to every pixel first.
    #[arg(long, value_name = "SPP", default_value_t = Adaptive::default().min_spp, value_parser = clap::value_parser!(u32).range(2..))]
    min_spp: u32,
    /// Pictures of different noise at each budget.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    #[command(flatten)]
    around: AroundArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// What one way of sampling makes of a budget: means over the seeds.
#[derive(Clone, Debug)]
struct Point {
    spp: u32,
    rays: f64,
    seconds: f64,
    rel_mse: f64,
    flip: f64,
    picture: Image,
}

/// What was measured of a scene.
struct Measured {
    view: View,
    uniform: Vec<Point>,
    adaptive: Vec<Point>,
}

/// Measures, prints and writes.
pub fn run(args: &AdaptiveArgs) -> anyhow::Result<()> {
    if args.around.around > 0 {
        return run_around(args);
    }
    let mut renderer = args.views.renderer()?;
    let mut settings = args.views.settings(&renderer);
    settings.push(("seeds", args.seeds.to_string()));
    settings.push(("least samples", args.min_spp.to_string()));
    settings.push(("errors are relative to", format!("radiance² + {}", metrics::REL_MSE_EPSILON)));
    let mut report = Report::new("adaptive", "Adaptive against uniform sampling", &settings);
    let mut all = Vec::new();
    for scene in args.views.scenes()? {
        let view = args.views.open(scene, &mut renderer)?;
        let mut of = |sampling: Sampling, budgets: &[u32]| -> anyhow::Result<Vec<Point>> {
            budgets.iter().map(|&spp| measure(&mut renderer, &view, spp, sampling, args.seeds)).collect()
        };
        let most = args.spp.iter().copied().max().unwrap_or(1);
        let uniform = of(Sampling::Uniform, &[&args.spp[..], &[2 * most, 4 * most]].concat())?;
        let settings = Adaptive { min_spp: args.min_spp, floor: Some(metrics::REL_MSE_EPSILON) };
        // What is compiled once is no cost of a picture; the reference has done that for equal samples.
        of(Sampling::Adaptive(settings), &[2 * args.min_spp])?;
        let adaptive = of(Sampling::Adaptive(settings), &args.spp)?;
        let measured = Measured { view, uniform, adaptive };
        say!("{}: {:.2} times fewer rays", measured.view.name, measured.gain(|p| p.rays));
        all.push(measured);
    }
    fill(&mut report, &all)?;
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

/// Device time of frames with the same number of samples everywhere, and where noise wants them, from all around.
fn run_around(args: &AdaptiveArgs) -> anyhow::Result<()> {
    let most = FrameSamples::ADAPTIVE.most;
    let with = |samples| RealtimeSettings { samples, budget: None, ..RealtimeSettings::default() };
    let frames = Frames {
        scenes: args.views.scenes()?,
        size: args.views.size(),
        adapter: args.views.adapter(),
        sampler: SamplerKind::default(),
        ways: vec![
            ("uniform", with(FrameSamples { least: most, most })),
            ("adaptive", with(FrameSamples::ADAPTIVE)),
        ],
    };
    let mut settings = args.around.settings(&frames)?;
    settings.push(("uniform samples", most.to_string()));
    settings.push(("adaptive samples", FrameSamples::ADAPTIVE.to_string()));
    let mut report = Report::new("adaptive", "Adaptive against uniform frames from all around", &settings);
    args.around.measure(&frames, &mut report)?;
    print_result(&report.summary())?;
    say!("{}", report.write(&args.report.report)?.display());
    Ok(())
}

fn measure(
    renderer: &mut Renderer,
    view: &View,
    spp: u32,
    sampling: Sampling,
    seeds: u32,
) -> anyhow::Result<Point> {
    let picture = view.reference.clone();
    let mut sum = Point { spp, rays: 0.0, seconds: 0.0, rel_mse: 0.0, flip: 0.0, picture };
    let share = 1.0 / f64::from(seeds);
    for seed in 1..=seeds {
        let job = Job { seed, ..view.job.clone() };
        let limits = Limits { spp, sampling, ..Limits::default() };
        let (picture, summary) = render(renderer, &job, &limits)?;
        let distance = view.distance(&picture)?;
        sum.rays += share * summary.rays as f64;
        sum.seconds += share * summary.elapsed.as_secs_f64();
        sum.rel_mse += share * distance.rel_mse;
        sum.flip += share * distance.flip;
        sum.picture = picture;
    }
    Ok(sum)
}

impl Measured {
    /// How much more of a cost uniform sampling needs for the errors that adaptive sampling has reached: the geometric mean
    /// over the budgets. NaN if uniform sampling has not come so far.
    fn gain(&self, cost: impl Fn(&Point) -> f64) -> f64 {
        let curve: Vec<(f64, f64)> = self.uniform.iter().map(|p| (p.rel_mse, cost(p))).collect();
        let gains = self.adaptive.iter().map(|p| (cost_at(&curve, p.rel_mse) / cost(p)).ln());
        let gains: Vec<f64> = gains.filter(|g| g.is_finite()).collect();
        (gains.iter().sum::<f64>() / gains.len() as f64).exp()
    }
}

/// What it costs to reach an error, on a curve of errors and costs; NaN outside of it.
fn cost_at(curve: &[(f64, f64)], error: f64) -> f64 {
    let mut sorted = curve.to_vec();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let between = sorted.windows(2).find(|w| (w[1].0..=w[0].0).contains(&error));
    between.map_or(f64::NAN, |w| {
        let ((e0, c0), (e1, c1)) = (w[0], w[1]);
        let share = if e0 > e1 { (e0 / error).ln() / (e0 / e1).ln() } else { 0.0 };
        (c0.ln() + share * (c1 / c0).ln()).exp()
    })
}

fn fill(report: &mut Report, all: &[Measured]) -> anyhow::Result<()> {
    report.text(
        "How many times fewer rays, and how much less time, adaptive sampling needs than uniform sampling for the same \
         relMSE against a converged reference: the geometric mean over the budgets.",
    );
    let mut gains = Table::new("gains", "Gains at equal relMSE", &["scene", "rays", "time"]);
    let mut sums = [Vec::new(), Vec::new()];
    for m in all {
        let (rays, time) = (m.gain(|p| p.rays), m.gain(|p| p.seconds));
        sums[0].push(rays);
        sums[1].push(time);
        gains.push(vec![m.view.name.as_str().into(), rays.into(), time.into()]);
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    gains.push(vec!["mean".into(), mean(&sums[0]).into(), mean(&sums[1]).into()]);
    let least = |v: &[f64]| Percentiles::of(v).least;
    gains.push(vec!["least".into(), least(&sums[0]).into(), least(&sums[1]).into()]);
    report.table(gains);
    let columns = ["scene", "sampling", "spp", "rays", "seconds", "relMSE", "FLIP"];
    let mut points = Table::new("points", "All measurements", &columns);
    for m in all {
        for (name, curve) in [("uniform", &m.uniform), ("adaptive", &m.adaptive)] {
            for p in curve {
                let numbers = [f64::from(p.spp), p.rays, p.seconds, p.rel_mse, p.flip];
                let names = [m.view.name.as_str().into(), name.into()];
                points.push(names.into_iter().chain(numbers.map(Into::into)).collect());
            }
        }
    }
    report.table(points);
    for m in all {
        let name = &m.view.name;
        let plot = |title: &str, x: &str, y: &str, of: fn(&Point) -> (f64, f64)| {
            let curve = |points: &[Point]| points.iter().map(of).collect();
            Plot::new(&format!("{name}: {title}"), (x, Scale::Log), (y, Scale::Log))
                .with("uniform", curve(&m.uniform))
                .with("adaptive", curve(&m.adaptive))
        };
        report.plot(plot("relMSE by rays", "rays", "relMSE", |p| (p.rays, p.rel_mse)));
        report.plot(plot("relMSE over time", "seconds", "relMSE", |p| (p.seconds, p.rel_mse)));
        report.plot(plot("FLIP over time", "seconds", "mean FLIP error", |p| (p.seconds, p.flip)));
        if let (Some(uniform), Some(adaptive)) = (m.uniform.first(), m.adaptive.first()) {
            let pictures = [uniform.picture.clone(), adaptive.picture.clone(), m.view.reference.clone()];
            let title = format!("{name}: {} samples per pixel uniform, adaptive; reference", uniform.spp);
            report.picture(&title, &m.view.crops(&pictures))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_read_off_the_curve() {
        // Twice the cost, half the error.
        let curve = [(0.5, 2.0), (1.0, 1.0), (0.125, 8.0)];
        for (error, cost) in [(1.0, 1.0), (0.5, 2.0), (0.25, 4.0), (0.125, 8.0)] {
            assert!((cost_at(&curve, error) - cost).abs() < 1e-9, "{error}");
        }
        assert!(cost_at(&curve, 0.1).is_nan() && cost_at(&curve, 2.0).is_nan());
    }
}
