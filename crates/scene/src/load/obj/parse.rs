//! OBJ text to numbers: in parallel over pieces of the file, then put together.

use super::text::{self, Lines};
use crate::LoadReport;
use crate::origin::Bounds;
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// An index that a face does not give.
pub(super) const MISSING: i32 = i32::MIN;
/// An index that no array has: zero, or not a number.
const INVALID: i32 = -1;

/// A corner of a face: 0-based indices of position, texture coordinates and normal. They may be out of range.
pub(super) type Corner = [i32; 3];

/// A parsed OBJ file.
#[derive(Default)]
pub(super) struct Data {
    /// What the positions are relative to.
    pub(super) anchor: DVec3,
    pub(super) positions: Vec<Vec3>,
    /// Colour of each position, as written; empty if the file has none.
    pub(super) colors: Vec<Vec4>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    /// Faces and the statements between them, in file order.
    pub(super) chunks: Vec<Faces>,
}

/// Faces of a piece of the file.
#[derive(Default)]
pub(super) struct Faces {
    corners: Vec<Corner>,
    /// For each face, where its corners end.
    ends: Vec<u32>,
    /// State changes, each before the face of that number.
    pub(super) changes: Vec<(u32, Change)>,
}

/// A statement that holds for the faces after it.
pub(super) enum Change {
    Object(String),
    Group(String),
    Material(String),
    Library(String),
    Smoothing(u32),
}

impl Faces {
    pub(super) fn len(&self) -> u32 {
        self.ends.len() as u32
    }

    /// Corners of a face; at least three.
    pub(super) fn face(&self, index: u32) -> &[Corner] {
        let start = if index == 0 { 0 } else { self.ends[index as usize - 1] };
        &self.corners[start as usize..self.ends[index as usize] as usize]
    }
}

/// What one piece of the file holds.
#[derive(Default)]
struct Chunk {
    /// Subtracted from positions.
    anchor: DVec3,
    positions: Vec<Vec3>,
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    faces: Faces,
    /// Corners and components whose index counts from the start of the chunk instead of that of the file.
    relative: Vec<(u32, u8)>,
    oddities: Oddities,
}

/// How often something was not as it should be.
#[derive(Default)]
struct Oddities {
    bad_numbers: usize,
    not_finite: usize,
    short_faces: usize,
    weights: usize,
    points: usize,
    lines: usize,
    others: BTreeMap<String, usize>,
}

/// Other statements are told apart up to this number of different ones.
const MAX_OTHERS: usize = 16;
const CHUNK_SIZE: usize = 1 << 20;
/// Statements whose arguments are names, which may have a `#` in them.
const NAMES: [&[u8]; 4] = [b"o", b"g", b"usemtl", b"mtllib"];

/// Parses the text of an OBJ file. Whatever it holds, this does not fail: what cannot be understood is reported.
///
/// Positions that are far from the origin are parsed once more with all their digits.
pub(super) fn parse(bytes: &[u8], report: &mut LoadReport) -> Data {
    let text = text::with_line_feeds(bytes);
    let pieces = text::chunks(&text, CHUNK_SIZE);
    let chunks = |anchor| pieces.par_iter().map(|text| Chunk::parse(text, anchor)).collect::<Vec<_>>();
    let first = chunks(DVec3::ZERO);
    for chunk in &first {
        chunk.oddities.report(report);
    }
    let mut data = put_together(first);
    data.anchor = Bounds::of(data.positions.iter().map(|p| p.as_dvec3())).anchor();
    if data.anchor != DVec3::ZERO {
        let again = chunks(data.anchor);
        data.positions = again.into_iter().flat_map(|chunk| chunk.positions).collect();
    }
    data
}

