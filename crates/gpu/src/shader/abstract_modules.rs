//! Names that stand for one of several modules.

/// Abstract names that modules import, and the modules that each may stand for; `kernel_*` is all
/// whose names begin so. [`Linkage::of`](super::Linkage::of) binds those that a variant decides
/// about; tracers, kernels and passes bind the others.
pub const ABSTRACT: &[(&str, &[&str])] = &[
    // Where texels are.
    ("texels", &["texels_layers", "texels_images"]),
    // How texture graphs are evaluated.
    ("graphs", &["graphs_none", "graphs_nodes"]),
    // What surfaces scatter: one model, or layers of them.
    ("scattering", &["scattering_plain", "scattering_layered"]),
    // How a light is chosen by what each can bring.
    ("light_chooser", &["light_chooser_tree", "light_chooser_list", "light_chooser_pair"]),
    // Who finds what rays hit.
    ("tracer", &["tracer_query", "tracer_bvh", "tracer_pipeline"]),
    // Where walks of `tracer_bvh` begin that do not begin at the root.
    ("entry_lists", &["hybrid_shaft_lists"]),
    // What an invocation does for a pixel, behind the entry points of megakernels.
    ("kernel", &["kernel_*"]),
    // What is asked of rays from a list.
    ("question", &["rays_closest", "rays_closest_packet", "rays_any"]),
    // What `direct` does at first hits.
    ("first_hits", &["first_hits_recorded", "first_hits_ignored"]),
    // How the rays of a dispatch are counted.
    ("ray_sum", &["group_rays", "own_rays"]),
    // How paths come to the queues of the next vertex.
    ("handing", &["wavefront_handing", "own_handing"]),
    // Whether shadow rays begin at the nodes of shafts.
    ("shafts", &["hybrid_no_shafts", "hybrid_shaft_rays"]),
];

/// The modules of a list of [`ABSTRACT`].
#[cfg(test)]
pub(crate) fn modules_of(choices: &[&'static str]) -> Vec<&'static str> {
    let files = || super::modules::files().map(|(name, _)| name);
    let modules_of = |choice: &&'static str| match choice.strip_suffix('*') {
        Some(start) => files().filter(|name| name.starts_with(start)).collect(),
        None => vec![*choice],
    };
    choices.iter().flat_map(modules_of).collect()
}
