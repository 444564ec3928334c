//! The tree of a scene's objects, and its lines as far as they are open.

use alhazen::{GroupId, Groups, InstanceId, Scene};
use std::collections::HashSet;

/// A line of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Item {
    /// A group of objects.
    Group(GroupId),
    /// An object.
    Object(InstanceId),
}

/// A line that is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// What it is.
    pub item: Item,
    /// How many groups it is in.
    pub depth: u32,
}

/// What is in what, in the order of the first object.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    top: Vec<Item>,
    /// What is in each group.
    inside: Vec<Vec<Item>>,
    /// How many objects are in each group and the groups in it.
    counts: Vec<u32>,
}

impl Tree {
    /// The tree of `count` objects without those of `removed`.
    pub fn new(groups: &Groups, count: u32, removed: &HashSet<InstanceId>) -> Self {
        let mut tree = Self {
            top: Vec::new(),
            inside: vec![Vec::new(); groups.list.len()],
            counts: vec![0; groups.list.len()],
        };
        for object in (0..count).filter(|object| !removed.contains(object)) {
            let mut item = Item::Object(object);
            let mut is_known = false;
            for group in groups.upwards(groups.of(object)) {
                let Some(count) = tree.counts.get_mut(group as usize) else { break };
                if !is_known {
                    tree.inside[group as usize].push(item);
                }
                is_known |= *count > 0;
                (*count, item) = (*count + 1, Item::Group(group));
            }
            if !is_known {
                tree.top.push(item);
            }
        }
        tree
    }

    /// How many objects are in a group and the groups in it.
    pub fn count(&self, group: GroupId) -> u32 {
        self.counts.get(group as usize).copied().unwrap_or(0)
    }

    /// The objects of a line.
    pub fn objects(&self, item: Item) -> Vec<InstanceId> {
        let (mut found, mut stack) = (Vec::new(), vec![item]);
        while let Some(item) = stack.pop() {
            match item {
                Item::Object(object) => found.push(object),
                Item::Group(group) => stack.extend(self.inside.get(group as usize).into_iter().flatten()),
            }
        }
        found.sort_unstable();
        found
    }

    /// The lines that are shown.
    ///
    /// - `is_open`: whether a group shows what is in it.
    /// - `is_wanted`: whether a line is.
    pub fn rows(&self, is_open: impl Fn(GroupId) -> bool, is_wanted: impl Fn(Item) -> bool) -> Vec<Row> {
        let mut rows = Vec::new();
        let mut stack: Vec<Row> = self.top.iter().rev().map(|item| Row { item: *item, depth: 0 }).collect();
        while let Some(row) = stack.pop() {
            if !is_wanted(row.item) {
                continue;
            }
            rows.push(row);
            if let Item::Group(group) = row.item
                && is_open(group)
            {
                let inside = self.inside.get(group as usize).into_iter().flatten().rev();
                stack.extend(inside.map(|item| Row { item: *item, depth: row.depth + 1 }));
            }
        }
        rows
    }
}

/// What a filter leaves: what is called so, what is in such groups, and the groups that it is in.
pub struct Found {
    objects: Vec<bool>,
    /// Groups with something found in them, or that are found themselves.
    groups: Vec<bool>,
    /// Groups with something found in them.
    pub open: Vec<bool>,
}

impl Found {
    /// What has `text` (lower case) in its name.
    pub fn new(scene: &Scene, text: &str) -> Self {
        let groups = &scene.groups;
        let has = |name: &str| name.to_lowercase().contains(text);
        let named = groups.within(|id| has(&groups.list[id as usize].name));
        let mut found = Self {
            objects: Vec::with_capacity(scene.instances.len()),
            groups: named.clone(),
            open: vec![false; named.len()],
        };
        for (id, instance) in (0..).zip(&scene.instances) {
            let is_named = has(&instance.name);
            let is_inside = groups.of(id).is_some_and(|group| named[group as usize]);
            found.objects.push(is_named || is_inside);
            // What is above is open already where a group is.
            let mut above = groups.of(id).filter(|_| is_named);
            while let Some(group) = above
                && !std::mem::replace(&mut found.open[group as usize], true)
            {
                found.groups[group as usize] = true;
                above = groups.list[group as usize].parent;
            }
        }
        // A group that is found lies in groups that have to be open, too.
        for id in (0..named.len()).filter(|id| named[*id]) {
            let mut above = groups.list[id].parent;
            while let Some(group) = above
                && !std::mem::replace(&mut found.open[group as usize], true)
            {
                found.groups[group as usize] = true;
                above = groups.list[group as usize].parent;
            }
        }
        found
    }