fn put_together(chunks: Vec<Chunk>) -> Data {
    let total = |count: fn(&Chunk) -> usize| chunks.iter().map(count).sum::<usize>();
    let colored = chunks.iter().any(|c| !c.colors.is_empty());
    let mut data = Data {
        positions: Vec::with_capacity(total(|c| c.positions.len())),
        uvs: Vec::with_capacity(total(|c| c.uvs.len())),
        normals: Vec::with_capacity(total(|c| c.normals.len())),
        ..Data::default()
    };
    for mut chunk in chunks {
        let base = [data.positions.len(), data.uvs.len(), data.normals.len()].map(|n| n as i32);
        for (corner, component) in &chunk.relative {
            let index = &mut chunk.faces.corners[*corner as usize][usize::from(*component)];
            let absolute = index.saturating_add(base[usize::from(*component)]);
            *index = if absolute < 0 { INVALID } else { absolute };
        }
        data.positions.append(&mut chunk.positions);
        data.uvs.append(&mut chunk.uvs);
        data.normals.append(&mut chunk.normals);
        if colored {
            data.colors.append(&mut chunk.colors);
            data.colors.resize(data.positions.len(), Vec4::ONE);
        }
        data.chunks.push(chunk.faces);
    }
    data
}

impl Chunk {
    fn parse(text: &[u8], anchor: DVec3) -> Self {
        let mut chunk = Self { anchor, ..Self::default() };
        for line in Lines::new(text) {
            let mut rest = &*line;
            let keyword = text::word(&mut rest);
            if keyword.is_some_and(|keyword| !NAMES.contains(&keyword)) {
                rest = text::before_hash(rest);
            }
            match keyword {
                Some(b"v") => chunk.position(rest),
                Some(b"vt") => {
                    let ([u, v], _) = chunk.numbers::<2>(rest);
                    // Upwards in OBJ files, downwards in the scene.
                    chunk.uvs.push(Vec2::new(u, 1.0 - v));
                }
                Some(b"vn") => {
                    let (normal, _) = chunk.numbers::<3>(rest);
                    chunk.normals.push(normal.into());
                }
                Some(b"f" | b"fo") => chunk.face(rest),
                None => {}
                Some(comment) if comment[0] == b'#' => {}
                Some(keyword) => chunk.statement(keyword, rest),
            }
        }
        chunk
    }

