//! The motions of a scene while the shutter is open.

use optics::motion::MotionSegment;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Motions while the shutter is open; each begins when it opens and ends when it closes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneMotion {
    /// From object to world, by [`crate::Scene::instances`].
    #[serde(with = "numbers")]
    pub instances: BTreeMap<u32, Vec<MotionSegment>>,
    /// From a space that the light carries along to the world, by [`crate::Scene::lights`]. Without scale.
    #[serde(with = "numbers")]
    pub lights: BTreeMap<u32, Vec<MotionSegment>>,
    /// What changes too, but is shown as it is in the middle of that time, for people.
    pub held: Vec<String>,
}

/// Segments as the numbers that they are made of.
mod numbers {
    use optics::motion::MotionSegment;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::collections::BTreeMap;

    type Segments = BTreeMap<u32, Vec<MotionSegment>>;
    type Numbers = BTreeMap<u32, Vec<[[f32; 4]; 8]>>;

    pub fn serialize<S: Serializer>(segments: &Segments, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = |s: &MotionSegment| {
            [
                s.translation,
                s.translation_step,
                s.rotation,
                s.rotation_step,
                s.stretch,
                s.stretch_step,
                s.shear,
                s.shear_step,
            ]
            .map(|v| v.to_array())
        };
        let numbers: Numbers = segments.iter().map(|(i, all)| (*i, all.iter().map(rows).collect())).collect();
        numbers.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Segments, D::Error> {
        let segment = |rows: [[f32; 4]; 8]| {
            let [
                translation,
                translation_step,
                rotation,
                rotation_step,
                stretch,
                stretch_step,
                shear,
                shear_step,
            ] = rows.map(|[x, y, z, w]| optics::vec4f(x, y, z, w));
            MotionSegment {
                translation,
                translation_step,
                rotation,
                rotation_step,
                stretch,
                stretch_step,
                shear,
                shear_step,
            }
        };
        let numbers = Numbers::deserialize(deserializer)?;
        Ok(numbers.into_iter().map(|(i, all)| (i, all.into_iter().map(segment).collect())).collect())
    }
}
