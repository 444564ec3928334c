//! Path guiding: paths that follow what was learned of the light before the picture, and the learning.

pub(crate) mod finds;
pub(crate) mod lanes;
pub(crate) mod prepare;
pub(crate) mod training;
pub(crate) mod vertex;
