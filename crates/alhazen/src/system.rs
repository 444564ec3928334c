//! What this machine can run, and what is chosen on it.

use accel::Kernel;

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
        (Kernel::Scalar, "scalar", "any processor"),
        (Kernel::Neon, "neon", "Arm with Advanced SIMD"),
        (Kernel::Avx2, "avx2", "x86-64 with AVX2, FMA, BMI1, BMI2, LZCNT, POPCNT"),
        (Kernel::Avx512, "avx512", "x86-64 with AVX-512 F, VL, DQ, BW"),
    ];
    let best = Kernel::best();
    let status = |(kernel, name, needs): (Kernel, _, _)| KernelStatus {
        name,
        needs,
        available: kernel.is_available(),
        chosen: kernel == best,
    };
    all.map(status).into()
}

/// All back ends that this build has.
pub fn backends() -> Vec<BackendStatus> {
    let device = processor_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let reason = "this build has no other back end".to_owned();
    vec![BackendStatus { name: "cpu", available: true, chosen: true, device, reason }]
}

/// Number of threads that render when nothing else is asked for.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The processor's name, where the system tells.
pub fn processor_name() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
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
