//! What somebody has changed of a scene, as a value: it can be kept, taken back, written to a file and applied.
//!
//! Edits refer to materials, textures and objects (instances) of the scene by number. What they add comes after all that is there,
//! in the order in which it was added, so that numbers stay what they are. [`Editable`] applies them; [`mod@file`] is how
//! they stand in a scene file: a `[base]` and the edits on top, which load as the very scene that was edited.

mod apply;
pub mod file;
mod graph;
mod numbered;
mod records;
mod slots;
mod tree;

pub use apply::{EditError, Editable, Resources};
pub use graph::{
    GraphProblem, GraphRecord, InputRecord, NodeRecord, ParameterRecord, PlacementRecord, ShownRecord,
};
pub use records::{
    CameraRecord, DaylightRecord, EnvironmentRecord, MaterialRecord, OrbitRecord, SkyRecord, SunRecord,
    UvTransformRecord,
};

use crate::{GroupId, InstanceId, Light, MaterialId, TextureId, TextureSlot};
use glam::Affine3A;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Changes of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Edits {
    /// What comes in addition.
    #[serde(rename = "add", skip_serializing_if = "Vec::is_empty")]
    pub additions: Vec<Addition>,
    /// New values of materials, by number.
    #[serde(with = "numbered", skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<MaterialId, MaterialRecord>,
    /// New graphs of textures that are graphs, by number.
    #[serde(with = "numbered", skip_serializing_if = "BTreeMap::is_empty")]
    pub textures: BTreeMap<TextureId, GraphRecord>,
    /// Textures of materials, by number and slot.
    #[serde(with = "numbered", skip_serializing_if = "BTreeMap::is_empty")]
    pub slots: BTreeMap<MaterialId, BTreeMap<TextureSlot, SlotEdit>>,
    /// Changes of objects, by number.
    #[serde(with = "numbered", skip_serializing_if = "BTreeMap::is_empty")]
    pub objects: BTreeMap<InstanceId, ObjectEdit>,
    /// Changes of groups, by number.
    #[serde(with = "numbered", skip_serializing_if = "BTreeMap::is_empty")]
    pub groups: BTreeMap<GroupId, GroupEdit>,
    /// Of all objects only these are part of the picture; none is all.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub isolated: BTreeSet<InstanceId>,
    /// All point, spot and directional lights; `None` keeps those that there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lights: Option<Vec<Light>>,
    /// Light from infinitely far away; `None` keeps what there is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentRecord>,
    /// All cameras, the one that is rendered first; `None` keeps those that there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cameras: Option<Vec<CameraRecord>>,
}

/// Something that a scene gets in addition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case", deny_unknown_fields)]
pub enum Addition {
    /// All objects, materials and lights of a file.
    Model {
        /// The file.
        file: PathBuf,
    },
    /// Another instance of an object's mesh, in the same place.
    Copy {
        /// The object.
        of: InstanceId,
    },
    /// A copy of a material, so that one object can be changed without the others.
    Material {
        /// The material.
        of: MaterialId,
    },
    /// A white sphere that shines, with a material of its own: a light of any size.
    Lamp {
        /// Radius, metres.
        radius: f32,
        /// Emitted radiance, W·sr⁻¹·m⁻², linear RGB.
        radiance: [f32; 3],
    },
}

/// A change of an object; what is `None` stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct ObjectEdit {
    /// Its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Object to world: the three columns of the matrix, then the translation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transform: Option<[f32; 12]>,
    /// Whether it is part of the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible: Option<bool>,
    /// It is gone. Its number stays, so that others keep theirs.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub removed: bool,
    /// The material of all its parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<MaterialId>,
}

/// A change of a group.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct GroupEdit {
    /// Its name; `None` keeps it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Nothing in it is part of the picture.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
}

/// A change of a texture of a material; what is `None` stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct SlotEdit {
    /// A picture that takes the texture's place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The set of texture coordinates, 0 or 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uv_set: Option<u32>,
    /// How coordinates are moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transform: Option<UvTransformRecord>,
}

impl ObjectEdit {
    /// Moves it there.
    pub fn set_transform(&mut self, transform: &Affine3A) {
        self.transform = Some(transform.to_cols_array());
    }
}

impl Edits {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Files of models that were added.
    pub fn models(&self) -> impl Iterator<Item = &Path> {
        self.additions.iter().filter_map(|addition| match addition {
            Addition::Model { file } => Some(file.as_path()),
            Addition::Copy { .. } | Addition::Material { .. } | Addition::Lamp { .. } => None,
        })
    }

    /// The picture around the scene, if it is from a file of its own.
    pub fn environment_file(&self) -> Option<&Path> {
        match &self.environment {
            Some(EnvironmentRecord::File { file, .. }) => Some(file),
            _ => None,
        }
    }

    /// Pictures that take the place of textures, each once, in the order in which they are added.
    pub fn pictures(&self) -> impl Iterator<Item = &Path> {
        let slots = self.slots.values().flat_map(BTreeMap::values);
        let mut seen = BTreeSet::new();
        slots.filter_map(|slot| slot.file.as_deref()).filter(move |file| seen.insert(*file))
    }

    /// Calls `f` with every path, to change it.
    pub fn for_each_path(&mut self, mut f: impl FnMut(&mut PathBuf)) {
        for addition in &mut self.additions {
            if let Addition::Model { file } = addition {
                f(file);
            }
        }
        self.slots
            .values_mut()
            .flat_map(BTreeMap::values_mut)
            .filter_map(|s| s.file.as_mut())
            .for_each(&mut f);
        if let Some(EnvironmentRecord::File { file, .. }) = &mut self.environment {
            f(file);
        }
    }

    /// Changes a group.
    pub fn group(&mut self, id: GroupId) -> &mut GroupEdit {
        self.groups.entry(id).or_default()
    }

    /// Changes a texture of a material.
    pub fn slot(&mut self, material: MaterialId, slot: TextureSlot) -> &mut SlotEdit {
        self.slots.entry(material).or_default().entry(slot).or_default()
    }

    /// Changes an object.
    pub fn object(&mut self, id: InstanceId) -> &mut ObjectEdit {
        self.objects.entry(id).or_default()
    }
}
