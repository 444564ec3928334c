//! Worley noise: distances to points that are scattered in space, one in each cell of the lattice.

use inlining::inline_all;
use wgsl_rs::wgsl;

#[wgsl]
#[inline_all]
pub mod voronoi {
    use crate::noise::*;
    use crate::random::*;
    use wgsl_rs::std::*;

    /// The point nearest to a place, and how much further the next one is.
    #[derive(Clone, Copy, Debug)]
    pub struct VoronoiCell {
        /// Distance to the nearest point.
        pub nearest: f32,
        /// Distance to the second nearest point.
        pub second: f32,
        /// Hash of the nearest point.
        pub hash: u32,
    }

    /// The cell of the Voronoi diagram that `p` is in.
    ///
    /// - `randomness`: 0 puts the points into the middle of lattice cells, 1 anywhere in them.
    ///
    /// Source: Worley, "A Cellular Texture Basis Function", SIGGRAPH 1996.
    pub fn voronoi_cell(p: Vec3f, randomness: f32, seed: u32) -> VoronoiCell {
        let x = lattice_floor(p.x);
        let y = lattice_floor(p.y);
        let z = lattice_floor(p.z);
        let inside = vec3f(p.x - floor(p.x), p.y - floor(p.y), p.z - floor(p.z));
        // Squares of distances.
        let mut cell = VoronoiCell { nearest: 100.0, second: 100.0, hash: 0u32 };
        let mut i = 0;
        while i < 27 {
            let dx = i % 3 - 1;
            let dy = (i / 3) % 3 - 1;
            let dz = i / 9 - 1;
            let h = lattice_hash(x + dx, y + dy, z + dz, seed);
            let jitter = hash_vector(h) - vec3f(0.5, 0.5, 0.5);
            let center = vec3f(f32(dx) + 0.5, f32(dy) + 0.5, f32(dz) + 0.5);
            let d = center + jitter * randomness - inside;
            let distance2 = dot(d, d);
            if distance2 < cell.nearest {
                cell.second = cell.nearest;
                cell.nearest = distance2;
                cell.hash = h;
            } else {
                cell.second = min(cell.second, distance2);
            }
            i += 1;
        }
        cell.nearest = sqrt(cell.nearest);
        cell.second = sqrt(cell.second);
        cell
    }

    /// Three uniform numbers in `[0, 1)` of a hash.
    pub fn hash_vector(hash: u32) -> Vec3f {
        let y = pcg_hash(hash);
        vec3f(unit_float(hash), unit_float(y), unit_float(pcg_hash(y)))
    }
}

#[cfg(test)]
mod tests {
    use super::voronoi::*;
    use wgsl_rs::std::*;

    #[test]
    fn without_randomness_cells_are_cubes() {
        let cell = voronoi_cell(vec3f(3.5, -1.5, 0.5), 0.0, 1);
        assert!(cell.nearest < 1e-6 && (cell.second - 1.0).abs() < 1e-5, "{cell:?}");
        let face = voronoi_cell(vec3f(4.0, -1.5, 0.5), 0.0, 1);
        assert!((face.second - face.nearest).abs() < 1e-5 && (face.nearest - 0.5).abs() < 1e-5);
    }

    #[test]
    fn the_second_is_never_nearer() {
        for i in 0..5_000 {
            let p = vec3f(i as f32 * 0.137, i as f32 * -0.071, i as f32 * 0.029);
            let cell = voronoi_cell(p, 1.0, 5);
            assert!(cell.nearest <= cell.second && cell.nearest < 1.5, "{cell:?}");
        }
    }
}
