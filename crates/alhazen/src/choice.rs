//! Which back end renders, and why.

use crate::Renderer;
use crate::fallback::{Fallback, Step};
use crate::several_devices;
use backend::{Backend, BackendError};
use cpu::CpuBackend;
use gpu::tracer::TracerKind;
use gpu::{Gpu, GpuBackend, GpuError, GpuOptions, PathKernel};
use std::fmt;
use std::str::FromStr;

/// What the user asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// A GPU if there is a real one, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU, a software driver if need be, in the way that suits it best.
    Gpu,
    /// A GPU, in this way.
    Tracer(TracerKind),
    /// All GPUs, and the CPU beside them.
    All,
}

impl BackendChoice {
    /// All of them, in the order in which users read them.
    pub const ALL: [Self; 7] = [
        Self::Auto,
        Self::Cpu,
        Self::Gpu,
        Self::Tracer(TracerKind::Bvh),
        Self::Tracer(TracerKind::Query),
        Self::Tracer(TracerKind::Pipeline),
        Self::All,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
            Self::Tracer(kind) => kind.name(),
            Self::All => "all",
        }
    }
}

impl fmt::Display for BackendChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no back end has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown back end `{0}`; there are: {names}", names = BackendChoice::ALL.map(BackendChoice::name).join(", "))]
pub struct UnknownBackend(pub String);

impl FromStr for BackendChoice {
    type Err = UnknownBackend;

    fn from_str(name: &str) -> Result<Self, UnknownBackend> {
        Self::ALL.into_iter().find(|c| c.name() == name).ok_or_else(|| UnknownBackend(name.to_owned()))
    }
}

/// How to make a [`Renderer`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RendererOptions {
    /// Which back end.
    pub backend: BackendChoice,
    /// A part of the GPU's name, in any case; `None` takes the best. Several, separated by commas, work together; the same
    /// name twice is two GPUs of that name.
    pub adapter: Option<String>,
    /// Threads of the CPU; `None` uses all cores.
    pub threads: Option<usize>,
    /// How path tracing is spread over a GPU's dispatches.
    pub kernel: PathKernel,
}

/// Why no renderer could be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChoiceError {
    /// The GPU that was asked for cannot be used.
    #[error("cannot render with the back end `{backend}`; `--backend auto` takes what there is")]
    Gpu {
        /// What was asked for.
        backend: &'static str,
        /// Why not.
        source: GpuError,
    },
    /// An adapter was named for the CPU.
    #[error("the back end `cpu` has no adapters; `{0}` cannot be chosen")]
    AdapterOfCpu(String),
    /// A kernel was named for the CPU.
    #[error("the back end `cpu` has no GPU kernels; `{0}` cannot be chosen")]
    KernelOfCpu(PathKernel),
    /// The CPU back end could not start.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// A renderer and why it is this one.
pub struct Chosen {
    /// It.
    pub renderer: Renderer,
    /// Why, in a sentence; empty where the user asked for nothing else.
    pub reason: String,
}

impl Renderer {
    /// The renderer that the options ask for.
    ///
    /// With [`BackendChoice::Auto`] there is always one: the CPU is the last resort. With `Auto` and
    /// [`BackendChoice::Gpu`], a device that cannot hold the scene or is lost while rendering is replaced by the next best,
    /// with what it has accumulated; [`Renderer::take_notices`] tells.
    ///
    /// # Errors
    /// See [`ChoiceError`].
    pub fn choose(options: &RendererOptions) -> Result<Chosen, ChoiceError> {
        let failed = |source| ChoiceError::Gpu { backend: options.backend.name(), source };
        match options.backend {
            BackendChoice::All => several_devices::choose(options),
            BackendChoice::Auto | BackendChoice::Gpu | BackendChoice::Tracer(_)
                if several_devices::names_several(options) =>
            {
                several_devices::choose(options)
            }
            BackendChoice::Cpu => match &options.adapter {
                Some(adapter) => Err(ChoiceError::AdapterOfCpu(adapter.clone())),
                None if options.kernel != PathKernel::Auto => Err(ChoiceError::KernelOfCpu(options.kernel)),
                None => Ok(Chosen { renderer: Self::cpu(options.threads)?, reason: String::new() }),
            },
            BackendChoice::Auto => {
                match Gpu::open(&gpu_options(options)).and_then(|gpu| choose_gpu(gpu, options)) {
                    Ok(chosen) => Ok(chosen),
                    // Who names an adapter wants that one.
                    Err(error) if options.adapter.is_some() => Err(failed(error)),
                    Err(error) => {
                        let renderer = Self::cpu(options.threads)?;
                        Ok(Chosen { renderer, reason: format!("the CPU, because {error}") })
                    }
                }
            }
            BackendChoice::Gpu => {
                let gpu = Gpu::open(&gpu_options(options)).map_err(failed)?;
                choose_gpu(gpu, options).map_err(failed)
            }
            BackendChoice::Tracer(kind) => {
                let gpu = Gpu::open(&gpu_options(options)).map_err(failed)?;
                let reason = format!("{} on {}", kind.name(), gpu.describe());
                let backend = open_backend(gpu, kind, options.kernel).map_err(failed)?;
                Ok(Chosen { renderer: Self::new(Box::new(backend)), reason })
            }
        }
    }
}

