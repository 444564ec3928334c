// Texture graphs. Nodes lie in `words`, each after those whose values it takes; what a node does is the optics'
// `texture_node`.

#import node_constants, node_readers, texture_images, use_readers
#import optics::constants, optics::image_texture, optics::texture_node, optics::texture_point

/// The value of a graph at a point.
fn evaluate_graph(use_: TextureUse, point: TexturePoint) -> vec4f {
    var registers: array<vec4f, GRAPH_REGISTERS>;
    var value = vec4f(0.0);
    for (var i = 0u; i < use_.width; i++) {
        let node = read_TextureNode(use_.first_texel + i * TEXTURE_NODE_WORDS);
        var a = graph_input(&registers, node.a);
        var b = graph_input(&registers, node.b);
        var c = graph_input(&registers, node.c);
        let offset = graph_input(&registers, node.offset);
        if node.operation == NODE_IMAGE {
            a = graph_image(node.texture, point.coords);
        } else if node.operation == NODE_TRIPLANAR {
            let at = node_coordinates(node, point, offset);
            a = graph_image(node.texture, triplanar_coords(at, 0u));
            b = graph_image(node.texture, triplanar_coords(at, 1u));
            c = graph_image(node.texture, triplanar_coords(at, 2u));
        }
        value = evaluate_node(node, point, a, b, c, offset);
        registers[node.output] = value;
    }
    return graph_value(value, (use_.flags & TEXTURE_SHARES) != 0u);
}

fn graph_input(registers: ptr<function, array<vec4f, GRAPH_REGISTERS>>, place: u32) -> vec4f {
    if place == NONE {
        return vec4f(0.0);
    }
    return (*registers)[place];
}

/// A texel of the image whose use begins at word `at`.
fn graph_image(at: u32, coords: vec4f) -> vec4f {
    let use_ = read_TextureUse(at);
    if use_.first_texel == NONE {
        return vec4f(1.0);
    }
    return sample_image(use_, coords);
}
