//! The pictures of the page's test, made on this machine: `pictures FOLDER` (see `cargo xtask web --test`).

use std::error::Error;
use std::path::PathBuf;
use std::time::Duration;
use web::{Session, scenes};

/// Columns, rows and samples, as `page/test.js` has them.
const SIZE: (u32, u32, u32) = (64, 36, 2);
/// A model that refers to another file, as `page/test.js` drops it.
const DROPPED: [(&str, &str); 2] = [
    ("model/triangle.obj", "mtllib triangle.mtl\nusemtl red\nv -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n"),
    ("model/triangle.mtl", "newmtl red\nKd 0.8 0.1 0.1\n"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("give a folder")?);
    let mut session = Session::new()?;
    session.resize(SIZE.0, SIZE.1)?;
    for (name, _) in scenes() {
        session.open(name)?;
        std::fs::write(folder.join(format!("{name}.exr")), picture(&mut session)?)?;
    }
    for (name, text) in DROPPED {
        session.give(name, text.as_bytes().to_vec());
    }
    session.open(DROPPED[0].0)?;
    std::fs::write(folder.join("dropped.exr"), picture(&mut session)?)?;
    Ok(())
}

fn picture(session: &mut Session) -> Result<Vec<u8>, Box<dyn Error>> {
    while !session.render(SIZE.2, Duration::from_millis(100))?.is_done(SIZE.2) {}
    Ok(session.exr()?)
}
