// Every image is a texture of its own, for devices with binding arrays.

enable wgpu_binding_array;
#import scene_records, variant
#import optics::image_texture

// wgpu allows no uniform buffer beside a binding array.
@group(0) @binding(0) var<storage, read> scene: SceneInfo;
@group(0) @binding(7) var images: binding_array<texture_2d<f32>, IMAGE_SLOTS>;

fn stored_texel(use_: TextureUse, column: u32, row: u32) -> vec4f {
    return textureLoad(images[use_.image], vec2u(column, row), 0);
}
