//! Path guiding: what was learned of the light that arrives at places of a scene, as trees over space and direction.
//!
//! A [`Guide`] is frozen: back ends sample directions from it, and everybody who has it samples the same ones. A [`Learner`] gathers
//! what paths find while they follow a guide, and makes a better one of it ([`Learner::refine`]). Its sums are integers, so
//! that they do not depend on the order in which threads or devices add to them: the same paths make the same guide, bit for bit.
//!
//! Source: the SD-tree of Müller, Gross and Novák, "Practical Path Switch for Efficient Light-Transport Simulation", 2017, with
//! what Müller's chapter of the course "Path Switch in Production", 2019, adds: next-event estimation takes part, and the probability
//! of the guide is learned, too, place by place. Formulas are the optics' (`optics::guiding`).

#![forbid(unsafe_code)]

mod guide;
mod learner;
mod refine;

pub use guide::{Guide, GuideLeaf, MOST_LEAVES, MOST_NODES, QuadNode, SpaceNode};
pub use learner::{FRACTIONS, Found, Learner};
