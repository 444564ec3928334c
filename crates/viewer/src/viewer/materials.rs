//! Materials that go from one object to others: copied and pasted, chosen from the list, or dragged onto an object.

use super::choosing::CopiedMaterial;
use super::state::{Selection, Viewer};
use crate::queries::Seen;
use alhazen::{InstanceId, MaterialId};

impl Viewer {
    /// The name of a material.
    pub fn material_name(&self, id: MaterialId) -> Option<&str> {
        Some(self.document.as_ref()?.scene().materials.get(id as usize)?.name.as_str())
    }

    /// Remembers the material of the active object.
    pub(super) fn copy_material(&mut self) {
        let Some(id) = self.selection.map(|selection| selection.material) else {
            return self.notice("select an object to copy its material", false);
        };
        let name = self.material_name(id).unwrap_or_default().to_owned();
        self.copied_material = Some(CopiedMaterial { id, generation: self.generation });
        self.notice(format!("copied the material {name} ({id})"), false);
    }

    /// Gives all selected objects the material that was copied.
    pub(super) fn paste_material(&mut self) {
        let objects = self.chosen_objects();
        let text = match self.copied_material {
            None => "no material was copied: select an object and copy its material first",
            Some(copied) if copied.generation != self.generation => {
                "the material that was copied is of another scene"
            }
            Some(copied) if self.material_name(copied.id).is_none() => {
                "the material that was copied is not there any more"
            }
            Some(_) if objects.is_empty() => "select the objects that get the material",
            Some(copied) => return self.assign_material(&objects, copied.id),
        };
        self.notice(text, false);
    }

    /// Gives objects a material.
    pub fn assign_material(&mut self, objects: &[InstanceId], id: MaterialId) {
        let before = self.edit_count;
        self.edit("assign material", |edits| {
            objects.iter().for_each(|object| edits.object(*object).material = Some(id));
        });
        if let Some(active) = self.selection.filter(|active| objects.contains(&active.object)) {
            self.selection = Some(Selection { material: id, ..active });
        }
        let name = self.material_name(id).unwrap_or_default().to_owned();
        let text = match objects.len() {
            _ if self.edit_count == before => "they have this material already".to_owned(),
            1 => format!("the object has the material {name} ({id})"),
            count => format!("{count} objects have the material {name} ({id})"),
        };
        self.notice(text, false);
    }

    /// A material was dropped onto what is seen somewhere: the object gets it, and with it all that are selected, if it is
    /// one of them.
    pub(super) fn drop_material(&mut self, id: MaterialId, seen: Option<Seen>) {
        let Some(seen) = seen else {
            return self.notice("there is no object to take the material", false);
        };
        let chosen = self.chosen_objects();
        let objects = if chosen.contains(&seen.instance) { chosen } else { vec![seen.instance] };
        self.assign_material(&objects, id);
    }
}
