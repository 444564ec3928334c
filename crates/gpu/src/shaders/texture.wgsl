// Textures. Wrapping and filtering are done here rather than by samplers, so that every device and the CPU agree to the
// last bits.

#import material_constants, scene, texels
#import optics::constants, optics::ggx, optics::tonemap

fn wrap_texel(i: i32, size: u32, mode: u32) -> u32 {
    let n = i32(size);
    if mode == WRAP_CLAMP {
        return u32(clamp(i, 0, n - 1));
    }
    // The remainder of a negative number is negative.
    let period = select(n, 2 * n, mode == WRAP_MIRRORED_REPEAT);
    let r = ((i % period) + period) % period;
    return u32(select(2 * n - 1 - r, r, r < n));
}

fn texel(use_: TextureUse, x: i32, y: i32) -> vec4f {
    let column = wrap_texel(x, use_.width, (use_.flags >> TEXTURE_WRAP_U_SHIFT) & 3u);
    let row = wrap_texel(y, use_.height, (use_.flags >> TEXTURE_WRAP_V_SHIFT) & 3u);
    let stored = stored_texel(use_, column, row);
    if (use_.flags & TEXTURE_SRGB) != 0u {
        return vec4f(srgb_decode(stored.rgb), stored.a);
    }
    return stored;
}

/// The linear RGBA value at texture coordinates, both sets of which are given.
fn sample_texture(use_: TextureUse, coords: vec4f) -> vec4f {
    let uv = vec3f(select(coords.xy, coords.zw, (use_.flags & TEXTURE_UV1) != 0u), 1.0);
    var p = vec2f(dot(use_.row_u, uv), dot(use_.row_v, uv)) * vec2f(f32(use_.width), f32(use_.height));
    if !(abs(p.x) < 1e9 && abs(p.y) < 1e9) {
        return texel(use_, 0, 0);
    }
    if (use_.flags & TEXTURE_BILINEAR) == 0u {
        return texel(use_, i32(floor(p.x)), i32(floor(p.y)));
    }
    p -= 0.5;
    let corner = floor(p);
    let f = p - corner;
    let x = i32(corner.x);
    let y = i32(corner.y);
    return texel(use_, x, y) * ((1.0 - f.x) * (1.0 - f.y)) + texel(use_, x + 1, y) * (f.x * (1.0 - f.y))
        + texel(use_, x, y + 1) * ((1.0 - f.x) * f.y) + texel(use_, x + 1, y + 1) * (f.x * f.y);
}

/// A texture of a material, if it has one there; ones otherwise.
fn sample_slot(material: u32, slot: u32, coords: vec4f) -> vec4f {
    let use_ = materials[material].textures[slot];
    if use_.first_texel == NONE {
        return vec4f(1.0);
    }
    return sample_texture(use_, coords);
}

/// The texel below a coordinate in [0, 1] over `size` texels whose centres span it, and how far the coordinate is beyond.
struct TablePlace {
    index: i32,
    beyond: f32,
}

fn table_place(coordinate: f32, size: u32) -> TablePlace {
    let x = clamp(coordinate * f32(size - 1u), 0.0, f32(size - 1u));
    let index = min(i32(x), i32(size) - 2);
    return TablePlace(index, x - f32(index));
}

/// The pair that `metallic_roughness_bsdf` takes as albedo.
fn lookup_ggx_albedo(cos_theta: f32, roughness: f32) -> vec2f {
    let at = albedo_coordinates(cos_theta, roughness * roughness);
    let size = textureDimensions(ggx_albedo);
    let x = table_place(at.x, size.x);
    let y = table_place(at.y, size.y);
    let corner = vec2i(x.index, y.index);
    let near = mix(textureLoad(ggx_albedo, corner, 0).xy,
        textureLoad(ggx_albedo, corner + vec2i(1, 0), 0).xy, x.beyond);
    let far = mix(textureLoad(ggx_albedo, corner + vec2i(0, 1), 0).xy,
        textureLoad(ggx_albedo, corner + vec2i(1, 1), 0).xy, x.beyond);
    return mix(near, far, y.beyond);
}

fn dielectric_albedo_plane(corner: vec2i, x: f32, y: f32) -> f32 {
    let near = mix(textureLoad(dielectric_albedo, corner, 0).x,
        textureLoad(dielectric_albedo, corner + vec2i(1, 0), 0).x, x);
    let far = mix(textureLoad(dielectric_albedo, corner + vec2i(0, 1), 0).x,
        textureLoad(dielectric_albedo, corner + vec2i(1, 1), 0).x, x);
    return mix(near, far, y);
}

/// Share of light that a single scattering event at a rough dielectric keeps.
fn lookup_dielectric_albedo(cos_theta: f32, alpha: f32, eta: f32) -> f32 {
    let at = albedo_coordinates(cos_theta, alpha);
    let size = textureDimensions(dielectric_albedo);
    let x = table_place(at.x, size.x);
    let y = table_place(at.y, DIELECTRIC_ALBEDO_HEIGHT);
    let z = table_place(albedo_eta_coordinate(eta), size.y / DIELECTRIC_ALBEDO_HEIGHT);
    let plane = i32(DIELECTRIC_ALBEDO_HEIGHT);
    let below = dielectric_albedo_plane(vec2i(x.index, z.index * plane + y.index), x.beyond, y.beyond);
    let above = dielectric_albedo_plane(vec2i(x.index, (z.index + 1) * plane + y.index), x.beyond, y.beyond);
    return mix(below, above, z.beyond);
}
