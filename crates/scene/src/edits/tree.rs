//! Groups that were renamed or hidden, and objects that are shown alone.

use super::{EditError, Editable, Edits};
use crate::{Groups, InstanceId};
use std::sync::Arc;

impl Editable {
    /// Gives groups the names of the edits, and hides what is in hidden ones or not isolated.
    pub(super) fn edit_groups(&mut self, edits: &Edits) -> Result<(), EditError> {
        let count = self.scene.groups.list.len();
        if let Some(&id) = edits.groups.keys().find(|id| **id as usize >= count) {
            return Err(EditError::Group { id, count });
        }
        for (id, edit) in &edits.groups {
            if let Some(name) = &edit.name {
                Arc::make_mut(&mut self.scene.groups).list[*id as usize].name.clone_from(name);
            }
        }
        if let Some(unseen) = Unseen::of(edits, &self.scene.groups) {
            let instances = self.scene.instances.iter_mut().zip(0..);
            instances.for_each(|(instance, id)| instance.visible &= !unseen.holds(id));
        }
        Ok(())
    }
}

/// Objects that are not part of the picture because of what they are in, or are not.
pub(super) struct Unseen<'e> {
    edits: &'e Edits,
    groups: &'e Groups,
    hidden: Vec<bool>,
}

impl<'e> Unseen<'e> {
    /// `None` if there can be no such objects.
    pub fn of(edits: &'e Edits, groups: &'e Groups) -> Option<Self> {
        if edits.isolated.is_empty() && !edits.groups.values().any(|group| group.hidden) {
            return None;
        }
        let is_hidden = |id| edits.groups.get(&id).is_some_and(|group| group.hidden);
        Some(Self { edits, groups, hidden: groups.within(is_hidden) })
    }

    /// Whether an object is one of them.
    pub fn holds(&self, id: InstanceId) -> bool {
        let isolated = &self.edits.isolated;
        let is_beside = !isolated.is_empty() && !isolated.contains(&id);
        is_beside || self.groups.of(id).is_some_and(|group| self.hidden[group as usize])
    }
}
