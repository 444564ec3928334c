//! `KHR_draco_mesh_compression`: a primitive's triangles and attributes in one compressed buffer view.

use super::accessor::{Integers, Pick};
use super::document::Document;
use super::json::{Kind, Primitive};
use crate::LoadError;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute};

/// A decompressed primitive.
pub(super) struct Decompressed<'p> {
    mesh: Mesh,
    primitive: &'p Primitive,
}

impl Document<'_> {
    /// Decompresses a primitive; `None` if it is not compressed, or has an uncompressed copy.
    ///
    /// # Errors
    /// Broken data, or more of it than the accessors declare.
    pub fn decompressed<'p>(
        &self,
        primitive: &'p Primitive,
        position: u32,
        object: &str,
    ) -> Result<Option<Decompressed<'p>>, LoadError> {
        let Some(draco) = &primitive.extensions.draco else { return Ok(None) };
        if self.has_data(position) {
            return Ok(None);
        }
        let points = self.accessor_count(position)?;
        let indices = primitive.indices.map_or(Ok(points), |indices| self.accessor_count(indices))?;
        let (bytes, _) = self.view(draco.buffer_view)?;
        // While it works, the decoder holds the attributes about twice.
        let attributes = draco.attributes.len().max(1) as u64;
        self.reserve::<[f32; 8]>(points.saturating_mul(attributes))?;
        self.reserve::<[u32; 4]>(indices)?;
        // Seams may split points beyond the declared number.
        let limits = DecodeLimits::default()
            .with_max_points(points.saturating_mul(2).saturating_add(64))
            .with_max_faces(indices / 3)
            .with_max_decoded_bytes(
                points.saturating_mul(attributes).saturating_mul(64).saturating_add(4096),
            );
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        let mut mesh = Mesh::new();
        MeshDecoder::new()
            .decode(&mut buffer, &mut mesh)
            .map_err(|error| self.malformed(object, format!("KHR_draco_mesh_compression: {error}")))?;
        Ok(Some(Decompressed { mesh, primitive }))
    }
}

impl Decompressed<'_> {
    /// Number of vertices.
    pub fn vertices(&self) -> u64 {
        self.mesh.num_points() as u64
    }

    /// The triangles; every index is less than the number of vertices.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let count = self.mesh.num_points() as u32;
        let triangles = self.mesh.faces().iter().map(|face| face.map(|point| point.0));
        triangles.filter(move |triangle| triangle.iter().all(|i| *i < count))
    }

    /// The values of an attribute for the vertices picked; `None` if it is not among the compressed ones.
    pub fn read<const N: usize, T: From<[f32; N]>>(
        &self,
        document: &Document<'_>,
        name: &str,
        integers: Integers,
        pick: Pick<'_>,
    ) -> Option<Vec<T>> {
        let id = *self.primitive.extensions.draco.as_ref()?.attributes.get(name)?;
        let attribute = self.mesh.attribute_by_unique_id(id)?;
        let accessor =
            self.primitive.attributes.get(name).and_then(|a| document.json.accessors.get(*a as usize));
        let normalized = integers == Integers::Normalized || accessor.is_some_and(|a| a.normalized);
        let scale = if normalized { fraction(attribute) } else { 1.0 };
        let numbers = attribute.read_f32s(self.mesh.num_points(), N);
        let (elements, _) = numbers.as_chunks::<N>();
        let element =
            |element: &[f32; N]| T::from(element.map(|v| (v * scale).max(if normalized { -1.0 } else { v })));
        Some(match pick {
            Pick::All => elements.iter().map(element).collect(),
            Pick::Only(picked) => picked.iter().map(|i| element(&elements[*i as usize])).collect(),
        })
    }

    /// How many numbers an element of the attribute has; `None` if it is not among the compressed ones.
    pub fn kind(&self, name: &str) -> Option<Kind> {
        let id = *self.primitive.extensions.draco.as_ref()?.attributes.get(name)?;
        match self.mesh.attribute_by_unique_id(id)?.num_components() {
            1 => Some(Kind::Scalar),
            2 => Some(Kind::Vec2),
            3 => Some(Kind::Vec3),
            4 => Some(Kind::Vec4),
            _ => Some(Kind::Unknown),
        }
    }
}

/// What turns the attribute's integers into fractions.
fn fraction(attribute: &PointAttribute) -> f32 {
    match attribute.data_type() {
        DataType::Int8 => 1.0 / 127.0,
        DataType::Uint8 => 1.0 / 255.0,
        DataType::Int16 => 1.0 / 32767.0,
        DataType::Uint16 => 1.0 / 65535.0,
        _ => 1.0,
    }
}
