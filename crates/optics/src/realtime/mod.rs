//! What a real-time renderer makes of few samples: what it keeps from earlier frames, and what it borrows from neighbours.
pub mod accumulation;
pub mod allocation;
pub mod antialiasing;
pub mod clusters;
pub mod edge_stops;
pub mod history;
pub mod reprojection;
pub mod signal;
pub mod spatial_filter;
