//! What a real-time renderer makes of few samples: what it keeps from earlier frames, and what it borrows from neighbours.
pub mod allocation;
pub mod edge_stops;
pub mod history;
pub mod signal;
