//! The bottom level: the primitives of one object.

use super::primitives::{self, Geometry, Sphere, corners};
use super::root_triangles::RootTriangles;
use super::tight_bounds::TightBounds;
use super::validate::validate_tree;
use crate::aabb::Aabb;
use crate::build::{
    self, EmptyArea, LeafCost, MAX_BRUTE_FORCE_BLOCKS, PresplitSettings, Presplits, PrimitiveRef, Quality,
    Settings, WideTree,
};
use crate::layout::{
    ChildRef, EMPTY, LEAF, LeafBlock, NO_PRIMITIVE, Node, SphereBlock, TriangleBlock, WIDTH, leaf_index,
};
use crate::simd::InstructionSet;
use rayon::prelude::*;

/// The leaf blocks of a [`Blas`], all of one kind.
pub(crate) enum LeafBlocks {
    Triangles(Vec<TriangleBlock>),
    Spheres(Vec<SphereBlock>),
}

/// A bounding volume hierarchy over the triangles or spheres of one object.
pub struct Blas {
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: ChildRef,
    pub(crate) leaves: LeafBlocks,
    /// See [`Aabb::extent`].
    pub(crate) extent: [f32; 3],
    bounds: Aabb,
    /// For the bounds of transformed instances.
    tight_bounds: TightBounds,
    /// First id and number of primitives of each geometry.
    geometries: Vec<(u32, u32)>,
    skipped: usize,
    /// Whether references were split, so that leaf boxes may be smaller than their triangles.
    split: bool,
    /// The triangles that streams test in the root stage; `None` for spheres.
    root_triangles: Option<RootTriangles>,
    instruction_set: InstructionSet,
}

/// Most references that presplitting adds for [`Quality::High`], as a share of the triangles.
const PRESPLIT_BUDGET: f64 = 0.3;

fn root_triangles_of(
    nodes: &[Node],
    root: ChildRef,
    leaves: &LeafBlocks,
    bounds: &Aabb,
) -> Option<RootTriangles> {
    match leaves {
        LeafBlocks::Triangles(blocks) => Some(RootTriangles::new(nodes, root, blocks, bounds)),
        LeafBlocks::Spheres(_) => None,
    }
}

/// Makes the leaf blocks of a tree. `fill` writes a primitive to a lane.
fn fill_blocks<B: LeafBlock>(
    tree: &WideTree,
    refs: &[PrimitiveRef],
    empty: B,
    fill: impl Fn(&mut B, usize, &PrimitiveRef) + Sync,
) -> Vec<B> {
    let mut blocks = Vec::new();
    tree.leaves
        .par_iter()
        .with_min_len(256)
        .map(|&(first, count)| {
            let mut block = empty;
            for lane in 0..count as usize {
                fill(&mut block, lane, &refs[first as usize + lane]);
            }
            block
        })
        .collect_into_vec(&mut blocks);
    blocks
}

impl Blas {
    /// Builds over triangles.
    ///
    /// Triangles with a vertex that is not finite or does not exist, and triangles without area,
    /// are left out, see [`Blas::skipped_primitives`].
    pub fn triangles(geometries: &[Geometry], quality: Quality) -> Blas {
        let mut refs = Vec::new();
        let mut skipped = 0;
        for (number, g) in geometries.iter().enumerate() {
            let (mut new, new_skipped) = primitives::triangle_references(g, number as u32);
            skipped += new_skipped;
            if refs.is_empty() {
                refs = new;
            } else {
                refs.append(&mut new);
            }
        }
        let points = |r: &PrimitiveRef| {
            let g = &geometries[r.geometry() as usize];
            g.indices[r.index() as usize].map(|i| g.positions[i as usize])
        };
        let settings = Settings::new(quality, WIDTH, LeafCost::PerBlock);
        let split = quality == Quality::High && refs.len() > WIDTH * MAX_BRUTE_FORCE_BLOCKS;
        if split {
            let presplits = PresplitSettings { budget: PRESPLIT_BUDGET, empty: EmptyArea::Whole };
            refs = Presplits::new(&refs, |r: &PrimitiveRef| Some(points(r)), presplits).apply(&refs);
        }
        let tree = build::build(&mut refs, settings);
        let blocks = fill_blocks(&tree, &refs, TriangleBlock::EMPTY, |block, lane, r| {
            let id = geometries[r.geometry() as usize].first_id + r.index();
            // Two references to a split triangle may be in one block.
            if !block.ids.contains(&id) {
                block.set_triangle(lane, &points(r));
                block.ids[lane] = id;
            }
        });
        let geometries = geometries.iter().map(|g| (g.first_id, g.indices.len() as u32)).collect();
        Blas::finish(tree, LeafBlocks::Triangles(blocks), geometries, skipped, split)
    }

