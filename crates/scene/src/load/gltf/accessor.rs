//! Accessors: typed arrays of numbers in buffers, checked before anything is allocated.

use super::document::Document;
use super::json::{Accessor, Kind, Sparse};
use crate::LoadError;

/// An accessor without a buffer view is all zeros, so its size costs the file nothing: no more elements than this.
const MAX_ZEROS: u64 = 1 << 24;

/// Which elements of an accessor are read.
#[derive(Clone, Copy)]
pub(super) enum Pick<'p> {
    /// All, in order.
    All,
    /// These, in this order; each is less than the accessor's count.
    Only(&'p [u32]),
}

impl Pick<'_> {
    fn len(self, count: usize) -> usize {
        match self {
            Pick::All => count,
            Pick::Only(picked) => picked.len(),
        }
    }
}

/// How integers become numbers.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Integers {
    /// As the accessor's `normalized` flag says.
    AsDeclared,
    /// Always fractions: colours and weights are defined no other way.
    Normalized,
}

/// Bytes of elements of `size` bytes that start `stride` bytes apart. The last element is whole.
#[derive(Clone, Copy)]
struct Strided<'d> {
    bytes: &'d [u8],
    stride: usize,
    size: usize,
}

impl<'d> Strided<'d> {
    /// The elements picked, as they are in memory.
    fn map<T>(self, pick: Pick<'_>, convert: impl Fn(&'d [u8]) -> T) -> Vec<T> {
        match pick {
            Pick::All => self.bytes.chunks(self.stride).map(|chunk| convert(&chunk[..self.size])).collect(),
            Pick::Only(picked) => {
                let element = |i: &u32| &self.bytes[*i as usize * self.stride..][..self.size];
                picked.iter().map(|i| convert(element(i))).collect()
            }
        }
    }
}

/// A stored number.
trait Number: Copy {
    const SIZE: usize;
    /// From `SIZE` little-endian bytes.
    fn read(bytes: &[u8]) -> Self;
    fn plain(self) -> f32;
    /// The fraction that an integer stands for.
    fn normalized(self) -> f32;
}

macro_rules! number {
    ($type:ty, $normalized:expr) => {
        impl Number for $type {
            const SIZE: usize = size_of::<$type>();
            fn read(bytes: &[u8]) -> Self {
                let mut array = [0; Self::SIZE];
                array.copy_from_slice(bytes);
                Self::from_le_bytes(array)
            }
            fn plain(self) -> f32 {
                self as f32
            }
            fn normalized(self) -> f32 {
                $normalized(self)
            }
        }
    };
}
number!(i8, |v| (f32::from(v) / 127.0).max(-1.0));
number!(u8, |v| f32::from(v) / 255.0);
number!(i16, |v| (f32::from(v) / 32767.0).max(-1.0));
number!(u16, |v| f32::from(v) / 65535.0);
number!(u32, |v| (f64::from(v) / f64::from(u32::MAX)) as f32);
number!(f32, |v| v);

const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

fn component_size(component: u32) -> Option<usize> {
    match component {
        I8 | U8 => Some(1),
        I16 | U16 => Some(2),
        U32 | F32 => Some(4),
        _ => None,
    }
}

fn components(kind: Kind) -> usize {
    match kind {
        Kind::Scalar => 1,
        Kind::Vec2 => 2,
        Kind::Vec3 => 3,
        Kind::Vec4 | Kind::Mat2 => 4,
        Kind::Mat3 => 9,
        Kind::Mat4 => 16,
        Kind::Unknown => 0,
    }
}

