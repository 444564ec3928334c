//! The library's side of `cargo xtask bench python`: traces the rays of a folder whenever a line comes in, and answers with
//! the seconds it took and the number of hits.
//!
//! The folder has `vertices`, `origins` and `directions` (f32 xyz each) and `triangles` (u32 ijk each), little-endian. Lines
//! are `arrays` and `normals` ([`RayQueries::intersect`] without and with them) and `streams` (the acceleration structure alone:
//! rays and hits are there, nothing is allocated or converted).

use accel::{Blas, Coherence, Geometry, Hit, Instance, MISS, Opaque, Quality, Ray, Tlas};
use alhazen::{Control, Mesh, RayQueries, Rays, Scene, SceneTables, Shape, TriangleMesh};
use rayon::prelude::*;
use std::error::Error;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: alhazen::HugePages = alhazen::HugePages;

/// Rows of three words.
fn rows<T>(path: &Path, convert: fn([u8; 4]) -> T) -> std::io::Result<Vec<[T; 3]>> {
    let bytes = std::fs::read(path)?;
    let words = bytes.as_chunks::<12>().0.iter();
    Ok(words.map(|row| [0, 4, 8].map(|i| convert([row[i], row[i + 1], row[i + 2], row[i + 3]]))).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name the folder with the rays")?);
    let vertices = rows(&folder.join("vertices"), f32::from_le_bytes)?;
    let triangles = rows(&folder.join("triangles"), u32::from_le_bytes)?;
    let origins = rows(&folder.join("origins"), f32::from_le_bytes)?;
    let directions = rows(&folder.join("directions"), f32::from_le_bytes)?;

    let geometry = Geometry { positions: &vertices, indices: &triangles, first_id: 0 };
    let blas = Blas::triangles(&[geometry], Quality::Balanced);
    let tlas = Tlas::build(&[Instance::identity(0)], vec![Arc::new(blas)]);
    let stream: Vec<Ray> = origins.iter().zip(&directions).map(|(o, d)| Ray::new(*o, *d)).collect();
    let mut stream_hits = vec![MISS; stream.len()];

    let mut scene = Scene::default();
    let positions = vertices.iter().map(|v| glam::Vec3::from(*v)).collect();
    let mesh = TriangleMesh { positions, indices: triangles, ..TriangleMesh::default() };
    scene.meshes.push(Mesh::single("mesh", Shape::Triangles(mesh), 0));
    scene.instances.push(alhazen::Instance::new("mesh", 0, glam::Affine3A::IDENTITY));
    let queries = RayQueries::new(SceneTables::build(&scene), None)?;
    let rays = Rays::new(&origins, &directions)?;

    println!("ready");
    for line in std::io::stdin().lock().lines() {
        let start = Instant::now();
        let (seconds, hits) = match line?.as_str() {
            "streams" => {
                trace(&tlas, &stream, &mut stream_hits);
                (start.elapsed(), stream_hits.iter().filter(|h| !h.is_miss()).count())
            }
            what => {
                let hits = queries.intersect(&rays, what == "normals", &Control::new());
                (start.elapsed(), hits.primitive.iter().filter(|p| **p >= 0).count())
            }
        };
        println!("{} {hits}", seconds.as_secs_f64());
    }
    Ok(())
}

/// All rays on all cores.
fn trace(tlas: &Tlas, rays: &[Ray], hits: &mut [Hit]) {
    let pieces = rays.par_chunks(4096).zip(hits.par_chunks_mut(4096));
    pieces.for_each(|(rays, hits)| tlas.closest_stream(rays, hits, &Opaque, Coherence::Incoherent));
}
