//! What shaders look up by word: vertex indices and attributes, densities of grids, and what belongs to lights and layers.

use super::materials::{LAYERS_WORDS, graph_nodes, graph_textures, layers};
use super::media::{Grid, Medium, grid_record, medium_record};
use optics::albedo::SheenAlbedo;
use optics::light_tree::LIGHT_NODE_WIDTH;
use scene::tables::{
    EmitterBox, LightMotion, LightNode, LightTree, MOST_BOXES, MaterialRecord, MotionRange, NONE, SceneTables,
};

/// Everything that is looked up by word, and where each part begins. First geometry, then what belongs to lights.
#[derive(Clone, Debug, Default)]
pub(super) struct Words {
    /// The words from `first` on.
    pub data: Vec<u32>,
    pub first: u32,
    pub indices: u32,
    pub spheres: u32,
    pub tangents: u32,
    pub uv1: u32,
    pub colors: u32,
    densities: u32,
    pub texture_places: u32,
    pub placements: u32,
    pub primitive_lights: u32,
    pub profiles: u32,
    pub discs: u32,
    pub disc_count: u32,
    pub row_alias: u32,
    pub portals: u32,
    pub emitter_boxes: u32,
    pub light_tree: u32,
    pub graph_nodes: u32,
    layers: u32,
    pub sheen_albedo: u32,
    media: u32,
}

/// Bytes for the words of so many more lights: coordinates and positions of three corners, a place among the visible ones, a place in the tree
/// of lights, and its nodes. The lights that there are may be few, so that their tree is one node or none.
pub fn words_of_lights(more: u32) -> u64 {
    const A_LIGHT: u64 = (21 + 1 + 1) * 4;
    if more == 0 {
        return 0;
    }
    let lights = u64::from(more) + u64::from(LIGHT_NODE_WIDTH);
    lights * A_LIGHT + LightTree::most_nodes(lights) * size_of::<LightNode>() as u64
}

impl Words {
    pub fn new(tables: &SceneTables) -> Self {
        let mut words = Self::default();
        words.indices = words.append(bytemuck::cast_slice(&tables.indices));
        words.spheres = words.append(bytemuck::cast_slice(&tables.spheres));
        words.tangents = words.append(bytemuck::cast_slice(&tables.tangents));
        words.uv1 = words.append(bytemuck::cast_slice(&tables.uv1));
        words.colors = words.append(bytemuck::cast_slice(&tables.colors));
        words.densities = words.append(bytemuck::cast_slice(&tables.densities));
        words.append_changeable(tables);
        words
    }

    /// What they are, for messages.
    pub fn object(&self) -> &'static str {
        match self.densities == self.texture_places {
            true => "vertex indices and attributes",
            false => "vertex indices, attributes and densities of grids",
        }
    }

    /// Where everything is, without the words.
    pub fn without_data(&self) -> Self {
        Self { data: Vec::new(), ..*self }
    }

    /// The words of other lights and layers for the same geometry.
    pub fn with_changes(&self, tables: &SceneTables) -> Self {
        let mut words = Self { data: Vec::new(), first: self.texture_places, ..*self };
        words.append_changeable(tables);
        words
    }

    fn append_changeable(&mut self, tables: &SceneTables) {
        self.texture_places = self.first + self.data.len() as u32;
        for light in tables.lights.iter().filter(|l| l.textured_material != NONE) {
            self.append(bytemuck::cast_slice(&light.texture_places));
        }
        self.placements = self.append(bytemuck::cast_slice(&tables.placements));
        self.primitive_lights = self.append(&tables.primitive_lights);
        self.profiles = self.append(&tables.profiles);
        let numbered = (0..).zip(&tables.lights);
        let discs: Vec<u32> = numbered.filter(|(_, l)| l.visible).map(|(i, _)| i).collect();
        self.disc_count = discs.len() as u32;
        self.discs = self.append(&discs);
        let rows = &tables.environment.row_alias;
        let rows: Vec<u32> = rows.iter().flat_map(|e| [e.threshold.to_bits(), e.alias]).collect();
        self.row_alias = self.append(&rows);
        self.portals = self.append(bytemuck::cast_slice(&tables.environment.portals));
        self.append_motion(tables);
        // Always as many, so that those of a scene that is changed have a place.
        let mut boxes = tables.emitter_boxes.clone();
        boxes.resize(MOST_BOXES, EmitterBox::default());
        self.emitter_boxes = self.append(bytemuck::cast_slice(&boxes));
        let tree = &tables.light_tree;
        self.light_tree = self.append(&[u32::from(tree.defends_root), tree.uniform_share.to_bits()]);
        self.append(&tree.places);
        self.append(bytemuck::cast_slice(&tree.nodes));
        let shown = self.append(bytemuck::cast_slice(&graph_textures(tables)));
        self.graph_nodes = self.append(bytemuck::cast_slice(&graph_nodes(tables, shown)));
        if !tables.layers.is_empty() {
            self.sheen_albedo = self.append(bytemuck::cast_slice(SheenAlbedo::shared().texels()));
            self.layers = self.append(&layers(tables, self.graph_nodes));
        }
        let grids: Vec<Grid> = tables.grids.iter().map(|g| grid_record(g, self.densities)).collect();
        let grids = self.append(bytemuck::cast_slice(&grids));
        let media: Vec<Medium> = tables.media.iter().map(|m| medium_record(m, grids)).collect();
        self.media = self.append(bytemuck::cast_slice(&media));
    }

    /// Appends the motions of what moves while the shutter is open, and where they are: see
    /// `motion.wgsl`. Nothing where everything stands still.
    fn append_motion(&mut self, tables: &SceneTables) {
        let Some(motion) = &tables.motion else { return };
        let range = |range: &MotionRange| [range.first, range.count];
        let segments = self.append(bytemuck::cast_slice(&motion.segments));
        let instances: Vec<u32> = motion.instances.iter().flat_map(range).collect();
        let instances = self.append(&instances);
        let light = |light: &LightMotion| {
            let rest = light.rest.rows();
            let rows = rest.as_flattened().iter().map(|x| x.to_bits());
            range(&light.segments).into_iter().chain(rows).collect::<Vec<u32>>()
        };
        let lights: Vec<u32> = motion.lights.iter().flat_map(light).collect();
        let lights = self.append(&lights);
        self.append(&[segments, instances, lights]);
    }

    /// Where a medium begins; `medium`: its index, or `NONE`.
    pub fn medium(&self, medium: u32) -> u32 {
        if medium == NONE { NONE } else { self.media + medium * (size_of::<Medium>() / 4) as u32 }
    }

    /// Where the layers of a material begin.
    pub fn layers_of(&self, m: &MaterialRecord) -> u32 {
        if m.layers == NONE { NONE } else { self.layers + m.layers * LAYERS_WORDS }
    }

    /// Appends a part; returns where it begins.
    fn append(&mut self, part: &[u32]) -> u32 {
        let first = self.first + self.data.len() as u32;
        self.data.extend_from_slice(part);
        first
    }
}
