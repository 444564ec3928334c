// The lobes of a surface told apart, for scenes with layered materials. Functions as in `realtime_lobes_plain.wgsl`.

#import realtime_frame, scattering
#import optics::bsdf, optics::scatter

fn scattering_without_diffuse(b: Scattering) -> Scattering {
    var others = b;
    if b.layered {
        others.layers.diffuse = vec3f(0.0);
        others.layers.diffuse_below = vec3f(0.0);
    } else if b.plain.kind == BSDF_GLOSSY {
        others.plain.diffuse = vec3f(0.0);
    }
    return others;
}

fn scattering_colors(b: Scattering) -> GuideColors {
    if b.layered {
        // What coats, sheen and refraction add has no colour of one texture.
        let widths = b.layers.widths;
        return GuideColors(b.layers.diffuse + b.layers.diffuse_below, vec3f(1.0), sqrt(max(widths.x, widths.y)));
    }
    let plain = b.plain;
    if plain.kind == BSDF_GLOSSY {
        return GuideColors(plain.diffuse * plain.diffuse_scale, plain.specular, sqrt(plain.alpha));
    }
    return GuideColors(vec3f(0.0), plain.diffuse, select(sqrt(plain.alpha), 0.0, bsdf_is_delta(plain)));
}
