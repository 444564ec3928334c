//! What shapes and models have in common: name, place, visibility, repetition.

use super::Builder;
use super::document::{Context, Entry};
use super::inclusion::MAX_INSTANCES;
use super::placement::Keys;
use super::repeat::{Copy, Repeat};
use super::values::{Rotation, Scale, Transform, Vec3Value};
use crate::load::LoadError;
use crate::load::session::instance;
use glam::DAffine3;
use serde::Deserialize;

/// Keys that shapes and models share.
const KEYS: [&str; 10] =
    ["name", "translate", "rotate", "scale", "motion", "visible", "dynamic", "if", "unless", "repeat"];

#[derive(Deserialize)]
struct RawObject {
    name: Option<String>,
    #[serde(flatten)]
    transform: Transform,
    #[serde(default)]
    motion: Vec<MotionKey>,
    visible: Option<bool>,
    dynamic: Option<bool>,
    #[serde(rename = "if")]
    when: Option<Condition>,
    unless: Option<Condition>,
}

/// Where an object is at a moment.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct MotionKey {
    /// Seconds.
    time: f32,
    translate: Option<Vec3Value>,
    rotate: Option<Rotation>,
    scale: Option<Scale>,
}

impl MotionKey {
    fn matrix(&self, context: &Context) -> Result<DAffine3, LoadError> {
        let Self { translate, rotate, scale, .. } = *self;
        Transform { translate, rotate, scale }.matrix(context)
    }
}

/// Something that is true or false: a boolean, a number (0 is false) or a string (empty is false).
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a boolean, a number or a string")]
enum Condition {
    Boolean(bool),
    Number(f64),
    Text(String),
}

impl Condition {
    fn is_true(&self) -> bool {
        match self {
            Condition::Boolean(truth) => *truth,
            Condition::Number(number) => *number != 0.0,
            Condition::Text(text) => !text.is_empty(),
        }
    }
}

/// The common part of a shape, model or light.
pub(super) struct Object {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Where each copy stands.
    pub copies: Vec<Copy>,
    /// Its own transform, applied before a copy's.
    pub own: DAffine3,
    /// Moments, seconds, and what is then in the place of `own`, which is the first of them; empty
    /// if it stands still.
    pub motion: Vec<(f32, DAffine3)>,
    /// Whether it is part of the picture.
    pub visible: bool,
    /// Whether it may move later.
    pub dynamic: bool,
}

impl Builder<'_> {
    /// Takes the common keys out of a table; `None` if the object is switched off by `if` or `unless`.
    pub(super) fn take_object(&mut self, entry: &mut Entry) -> Result<Option<Object>, LoadError> {
        let context = entry.context();
        let repeat = entry.take_table("repeat").map(|table| table.read::<Repeat>()).transpose()?;
        let raw: RawObject = entry.split(&KEYS).read()?;
        if raw.when.is_some_and(|c| !c.is_true()) || raw.unless.is_some_and(|c| c.is_true()) {
            return Ok(None);
        }
        // All that copies take is counted before the first one is made.
        let each = instance(raw.name.as_deref().map_or(0, str::len)) + size_of::<Copy>() as u64;
        let count = repeat.as_ref().map_or(1, Repeat::count);
        context.take(each.saturating_mul(count), "copies")?;
        let copies = match &repeat {
            Some(repeat) => repeat.copies(self.budget.instances, &context)?,
            None => vec![Copy::default()],
        };
        self.spend_instances(copies.len(), &context)?;
        let key = |key: &MotionKey| Ok((key.time, key.matrix(&context)?));
        let motion = raw.motion.iter().map(key).collect::<Result<Vec<_>, LoadError>>()?;
        let own = raw.transform.matrix(&context)?;
        if !motion.is_empty() && own != DAffine3::IDENTITY {
            return Err(context
                .error("`motion` says where the object is: it excludes `translate`, `rotate` and `scale`"));
        }
        context.take((motion.len() as u64).saturating_mul(count).saturating_mul(64), "motions")?;
        Ok(Some(Object {
            name: raw.name,
            copies,
            own: motion.first().map_or(own, |(_, first)| *first),
            motion,
            visible: raw.visible.unwrap_or(true),
            dynamic: raw.dynamic.unwrap_or(false),
        }))
    }

    /// Counts instances against the limit.
    pub(super) fn spend_instances(&mut self, count: usize, context: &Context) -> Result<(), LoadError> {
        match self.budget.instances.checked_sub(count) {
            Some(left) => {
                self.budget.instances = left;
                Ok(())
            }
            None => Err(context.error(format!("the scene has more than {MAX_INSTANCES} objects"))),
        }
    }
}

impl Object {
    /// The name of copy `i`.
    pub fn copy_name(&self, fallback: &str, i: usize) -> String {
        let name = self.name.as_deref().unwrap_or(fallback);
        if self.copies.len() == 1 { name.to_owned() } else { format!("{name} {}", i + 1) }
    }

    /// Where a copy is over time, `inner` to the world; `None` if it stands still.
    pub fn keys(&self, copy: &Copy, inner: &DAffine3) -> Option<Keys> {
        let times = self.motion.iter().map(|(time, _)| *time).collect();
        let worlds = self.motion.iter().map(|(_, own)| copy.motion * *own * *inner).collect();
        (!self.motion.is_empty()).then_some(Keys { times, worlds })
    }

    /// Object to world for a copy.
    pub fn transform(&self, copy: &Copy) -> DAffine3 {
        copy.motion * self.own
    }
}