    /// Up to `N` numbers, the others 0, and how many there are.
    fn numbers<const N: usize>(&mut self, mut rest: &[u8]) -> ([f32; N], usize) {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            let Some(word) = text::word(&mut rest) else { return (values, i) };
            *value = self.number(word);
        }
        (values, N)
    }

    fn number(&mut self, word: &[u8]) -> f32 {
        let value = text::number(word).unwrap_or_else(|| {
            self.oddities.bad_numbers += 1;
            text::number_prefix(word).unwrap_or(0.0)
        });
        if value.is_finite() {
            return value;
        }
        self.oddities.not_finite += 1;
        0.0
    }

    fn position(&mut self, rest: &[u8]) {
        let (values, count) = self.numbers::<7>(rest);
        if count < 3 {
            self.oddities.bad_numbers += 1;
        }
        let [x, y, z, r, g, b, a] = values;
        let position = Vec3::new(x, y, z);
        let is_near = self.anchor == DVec3::ZERO;
        self.positions.push(if is_near { position } else { self.exact_position(rest, position) });
        match count {
            4 => self.oddities.weights += usize::from(r != 1.0),
            6 | 7 => {
                self.colors.resize(self.positions.len() - 1, Vec4::ONE);
                self.colors.push(Vec4::new(r, g, b, if count == 7 { a } else { 1.0 }));
            }
            _ => {}
        }
    }

    /// A position relative to the anchor, from its text or else from its rounded value.
    fn exact_position(&self, mut rest: &[u8], rounded: Vec3) -> Vec3 {
        let mut exact = rounded.as_dvec3();
        for axis in 0..3 {
            let word = text::word(&mut rest).and_then(|word| std::str::from_utf8(word).ok());
            let number = word.and_then(|word| word.parse::<f64>().ok());
            exact[axis] = number.filter(|n| n.is_finite()).unwrap_or(exact[axis]);
        }
        crate::origin::rounded(exact - self.anchor)
    }

    fn face(&mut self, mut rest: &[u8]) {
        let start = self.faces.corners.len();
        while let Some(word) = text::word(&mut rest) {
            self.corner(word);
        }
        if self.faces.corners.len() < start + 3 {
            self.faces.corners.truncate(start);
            while self.relative.last().is_some_and(|(corner, _)| *corner as usize >= start) {
                self.relative.pop();
            }
            self.oddities.short_faces += 1;
        } else {
            self.faces.ends.push(self.faces.corners.len() as u32);
        }
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, each counted from 1, or from −1 backwards.
    fn corner(&mut self, word: &[u8]) {
        let mut corner = [INVALID, MISSING, MISSING];
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for (component, field) in word.split(|c| *c == b'/').take(3).enumerate() {
            corner[component] = match index(field) {
                None if component > 0 && field.is_empty() => MISSING,
                None | Some(0) => INVALID,
                Some(index) if index > 0 => index - 1,
                Some(index) => {
                    self.relative.push((self.faces.corners.len() as u32, component as u8));
                    // Negative if it lies before this chunk; the start of the chunk is added later.
                    (counts[component] as i32).saturating_add(index)
                }
            };
        }
        self.faces.corners.push(corner);
    }

    fn statement(&mut self, keyword: &[u8], rest: &[u8]) {
        let change = match keyword {
            b"o" => Change::Object(text::name(text::before_comment(rest))),
            b"g" => Change::Group(text::name(text::before_comment(rest))),
            // Comments or parts of names: what there is decides.
            b"usemtl" => Change::Material(text::name(rest)),
            b"mtllib" => Change::Library(text::name(rest)),
            b"s" => Change::Smoothing(smoothing_group(rest)),
            b"p" => return self.oddities.points += 1,
            b"l" => return self.oddities.lines += 1,
            _ => {
                let name: String = String::from_utf8_lossy(keyword).chars().take(24).collect();
                let others = &mut self.oddities.others;
                if others.len() < MAX_OTHERS || others.contains_key(&name) {
                    *others.entry(name).or_default() += 1;
                }
                return;
            }
        };
        self.faces.changes.push((self.faces.len(), change));
    }
}

/// A whole number that fits, or `None`.
#[inline]
fn index(field: &[u8]) -> Option<i32> {
    let (negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, field),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0i32;
    for digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = value.checked_mul(10)?.checked_add(i32::from(digit - b'0'))?;
    }
    Some(if negative { -value } else { value })
}

fn smoothing_group(rest: &[u8]) -> u32 {
    let mut rest = rest;
    match text::word(&mut rest) {
        None | Some(b"off") => 0,
        Some(b"on") => 1,
        Some(word) => index(word).map_or(1, |i| i.unsigned_abs()),
    }
}

