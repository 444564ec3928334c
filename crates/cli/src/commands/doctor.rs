//! `alhazen doctor`: what this machine can run, and what is chosen and why.

use crate::console::{bytes, print_result};
use alhazen::system;
use std::fmt::Write;

/// Show what this machine can run and which back end is chosen.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Put its output into bug reports.

Examples:
  alhazen doctor
  alhazen doctor --json")]
pub struct DoctorArgs {
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
}

/// Prints the findings.
pub fn run(args: &DoctorArgs) -> anyhow::Result<()> {
    let text = if args.json { format!("{}\n", as_json()) } else { as_text()? };
    print_result(&text)
}

fn as_text() -> anyhow::Result<String> {
    let mut text = String::new();
    let features = system::processor_features();
    let memory = |size: Option<u64>| size.map_or("unknown".into(), bytes);
    writeln!(text, "alhazen     {}", env!("CARGO_PKG_VERSION"))?;
    writeln!(text, "system      {} {}", std::env::consts::OS, std::env::consts::ARCH)?;
    writeln!(text, "processor   {}", system::processor_name().as_deref().unwrap_or("unknown"))?;
    writeln!(text, "features    {}", if features.is_empty() { "none".into() } else { features.join(" ") })?;
    writeln!(text, "threads     {}", system::default_threads())?;
    let (total, available) = (alhazen::total_memory_bytes(), alhazen::available_memory_bytes());
    writeln!(text, "memory      {}, {} available", memory(total), memory(available))?;
    writeln!(text, "\ntraversal kernels of the CPU back end")?;
    for kernel in system::kernels() {
        let status = match (kernel.chosen, kernel.available) {
            (true, _) => "chosen: the fastest that this processor can run",
            (false, true) => "available",
            (false, false) => "not on this processor",
        };
        writeln!(text, "  {:<8} {status} (needs {})", kernel.name, kernel.needs)?;
    }
    writeln!(text, "\nback ends")?;
    for backend in system::backends() {
        let status = match (backend.chosen, backend.available) {
            (true, _) => "chosen",
            (false, true) => "available",
            (false, false) => "not available",
        };
        writeln!(text, "  {:<12} {status}: {} ({})", backend.name, backend.reason, backend.device)?;
    }
    writeln!(text, "  {:<12} {}", "all", system::all_devices().join(", and "))?;
    adapters_as_text(&mut text)?;
    Ok(text)
}

fn adapters_as_text(text: &mut String) -> anyhow::Result<()> {
    writeln!(text, "\nadapters")?;
    let adapters = system::adapters();
    if adapters.is_empty() {
        writeln!(text, "  none: a GPU needs a driver for Vulkan, Direct3D 12 or Metal")?;
    }
    for a in adapters {
        writeln!(text, "  {} ({}, {}; {})", a.name, a.kind, a.api, a.driver)?;
        for (backend, lacks) in &a.lacks {
            let status =
                if lacks.is_empty() { "yes".into() } else { format!("no, it lacks {}", lacks.join(", ")) };
            writeln!(text, "    {backend:<12} {status}")?;
        }
        writeln!(text, "    uses         {}", a.features.join(" "))?;
        writeln!(
            text,
            "    lacks        {}",
            if a.missing.is_empty() { "nothing".into() } else { a.missing.join(" ") }
        )?;
        for (name, limit) in &a.limits {
            writeln!(text, "    {limit} {name}")?;
        }
    }
    Ok(())
}

fn as_json() -> serde_json::Value {
    let kernel = |k: &system::KernelStatus| serde_json::json!({ "name": k.name, "needs": k.needs, "available": k.available, "chosen": k.chosen });
    let backend = |b: &system::BackendStatus| {
        serde_json::json!({
            "name": b.name, "available": b.available, "chosen": b.chosen, "device": b.device, "reason": b.reason,
        })
    };
    let adapter = |a: &system::AdapterStatus| {
        let lacks: serde_json::Map<_, _> =
            a.lacks.iter().map(|(name, lacks)| ((*name).to_owned(), serde_json::json!(lacks))).collect();
        let limits: serde_json::Map<_, _> =
            a.limits.iter().map(|(name, limit)| ((*name).to_owned(), serde_json::json!(limit))).collect();
        serde_json::json!({
            "name": a.name, "api": a.api, "kind": a.kind, "driver": a.driver, "software": a.is_software,
            "features": a.features, "missing": a.missing, "lacks": lacks, "limits": limits,
        })
    };
    serde_json::json!({
        "version": env!("CARGO_PKG_VERSION"),
        "os": std::env::consts::OS,
        "architecture": std::env::consts::ARCH,
        "processor": system::processor_name(),
        "features": system::processor_features(),
        "threads": system::default_threads(),
        "memory_bytes": alhazen::total_memory_bytes(),
        "available_memory_bytes": alhazen::available_memory_bytes(),
        "kernels": system::kernels().iter().map(kernel).collect::<Vec<_>>(),
        "backends": system::backends().iter().map(backend).collect::<Vec<_>>(),
        "all_devices": system::all_devices(),
        "adapters": system::adapters().iter().map(adapter).collect::<Vec<_>>(),
    })
}
