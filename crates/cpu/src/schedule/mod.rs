//! How the picture is cut into work for threads.

pub(crate) mod passes;
pub(crate) mod photon_passes;
pub(crate) mod pixel_list;
pub(crate) mod row_blocks;
pub(crate) mod work;
