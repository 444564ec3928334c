//! Where the photons of a pass are: a hash grid of cells as large as the disc that is gathered.

use super::{Photon, PhotonLights};
use optics::photons::{photon_bucket, photon_cell};
use optics::vector::dot;
use optics::{Vec3f, vec3f};
use std::sync::Arc;

/// The photons of a pass, by cell.
///
/// Their order within a cell is that in which they were emitted, so sums over them have the same bits whoever made them.
pub(crate) struct PhotonMap {
    photons: Vec<Photon>,
    /// The photons of bucket `b` are those from `first[b]` to `first[b + 1]`.
    first: Vec<u32>,
    /// 1 / edge of a cell, which is the disc's diameter.
    per_metre: f32,
    radius2: f32,
    /// Photons that the pass has emitted.
    count: u32,
    lights: Arc<PhotonLights>,
}

impl PhotonMap {
    /// Sorts photons by cell. `radius2`: of the discs, m²; `count`: of photons emitted.
    pub fn new(photons: Vec<Photon>, radius2: f32, count: u32, lights: Arc<PhotonLights>) -> Self {
        let per_metre = 0.5 / radius2.sqrt();
        let buckets = (photons.len() as u32).next_power_of_two().max(2);
        let bucket = |p: &Photon| photon_bucket(photon_cell(p.position, per_metre), buckets) as usize;
        let mut first = vec![0u32; buckets as usize + 1];
        for photon in &photons {
            first[bucket(photon) + 1] += 1;
        }
        for b in 1..first.len() {
            first[b] += first[b - 1];
        }
        let mut order = vec![0u32; photons.len()];
        let mut next = first.clone();
        for (index, photon) in photons.iter().enumerate() {
            let place = &mut next[bucket(photon)];
            order[*place as usize] = index as u32;
            *place += 1;
        }
        let photons = order.iter().map(|i| photons[*i as usize]).collect();
        Self { photons, first, per_metre, radius2, count, lights }
    }

    /// Square of the radius within which photons count, m².
    pub fn radius2(&self) -> f32 {
        self.radius2
    }

    /// Photons emitted.
    pub fn count(&self) -> f32 {
        self.count as f32
    }

    /// The lights that they come from.
    pub fn lights(&self) -> &PhotonLights {
        &self.lights
    }

    /// Calls `found` with each photon that is nearer to `p` than the radius, and the square of its distance.
    pub fn for_each_near(&self, p: Vec3f, mut found: impl FnMut(&Photon, f32)) {
        if self.photons.is_empty() {
            return;
        }
        let buckets = self.first.len() as u32 - 1;
        // A disc as large as a cell reaches into the neighbour on the nearer side of each axis.
        let half = vec3f(0.5, 0.5, 0.5) * (1.0 / self.per_metre);
        let low = photon_cell(p - half, self.per_metre);
        for corner in 0..8u32 {
            let step = |bit: u32| ((corner >> bit) & 1) as f32;
            let cell = low + vec3f(step(0), step(1), step(2));
            let bucket = photon_bucket(cell, buckets) as usize;
            for photon in &self.photons[self.first[bucket] as usize..self.first[bucket + 1] as usize] {
                let away = photon.position - p;
                let distance2 = dot(away, away);
                // Cells may share a bucket.
                if distance2 < self.radius2 && photon_cell(photon.position, self.per_metre) == cell {
                    found(photon, distance2);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use optics::random::{pcg_hash, unit_float};

    #[test]
    fn all_photons_in_reach_are_found_once() {
        let number = |i: u32| unit_float(pcg_hash(i)) * 4.0 - 2.0;
        let point = |i: u32| vec3f(number(3 * i), number(3 * i + 1), number(3 * i + 2));
        let zero = vec3f(0.0, 0.0, 0.0);
        let photon = |i| Photon {
            position: point(i),
            wi: zero,
            flux: vec3f(i as f32, 0.0, 0.0),
            normal: zero,
            density: 0.0,
            segments: 1,
        };
        let photons: Vec<_> = (0..3000).map(photon).collect();
        let map = PhotonMap::new(photons.clone(), 0.09, 3000, Arc::default());
        for i in 0..200 {
            let p = point(10_000 + i);
            let mut found = Vec::new();
            map.for_each_near(p, |photon, _| found.push(photon.flux.x as usize));
            found.sort_unstable();
            let near = |q: &Photon| dot(q.position - p, q.position - p) < 0.09;
            let expected: Vec<_> = (0..3000).filter(|i| near(&photons[*i])).collect();
            assert_eq!(found, expected);
        }
    }
}
