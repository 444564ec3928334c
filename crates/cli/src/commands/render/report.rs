//! What is printed about a scene and a finished picture.

use super::args::RenderArgs;
use crate::console::{bytes, json_line, metric, print_report, print_result, say, seconds};
use alhazen::{Job, LoadStats, Loaded, Renderer, Summary, plain};
use std::path::PathBuf;
use std::time::Duration;

/// What was loaded.
pub fn print_loaded(loaded: &Loaded) {
    let scene = &loaded.scene;
    let (unique, instanced) = (scene.unique_triangles(), scene.instanced_triangles());
    let triangles = if unique as u64 == instanced {
        format!("{unique} triangles")
    } else {
        format!("{unique} triangles ({instanced} instanced)")
    };
    let counts = format!("{} instances, {} materials", scene.instances.len(), scene.materials.len());
    let (name, time) = (plain(&scene.name), seconds(loaded.report.elapsed));
    say!("{name}: {triangles}, {counts}, loaded in {time}");
    // Where there is nothing to see, everything that the loader noticed may be the reason.
    print_report(&loaded.report, scene.bounds().is_none());
}

/// What was rendered: for programs to stdout, for people to stderr.
pub fn report(
    args: &RenderArgs,
    renderer: &Renderer,
    job: &Job,
    summary: &Summary,
    load: Duration,
    built: &LoadStats,
    written: &[PathBuf],
) -> anyhow::Result<()> {
    let elapsed = summary.elapsed.as_secs_f64().max(1e-9);
    let (samples_rate, rays_rate) = (summary.samples as f64 / elapsed, summary.rays as f64 / elapsed);
    let memory = alhazen::peak_memory_bytes();
    if args.json {
        let json = serde_json::json!({
            "scene": args.scene, "backend": renderer.backend_name(), "device": renderer.describe(),
            "kernel": renderer.kernel(),
            "integrator": job.integrator.name(), "width": job.width, "height": job.height, "spp": summary.spp,
            "samples": summary.samples, "rays": summary.rays, "render_seconds": elapsed,
            "samples_per_second": samples_rate, "rays_per_second": rays_rate,
            "load_seconds": load.as_secs_f64(), "build_seconds": built.build.as_secs_f64(),
            "acceleration_bytes": built.acceleration_bytes, "table_bytes": built.table_bytes,
            "device_bytes": built.device_bytes,
            "device_seconds": summary.device_time.map(|t| t.as_secs_f64()),
            "peak_memory_bytes": memory, "noise": summary.noise, "invalid_samples": summary.invalid_samples,
            "cancelled": summary.cancelled, "output": written,
        });
        print_result(&json_line(&json))?;
    }
    if args.quiet {
        return Ok(());
    }
    if summary.invalid_samples > 0 {
        say!("  {} samples were NaN or infinite and were left out", summary.invalid_samples);
    }
    let names: Vec<_> = written.iter().map(|p| p.display().to_string()).collect();
    say!(
        "{}: {}×{}, {} spp, {} in {} ({}samples/s, {}rays/s) on {}; built in {}{}",
        names.join(", "),
        job.width,
        job.height,
        summary.spp,
        job.integrator.name(),
        seconds(summary.elapsed),
        metric(samples_rate),
        metric(rays_rate),
        renderer.describe(),
        seconds(built.build),
        memory.map_or(String::new(), |m| format!("; peak memory {}", bytes(m))),
    );
    Ok(())
}
