//! Pictures of the values of each node of a texture, kept until the texture changes.

use crate::document::Document;
use crate::thumbnails::{SIDE, pixel_of};
use alhazen::edits::{Addition, SlotEdit};
use alhazen::texture_graph::TextureGraph;
use alhazen::{MaterialId, Scene, Texture, TextureSlot};
use egui::{Color32, ColorImage, Context, Rgba, TextureHandle, TextureOptions};
use glam::Vec2;
use std::collections::BTreeMap;

/// What a node looks like over a square of its coordinates.
pub struct NodePreview {
    /// Its values as colours; see [`TextureGraph::node_values`].
    pub picture: ColorImage,
    /// Its least and greatest value of red, green and blue.
    pub range: [f32; 2],
}

/// What each node of a graph looks like; nothing for graphs that cannot be evaluated.
pub fn previews_of(scene: &Scene, graph: &TextureGraph) -> Vec<NodePreview> {
    let image = |shown: &alhazen::TextureRef, uv: Vec2| pixel_of(scene, shown.texture, uv);
    let nodes = graph.node_values(SIDE, image).unwrap_or_default();
    nodes.iter().map(|values| preview(values)).collect()
}

fn preview(values: &[[f32; 4]]) -> NodePreview {
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for channel in values.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]) {
        range = [range[0].min(channel), range[1].max(channel)];
    }
    NodePreview { picture: picture(values), range }
}

/// Values from 0 to 1 as they are, others as the nearer one.
fn picture(values: &[[f32; 4]]) -> ColorImage {
    let color = |[r, g, b, _]: &[f32; 4]| -> Color32 {
        let [r, g, b] = [*r, *g, *b].map(|v| v.clamp(0.0, 1.0));
        Rgba::from_rgb(r, g, b).into()
    };
    ColorImage::new([SIDE as usize, SIDE as usize], values.iter().map(color).collect())
}

/// A small picture on the window's device.
pub struct ShownPreview {
    /// The picture.
    pub texture: TextureHandle,
    /// Least and greatest value that it shows.
    pub range: [f32; 2],
}

/// Pictures that have taken the place of textures.
type Slots = BTreeMap<MaterialId, BTreeMap<TextureSlot, SlotEdit>>;

/// The previews of all textures that have been looked at.
#[derive(Default)]
pub struct NodePreviews {
    /// What the numbers of textures and images depend on: the document, and what was added to it.
    numbers: (u64, Vec<Addition>, Slots),
    graphs: BTreeMap<u32, (TextureGraph, Vec<ShownPreview>)>,
    images: BTreeMap<u32, TextureHandle>,
}

impl NodePreviews {
    /// The previews of the nodes of a graph, computed anew if it has changed.
    pub fn of_graph(
        &mut self,
        ctx: &Context,
        document: &Document,
        id: u32,
        graph: &TextureGraph,
    ) -> &[ShownPreview] {
        self.follow(document);
        let is_current = self.graphs.get(&id).is_some_and(|(old, _)| old == graph);
        if !is_current {
            let show = |(number, node): (usize, NodePreview)| ShownPreview {
                texture: load(ctx, format!("node {number} of texture {id}"), node.picture),
                range: node.range,
            };
            let previews = previews_of(document.scene(), graph).into_iter().enumerate().map(show).collect();
            self.graphs.insert(id, (graph.clone(), previews));
        }
        self.graphs.get(&id).map_or(&[], |(_, previews)| previews)
    }

    /// The preview of a texture that is an image.
    pub fn of_image(&mut self, ctx: &Context, document: &Document, id: u32) -> &TextureHandle {
        self.follow(document);
        self.images.entry(id).or_insert_with(|| {
            let scene = document.scene();
            let share = |pixel: u32| (pixel as f32 + 0.5) / SIDE as f32;
            let value = |i: u32| pixel_of(scene, id, Vec2::new(share(i % SIDE), share(i / SIDE)));
            let values: Vec<_> = (0..SIDE * SIDE).map(value).collect();
            load(ctx, format!("texture {id}"), picture(&values))
        })
    }

    /// Forgets what another document, or other additions, had.
    fn follow(&mut self, document: &Document) {
        let edits = document.edits();
        let (generation, additions, slots) = &self.numbers;
        let is_same = *generation == document.generation && *additions == edits.additions;
        if !is_same || *slots != edits.slots {
            let numbers = (document.generation, edits.additions.clone(), edits.slots.clone());
            *self = Self { numbers, ..Self::default() };
        }
    }
}

fn load(ctx: &Context, name: String, picture: ColorImage) -> TextureHandle {
    ctx.load_texture(name, picture, TextureOptions::NEAREST)
}

/// The graph of a texture, if it is one.
pub fn graph_of(scene: &Scene, id: u32) -> Option<&TextureGraph> {
    match scene.textures.get(id as usize)? {
        Texture::Graph(graph) => Some(graph),
        Texture::Image(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alhazen::texture_graph::kind_named;

    #[test]
    fn a_checkerboard_has_two_colours() {
        let mut graph = TextureGraph::of(kind_named("checkerboard").expect("a kind"));
        let scaled = glam::Affine3A::from_scale(glam::Vec3::splat(4.0));
        graph.nodes[0].placement.map = scaled;
        let previews = previews_of(&Scene::default(), &graph);
        let [preview] = previews.as_slice() else { panic!("one node") };
        let pixels = &preview.picture.pixels;
        // Borders of cells are borders of pixels.
        let dark = pixels.iter().filter(|p| p.r() < 16).count();
        let bright = pixels.iter().filter(|p| p.r() > 240).count();
        assert_eq!((dark, bright), (pixels.len() / 2, pixels.len() / 2));
        let [low, high] = preview.range;
        assert!(low.abs() < 0.01 && (high - 1.0).abs() < 0.01, "{low} {high}");
    }

    #[test]
    fn what_cannot_be_evaluated_has_no_previews() {
        assert!(previews_of(&Scene::default(), &TextureGraph::default()).is_empty());
    }
}
