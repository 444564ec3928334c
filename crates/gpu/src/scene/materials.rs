//! Materials, their layers and their textures: the tables' records with what they refer to in its place on the device.

use super::texels::{ImagePlace, images};
use super::words::Words;
use optics::albedo::SheenAlbedo;
use scene::tables::{LAYER_TEXTURES, LayersRecord, MaterialRecord, SceneTables, TextureNode, TextureUse};

/// 32-bit words of a material's layers in `words`: the record, then the uses of its textures.
pub(super) const LAYERS_WORDS: u32 = words_of::<LayersRecord>() + LAYER_TEXTURES * words_of::<TextureUse>();

const fn words_of<T>() -> u32 {
    (size_of::<T>() / 4) as u32
}

/// All materials.
pub(super) fn materials(tables: &SceneTables, words: &Words) -> Vec<MaterialRecord> {
    let images = images(tables);
    let record = |m: &MaterialRecord| MaterialRecord {
        layers: words.layers_of(m),
        medium: words.medium(m.medium),
        textures: m.textures.map(|texture| placed(&images, words.graph_nodes, texture)),
        ..*m
    };
    tables.materials.iter().map(record).collect()
}

/// All layers as words, [`LAYERS_WORDS`] each. `graph_nodes`: where the nodes of graphs begin.
pub(super) fn layers(tables: &SceneTables, graph_nodes: u32) -> Vec<u32> {
    let images = images(tables);
    let mut words = Vec::with_capacity(tables.layers.len() * LAYERS_WORDS as usize);
    for (record, textures) in tables.layers.iter().zip(&tables.layer_textures) {
        words.extend_from_slice(bytemuck::cast_slice(std::slice::from_ref(record)));
        words.extend_from_slice(bytemuck::cast_slice(
            &textures.map(|texture| placed(&images, graph_nodes, texture)),
        ));
    }
    words
}

/// The images that graphs show, as words.
pub(super) fn graph_textures(tables: &SceneTables) -> Vec<TextureUse> {
    let images = images(tables);
    tables.graph_textures.iter().map(|texture| placed(&images, 0, *texture)).collect()
}

/// The nodes of graphs, whose images begin at word `textures`.
pub(super) fn graph_nodes(tables: &SceneTables, textures: u32) -> Vec<TextureNode> {
    let placed = |node: &TextureNode| TextureNode {
        texture: textures + node.texture * words_of::<TextureUse>(),
        ..*node
    };
    tables.graph_nodes.iter().map(placed).collect()
}

/// The use of a texture whose image is one of `images`, see [`images`], or of a graph whose nodes are among those that
/// begin at word `graph_nodes`.
fn placed(images: &[ImagePlace], graph_nodes: u32, texture: TextureUse) -> TextureUse {
    if texture.is_graph() {
        let first_texel = graph_nodes + texture.first_texel * words_of::<TextureNode>();
        return TextureUse { first_texel, ..texture };
    }
    let image = images.binary_search(&ImagePlace::of(&texture)).unwrap_or(0) as u32;
    TextureUse { image, ..texture }
}

/// The name that shaders have for the size of a node.
pub fn node_constants() -> [(&'static str, u32); 1] {
    [("TEXTURE_NODE_WORDS", words_of::<TextureNode>())]
}

/// Names that shaders have for the sizes of layers and of their tables.
pub fn layer_constants() -> [(&'static str, u32); 4] {
    [
        ("LAYERS_RECORD_WORDS", words_of::<LayersRecord>()),
        ("TEXTURE_USE_WORDS", words_of::<TextureUse>()),
        ("SHEEN_ALBEDO_WIDTH", SheenAlbedo::SIZE[0] as u32),
        ("SHEEN_ALBEDO_HEIGHT", SheenAlbedo::SIZE[1] as u32),
    ]
}
