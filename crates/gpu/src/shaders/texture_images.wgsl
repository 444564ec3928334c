// Images. Wrapping and filtering are the optics' `image_texture` rather than samplers', so that every device and the CPU agree
// to the last bits.

#import texels, variant
#import optics::image_texture

fn texel(use_: TextureUse, x: i32, y: i32) -> vec4f {
    let stored = stored_texel(use_, texel_column(use_, x), texel_row(use_, y));
    if SCENE_HAS_HALF_TEXELS {
        return decode_texel(use_, stored);
    }
    return decode_bytes(use_, stored);
}

/// The linear RGBA value of an image at texture coordinates, both sets of which are given.
fn sample_image(use_: TextureUse, coords: vec4f) -> vec4f {
    let f = texel_footprint(use_, coords);
    if !f.bilinear {
        return texel(use_, f.x, f.y);
    }
    return mix_texels(f, texel(use_, f.x, f.y), texel(use_, f.x + 1, f.y),
        texel(use_, f.x, f.y + 1), texel(use_, f.x + 1, f.y + 1));
}