    /// Builds over spheres with consecutive ids from `first_id` on.
    ///
    /// Spheres that are not finite or whose radius is not positive are left out, see
    /// [`Blas::skipped_primitives`].
    pub fn spheres(spheres: &[Sphere], first_id: u32, quality: Quality) -> Blas {
        let (mut refs, skipped) = primitives::sphere_references(spheres, 0);
        let tree = build::build(&mut refs, Settings::new(quality, WIDTH, LeafCost::PerBlock));
        let blocks = fill_blocks(&tree, &refs, SphereBlock::EMPTY, |block, lane, r| {
            let s = &spheres[r.index() as usize];
            for a in 0..3 {
                block.spheres[a][lane] = s.center[a];
            }
            block.spheres[3][lane] = s.radius;
            block.ids[lane] = first_id + r.index();
        });
        Blas::finish(
            tree,
            LeafBlocks::Spheres(blocks),
            vec![(first_id, spheres.len() as u32)],
            skipped,
            false,
        )
    }

    fn finish(
        tree: WideTree,
        leaves: LeafBlocks,
        geometries: Vec<(u32, u32)>,
        skipped: usize,
        split: bool,
    ) -> Blas {
        let WideTree { mut nodes, root, bounds, .. } = tree;
        nodes.shrink_to_fit();
        let root_triangles = root_triangles_of(&nodes, root, &leaves, &bounds);
        let extent = bounds.extent();
        let tight_bounds = TightBounds::new(&nodes, root, bounds);
        let blas = Blas {
            nodes,
            root,
            leaves,
            extent,
            bounds,
            tight_bounds,
            geometries,
            skipped,
            split,
            root_triangles,
            instruction_set: InstructionSet::best(),
        };
        #[cfg(debug_assertions)]
        blas.validate().expect("a tree that was just built");
        blas
    }