impl Document<'_> {
    /// The accessor's number of elements, not checked against its data.
    pub fn accessor_count(&self, index: u32) -> Result<u64, LoadError> {
        Ok(self.get(&self.json.accessors, index, "accessor")?.count)
    }

    /// The accessor's shape.
    pub fn accessor_kind(&self, index: u32) -> Result<Kind, LoadError> {
        Ok(self.get(&self.json.accessors, index, "accessor")?.kind)
    }

    /// Whether the accessor's values stand in the file, rather than being left to an extension.
    pub fn has_data(&self, index: u32) -> bool {
        let accessor = self.json.accessors.get(index as usize);
        accessor.is_some_and(|a| a.buffer_view.is_some() || a.sparse.is_some())
    }

    /// Reads elements of `N` numbers. Integers are converted as `integers` says.
    ///
    /// # Errors
    /// The accessor does not exist, has another shape, reaches beyond its buffer view, or is too large.
    pub fn read<const N: usize, T: From<[f32; N]> + Copy>(
        &self,
        index: u32,
        kind: Kind,
        integers: Integers,
        pick: Pick<'_>,
    ) -> Result<Vec<T>, LoadError> {
        let accessor = self.typed(index, kind)?;
        debug_assert_eq!(components(kind), N);
        let normalized = accessor.normalized || integers == Integers::Normalized;
        let count = self.checked_count(index, accessor)?;
        self.reserve::<T>(pick.len(count) as u64)?;
        let convert = |elements: Strided<'_>, pick: Pick<'_>| match (accessor.component_type, normalized) {
            (I8, false) => elements.map(pick, |b| T::from(numbers::<N, i8>(b, i8::plain))),
            (I8, true) => elements.map(pick, |b| T::from(numbers::<N, i8>(b, i8::normalized))),
            (U8, false) => elements.map(pick, |b| T::from(numbers::<N, u8>(b, u8::plain))),
            (U8, true) => elements.map(pick, |b| T::from(numbers::<N, u8>(b, u8::normalized))),
            (I16, false) => elements.map(pick, |b| T::from(numbers::<N, i16>(b, i16::plain))),
            (I16, true) => elements.map(pick, |b| T::from(numbers::<N, i16>(b, i16::normalized))),
            (U16, false) => elements.map(pick, |b| T::from(numbers::<N, u16>(b, u16::plain))),
            (U16, true) => elements.map(pick, |b| T::from(numbers::<N, u16>(b, u16::normalized))),
            (U32, false) => elements.map(pick, |b| T::from(numbers::<N, u32>(b, u32::plain))),
            (U32, true) => elements.map(pick, |b| T::from(numbers::<N, u32>(b, u32::normalized))),
            _ => elements.map(pick, |b| T::from(numbers::<N, f32>(b, f32::plain))),
        };
        self.assemble(index, accessor, count, pick, T::from([0.0; N]), convert)
    }

    /// Reads unsigned integers: vertex indices.
    ///
    /// # Errors
    /// As [`Document::read`]; also for signed or floating-point components.
    pub fn read_indices(&self, index: u32) -> Result<Vec<u32>, LoadError> {
        let accessor = self.typed(index, Kind::Scalar)?;
        let count = self.checked_count(index, accessor)?;
        self.reserve::<u32>(count as u64)?;
        if !is_unsigned(accessor.component_type) {
            let message = format!("component type {} cannot be an index", accessor.component_type);
            return Err(self.malformed(format!("accessor {index}"), message));
        }
        let convert =
            |elements: Strided<'_>, pick: Pick<'_>| unsigned(accessor.component_type, elements, pick);
        self.assemble(index, accessor, count, Pick::All, 0, convert)
    }

    fn typed(&self, index: u32, kind: Kind) -> Result<&Accessor, LoadError> {
        let accessor = self.get(&self.json.accessors, index, "accessor")?;
        if accessor.kind != kind {
            let message = format!("has type {:?} where {kind:?} is expected", accessor.kind);
            return Err(self.malformed(format!("accessor {index}"), message));
        }
        if component_size(accessor.component_type).is_none() {
            let message = format!("component type {} does not exist", accessor.component_type);
            return Err(self.malformed(format!("accessor {index}"), message));
        }
        Ok(accessor)
    }

    /// The number of elements, which the file's data is large enough for.
    fn checked_count(&self, index: u32, accessor: &Accessor) -> Result<usize, LoadError> {
        match accessor.buffer_view {
            Some(_) => self.base(index, accessor)?,
            None if accessor.count > MAX_ZEROS => {
                return Err(LoadError::TooLarge {
                    path: self.path.to_owned(),
                    what: format!("the number of elements of accessor {index}, which has no buffer view,"),
                    size: accessor.count,
                    limit: MAX_ZEROS,
                });
            }
            None => None,
        };
        Ok(accessor.count as usize)
    }

    /// The elements in the accessor's own buffer view, if it has one and any element.
    fn base(&self, index: u32, accessor: &Accessor) -> Result<Option<Strided<'_>>, LoadError> {
        let Some(view) = accessor.buffer_view.filter(|_| accessor.count > 0) else { return Ok(None) };
        let size = components(accessor.kind) * component_size(accessor.component_type).unwrap_or(0);
        let object = || format!("accessor {index}");
        self.strided(view, accessor.byte_offset, accessor.count, size, true, &object).map(Some)
    }

    /// `count` (at least 1) elements of `size` bytes in a buffer view.
    fn strided(
        &self,
        view: u32,
        offset: u64,
        count: u64,
        size: usize,
        may_stride: bool,
        object: &dyn Fn() -> String,
    ) -> Result<Strided<'_>, LoadError> {
        let (bytes, view) = self.view(view)?;
        let stride = view.byte_stride.filter(|s| may_stride && *s != 0).unwrap_or(size as u64);
        if stride < size as u64 {
            return Err(
                self.malformed(object(), format!("elements of {size} bytes overlap at stride {stride}"))
            );
        }
        let length = stride.checked_mul(count - 1).and_then(|l| l.checked_add(size as u64));
        let end = length.and_then(|l| l.checked_add(offset)).filter(|end| *end <= bytes.len() as u64);
        let Some(end) = end else {
            let available = bytes.len();
            let message = format!(
                "{count} elements of {size} bytes, {stride} apart, from {offset} on, do not fit the {available} bytes of its buffer view"
            );
            return Err(self.malformed(object(), message));
        };
        Ok(Strided { bytes: &bytes[offset as usize..end as usize], stride: stride as usize, size })
    }

    /// Base values (zeros without a buffer view) with the sparse ones put over them.
    fn assemble<T: Copy>(
        &self,
        index: u32,
        accessor: &Accessor,
        count: usize,
        pick: Pick<'_>,
        zero: T,
        convert: impl Fn(Strided<'_>, Pick<'_>) -> Vec<T>,
    ) -> Result<Vec<T>, LoadError> {
        let base = self.base(index, accessor)?;
        let read_base = |pick: Pick<'_>| match base {
            Some(elements) => convert(elements, pick),
            None => vec![zero; pick.len(count)],
        };
        let Some(sparse) = accessor.sparse.as_ref().filter(|s| s.count > 0) else {
            return Ok(read_base(pick));
        };
        self.reserve::<T>(count as u64)?;
        let mut values = read_base(Pick::All);
        self.apply_sparse(index, accessor, sparse, &mut values, convert)?;
        Ok(match pick {
            Pick::All => values,
            Pick::Only(picked) => picked.iter().map(|i| values[*i as usize]).collect(),
        })
    }

    fn apply_sparse<T: Copy>(
        &self,
        index: u32,
        accessor: &Accessor,
        sparse: &Sparse,
        values: &mut [T],
        convert: impl Fn(Strided<'_>, Pick<'_>) -> Vec<T>,
    ) -> Result<(), LoadError> {
        let object = || format!("sparse values of accessor {index}");
        let component = sparse.indices.component_type;
        let Some(index_size) = component_size(component).filter(|_| is_unsigned(component)) else {
            return Err(self.malformed(object(), format!("component type {component} cannot be an index")));
        };
        let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let places = self.strided(view, offset, sparse.count, index_size, false, &object)?;
        let size = components(accessor.kind) * component_size(accessor.component_type).unwrap_or(0);
        let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
        let replacements = self.strided(view, offset, sparse.count, size, false, &object)?;
        self.reserve::<(T, u32)>(sparse.count)?;
        for (place, value) in
            unsigned(component, places, Pick::All).iter().zip(convert(replacements, Pick::All))
        {
            let count = values.len();
            *values.get_mut(*place as usize).ok_or_else(|| {
                self.malformed(object(), format!("index {place} is beyond the {count} elements"))
            })? = value;
        }
        Ok(())
    }
}

fn is_unsigned(component: u32) -> bool {
    matches!(component, U8 | U16 | U32)
}

fn unsigned(component: u32, elements: Strided<'_>, pick: Pick<'_>) -> Vec<u32> {
    match component {
        U8 => elements.map(pick, |b| u32::from(u8::read(b))),
        U16 => elements.map(pick, |b| u32::from(u16::read(b))),
        _ => elements.map(pick, u32::read),
    }
}

fn numbers<const N: usize, C: Number>(bytes: &[u8], convert: impl Fn(C) -> f32) -> [f32; N] {
    let bytes = &bytes[..N * C::SIZE]; // one check instead of N
    std::array::from_fn(|i| convert(C::read(&bytes[i * C::SIZE..(i + 1) * C::SIZE])))
}
