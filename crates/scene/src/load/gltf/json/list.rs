//! Arrays and strings of a glTF file that could be too large.

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// An array of at most [`List::LIMIT`] elements, empty when the file leaves it out.
///
/// Two bytes of JSON (`{}`) can become hundreds in memory, so that a limit on the file alone would not do.
pub struct List<T>(Vec<T>);

impl<T> List<T> {
    /// Four million nodes or accessors are beyond any sensible scene.
    pub const LIMIT: usize = 1 << 22;
}

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Deref for List<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T> DerefMut for List<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Elements<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Elements<T> {
            type Value = Vec<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<T>, A::Error> {
                let mut elements = Vec::new();
                while let Some(element) = seq.next_element()? {
                    if elements.len() == List::<T>::LIMIT {
                        return Err(A::Error::custom(format!("more than {} elements", List::<T>::LIMIT)));
                    }
                    elements.push(element);
                }
                Ok(elements)
            }
        }
        deserializer.deserialize_seq(Elements(PhantomData)).map(Self)
    }
}

/// A URI, borrowed from the file where it has no escapes: embedded data can be most of it.
#[derive(Deserialize)]
#[serde(transparent)]
pub struct Uri<'a>(#[serde(borrow)] pub Cow<'a, str>);
