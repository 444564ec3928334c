//! Which devices work together.

use crate::choice::{ChoiceError, Chosen, RendererOptions, open_backend};
use crate::fallback::{Fallback, Step};
use crate::together::Together;
use crate::{BackendChoice, Renderer};
use backend::Backend;
use cpu::CpuBackend;
use gpu::tracer::TracerKind;
use gpu::{AdapterSummary, Gpu, GpuError, GpuOptions};

/// Names of adapters that are separated by commas; one that is a part of an adapter's name as a whole is one.
fn names(adapter: Option<&str>, adapters: &[AdapterSummary]) -> Vec<String> {
    let Some(list) = adapter else { return Vec::new() };
    let is_one = adapters.iter().any(|a| matches(a, list));
    let parts = || list.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty());
    if is_one { vec![list.to_owned()] } else { parts().collect() }
}

/// Whether more than one adapter is named.
pub(crate) fn names_several(options: &RendererOptions) -> bool {
    let lists = options.adapter.as_deref().is_some_and(|list| list.contains(','));
    lists && names(options.adapter.as_deref(), &gpu::adapters()).len() > 1
}

fn matches(adapter: &AdapterSummary, name: &str) -> bool {
    adapter.info.name.to_lowercase().contains(&name.to_lowercase())
}

/// How to open each of the GPUs that are meant: those that are named, the same name twice being two of them, or all real
/// ones, each once though several drivers may offer it.
fn devices(names: &[String], adapters: &[AdapterSummary]) -> Vec<GpuOptions> {
    let named = |(i, name): (usize, &String)| {
        let ordinal = names[..i].iter().filter(|earlier| *earlier == name).count();
        GpuOptions { adapter: Some(name.clone()), ordinal, ..GpuOptions::default() }
    };
    if !names.is_empty() {
        return names.iter().enumerate().map(named).collect();
    }
    let real = adapters.iter().enumerate().filter(|(_, a)| !a.is_software());
    let api = real.clone().next().map(|(_, a)| a.info.backend);
    let option = |(i, a): (usize, &AdapterSummary)| {
        let name = a.info.name.clone();
        let ordinal = adapters[..i].iter().filter(|earlier| matches(earlier, &name)).count();
        GpuOptions { adapter: Some(name), ordinal, ..GpuOptions::default() }
    };
    real.filter(|(_, a)| Some(a.info.backend) == api).map(option).collect()
}

/// What `--backend all` would take, for people.
pub(crate) fn describe_all() -> Vec<String> {
    let adapters = gpu::adapters();
    let gpus = devices(&[], &adapters).into_iter().filter_map(|options| options.adapter);
    let processor = crate::system::processor_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    gpus.chain([processor]).collect()
}

/// A renderer on all that the options ask for.
///
/// # Errors
/// [`ChoiceError::Gpu`] for a GPU that is named and cannot be used, or where only GPUs are asked for and there is none.
pub(crate) fn choose(options: &RendererOptions) -> Result<Chosen, ChoiceError> {
    let adapters = gpu::adapters();
    let names = names(options.adapter.as_deref(), &adapters);
    let failed = |source| ChoiceError::Gpu { backend: options.backend.name(), source };
    let mut members: Vec<Box<dyn Backend>> = Vec::new();
    let mut left_out = String::new();
    for device in devices(&names, &adapters) {
        match open(&device, options) {
            Ok(backend) => members.push(backend),
            Err(error) if !names.is_empty() => return Err(failed(error)),
            Err(error) => left_out += &format!("; without {}: {error}", device.adapter.unwrap_or_default()),
        }
    }
    if options.backend == BackendChoice::All {
        // The devices' threads want to be heard: one core for each.
        let cores = crate::system::default_threads().saturating_sub(members.len()).max(1);
        let threads = options.threads.or((!members.is_empty()).then_some(cores));
        members.push(Box::new(CpuBackend::new(threads)?));
    }
    let together = Together::new(members);
    let reason = together.devices().join(", and ") + &left_out;
    let steps = vec![Step::Cpu(options.threads)];
    let backend: Box<dyn Backend> = match options.backend {
        BackendChoice::Auto | BackendChoice::Gpu => Box::new(Fallback::new(Box::new(together), steps)),
        _ => Box::new(together),
    };
    Ok(Chosen { renderer: Renderer::new(backend), reason })
}

fn open(device: &GpuOptions, options: &RendererOptions) -> Result<Box<dyn Backend>, GpuError> {
    let gpu = Gpu::open(device)?;
    let kind = match options.backend {
        BackendChoice::Tracer(kind) => kind,
        _ => TracerKind::best(gpu.features, gpu.is_software()),
    };
    Ok(Box::new(open_backend(gpu, kind, options.kernel)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_a_list_and_the_same_name_twice_is_two_devices() {
        let names = names(Some("H100, llvmpipe,H100"), &[]);
        assert_eq!(names, ["H100", "llvmpipe", "H100"]);
        let devices = devices(&names, &[]);
        let ordinals: Vec<_> = devices.iter().map(|d| (d.adapter.as_deref(), d.ordinal)).collect();
        assert_eq!(ordinals, [(Some("H100"), 0), (Some("llvmpipe"), 0), (Some("H100"), 1)]);
        assert!(super::names(None, &[]).is_empty());
    }

    #[test]
    fn all_devices_have_a_processor_among_them() {
        let all = describe_all();
        let real = gpu::adapters().iter().filter(|a| !a.is_software()).count();
        assert!(!all.is_empty() && all.len() <= real + 1, "{all:?}");
        let options = RendererOptions { backend: BackendChoice::All, ..RendererOptions::default() };
        let chosen = choose(&options).expect("a processor");
        assert!(chosen.reason.contains("cpu on"), "{}", chosen.reason);
        let options = RendererOptions { adapter: Some("no such chip, none".into()), ..options };
        assert!(matches!(choose(&options), Err(ChoiceError::Gpu { backend: "all", .. })));
    }
}
