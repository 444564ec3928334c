//! The GPU back ends: the same optics, traced three ways.
