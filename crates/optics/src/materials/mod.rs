pub mod image_texture;
pub mod layers;
pub mod material;
pub mod plain;
pub mod record;