    /// Whether a line is left.
    pub fn has(&self, item: Item) -> bool {
        match item {
            Item::Group(group) => self.groups.get(group as usize).is_some_and(|found| *found),
            Item::Object(object) => self.objects.get(object as usize).is_some_and(|found| *found),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Item::{Group, Object};
    use super::*;
    use alhazen::Instance;
    use glam::Affine3A;
    use std::time::Instant;

    /// A car with two wheels and a body, after something that is in no group.
    fn scene() -> Scene {
        let mut groups = Groups::default();
        let car = groups.add("car", None);
        let wheels = groups.add("wheels", Some(car));
        let names = ["floor", "left", "body", "right"];
        [(1, wheels), (2, car), (3, wheels)].into_iter().for_each(|(i, group)| groups.put(i, Some(group)));
        let instances = names.map(|name| Instance::new(name, 0, Affine3A::IDENTITY)).to_vec();
        Scene { instances, groups: groups.into(), ..Scene::default() }
    }

    fn shown(rows: &[Row]) -> Vec<(Item, u32)> {
        rows.iter().map(|row| (row.item, row.depth)).collect()
    }

    #[test]
    fn lines_are_those_of_open_groups_in_the_order_of_the_file() {
        let scene = scene();
        let tree = Tree::new(&scene.groups, 4, &HashSet::new());
        assert_eq!((tree.count(0), tree.count(1)), (3, 2));
        assert_eq!(tree.objects(Group(0)), [1, 2, 3]);
        assert_eq!(shown(&tree.rows(|_| false, |_| true)), [(Object(0), 0), (Group(0), 0)]);
        let all =
            [(Object(0), 0), (Group(0), 0), (Group(1), 1), (Object(1), 2), (Object(3), 2), (Object(2), 1)];
        assert_eq!(shown(&tree.rows(|_| true, |_| true)), all);
        let removed = HashSet::from([1, 3]);
        let tree = Tree::new(&scene.groups, 4, &removed);
        let left = [(Object(0), 0), (Group(0), 0), (Object(2), 1)];
        assert_eq!(shown(&tree.rows(|_| true, |_| true)), left, "groups without objects are gone");
    }

    #[test]
    fn filters_leave_what_is_called_so_and_where_it_is() {
        let scene = scene();
        let tree = Tree::new(&scene.groups, 4, &HashSet::new());
        let rows = |text: &str| {
            let found = Found::new(&scene, text);
            shown(&tree.rows(|group| found.open[group as usize], |item| found.has(item)))
        };
        assert_eq!(rows("right"), [(Group(0), 0), (Group(1), 1), (Object(3), 2)]);
        assert_eq!(rows("wheel"), [(Group(0), 0), (Group(1), 1)]);
        assert_eq!(rows("flo"), [(Object(0), 0)]);
        assert!(rows("nothing").is_empty());
    }

    /// A hundred thousand objects in three hundred groups, ten deep.
    #[test]
    fn large_scenes_are_quick() {
        let mut groups = Groups::default();
        for top in 0..30 {
            let mut parent = None;
            (0..10).for_each(|depth| parent = Some(groups.add(format!("group {top} {depth}"), parent)));
        }
        let name = |i: u32| Instance::new(format!("object {i}"), 0, Affine3A::IDENTITY);
        let instances: Vec<_> = (0..100_000).map(name).collect();
        (0..100_000).for_each(|i| groups.put(i, Some(i % 300)));
        let scene = Scene { instances, groups: groups.into(), ..Scene::default() };
        let begin = Instant::now();
        let tree = Tree::new(&scene.groups, 100_000, &HashSet::new());
        assert_eq!(tree.rows(|_| true, |_| true).len(), 100_300);
        let found = Found::new(&scene, "object 99999");
        assert_eq!(tree.rows(|g| found.open[g as usize], |item| found.has(item)).len(), 11);
        let took = begin.elapsed();
        assert!(took.as_millis() < 2000, "{took:?}");
    }
}
