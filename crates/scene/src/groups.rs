//! What a file groups: names for people. Back ends know nothing of it.

use crate::InstanceId;
use serde::{Deserialize, Serialize};

/// Index into [`Groups::list`].
pub type GroupId = u32;

/// A group of objects and of other groups: a node of a glTF file, the copies of a shape, a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// The group that it is in; `None` at the top. Its number is less than the group's own.
    pub parent: Option<GroupId>,
}

/// The tree of a scene's objects.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Groups {
    /// All groups, parents before what is in them.
    pub list: Vec<Group>,
    /// The group of each instance, by its number. Instances beyond the end are in none.
    pub of_instances: Vec<Option<GroupId>>,
}

impl Groups {
    /// The group that an instance is in.
    pub fn of(&self, instance: InstanceId) -> Option<GroupId> {
        self.of_instances.get(instance as usize).copied().flatten()
    }

    /// A group, the group that it is in, and so on up to the top.
    pub fn upwards(&self, group: Option<GroupId>) -> impl Iterator<Item = GroupId> {
        std::iter::successors(group, |id| self.list.get(*id as usize).and_then(|group| group.parent))
    }

    /// Adds a group and returns its number.
    pub fn add(&mut self, name: impl Into<String>, parent: Option<GroupId>) -> GroupId {
        self.list.push(Group { name: name.into(), parent });
        (self.list.len() - 1) as GroupId
    }

    /// Puts an instance into a group.
    pub fn put(&mut self, instance: InstanceId, group: Option<GroupId>) {
        let (index, known) = (instance as usize, self.of_instances.len());
        if group.is_some() && index >= known {
            self.of_instances.resize(index + 1, None);
        }
        if let Some(place) = self.of_instances.get_mut(index) {
            *place = group;
        }
    }

    /// Takes the groups of instances that have become those from number `first` on. What was at the
    /// top is in `parent` now.
    ///
    /// - `count`: how many instances there are.
    pub fn append(&mut self, other: &Self, first: InstanceId, count: usize, parent: Option<GroupId>) {
        let offset = self.list.len() as GroupId;
        self.list.extend(other.list.iter().map(|group| Group {
            name: group.name.clone(),
            parent: group.parent.map(|id| id + offset).or(parent),
        }));
        for number in 0..count as InstanceId {
            self.put(first + number, other.of(number).map(|id| id + offset).or(parent));
        }
    }

    /// Of each group whether it, or one that it is in, is one of `chosen`.
    pub fn within(&self, chosen: impl Fn(GroupId) -> bool) -> Vec<bool> {
        let mut within: Vec<bool> = Vec::with_capacity(self.list.len());
        for (id, group) in self.list.iter().enumerate() {
            let above = group.parent.and_then(|id| within.get(id as usize)).copied();
            within.push(above.unwrap_or(false) || chosen(id as GroupId));
        }
        within
    }

    /// What is wrong with groups that no loader has made, if anything is.
    pub(crate) fn problem(&self) -> Option<String> {
        let count = self.list.len();
        let late = |(id, group): (usize, &Group)| group.parent.is_some_and(|p| p as usize >= id);
        if let Some(id) = self.list.iter().enumerate().position(late) {
            return Some(format!("group {id} comes before the group that it is in"));
        }
        let missing = self.of_instances.iter().flatten().find(|id| **id as usize >= count)?;
        Some(format!("there is no group {missing}"))
    }

    /// Bytes that they take.
    pub(crate) fn bytes(&self) -> u64 {
        let names: usize = self.list.iter().map(|group| group.name.len()).sum();
        (names + size_of_val(&self.list[..]) + size_of_val(&self.of_instances[..])) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_appended_below_another() {
        let mut model = Groups::default();
        let wheel = model.add("wheel", None);
        model.put(1, Some(wheel));
        let mut all = Groups::default();
        let car = all.add("car", None);
        all.append(&model, 3, 2, Some(car));
        assert_eq!(all.list[1], Group { name: "wheel".into(), parent: Some(car) });
        assert_eq!([2, 3, 4, 5].map(|i| all.of(i)), [None, Some(car), Some(1), None]);
        assert_eq!(all.upwards(all.of(4)).collect::<Vec<_>>(), [1, car]);
        assert_eq!(all.within(|id| id == car), [true, true]);
        assert_eq!(all.within(|id| id == 1), [false, true]);
        assert_eq!(all.problem(), None);
    }

    #[test]
    fn what_no_loader_makes_is_found() {
        let own = Group { name: "own".into(), parent: Some(0) };
        let ring = Groups { list: vec![own], ..Groups::default() };
        assert!(ring.problem().is_some_and(|text| text.contains("group 0")));
        let missing = Groups { of_instances: vec![None, Some(7)], ..Groups::default() };
        assert!(missing.problem().is_some_and(|text| text.contains("no group 7")));
    }
}
