//! Tool-tips of controls: what a control does, its unit and its range.

use egui::Response;

/// Label and text of each control that has a tool-tip.
const TOOLTIPS: &[(&str, &str)] = &[
    ("Back end", "What renders. auto takes the fastest that this machine has."),
    ("Adapter", "The GPU."),
    ("Integrator", "How light is computed. path converges to the correct picture; direct has a fixed cost."),
    ("Samples per pixel", "The picture ends at this number. With adaptive sampling it is the average."),
    ("Maximum frames", "A view that stands still ends after this many frames."),
    (
        "Maximum depth",
        "Largest number of path segments. 1: emission seen directly. 2: direct light. 1 to 1000.",
    ),
    ("Russian roulette: start depth", "Paths with fewer segments are never ended at random. 0 to 1000."),
    (
        "Russian roulette: minimum survival probability",
        "0.01 to 1; 1 switches Russian roulette off. Surviving paths are weighted by 1 / probability, so the \
         expected picture does not change.",
    ),
    ("Splitting", "Paths that start at the first surface of each camera ray. 1 to 64."),
    (
        "Strict glTF BRDF (single scattering)",
        "Follows glTF 2.0, Appendix B exactly. Otherwise the energy that microfacets lose is compensated.",
    ),
    ("Sampler", "Where random numbers come from: Sobol points, blue noise, or independent numbers."),
    ("Seed", "Changes the noise, not the expected picture."),
    ("No clamping", "Sample values are never limited, so bright samples add noise but no bias."),
    ("Shadow rays", "For each light with an area. 1 to 256."),
    ("Soft shadows", "Lights with an area are sampled over it. Otherwise they shine from their centre."),
    ("Reflection rays", "At the first hit. 0 to 256; 0 switches glossy reflections off."),
    ("Ambient occlusion rays", "At the first hit. 0 to 256; 0 leaves ambient light unoccluded."),
    ("Limited ambient occlusion", "Only what is near occludes. Otherwise everything does."),
    ("Ambient occlusion distance (m)", "Geometry farther away does not occlude ambient light."),
    ("Maximum specular depth", "Longest chain of mirror reflections and refractions. 1 to 64."),
    ("Phong highlights", "Lambert and Phong lobes instead of microfacets, to compare with."),
    (
        "Custom light attenuation",
        "Point and spot lights fade with distance d as 1 / (C + L d + Q d²). Physics is 1 / d².",
    ),
    ("Shadows", "Traces shadow rays."),
    ("Light cutoff (W/m²)", "A light is ignored where its irradiance is below this. 0 ignores none."),
    (
        "Reflections: minimum survival probability",
        "0.01 to 1. Least probability that a glossy surface traces reflection rays. The expected picture \
         does not change.",
    ),
    ("Rasterised first hits", "The rasteriser finds the first surface of each pixel. Otherwise rays do."),
    (
        "Adaptive sampling",
        "After the minimum, samples go to the pixels that lower the error of the picture most.",
    ),
    ("Minimum samples per pixel", "Every pixel gets these first. 2 to 65,536."),
    ("Noise limit", "The picture ends when its noise is below the limit."),
    ("Relative standard error", "Standard error of the picture relative to its values. 0.0001 to 1."),
    ("Denoise", "Removes noise while the picture is rendered. Saved pictures get the same."),
    ("Denoiser", "The network is trained on pictures of this renderer. The others are for comparison."),
    ("Fixed resolution", "Renders this size. Otherwise the size of the window."),
    ("Layer", "The picture, its noise, or an auxiliary layer."),
    ("Tone mapper", "Maps linear radiance to display values."),
    ("Exposure (stops)", "Factor 2^stops on radiance before tone mapping. -10 to 10."),
    ("Saturation", "After tone mapping. 0: grey, 1: unchanged, 2: doubled."),
    ("False colour", "Shows luminance in stops around middle grey."),
    ("Split position", "Where the line between A and B is. 0: left edge, 1: right edge."),
    ("Displayed buffer", "The picture, one signal, or a map, as false colours."),
    (
        "Light candidates",
        "Lights that the first surface looks at before it samples one. 0: one light by power or by the light \
         tree, as path does.",
    ),
    ("Spatial filter", "Removes noise from frames. Without it the mean of the frames is that of path."),
    ("Filter passes", "Each is twice as wide as the one before. 0 to 8."),
    ("Adaptive frames", "Noisy pixels get more samples in a frame, calm ones none."),
    ("Samples per pixel and frame", "The same for every pixel."),
    ("Minimum samples", "Of a noisy pixel in one frame."),
    ("Maximum samples", "Of a noisy pixel in one frame."),
    ("Time budget", "As many samples as fit into the time of a frame go to the noisiest pixels."),
    ("Time of a frame (ms)", "On the device. 0.1 to 1000."),
    ("Variance tolerance", "Pixels whose mean has a lower variance get no samples. 0.0001 to 1."),
    ("Noise radius (pixels)", "Neighbourhood that estimates the noise of pixels with few samples. 0 to 8."),
    ("Spread radius (pixels)", "How far the noise map is spread. 0 to 8."),
    (
        "Refresh interval (frames)",
        "A calm pixel gets a sample in one of so many frames. 0: never, which is biased.",
    ),
    (
        "History length (samples)",
        "What earlier frames count for at most while anything moves. 0 forgets them.",
    ),
    (
        "Depth tolerance (tenths)",
        "Largest difference of distances of one surface, in tenths of the distance.",
    ),
    ("Normal tolerance (cosine)", "Smallest cosine between normals of one surface. 0 to 1."),
    (
        "History clipping (deviations)",
        "Earlier frames are clipped to so many standard deviations of the new samples while anything moves.",
    ),
    ("Focus distance (m)", "Along the axis of the camera. Ctrl+click in the picture sets it."),
    ("Lens radius (m)", "A larger lens blurs more. 0 is a pinhole."),
    ("Turbidity", "Haziness of the air. 2: clear, 10: hazy."),
    ("Metallic", "0: dielectric, 1: metal."),
    ("Roughness", "0: smooth, 1: rough. GGX alpha is its square."),
    ("Specular", "Strength of the dielectric reflection. 0 to 1."),
    ("Transmission", "Share of light that is refracted instead of scattered. 0 to 1."),
];

/// The tool-tip of the control with this label.
fn tooltip(label: &str) -> Option<&'static str> {
    TOOLTIPS.iter().find(|(name, _)| *name == label).map(|(_, text)| *text)
}

/// The control with its tool-tip, if it has one.
pub fn explain(response: Response, label: &str) -> Response {
    match tooltip(label) {
        Some(text) => response.on_hover_text(text),
        None => response,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tooltips_belong_to_controls() {
        let panels = [
            include_str!("render.rs"),
            include_str!("frames.rs"),
            include_str!("camera.rs"),
            include_str!("environment.rs"),
            include_str!("material.rs"),
        ];
        let is_used = |label: &str| panels.iter().any(|text| text.contains(&format!("\"{label}\"")));
        for (label, text) in TOOLTIPS {
            assert!(is_used(label), "no control is called {label:?}");
            assert!(text.ends_with('.'), "{label:?}: {text}");
        }
        assert_eq!(tooltip("no such control"), None);
    }
}
