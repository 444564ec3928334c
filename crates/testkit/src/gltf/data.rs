//! Buffer views and accessors.

use super::File;
use serde_json::{Value, json};

const FLOAT: u32 = 5126;

/// What accessors hold.
#[derive(Clone, Copy)]
pub(super) enum Holds {
    /// Single-precision numbers of any sign.
    Numbers,
    /// Numbers of `[0, 1]`: as floats, or normalised integers.
    Shares,
    /// Integers below a number.
    Below(usize),
}

impl File<'_, '_> {
    /// A view of new bytes; its index.
    pub(super) fn add_view(&mut self, bytes: &[u8], stride: Option<usize>) -> u32 {
        let (offset, length) = (self.binary.len(), bytes.len());
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        if self.choices.once_in(128) {
            let key = self.choices.one_of(&["byteOffset", "byteLength", "byteStride"]);
            view[key] = json!(self.choices.one_of(&[0u64, 1, 3, 252, 1 << 20, 1 << 32, u64::MAX]));
        }
        if self.choices.once_in(48) {
            view["extensions"] = json!({ "EXT_meshopt_compression": self.compression(offset, length) });
        }
        self.views.push(view);
        self.views.len() as u32 - 1
    }

    /// The bytes are not what such a compression makes, but for their first one.
    fn compression(&mut self, offset: usize, length: usize) -> Value {
        let mode = self.choices.one_of(&["ATTRIBUTES", "TRIANGLES", "INDICES"]);
        if let Some(first) = self.binary.get_mut(offset) {
            *first = match mode {
                "ATTRIBUTES" => 0xa0,
                "TRIANGLES" => 0xe1,
                _ => 0xd1,
            };
        }
        let filter = self.choices.one_of(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"]);
        let stride = self.choices.one_of(&[4, 8, 12, 16, 2, 256]);
        let count = self.choices.below(100);
        json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride, "count": count,
            "mode": mode, "filter": filter })
    }

    /// An accessor of `count` elements of `width` numbers, its kind and index.
    pub(super) fn add_accessor(&mut self, kind: &str, width: usize, count: usize, holds: Holds) -> u32 {
        let component = match holds {
            Holds::Numbers => FLOAT,
            Holds::Shares => self.choices.one_of(&[FLOAT, 5121, 5123]),
            // Bytes cannot count to more.
            Holds::Below(limit) if limit > 256 => self.choices.one_of(&[5125, 5123]),
            Holds::Below(_) => self.choices.one_of(&[5125, 5123, 5121]),
        };
        // Most accessors are sound as a whole: one bad number in each mesh would leave little to draw.
        let sound = !self.choices.once_in(8);
        let mut bytes = Vec::new();
        for _ in 0..count * width {
            self.push_number(&mut bytes, component, holds, sound);
        }
        let size = bytes.len() / (count * width).max(1);
        let stride = self.choices.once_in(8).then_some((size * width).next_multiple_of(4));
        let bytes = if stride == Some(size * width) || stride.is_none() {
            bytes
        } else {
            spread(&bytes, size * width)
        };
        let view = self.add_view(&bytes, stride);
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        if component != FLOAT && matches!(holds, Holds::Shares) {
            accessor["normalized"] = json!(true);
        }
        if self.choices.once_in(12) && count > 0 {
            accessor["sparse"] = self.sparse(width, count, component, holds, sound);
            if self.choices.once_in(3)
                && let Some(fields) = accessor.as_object_mut()
            {
                fields.remove("bufferView");
            }
        }
        if self.choices.once_in(96) {
            let (key, value) = self.choices.one_of(&[
                ("count", 0u64),
                ("count", 1),
                ("count", 1_000_000),
                ("count", 1 << 40),
                ("byteOffset", 1),
                ("byteOffset", u64::MAX),
                ("componentType", 5120),
                ("componentType", 7),
            ]);
            accessor[key] = json!(value);
        }
        self.accessors.push(accessor);
        self.accessors.len() as u32 - 1
    }

    fn push_number(&mut self, bytes: &mut Vec<u8>, component: u32, holds: Holds, sound: bool) {
        if let Holds::Below(limit) = holds {
            let index = if sound { self.choices.below(limit) as u32 } else { self.choices.index(limit) };
            let size = if component == 5121 {
                1
            } else if component == 5123 {
                2
            } else {
                4
            };
            return bytes.extend(&index.to_le_bytes()[..size]);
        }
        match (component, holds) {
            (FLOAT, Holds::Numbers) => {
                let value = match (sound, self.choices.unit()) {
                    (true, unit) => 4.0 * unit as f32 - 2.0,
                    (false, _) if self.choices.once_in(16) => f32::NAN,
                    (false, _) => self.choices.number() as f32,
                };
                bytes.extend(value.to_le_bytes());
            }
            (FLOAT, _) => bytes.extend((self.choices.share() as f32).to_le_bytes()),
            (5121, _) => bytes.push(self.choices.byte()),
            _ => bytes.extend([self.choices.byte(), self.choices.byte()]),
        }
    }

    /// Some elements that differ from the others.
    fn sparse(&mut self, width: usize, count: usize, component: u32, holds: Holds, sound: bool) -> Value {
        let changed = 1 + self.choices.below(count.min(8));
        let mut indices: Vec<u32> = (0..changed).map(|_| self.choices.index(count)).collect();
        if !self.choices.once_in(8) {
            indices.sort_unstable();
            indices.dedup();
        }
        let places: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let mut values = Vec::new();
        for _ in 0..indices.len() * width {
            self.push_number(&mut values, component, holds, sound);
        }
        let (places, values) = (self.add_view(&places, None), self.add_view(&values, None));
        json!({ "count": indices.len(), "indices": { "bufferView": places, "componentType": 5125 },
            "values": { "bufferView": values } })
    }
}

/// Elements of `size` bytes, each padded to a multiple of 4.
fn spread(bytes: &[u8], size: usize) -> Vec<u8> {
    let padded = |element: &[u8]| {
        let mut element = element.to_vec();
        element.resize(size.next_multiple_of(4), 0);
        element
    };
    bytes.chunks(size.max(1)).flat_map(padded).collect()
}
