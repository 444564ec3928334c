//! What is done with lines of the tree of objects: choosing, hiding, showing alone, renaming.

use super::state::{Selection, Viewer};
use crate::outliner::Item;
use alhazen::InstanceId;
use glam::Vec3;

impl Viewer {
    /// Marks a line; an object is selected.
    pub fn choose(&mut self, item: Item) {
        self.open.outliner.cursor = Some(item);
        let selection = match item {
            Item::Group(_) => None,
            Item::Object(object) => {
                let material = self.document.as_ref().and_then(|d| d.material_of(object)).unwrap_or(0);
                Some(Selection { object, material })
            }
        };
        self.select(selection);
        self.open.outliner.known_selection = self.selection.map(|s| s.object);
    }

    /// The line that commands act on: what is selected, or else a group that is marked.
    pub fn chosen(&self) -> Option<Item> {
        let group = self.open.outliner.cursor.filter(|item| matches!(item, Item::Group(_)));
        self.selection.map(|selection| Item::Object(selection.object)).or(group)
    }

    /// The objects that commands act on.
    pub fn chosen_objects(&self) -> Vec<InstanceId> {
        let mut objects = self.chosen().map_or(Vec::new(), |item| self.open.outliner.tree().objects(item));
        objects.extend(&self.also);
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// The name of a line.
    pub fn name_of(&self, item: Item) -> Option<&str> {
        let scene = self.document.as_ref()?.scene();
        match item {
            Item::Group(group) => scene.groups.list.get(group as usize).map(|g| g.name.as_str()),
            Item::Object(object) => scene.instances.get(object as usize).map(|i| i.name.as_str()),
        }
    }

    /// Whether the switch of a line is on; what it is in may be hidden all the same.
    pub fn is_on(&self, item: Item) -> bool {
        let Some(document) = &self.document else { return false };
        let edits = document.edits();
        match item {
            Item::Group(group) => !edits.groups.get(&group).is_some_and(|g| g.hidden),
            Item::Object(object) => {
                let own = document.unchanged().instances.get(object as usize).is_some_and(|i| i.visible);
                edits.objects.get(&object).and_then(|o| o.visible).unwrap_or(own)
            }
        }
    }

    /// Turns the switch of a line.
    pub fn switch(&mut self, item: Item) {
        let on = !self.is_on(item);
        self.edit("hide", |edits| match item {
            Item::Group(group) => edits.group(group).hidden = !on,
            Item::Object(object) => edits.object(object).visible = Some(on),
        });
    }

    /// Shows nothing but what is chosen, or everything again.
    pub(super) fn isolate(&mut self) {
        let objects: std::collections::BTreeSet<_> = self.chosen_objects().into_iter().collect();
        let Some(document) = &self.document else { return };
        let isolated = &document.edits().isolated;
        let ends = !isolated.is_empty() && (objects.is_empty() || *isolated == objects);
        if objects.is_empty() && !ends {
            return self.notice("select an object or a group to show it alone", false);
        }
        self.edit("isolate", |edits| edits.isolated = if ends { Default::default() } else { objects });
    }

    /// Shows everything that was hidden here.
    pub(super) fn show_all(&mut self) {
        let before = self.edit_count;
        self.edit("show all", |edits| {
            edits.isolated.clear();
            edits.groups.values_mut().for_each(|group| group.hidden = false);
            let hidden = edits.objects.values_mut().filter(|object| object.visible == Some(false));
            hidden.for_each(|object| object.visible = Some(true));
        });
        if self.edit_count == before {
            self.notice("nothing is hidden", false);
        }
    }

    /// Begins to give what is chosen another name.
    pub(super) fn begin_renaming(&mut self) {
        let Some(item) = self.chosen() else {
            return self.notice("select an object or a group to rename it", false);
        };
        let name = self.name_of(item).unwrap_or_default().to_owned();
        (self.open.side, self.open.tab) = (true, crate::panels::Tab::Objects);
        if let Some(document) = &self.document {
            self.open.outliner.reveal(document, item);
        }
        self.open.outliner.renaming = Some((item, name));
    }

    /// Gives a line another name; an empty one is none.
    pub fn rename(&mut self, item: Item, name: &str) {
        let name = name.trim();
        if name.is_empty() || self.name_of(item) == Some(name) {
            return;
        }
        let name = Some(name.to_owned());
        self.edit("rename", |edits| match item {
            Item::Group(group) => edits.group(group).name = name,
            Item::Object(object) => edits.object(object).name = name,
        });
    }

    /// The box around what is chosen, or else around everything.
    pub(super) fn bounds_of_chosen(&self) -> Option<(Vec3, Vec3)> {
        let document = self.document.as_ref()?;
        let objects = self.chosen_objects();
        if objects.is_empty() {
            return document.scene().bounds();
        }
        let boxes = objects.into_iter().filter_map(|object| document.bounds_of(object));
        boxes.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
    }
}
