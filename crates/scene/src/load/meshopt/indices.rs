//! Modes `TRIANGLES` and `INDICES`: indices as references to what was used lately.

use super::{Bytes, MeshoptError, unzigzag, version};

/// Bytes of the table at the end of triangles.
const TABLE: usize = 16;
/// Zeros at the end of a sequence.
const TAIL: usize = 4;

/// The last sixteen values.
struct Recent<T> {
    values: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(value: T) -> Self {
        Self { values: [value; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.values[self.next] = value;
        self.next = (self.next + 1) & 15;
    }

    /// The value that was pushed last, or `back` before it.
    fn get(&self, back: usize) -> T {
        self.values[self.next.wrapping_sub(1 + back) & 15]
    }
}

/// What the decoder of triangles remembers.
struct Memory {
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// The next vertex that has not been used yet.
    fresh: u32,
    /// The last index that was written as a difference.
    last: u32,
}

impl Memory {
    fn fresh(&mut self) -> u32 {
        let fresh = self.fresh;
        self.fresh = fresh.wrapping_add(1);
        fresh
    }

    /// An index as its difference from the last one.
    fn explicit(&mut self, data: &mut Bytes<'_>) -> Result<u32, MeshoptError> {
        self.last = self.last.wrapping_add(unzigzag(data.variable()?));
        Ok(self.last)
    }
}

/// Decodes `count` indices of triangles.
///
/// # Errors
/// See [`MeshoptError`].
pub fn decode_triangles(data: &[u8], count: usize) -> Result<Vec<u32>, MeshoptError> {
    if !count.is_multiple_of(3) {
        return Err(MeshoptError::IndexCount(count));
    }
    let mut data = Bytes(data);
    let version = version(&mut data, 0xe0, 1)?;
    // The newer version has two codes for neighbours of the last explicit index.
    let explicit_from = if version >= 1 { 13 } else { 15 };
    let codes = data.take(count / 3)?;
    let end = data.0.len().checked_sub(TABLE).ok_or(MeshoptError::Truncated)?;
    let (body, table) = data.0.split_at(end);
    let mut data = Bytes(body);
    let mut memory = Memory { edges: Recent::new([!0; 2]), vertices: Recent::new(!0), fresh: 0, last: 0 };
    let mut out = Vec::with_capacity(count);
    for code in codes {
        let triangle = match code {
            0..0xf0 => at_edge(*code, explicit_from, &mut memory, &mut data)?,
            0xf0..0xfe => apart(table[usize::from(code & 15)], None, &mut memory, &mut data)?,
            0xfe.. => {
                let vertices = data.byte()?;
                if vertices == 0 {
                    memory.fresh = 0;
                }
                apart(vertices, Some(*code), &mut memory, &mut data)?
            }
        };
        out.extend(triangle);
    }
    if data.0.is_empty() { Ok(out) } else { Err(MeshoptError::TooLong) }
}

/// A triangle at a recent edge.
fn at_edge(
    code: u8,
    explicit_from: u8,
    memory: &mut Memory,
    data: &mut Bytes<'_>,
) -> Result<[u32; 3], MeshoptError> {
    let [a, b] = memory.edges.get(usize::from(code >> 4));
    let third = code & 15;
    let c = match third {
        0 => memory.fresh(),
        _ if third < explicit_from => memory.vertices.get(usize::from(third)),
        15 => memory.explicit(data)?,
        _ => {
            let step = if third == 13 { u32::MAX } else { 1 };
            memory.last = memory.last.wrapping_add(step);
            memory.last
        }
    };
    if third == 0 || third >= explicit_from {
        memory.vertices.push(c);
    }
    memory.edges.push([c, b]);
    memory.edges.push([a, c]);
    Ok([a, b, c])
}

/// A triangle without a recent edge. `vertices` says what its second and third corner are; the first is a fresh vertex
/// unless `code` is 0xff.
fn apart(
    vertices: u8,
    code: Option<u8>,
    memory: &mut Memory,
    data: &mut Bytes<'_>,
) -> Result<[u32; 3], MeshoptError> {
    let first_explicit = code == Some(0xff);
    let may_be_explicit = code.is_some();
    let [second, third] = [vertices >> 4, vertices & 15];
    let is_explicit = |corner: u8| may_be_explicit && corner == 15;
    // Corners that are known come first: fresh vertices are counted before explicit ones are read.
    let mut a = if first_explicit { 0 } else { memory.fresh() };
    let known = |corner: u8, memory: &mut Memory| match corner {
        0 => memory.fresh(),
        // The first corner is not among the recent vertices yet.
        corner => memory.vertices.get(usize::from(corner) - 1),
    };
    let mut b = known(second, memory);
    let mut c = known(third, memory);
    if first_explicit {
        a = memory.explicit(data)?;
    }
    if is_explicit(second) {
        b = memory.explicit(data)?;
    }
    if is_explicit(third) {
        c = memory.explicit(data)?;
    }
    memory.vertices.push(a);
    if second == 0 || is_explicit(second) {
        memory.vertices.push(b);
    }
    if third == 0 || is_explicit(third) {
        memory.vertices.push(c);
    }
    memory.edges.push([b, a]);
    memory.edges.push([c, b]);
    memory.edges.push([a, c]);
    Ok([a, b, c])
}

/// Decodes `count` indices in any order.
///
/// # Errors
/// See [`MeshoptError`].
pub fn decode_sequence(data: &[u8], count: usize) -> Result<Vec<u32>, MeshoptError> {
    let mut data = Bytes(data);
    version(&mut data, 0xd0, 1)?;
    // Every index is at least a byte: this keeps a false count from taking memory.
    let end = data.0.len().checked_sub(TAIL).filter(|end| count <= *end).ok_or(MeshoptError::Truncated)?;
    let mut data = Bytes(&data.0[..end]);
    let mut baselines = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let value = data.variable()?;
        let baseline = &mut baselines[(value & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(value >> 1));
        out.push(*baseline);
    }
    if data.0.is_empty() { Ok(out) } else { Err(MeshoptError::TooLong) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of meshoptimizer's own tests, which its author made by its reference encoder.
    const TRIANGLES: [u32; 12] = [0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9];
    const TRIANGLES_V0: [u8; 27] = [
        0xe0, 0xf0, 0x10, 0xfe, 0xff, 0xf0, 0x0c, 0xff, 0x02, 0x02, 0x02, 0x00, 0x76, 0x87, 0x56, 0x67, 0x78,
        0xa9, 0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
    ];
    const SEQUENCE: [u32; 8] = [0, 1, 51, 2, 49, 1000, 3, 4];

    #[test]
    fn triangles_of_the_reference_encoder_are_decoded() {
        assert_eq!(decode_triangles(&TRIANGLES_V0, 12).as_deref(), Ok(&TRIANGLES[..]));
        for length in 0..TRIANGLES_V0.len() {
            assert!(decode_triangles(&TRIANGLES_V0[..length], 12).is_err(), "{length}");
        }
        assert_eq!(decode_triangles(&TRIANGLES_V0, 13), Err(MeshoptError::IndexCount(13)));
    }

    #[test]
    fn sequences_use_two_baselines() {
        let mut data = vec![0xd1];
        let mut baselines = [0i64; 2];
        for index in SEQUENCE.map(i64::from) {
            // The nearer baseline, as an encoder would choose.
            let nearer = usize::from((index - baselines[1]).abs() < (index - baselines[0]).abs());
            let difference = index - baselines[nearer];
            baselines[nearer] = index;
            let zigzag = ((difference << 1) ^ (difference >> 63)) as u64;
            let mut value = zigzag << 1 | nearer as u64;
            while value > 127 {
                data.push(value as u8 | 128);
                value >>= 7;
            }
            data.push(value as u8);
        }
        data.extend([0; 4]);
        assert_eq!(decode_sequence(&data, 8).as_deref(), Ok(&SEQUENCE[..]));
        assert!((0..data.len()).all(|length| decode_sequence(&data[..length], 8).is_err()));
    }
}
