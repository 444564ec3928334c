//! Accessors and buffers, also sparse and compressed ones.

use super::list::Uri;
use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Accessor {
    pub buffer_view: Option<u32>,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: u64,
    #[serde(rename = "type")]
    pub kind: Kind,
    pub sparse: Option<Sparse>,
    #[serde(default)]
    pub min: Corner,
    #[serde(default)]
    pub max: Corner,
}

/// The first three of a list of numbers, if there are as many. Whatever else stands there is passed over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner(pub Option<[f64; 3]>);

impl<'de> Deserialize<'de> for Corner {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CornerVisitor)
    }
}

struct CornerVisitor;

impl<'de> Visitor<'de> for CornerVisitor {
    type Value = Corner;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Corner, A::Error> {
        let mut numbers = [None; 3];
        for number in &mut numbers {
            *number = list.next_element::<serde_json::Number>()?.and_then(|n| n.as_f64());
        }
        while list.next_element::<IgnoredAny>()?.is_some() {}
        let [Some(x), Some(y), Some(z)] = numbers else { return Ok(Corner(None)) };
        Ok(Corner(Some([x, y, z])))
    }

    fn visit_unit<E>(self) -> Result<Corner, E> {
        Ok(Corner(None))
    }
}

/// The shape of an accessor's elements.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub enum Kind {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
    #[serde(other)]
    Unknown,
}

#[derive(Deserialize)]
pub struct Sparse {
    pub count: u64,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BufferView {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: Option<u64>,
    #[serde(default)]
    pub extensions: ViewExtensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Buffer<'a> {
    #[serde(borrow)]
    pub uri: Option<Uri<'a>>,
    #[serde(default)]
    pub byte_length: u64,
    #[serde(default)]
    pub extensions: Compression,
}

/// The extensions that compress buffer views, on the buffers that stand in for uncompressed data.
#[derive(Default, Deserialize)]
pub struct Compression {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext: Option<IgnoredAny>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr: Option<IgnoredAny>,
}

impl Compression {
    /// The name of the extension in use.
    pub fn name(&self) -> Option<&'static str> {
        let ext = self.ext.is_some().then_some("EXT_meshopt_compression");
        ext.or(self.khr.is_some().then_some("KHR_meshopt_compression"))
    }
}

/// The extensions that compress buffer views, on the views.
#[derive(Default, Deserialize)]
pub struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub ext: Option<Box<Meshopt>>,
    #[serde(rename = "KHR_meshopt_compression")]
    pub khr: Option<Box<Meshopt>>,
}

impl ViewExtensions {
    /// Where the compressed data is, if the view is compressed.
    pub fn compressed(&self) -> Option<&Meshopt> {
        self.ext.as_deref().or(self.khr.as_deref())
    }
}

/// Where the compressed data of a view is, and what it becomes.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Meshopt {
    pub buffer: u32,
    #[serde(default)]
    pub byte_offset: u64,
    pub byte_length: u64,
    pub byte_stride: u64,
    pub count: u64,
    pub mode: String,
    pub filter: Option<String>,
}
