// What the learned filter is given: the light that frames have found together, as the network sees
// pictures (`denoise_picture`), times the exposure. What is emitted has no noise and is left out.
// Beyond the right and the lower edge the picture is mirrored: the network's sides are multiples of
// 32.

#import realtime_frame, realtime_guides
#import optics::light_tree, optics::math, optics::scatter, optics::signal

@group(3) @binding(15) var<storage, read> signals: array<vec4u>;
/// Three words a pixel.
@group(3) @binding(27) var<storage, read_write> learned_picture: array<vec4f>;

/// Columns and rows of what the network sees.
fn learned_size() -> vec2u {
    return (realtime.size + 31u) / 32u * 32u;
}

/// The pixel that a place of the network's picture is the mirror image of.
fn mirrored_pixel(place: vec2u) -> vec2u {
    let turned = place % (2u * realtime.size);
    return select(2u * realtime.size - 1u - turned, turned, turned < realtime.size);
}

/// Standard deviation of the irradiance, compressed as `denoise_features` compresses irradiance.
/// Lobes vary by themselves.
fn deviation_seen(light: Signal, colors: LobeColors, albedo: vec3f) -> f32 {
    let diffuse = light.diffuse_deviation * colors.diffuse;
    let specular = light.specular_deviation * colors.specular;
    let deviation = sqrt(diffuse * diffuse + specular * specular) / (albedo + 0.05);
    return log(1.0 + 16.0 * sqrt(dot(deviation, deviation) / 3.0)) / 3.0;
}

@compute @workgroup_size(8, 8)
fn show_network(@builtin(global_invocation_id) id: vec3u) {
    let size = learned_size();
    if any(id.xy >= size) {
        return;
    }
    let at = place_of(mirrored_pixel(id.xy));
    let to = 3u * (id.y * size.x + id.x);
    if guide_distance(at) <= 0.0 {
        learned_picture[to] = vec4f(0.0);
        learned_picture[to + 1u] = vec4f(0.0);
        learned_picture[to + 2u] = vec4f(0.0, 0.0, 1.0, 0.0);
        return;
    }
    let colors = guide_colors(at);
    let light = unpack_signal(signals[at]);
    let seen = max(signal_radiance(light, 1.0, colors.diffuse, colors.specular), vec3f(0.0));
    let albedo = clamp(colors.diffuse + colors.specular, vec3f(0.0), vec3f(1.0));
    let normal = octahedral_decode(guide_point(at).w);
    learned_picture[to] = vec4f(select(vec3f(0.0), seen, is_finite3(seen)), albedo.x);
    learned_picture[to + 1u] = vec4f(albedo.yz, normal.xy);
    learned_picture[to + 2u] = vec4f(normal.z, deviation_seen(light, colors, albedo), 1.0, 0.0);
}
