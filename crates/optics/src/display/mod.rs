//! What a picture needs before it is shown.
pub mod tonemap;