/// What to ask of a device for these options.
fn gpu_options(options: &RendererOptions) -> GpuOptions {
    // A software driver is slower than our own code on the same processor: only who asks gets it.
    let allow_software = options.backend != BackendChoice::Auto || options.adapter.is_some();
    GpuOptions { adapter: options.adapter.clone(), allow_software, ..GpuOptions::default() }
}

pub(crate) fn open_backend(gpu: Gpu, kind: TracerKind, kernel: PathKernel) -> Result<GpuBackend, GpuError> {
    let mut backend = GpuBackend::new(gpu, kind)?;
    backend.set_path_kernel(kernel);
    Ok(backend)
}

/// The best way on a device, with the next best behind it and the CPU behind all.
fn choose_gpu(gpu: Gpu, options: &RendererOptions) -> Result<Chosen, GpuError> {
    let kind = TracerKind::best(gpu.features, gpu.is_software());
    let why = match kind {
        TracerKind::Query => "it traces rays in hardware",
        TracerKind::Bvh | TracerKind::Pipeline if gpu.is_software() => {
            "a software driver walks our own hierarchy fastest"
        }
        TracerKind::Bvh | TracerKind::Pipeline => {
            "it has no ray queries, and our own hierarchy is faster than its pipelines"
        }
    };
    let reason = format!("{} on {}: {why}", kind.name(), gpu.describe());
    let backend = open_backend(gpu, kind, options.kernel)?;
    let mut steps = vec![Step::Cpu(options.threads)];
    if kind != TracerKind::Bvh {
        steps.push(Step::Gpu(TracerKind::Bvh, gpu_options(options), options.kernel));
    }
    Ok(Chosen { renderer: Renderer::new(Box::new(Fallback::new(Box::new(backend), steps))), reason })
}

/// Opens what a step of a fall-back names.
pub(crate) fn open_step(step: &Step) -> Result<Box<dyn Backend>, BackendError> {
    match step {
        Step::Cpu(threads) => Ok(Box::new(CpuBackend::new(*threads)?)),
        Step::Gpu(kind, options, kernel) => {
            let device = |e: GpuError| BackendError::Device { backend: kind.name(), source: Box::new(e) };
            let gpu = Gpu::open(options).map_err(device)?;
            Ok(Box::new(open_backend(gpu, *kind, *kernel).map_err(device)?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_back_and_others_are_refused() {
        for choice in BackendChoice::ALL {
            assert_eq!(choice.name().parse(), Ok(choice));
        }
        let error = "gpu-magic".parse::<BackendChoice>().expect_err("unknown").to_string();
        assert!(error.contains("`gpu-magic`") && error.contains("gpu-query"), "{error}");
    }

    #[test]
    fn the_cpu_needs_no_reason_and_takes_no_adapter() {
        let cpu = RendererOptions { backend: BackendChoice::Cpu, ..RendererOptions::default() };
        let chosen = Renderer::choose(&cpu).expect("always there");
        assert_eq!((chosen.renderer.backend_name(), chosen.reason.as_str()), ("cpu", ""));
        let named = RendererOptions { adapter: Some("chip".into()), ..cpu };
        assert!(matches!(Renderer::choose(&named), Err(ChoiceError::AdapterOfCpu(name)) if name == "chip"));
        let kernel = RendererOptions {
            kernel: PathKernel::Wavefront,
            backend: BackendChoice::Cpu,
            ..RendererOptions::default()
        };
        let error = Renderer::choose(&kernel).err().expect("no kernels");
        assert!(error.to_string().contains("wavefront"), "{error}");
    }

    #[test]
    fn auto_always_finds_something_and_says_why() {
        let chosen = Renderer::choose(&RendererOptions::default()).expect("always there");
        assert!(!chosen.reason.is_empty());
        let software = gpu::adapters().iter().all(gpu::AdapterSummary::is_software);
        assert_eq!(chosen.renderer.backend_name() == "cpu", software, "{}", chosen.reason);
    }

    #[test]
    fn an_unknown_adapter_is_an_error() {
        let options = RendererOptions { adapter: Some("no such chip".into()), ..RendererOptions::default() };
        let error = Renderer::choose(&options).err().expect("no such chip");
        let source = std::error::Error::source(&error).expect("a source").to_string();
        assert!(source.contains("no such chip"), "{error}: {source}");
    }
}
