//! What this machine can run, and what is chosen on it.

use accel::InstructionSet;
use gpu::tracer::TracerKind;

/// One traversal kernel of the CPU back end on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelStatus {
    /// Its name.
    pub name: &'static str,
    /// What it needs.
    pub needs: &'static str,
    /// Whether this processor can run it.
    pub available: bool,
    /// Whether it is the one that renders.
    pub chosen: bool,
}

/// One back end on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendStatus {
    /// Its name, one of [`crate::BACKENDS`].
    pub name: &'static str,
    /// Whether it can render here.
    pub available: bool,
    /// Whether it is the one that renders when nothing else is asked for.
    pub chosen: bool,
    /// What it runs on.
    pub device: String,
    /// Why it was chosen or not.
    pub reason: String,
}

/// All traversal kernels, the simplest first.
pub fn kernels() -> Vec<KernelStatus> {
    let all = [
        (InstructionSet::Scalar, "scalar", "any processor"),
        (InstructionSet::Neon, "neon", "Arm with Advanced SIMD"),
        (InstructionSet::Avx2, "avx2", "x86-64 with AVX2, FMA, BMI1, BMI2, LZCNT, POPCNT"),
        (InstructionSet::Avx512, "avx512", "x86-64 with AVX-512 F, VL, DQ, BW"),
    ];
    let best = InstructionSet::best();
    let status = |(kernel, name, needs): (InstructionSet, _, _)| KernelStatus {
        name,
        needs,
        available: kernel.is_available(),
        chosen: kernel == best,
    };
    all.map(status).into()
}

