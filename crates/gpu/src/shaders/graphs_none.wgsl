// Texture graphs, in scenes without any.

#import optics::image_texture, optics::texture_point

/// The value of a graph at a point.
fn evaluate_graph(use_: TextureUse, point: TexturePoint) -> vec4f {
    return vec4f(1.0);
}
