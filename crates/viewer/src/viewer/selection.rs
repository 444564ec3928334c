//! What is selected: one object is the active one, whose numbers pages show; others may be selected with it. Commands and
//! handles act on all of them.

use super::choosing::Choosing;
use super::state::{Selection, Viewer};
use crate::outliner::Item;
use crate::queries::Seen;
use alhazen::InstanceId;
use alhazen::edits::Addition;
use std::collections::BTreeSet;

impl Viewer {
    /// Selects one object and no other, or none.
    pub fn select(&mut self, selection: Option<Selection>) {
        self.selection = selection;
        self.also.clear();
        self.gizmo.light = None;
    }

    /// Nothing is selected any more.
    pub fn deselect(&mut self) {
        self.select(None);
        self.open.outliner.cursor = None;
    }

    /// Whether there is anything that could be deselected.
    pub(super) fn has_selection(&self) -> bool {
        self.chosen().is_some() || self.gizmo.light.is_some()
    }

    /// Whether a line is part of what commands act on.
    pub fn is_chosen(&self, item: Item) -> bool {
        match item {
            Item::Object(object) if self.also.contains(&object) => true,
            _ => self.chosen() == Some(item),
        }
    }

    /// Selects these objects.
    ///
    /// - `active`: the one whose numbers are shown; another one where this is not among them.
    pub fn select_objects(&mut self, mut objects: BTreeSet<InstanceId>, active: Option<InstanceId>) {
        let active = active.filter(|object| objects.contains(object)).or(objects.last().copied());
        let Some(object) = active else { return self.deselect() };
        objects.remove(&object);
        let material = self.document.as_ref().and_then(|d| d.material_of(object)).unwrap_or(0);
        self.select(Some(Selection { object, material }));
        self.also = objects;
    }

    /// Changes what is selected by what was found.
    pub fn choose_objects(&mut self, found: impl IntoIterator<Item = InstanceId>, how: Choosing) {
        let found: BTreeSet<_> = found.into_iter().collect();
        let before: BTreeSet<_> = self.chosen_objects().into_iter().collect();
        let active = self.selection.map(|selection| selection.object);
        let objects = match how {
            Choosing::Only => found,
            Choosing::More => &before | &found,
            Choosing::Less => &before - &found,
        };
        self.select_objects(objects, active);
    }

    /// Selects a line as well, or no more.
    pub fn toggle_chosen(&mut self, item: Item) {
        let objects = self.open.outliner.tree().objects(item);
        let mut all: BTreeSet<_> = self.chosen_objects().into_iter().collect();
        let mut active = self.selection.map(|selection| selection.object);
        if objects.iter().all(|object| all.contains(object)) {
            all.retain(|object| !objects.contains(object));
        } else {
            active = objects.last().copied();
            all.extend(objects);
        }
        self.select_objects(all, active);
        self.known(item);
    }

    /// Selects what is seen somewhere as well, or no more. The material is that of the place.
    pub(super) fn toggle_seen(&mut self, seen: Seen) {
        self.toggle_chosen(Item::Object(seen.instance));
        // The tree shows what was picked.
        self.open.outliner.known_selection = None;
        self.open.tab = crate::panels::Tab::Objects;
        if let Some(active) = self.selection.filter(|active| active.object == seen.instance) {
            self.selection = Some(Selection { material: seen.material, ..active });
        }
    }

    /// Selects all lines from the one that is marked to this one as well.
    pub fn extend_to(&mut self, item: Item) {
        let outliner = &self.open.outliner;
        let from = outliner.cursor.and_then(|cursor| outliner.place(cursor));
        let Some((from, to)) = from.zip(outliner.place(item)) else { return self.choose(item) };
        let rows = &outliner.rows()[from.min(to)..=from.max(to)];
        let objects: Vec<_> = rows.iter().flat_map(|row| outliner.tree().objects(row.item)).collect();
        self.choose_objects(objects, Choosing::More);
        if let Item::Object(object) = item {
            let all = self.chosen_objects().into_iter().collect();
            self.select_objects(all, Some(object));
        }
        self.known(item);
    }

    /// The tree has made the selection itself, and need not show it.
    fn known(&mut self, item: Item) {
        self.open.outliner.cursor = Some(item);
        self.open.outliner.known_selection = self.selection.map(|s| s.object);
    }

    /// Leaves out what is gone or has another material.
    pub(super) fn mend_selection(&mut self) {
        let Some(document) = &self.document else { return };
        let (scene, edits) = (document.scene(), document.edits());
        let is_there = |object: &InstanceId| {
            let removed = edits.objects.get(object).is_some_and(|o| o.removed);
            !removed && (*object as usize) < scene.instances.len()
        };
        let materials = scene.materials.len();
        self.also.retain(is_there);
        match self.selection {
            Some(active) if !is_there(&active.object) => {
                let others = std::mem::take(&mut self.also);
                self.select_objects(others, None);
            }
            Some(active) if active.material as usize >= materials => {
                let material = document.material_of(active.object).unwrap_or(0);
                self.selection = Some(Selection { material, ..active });
            }
            _ => {}
        }
    }

    /// Copies what is selected, and selects the copies: beside the originals, where they are seen.
    pub(super) fn duplicate(&mut self) {
        let objects = self.chosen_objects();
        let (Some(document), false) = (&self.document, objects.is_empty()) else {
            return self.notice("select an object or a group to duplicate it", false);
        };
        let scene = document.scene();
        let first = scene.instances.len() as InstanceId;
        let size = self.bounds_of_chosen().map_or(1.0, |(low, high)| (high - low).x.max(1e-3));
        let beside = glam::Affine3A::from_translation(glam::Vec3::X * size * 1.1);
        let copy = |of: &InstanceId| {
            let instance = scene.instances.get(*of as usize)?;
            let changed = document.edits().objects.get(of).cloned().unwrap_or_default();
            Some((*of, beside * instance.transform, changed))
        };
        let copies: Vec<_> = objects.iter().filter_map(copy).collect();
        let active = self.selection.and_then(|s| copies.iter().position(|(of, ..)| *of == s.object));
        let (count, material) = (copies.len() as InstanceId, self.selection.map(|s| s.material));
        self.edit("duplicate", |edits| {
            for (number, (of, moved, changed)) in (first..).zip(copies) {
                edits.additions.push(Addition::Copy { of });
                let copy = edits.object(number);
                // Copies are made before values are changed.
                (copy.material, copy.visible) = (changed.material, changed.visible);
                copy.set_transform(&moved);
            }
        });
        let active = active.map(|place| first + place as InstanceId);
        self.select_objects((first..first + count).collect(), active);
        if let (Some(selection), Some(material), Some(_)) = (&mut self.selection, material, active) {
            selection.material = material;
        }
    }

    /// Hides what is selected, or shows it again where all of it is hidden.
    pub(super) fn hide(&mut self) {
        let Some(item) = self.chosen() else {
            return self.notice("select an object or a group to hide it", false);
        };
        if self.also.is_empty() {
            return self.switch(item);
        }
        let objects = self.chosen_objects();
        let shows = !objects.iter().any(|object| self.is_on(Item::Object(*object)));
        self.edit("hide", |edits| {
            objects.into_iter().for_each(|object| edits.object(object).visible = Some(shows));
        });
    }
}