/// One adapter on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterStatus {
    /// Its name.
    pub name: String,
    /// Interface through which it is driven, such as `Vulkan`.
    pub api: String,
    /// What it is, such as `DiscreteGpu`.
    pub kind: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Whether it computes on the processor.
    pub is_software: bool,
    /// Features that Alhazen uses and it has.
    pub features: Vec<String>,
    /// Features that Alhazen would use and it lacks.
    pub missing: Vec<String>,
    /// Limits that matter, by name.
    pub limits: Vec<(&'static str, u64)>,
    /// For each GPU back end, what it lacks for it; empty if nothing.
    pub lacks: Vec<(&'static str, Vec<String>)>,
}

/// All adapters, the best first.
pub fn adapters() -> Vec<AdapterStatus> {
    gpu::adapters().iter().map(adapter_status).collect()
}

fn adapter_status(a: &gpu::AdapterSummary) -> AdapterStatus {
    AdapterStatus {
        name: a.info.name.clone(),
        api: format!("{:?}", a.info.backend),
        kind: format!("{:?}", a.info.device_type),
        driver: [a.info.driver.as_str(), a.info.driver_info.as_str()].join(" ").trim().to_owned(),
        is_software: a.is_software(),
        features: a.used_features(),
        missing: a.missing_features(),
        limits: vec![
            ("bytes a shader sees of a buffer", a.limits.max_storage_buffer_binding_size),
            ("bytes of a buffer", a.limits.max_buffer_size),
            ("pixels along a texture", u64::from(a.limits.max_texture_dimension_2d)),
            ("storage buffers of a shader", u64::from(a.limits.max_storage_buffers_per_shader_stage)),
        ],
        lacks: TracerKind::ALL.map(|kind| (kind.name(), what_is_lacking(a, kind))).into(),
    }
}

fn what_is_lacking(adapter: &gpu::AdapterSummary, kind: TracerKind) -> Vec<String> {
    let mut missing = kind.missing(adapter.features);
    let (needed, offered) = (gpu::STORAGE_BUFFERS, adapter.limits.max_storage_buffers_per_shader_stage);
    if offered < needed {
        missing.push(format!("{needed} storage buffers a shader (it has {offered})"));
    }
    missing
}

/// What `--backend all` renders with: the names of all real GPUs, and of the processor.
pub fn all_devices() -> Vec<String> {
    crate::several_devices::describe_all()
}

/// All back ends that this build has, in the order of [`crate::BACKENDS`], and which one `auto` takes.
pub fn backends() -> Vec<BackendStatus> {
    let adapters = gpu::adapters();
    let chosen = chosen_gpu(&adapters);
    let processor = processor_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let reason = match (&chosen, adapters.first()) {
        (Some(_), _) => "the last resort; a GPU is faster",
        (None, Some(_)) => "there is no real GPU, and software drivers are slower",
        (None, None) => "no driver offers a GPU",
    };
    let cpu = BackendStatus {
        name: "cpu",
        available: true,
        chosen: chosen.is_none(),
        device: processor,
        reason: reason.to_owned(),
    };
    let gpus = TracerKind::ALL.map(|kind| gpu_status(&adapters, kind, chosen == Some(kind)));
    std::iter::once(cpu).chain(gpus).collect()
}

/// How `auto` traces on this machine; `None` if it stays on the CPU.
fn chosen_gpu(adapters: &[gpu::AdapterSummary]) -> Option<TracerKind> {
    let best = adapters.first().filter(|a| !a.is_software())?;
    let kind = TracerKind::best(best.features, false);
    what_is_lacking(best, kind).is_empty().then_some(kind)
}

fn gpu_status(adapters: &[gpu::AdapterSummary], kind: TracerKind, chosen: bool) -> BackendStatus {
    let able = adapters.iter().find(|a| what_is_lacking(a, kind).is_empty());
    let (device, reason) = match (able.or(adapters.first()), able) {
        (None, _) => ("no GPU".to_owned(), "no driver offers an adapter".to_owned()),
        (Some(a), None) => (a.info.name.clone(), format!("it lacks {}", what_is_lacking(a, kind).join(", "))),
        (Some(a), Some(_)) if chosen => (a.info.name.clone(), "the fastest way there".to_owned()),
        (Some(a), Some(_)) if a.is_software() => {
            (a.info.name.clone(), "a software driver, slower than the CPU back end".to_owned())
        }
        (Some(a), Some(_)) => (a.info.name.clone(), "another way is faster".to_owned()),
    };
    BackendStatus { name: kind.name(), available: able.is_some(), chosen, device, reason }
}

/// Number of threads that render when nothing else is asked for.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The processor's name, where the system tells.
pub fn processor_name() -> Option<String> {
    let mut system = sysinfo::System::new().ok()?;
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    let name = system.cpus().first()?.brand().trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// Instruction set extensions of this processor that matter to Alhazen.
pub fn processor_features() -> Vec<&'static str> {
    let mut found = Vec::new();
    macro_rules! look_for {
        ($detect:ident: $($name:tt)*) => {
            $(if std::arch::$detect!($name) { found.push($name); })*
        };
    }
    #[cfg(target_arch = "x86_64")]
    look_for!(is_x86_feature_detected: "sse4.2" "avx" "avx2" "fma" "f16c" "bmi1" "bmi2" "lzcnt" "popcnt" "avx512f"
        "avx512vl" "avx512dq" "avx512bw");
    #[cfg(target_arch = "aarch64")]
    look_for!(is_aarch64_feature_detected: "neon" "sve" "sve2");
    // Other processors run the portable code.
    let _ = &mut found;
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_one_kernel_and_one_back_end_are_chosen_and_can_run() {
        let kernels = kernels();
        assert_eq!(kernels.iter().filter(|k| k.chosen).count(), 1);
        assert!(kernels.iter().all(|k| !k.chosen || k.available), "{kernels:?}");
        let backends = backends();
        assert_eq!(backends.iter().map(|b| b.name).collect::<Vec<_>>(), crate::BACKENDS);
        assert_eq!(backends.iter().filter(|b| b.chosen && b.available).count(), 1);
        assert!(default_threads() > 0);
    }
}
