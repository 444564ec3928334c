// The lobes of a surface told apart, for scenes without layered materials.

#import realtime_frame, scattering
#import optics::bsdf, optics::scatter

/// All but the diffuse lobe; what is sampled stays the same.
fn scattering_without_diffuse(b: Scattering) -> Scattering {
    var others = b;
    if b.kind == BSDF_GLOSSY {
        others.diffuse = vec3f(0.0);
    }
    return others;
}

fn scattering_colors(b: Scattering) -> GuideColors {
    if b.kind == BSDF_GLOSSY {
        return GuideColors(b.diffuse * b.diffuse_scale, b.specular, sqrt(b.alpha));
    }
    // Mirrors and dielectrics: `diffuse` is their tint.
    return GuideColors(vec3f(0.0), b.diffuse, select(sqrt(b.alpha), 0.0, bsdf_is_delta(b)));
}
