//! Where streams write their closest hits: arrays of hits, or structures of arrays.

use crate::ray::{Hit, MISS};

/// Sixteen hits as a structure of arrays, see [`Hit`]; as Embree's `RTCHit16`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Hit16 {
    /// See [`Hit::t`].
    pub t: [f32; 16],
    /// See [`Hit::u`].
    pub u: [f32; 16],
    /// See [`Hit::v`].
    pub v: [f32; 16],
    /// See [`Hit::primitive`].
    pub primitive: [u32; 16],
    /// See [`Hit::instance`].
    pub instance: [u32; 16],
}

impl Hit16 {
    /// Sixteen misses.
    pub const MISSES: Hit16 = Hit16 {
        t: [MISS.t; 16],
        u: [MISS.u; 16],
        v: [MISS.v; 16],
        primitive: [MISS.primitive; 16],
        instance: [MISS.instance; 16],
    };

    /// One hit.
    ///
    /// # Panics
    ///
    /// If `lane` is not below 16.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            instance: self.instance[lane],
        }
    }
}

/// The output of a stream query for closest hits.
pub trait HitSink {
    /// Number of hits that it holds.
    fn len(&self) -> usize;

    /// Writes a hit. May panic if `index` is out of range.
    fn set(&mut self, index: usize, hit: &Hit);

    /// Writes sixteen hits from `first` on. Hits beyond the end are dropped.
    #[inline(always)]
    fn set16(&mut self, first: usize, hits: &Hit16) {
        for lane in 0..self.len().saturating_sub(first).min(16) {
            self.set(first + lane, &hits.get(lane));
        }
    }

    /// Whether it holds no hits.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sets all hits to [`MISS`].
    fn clear(&mut self) {
        (0..self.len()).for_each(|index| self.set(index, &MISS));
    }
}

impl HitSink for [Hit] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[Hit]>::len(self)
    }

    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit) {
        self[index] = *hit;
    }
}

/// Hits as a structure of arrays, see [`Hit`].
#[derive(Debug)]
pub struct HitColumns<'a> {
    t: &'a mut [f32],
    uv: [&'a mut [f32]; 2],
    primitive: &'a mut [u32],
    instance: &'a mut [u32],
}

impl<'a> HitColumns<'a> {
    /// Hits are written to these columns.
    ///
    /// # Panics
    ///
    /// If lengths differ.
    pub fn new(
        t: &'a mut [f32],
        uv: [&'a mut [f32]; 2],
        primitive: &'a mut [u32],
        instance: &'a mut [u32],
    ) -> Self {
        let lengths = [uv[0].len(), uv[1].len(), primitive.len(), instance.len()];
        assert_eq!(lengths, [t.len(); 4], "columns of one length");
        HitColumns { t, uv, primitive, instance }
    }
}

impl HitSink for HitColumns<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.t.len()
    }

    #[inline(always)]
    fn set(&mut self, index: usize, hit: &Hit) {
        assert!(index < self.t.len());
        // SAFETY: all columns have the length of the first, see `HitColumns::new`.
        unsafe {
            *self.t.get_unchecked_mut(index) = hit.t;
            *self.uv[0].get_unchecked_mut(index) = hit.u;
            *self.uv[1].get_unchecked_mut(index) = hit.v;
            *self.primitive.get_unchecked_mut(index) = hit.primitive;
            *self.instance.get_unchecked_mut(index) = hit.instance;
        }
    }

    #[inline(always)]
    fn set16(&mut self, first: usize, hits: &Hit16) {
        write16(self.t, first, &hits.t);
        write16(self.uv[0], first, &hits.u);
        write16(self.uv[1], first, &hits.v);
        write16(self.primitive, first, &hits.primitive);
        write16(self.instance, first, &hits.instance);
    }

    fn clear(&mut self) {
        self.t.fill(MISS.t);
        self.uv.iter_mut().for_each(|column| column.fill(0.0));
        self.primitive.fill(MISS.primitive);
        self.instance.fill(MISS.instance);
    }
}

/// Writes sixteen values to a column. Values beyond the end are dropped.
#[inline(always)]
fn write16<T: Copy>(column: &mut [T], first: usize, numbers: &[T; 16]) {
    let rest = column.get_mut(first..).unwrap_or_default();
    match rest.first_chunk_mut() {
        Some(all) => *all = *numbers,
        None => rest.copy_from_slice(&numbers[..rest.len()]),
    }
}
