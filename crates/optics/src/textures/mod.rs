//! Textures as values: noise, patterns, colours, and the nodes of graphs that combine them.
pub mod color_nodes;
pub mod noise;
pub mod patterns;
pub mod texture_node;
pub mod texture_point;
pub mod voronoi;
