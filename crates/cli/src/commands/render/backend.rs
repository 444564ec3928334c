//! The back end that renders.

use super::args::RenderArgs;
use crate::console::say;
use alhazen::{AovKind, BackendChoice, Renderer, RendererOptions, Switch};

/// The back end that the arguments ask for; says once which it is and why.
pub fn choose_renderer(args: &RenderArgs) -> anyhow::Result<Renderer> {
    let has_mattes = args.aov.iter().any(|aov| aov.kind() == AovKind::Shares);
    let wants_cpu = [args.caustics, args.guiding].contains(&Some(Switch::On));
    let backend = match args.backend {
        BackendChoice::Auto | BackendChoice::All if has_mattes || wants_cpu => BackendChoice::Cpu,
        chosen => chosen,
    };
    let options = RendererOptions {
        backend,
        adapter: args.adapter.clone(),
        threads: args.threads,
        kernel: args.kernel,
    };
    let chosen = Renderer::choose(&options)?;
    if !args.quiet && !chosen.reason.is_empty() {
        say!("rendering on {}", chosen.reason);
    }
    Ok(chosen.renderer)
}

/// What the back end has to say, even to who wants no progress: the picture was made in another way than asked for.
pub fn print_notices(renderer: &mut Renderer) {
    renderer.take_notices().iter().for_each(|notice| say!("{notice}"));
}
