// Textures: images and graphs. And the tables of directional albedos.

#import albedo_constants, graphs, scene, texture_images, variant
#import optics::ggx, optics::image_texture, optics::texture_point

/// The linear RGBA value of a texture at a point.
fn sample_texture(use_: TextureUse, point: TexturePoint) -> vec4f {
    if SCENE_HAS_GRAPHS && (use_.flags & TEXTURE_GRAPH) != 0u {
        return evaluate_graph(use_, point);
    }
    return sample_image(use_, point.coords);
}

/// A texture of a material, if it has one there; ones otherwise.
fn sample_slot(material: u32, slot: u32, point: TexturePoint) -> vec4f {
    if !has_texture(material, slot) {
        return vec4f(1.0);
    }
    return sample_texture(materials[material].textures[slot], point);
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