impl Oddities {
    fn report(&self, report: &mut LoadReport) {
        let mut note = |count: usize, add: fn(&mut LoadReport, String), message: &str| {
            if count > 0 {
                add(report, message.to_owned());
                if let Some(known) = report.notes.iter_mut().find(|n| n.message == message) {
                    known.count += count - 1;
                }
            }
        };
        note(
            self.bad_numbers,
            LoadReport::repaired,
            "a number is missing or malformed; its readable start, or 0, is used",
        );
        note(self.not_finite, LoadReport::repaired, "a number is not finite; 0 is used");
        note(self.short_faces, LoadReport::ignored, "a face has fewer than three corners");
        note(self.weights, LoadReport::ignored, "a position has a rational weight");
        note(self.points, LoadReport::ignored, "points are not drawn");
        note(self.lines, LoadReport::ignored, "lines are not drawn");
        for (name, count) in &self.others {
            note(*count, LoadReport::ignored, &format!("the statement `{name}` is not known"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces(data: &Data) -> Vec<Vec<Corner>> {
        data.chunks.iter().flat_map(|c| (0..c.len()).map(|i| c.face(i).to_vec())).collect()
    }

    #[test]
    fn every_face_syntax() {
        let mut report = LoadReport::default();
        let data = parse(
            b"f 1 2 3\nf 1/4 2/5 3/6\nf 1//7 2//8 3//9\nf 1/4/7 2/5/8 3/6/9 4/ # x\nf 0 x 99999999999\nf 1 2",
            &mut report,
        );
        assert_eq!(faces(&data)[0], [[0, MISSING, MISSING], [1, MISSING, MISSING], [2, MISSING, MISSING]]);
        assert_eq!(faces(&data)[1], [[0, 3, MISSING], [1, 4, MISSING], [2, 5, MISSING]]);
        assert_eq!(faces(&data)[2], [[0, MISSING, 6], [1, MISSING, 7], [2, MISSING, 8]]);
        assert_eq!(faces(&data)[3], [[0, 3, 6], [1, 4, 7], [2, 5, 8], [3, MISSING, MISSING]]);
        assert_eq!(faces(&data)[4], [[INVALID, MISSING, MISSING]; 3]);
        assert_eq!(faces(&data).len(), 5);
        assert_eq!(report.notes.len(), 1);
    }

    #[test]
    fn negative_indices_reach_across_chunks() {
        let mut texts = vec![
            "v 1 0 0\nv 2 0 0\nvt 0 0\n",
            "v 3 0 0\nf -1/-1 -2/-1 -3/-1\nf -4 1 1\nv 4 0 0\n",
            "f -1 -2 -4\n",
        ];
        let whole = texts.concat();
        let apart = put_together(texts.drain(..).map(|t| Chunk::parse(t.as_bytes(), DVec3::ZERO)).collect());
        let together = parse(whole.as_bytes(), &mut LoadReport::default());
        for data in [apart, together] {
            let faces = faces(&data);
            assert_eq!(faces[0], [[2, 0, MISSING], [1, 0, MISSING], [0, 0, MISSING]]);
            assert_eq!(faces[1][0], [INVALID, MISSING, MISSING]);
            assert_eq!(faces[2].iter().map(|c| c[0]).collect::<Vec<_>>(), [3, 2, 0]);
            assert_eq!(data.positions.len(), 4);
        }
    }

    #[test]
    fn comments_end_statements() {
        let mut report = LoadReport::default();
        let data = parse(
            b"v 1 2 3 # vertex 12 of 99\nv 4 5 6#x\nv 7 8 9 1 # 2 3\nvt 0 1 # 2\nvn 0 0 1#\ng a # b\nf 1 2 3 # 4\ns off# x\nf 1 2 3#4\n#f 1\n",
            &mut report,
        );
        assert_eq!(data.positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]].map(Vec3::from));
        assert!(data.colors.is_empty() && report.notes.is_empty(), "{:?}", report.notes);
        assert_eq!((data.normals[0], data.uvs[0]), (Vec3::Z, Vec2::ZERO));
        assert_eq!(faces(&data).iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
        let changes = &data.chunks[0].changes;
        assert!(matches!(&changes[0].1, Change::Group(name) if name == "a"));
        assert!(matches!(changes[1].1, Change::Smoothing(0)));
    }

    #[test]
    fn colours_and_weights() {
        let mut report = LoadReport::default();
        let data = parse(
            b"v 0 0 0\nv 1 2 3 0.25 0.5 0.75\nv 1 2 3 0.5\nv 1 1 1 1 0 0 0.5\nv nan inf 1e99",
            &mut report,
        );
        let colors = [[1.0; 4], [0.25, 0.5, 0.75, 1.0], [1.0; 4], [1.0, 0.0, 0.0, 0.5], [1.0; 4]];
        assert_eq!(data.colors, colors.map(Vec4::from));
        assert_eq!(data.positions[4], Vec3::ZERO);
        let counts: Vec<_> = report.notes.iter().map(|n| n.count).collect();
        assert_eq!(counts, [3, 1]);
    }
}
