//! Which instruction sets there are, and which of them this processor has.

/// The instruction sets that the traversal kernels are compiled for. Embree calls this the ISA.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Portable code, one lane at a time.
    Scalar,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL, DQ and BW.
    Avx512,
    /// Arm with Advanced SIMD.
    Neon,
}

impl InstructionSet {
    /// Those that this processor has, slowest first. Never empty.
    pub fn available() -> Vec<InstructionSet> {
        [InstructionSet::Scalar, InstructionSet::Neon, InstructionSet::Avx2, InstructionSet::Avx512]
            .into_iter()
            .filter(|isa| isa.is_available())
            .collect()
    }

    /// The fastest that this processor has.
    pub fn best() -> InstructionSet {
        if cfg!(miri) {
            return InstructionSet::Scalar;
        }
        *InstructionSet::available().last().unwrap_or(&InstructionSet::Scalar)
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        match self {
            InstructionSet::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => {
                InstructionSet::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => true,
            #[allow(unreachable_patterns, reason = "the available sets depend on the target")]
            _ => false,
        }
    }
}