    /// Moves the triangles to new positions. The topology of the tree stays the same, so queries
    /// get slower the farther triangles move.
    ///
    /// Triangles that are now not finite or have no area cannot be hit until a later refit.
    /// Triangles that were left out of the build stay out.
    ///
    /// # Panics
    ///
    /// If this holds spheres, or if the number, ids or lengths of the geometries differ from those
    /// of the build.
    pub fn refit(&mut self, geometries: &[Geometry]) {
        let lists: Vec<_> = geometries.iter().map(|g| (g.first_id, g.indices.len() as u32)).collect();
        assert_eq!(lists, self.geometries, "refit needs the geometries that the tree was built with");
        let LeafBlocks::Triangles(blocks) = &mut self.leaves else {
            panic!("only triangles can be refitted")
        };
        let find = |id: u32| {
            let g = geometries.iter().find(|g| id.wrapping_sub(g.first_id) < g.indices.len() as u32)?;
            corners(g, (id - g.first_id) as usize)
        };
        blocks.par_iter_mut().with_min_len(256).for_each(|block| {
            for lane in 0..WIDTH {
                if block.ids[lane] != NO_PRIMITIVE {
                    block.set_triangle(lane, &find(block.ids[lane]).unwrap_or([[f32::NAN; 3]; 3]));
                }
            }
        });
        // Children are stored after their parents.
        for at in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let child = self.nodes[at].children[slot];
                let bounds = if child == EMPTY { break } else { self.child_bounds(child) };
                self.nodes[at].set_bounds(slot, &bounds);
            }
        }
        self.bounds = if self.root == EMPTY { Aabb::EMPTY } else { self.child_bounds(self.root) };
        self.extent = self.bounds.extent();
        self.tight_bounds = TightBounds::new(&self.nodes, self.root, self.bounds);
        self.root_triangles = root_triangles_of(&self.nodes, self.root, &self.leaves, &self.bounds);
        #[cfg(debug_assertions)]
        self.validate().expect("a tree that was just refitted");
    }

    /// The triangles that streams test in the root stage.
    #[inline(always)]
    pub(crate) fn root_triangles(&self) -> Option<&RootTriangles> {
        self.root_triangles.as_ref()
    }

    /// The blocks, if there are so few that testing all of them is faster than traversal.
    #[inline(always)]
    pub(crate) fn brute_force_blocks(&self) -> Option<&[TriangleBlock]> {
        match &self.leaves {
            LeafBlocks::Triangles(blocks) if blocks.len() <= MAX_BRUTE_FORCE_BLOCKS => Some(blocks),
            _ => None,
        }
    }

    fn child_bounds(&self, child: ChildRef) -> Aabb {
        if child & LEAF == 0 {
            return self.nodes[child as usize].union();
        }
        let index = leaf_index(child);
        match &self.leaves {
            LeafBlocks::Triangles(blocks) => blocks[index].bounds(),
            LeafBlocks::Spheres(blocks) => blocks[index].bounds(),
        }
    }

    /// The bounds of all primitives, in object space.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bounds of the object under a transform, with room for the rounding of transformed rays.
    pub(crate) fn transformed_bounds(&self, object_to_world: &[[f32; 4]; 3]) -> Aabb {
        self.tight_bounds.transformed(object_to_world)
    }

    /// Number of primitives that were left out of the build because they cannot be hit.
    pub fn skipped_primitives(&self) -> usize {
        self.skipped
    }

    /// Number of primitives in the tree.
    pub fn primitive_count(&self) -> usize {
        self.geometries.iter().map(|g| g.1 as usize).sum::<usize>() - self.skipped
    }

    /// Memory that this occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let blocks = match &self.leaves {
            LeafBlocks::Triangles(b) => b.capacity() * size_of::<TriangleBlock>(),
            LeafBlocks::Spheres(b) => b.capacity() * size_of::<SphereBlock>(),
        };
        let root_triangles = self.root_triangles.as_ref().map_or(0, RootTriangles::memory_bytes);
        let nodes = self.nodes.capacity() * size_of::<Node>();
        let tight_bounds = self.tight_bounds.memory_bytes();
        size_of::<Blas>() + nodes + blocks + root_triangles + tight_bounds
    }

    /// The instruction set that queries use.
    pub fn instruction_set(&self) -> InstructionSet {
        self.instruction_set
    }

    /// Sets the instruction set, for tests and comparisons.
    ///
    /// # Panics
    ///
    /// If this processor does not have it.
    pub fn set_instruction_set(&mut self, isa: InstructionSet) {
        assert!(isa.is_available(), "{isa:?} is not available here");
        self.instruction_set = isa;
    }

    /// Checks the structure: every reference is valid, every node and block is reached once, every
    /// box contains what is below it, every primitive is in a block.
    ///
    /// # Errors
    ///
    /// A description of the first defect.
    pub fn validate(&self) -> Result<(), String> {
        match &self.leaves {
            LeafBlocks::Triangles(blocks) => self.validate_blocks(blocks),
            LeafBlocks::Spheres(blocks) => self.validate_blocks(blocks),
        }
    }

    fn validate_blocks<B: LeafBlock>(&self, blocks: &[B]) -> Result<(), String> {
        let bounds = |block: &B| if self.split { Aabb::EMPTY } else { block.bounds() };
        let boxes: Vec<Aabb> = blocks.iter().map(bounds).collect();
        validate_tree(&self.nodes, self.root, &boxes)?;
        let lanes = blocks.iter().flat_map(|b| b.ids()).filter(|&&id| id != NO_PRIMITIVE).count();
        if lanes < self.primitive_count() {
            return Err(format!("{lanes} lanes for {} primitives", self.primitive_count()));
        }
        Ok(())
    }
}
