// Texels lie one after the other in the layers of one array texture. That needs no binding arrays, which browsers and older
// GPUs do not have; it costs one binding, however many textures there are; and unlike a storage buffer it is not limited
// to 128 MiB.

#import scene_records, variant
#import optics::image_texture

@group(0) @binding(0) var<uniform> scene: SceneInfo;
@group(0) @binding(7) var texels: texture_2d_array<f32>;

fn stored_texel(use_: TextureUse, column: u32, row: u32) -> vec4f {
    let place = texel_place(use_, column, row);
    let first = four_bytes(place);
    if !SCENE_HAS_HALF_TEXELS || (use_.flags & TEXTURE_HALF) == 0u {
        return first;
    }
    return half_texel(first, four_bytes(place + 1u));
}

fn four_bytes(place: u32) -> vec4f {
    let line = place >> scene.texel_width_log2;
    let at = vec2u(place & ((1u << scene.texel_width_log2) - 1u), line % scene.texel_height);
    return textureLoad(texels, at, line / scene.texel_height, 0);
}
