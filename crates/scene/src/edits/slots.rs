//! Textures of materials that were replaced or moved.

use super::{EditError, Editable, Edits, Resources, SlotEdit};
use crate::{Image, ImageId, ImageTexture, Sampler, Texture, TextureRef, TextureSlot};
use std::collections::HashMap;
use std::path::Path;

impl Editable {
    /// Gives materials the textures of the edits.
    pub(super) fn edit_slots(&mut self, edits: &Edits, resources: &Resources) -> Result<(), EditError> {
        let mut images: HashMap<&Path, ImageId> = HashMap::new();
        for file in edits.pictures() {
            let image = resources.pictures.get(file).ok_or_else(|| EditError::File(file.to_owned()))?;
            images.insert(file, self.scene.images.len() as ImageId);
            self.scene.images.push(Image::clone(image));
        }
        for (id, slots) in &edits.slots {
            self.material(*id)?;
            for (slot, edit) in slots {
                let before = self.scene.materials[*id as usize].texture(*slot);
                let image = edit.file.as_deref().and_then(|file| images.get(file));
                let texture = match image {
                    Some(image) => self.texture_of(*image, *slot, before),
                    None => before,
                };
                let texture = texture.map(|texture| moved(texture, edit)).transpose();
                let object = || format!("{slot:?} texture of material {id}");
                *self.scene.materials[*id as usize].texture_mut(*slot) =
                    texture.map_err(|problem| EditError::Value { object: object(), problem })?;
            }
        }
        Ok(())
    }

    /// A new texture of an image, sampled as the one that it replaces.
    fn texture_of(
        &mut self,
        image: ImageId,
        slot: TextureSlot,
        before: Option<TextureRef>,
    ) -> Option<TextureRef> {
        let old = before.and_then(|old| self.scene.textures.get(old.texture as usize)?.as_image());
        let sampler = old.map_or(Sampler::default(), |old| old.sampler);
        let number = self.scene.textures.len() as u32;
        let texture = ImageTexture { image, sampler, color_space: slot.color_space() };
        self.scene.textures.push(Texture::Image(texture));
        Some(TextureRef { texture: number, ..before.unwrap_or(TextureRef::new(number)) })
    }
}

/// A texture on other coordinates. An error says what is wrong.
fn moved(texture: TextureRef, edit: &SlotEdit) -> Result<TextureRef, String> {
    let uv_set = edit.uv_set.unwrap_or(texture.uv_set);
    if uv_set > 1 {
        return Err(format!("there are UV sets 0 and 1, not {uv_set}"));
    }
    let Some(record) = edit.transform else { return Ok(TextureRef { uv_set, ..texture }) };
    let numbers = record.offset.into_iter().chain(record.scale).chain([record.rotation]);
    if let Some(number) = numbers.into_iter().find(|n| !n.is_finite()) {
        return Err(format!("the transform has {number}"));
    }
    Ok(TextureRef { uv_set, transform: record.transform(), ..texture })
}
