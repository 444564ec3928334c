//! Situations from bug reports about other programs, and their relatives: what a shape is, how it stands in the world and
//! which side of it is seen must not change what its material does.

#![allow(clippy::disallowed_methods, reason = "tests compare with the standard library")]

mod common;

#[path = "wild/gaps.rs"]
mod gaps;
#[path = "wild/on_gpus.rs"]
mod on_gpus;
#[path = "wild/parts.rs"]
mod parts;
#[path = "wild/placement.rs"]
mod placement;
#[path = "wild/sides.rs"]
mod sides;
#[path = "wild/spheres.rs"]
mod spheres;
#[path = "wild/terminator.rs"]
mod terminator;
#[path = "wild/textures.rs"]
mod textures;
