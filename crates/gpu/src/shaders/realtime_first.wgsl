// The first vertex of paths, whose light is kept apart by the first surface's lobes.

@group(3) @binding(14) var<storage, read_write> lights_found: array<FoundLight>;

/// Light of one sample, from the diffuse and from the other lobes of the first surface.
struct SplitLight {
    diffuse: vec3f,
    specular: vec3f,
    /// From the first surface to the second, metres; 0 if there is none.
    hit_distance: f32,
}

/// The first surface as its lobes are told apart.
struct FirstLobes {
    all: Scattering,
    others: Scattering,
    frame: Frame,
    wo: vec3f,
}

/// As `scatter` makes them, with the same random numbers.
fn first_lobes(path: Path, s: Surface, footprint: f32) -> FirstLobes {
    var u_model = 0.0;
    if wants_model_number(s.material) {
        u_model = sample_2d(path.sampler, PAIRS_BEFORE_VERTICES + PAIR_MODEL).x;
    }
    let all = surface_scattering(s, footprint, path.state.throughput, u_model, view.single_scatter != 0u);
    let frame = scattering_frame(all, s);
    return FirstLobes(all, scattering_without_diffuse(all), frame, to_local(frame, s.wo));
}

fn share_of_diffuse(lobes: FirstLobes, direction: vec3f) -> vec3f {
    let wi = to_local(lobes.frame, direction);
    return diffuse_share(scattering_eval(lobes.all, lobes.wo, wi).value_cos,
        scattering_eval(lobes.others, lobes.wo, wi).value_cos);
}

/// Adds a sample to a pixel, unless it is no number.
fn add_light(at: u32, light: SplitLight) {
    lights_found[at].drawn += 1u;
    if !is_valid_sample(light.diffuse) || !is_valid_sample(light.specular) {
        return;
    }
    lights_found[at].diffuse += light.diffuse;
    lights_found[at].specular += light.specular;
    lights_found[at].count += 1u;
    lights_found[at].hit_distance += min(light.hit_distance, FAR);
    lights_found[at].squares += vec2f(sqr(luminance(light.diffuse)), sqr(luminance(light.specular)));
}
