//! The state of the tree of objects: what is open, found, marked and being renamed. The panel
//! `panels/outliner.rs` shows it.

mod tree;

pub use tree::{Found, Item, Row, Tree};

use crate::document::Document;
use alhazen::{GroupId, InstanceId};
use std::collections::HashSet;

/// The tree of objects as the user sees it.
#[derive(Clone, Debug, Default)]
pub struct Outliner {
    /// What is typed to find objects.
    pub filter: String,
    /// The line that keys act on.
    pub cursor: Option<Item>,
    /// A line that gets another name, and what is typed.
    pub renaming: Option<(Item, String)>,
    /// The cursor's line has to be scrolled to.
    pub reveals: bool,
    /// Whether keys go to it.
    pub has_focus: bool,
    /// The object that was selected when the tree was shown last.
    pub known_selection: Option<InstanceId>,
    open: HashSet<GroupId>,
    tree: Tree,
    rows: Vec<Row>,
    made_of: MadeOf,
    shows: Option<(String, u64)>,
}

/// What a tree depends on.
#[derive(Clone, Debug, Default, PartialEq)]
struct MadeOf {
    generation: u64,
    objects: usize,
    groups: usize,
    removed: Vec<InstanceId>,
}

impl Outliner {
    /// Makes the lines anew where the document has changed. `edits`: counts its changes.
    pub fn follow(&mut self, document: &Document, edits: u64) {
        let scene = document.scene();
        let removed = document.edits().objects.iter().filter(|(_, o)| o.removed).map(|(id, _)| *id);
        let made_of = MadeOf {
            generation: document.generation,
            objects: scene.instances.len(),
            groups: scene.groups.list.len(),
            removed: removed.collect(),
        };
        if made_of != self.made_of {
            if made_of.generation != self.made_of.generation {
                self.forget();
            }
            let removed = made_of.removed.iter().copied().collect();
            self.tree = Tree::new(&scene.groups, made_of.objects as u32, &removed);
            (self.made_of, self.shows) = (made_of, None);
        }
        let filter = self.filter.trim().to_lowercase();
        // Names matter only to a filter.
        let shows = (filter.clone(), if filter.is_empty() { 0 } else { edits });
        if self.shows.as_ref() != Some(&shows) {
            self.rows = if filter.is_empty() {
                self.tree.rows(|group| self.open.contains(&group), |_| true)
            } else {
                let found = Found::new(scene, &filter);
                let is_open = |group: GroupId| found.open[group as usize] || self.open.contains(&group);
                self.tree.rows(is_open, |item| found.has(item))
            };
            self.shows = Some(shows);
        }
    }

    /// What another scene does not have.
    fn forget(&mut self) {
        (self.cursor, self.renaming, self.known_selection) = (None, None, None);
        self.open.clear();
        self.filter.clear();
    }

    /// The lines that are shown.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The whole tree.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Whether a group shows what is in it.
    pub fn is_open(&self, group: GroupId) -> bool {
        self.open.contains(&group)
    }

    /// Has a group show what is in it, or not.
    pub fn set_open(&mut self, group: GroupId, open: bool) {
        let _ = if open { self.open.insert(group) } else { self.open.remove(&group) };
        self.shows = None;
    }

    /// Opens all groups, or none.
    pub fn set_all_open(&mut self, document: &Document, open: bool) {
        let count = document.scene().groups.list.len() as GroupId;
        self.open = if open { (0..count).collect() } else { HashSet::new() };
        self.shows = None;
    }

    /// Marks a line, opens what it is in, and has it scrolled to.
    pub fn reveal(&mut self, document: &Document, item: Item) {
        let groups = &document.scene().groups;
        let above = match item {
            Item::Object(object) => groups.of(object),
            Item::Group(group) => groups.list.get(group as usize).and_then(|group| group.parent),
        };
        self.open.extend(groups.upwards(above));
        (self.cursor, self.reveals, self.shows) = (Some(item), true, None);
    }

    /// The place of a line among those shown.
    pub fn place(&self, item: Item) -> Option<usize> {
        self.rows.iter().position(|row| row.item == item)
    }

    /// The line `by` lines below the cursor's, as far as there are any.
    pub fn beside(&self, by: isize) -> Option<Item> {
        let last = self.rows.len().checked_sub(1)?;
        let place = match self.cursor.and_then(|item| self.place(item)) {
            Some(place) => place.saturating_add_signed(by).min(last),
            None => 0,
        };
        Some(self.rows[place].item)
    }

    /// The group that the cursor's line is in.
    pub fn above(&self) -> Option<Item> {
        let place = self.cursor.and_then(|item| self.place(item))?;
        let depth = self.rows[place].depth;
        let above = self.rows[..place].iter().rev().find(|row| row.depth < depth);
        above.map(|row| row.item)
    }
}
