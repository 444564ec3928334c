//! Lists of poses, as JSON.

use crate::error::SensorError;
use alhazen::Camera;
use glam::DVec3;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A calibrated camera and where it goes.
///
/// As JSON: `{"width": 640, "height": 480, "matrix": [[fx, s, cx], [0, fy, cy], [0, 0, 1]], "distortion": [k1, k2, p1, p2, k3],
/// "fisheye": false, "poses": [[[…], …], …], "moves": {"car": [[[…], …], …]}}`. Matrices are lists of rows.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Poses {
    /// Width of the pictures in pixels.
    pub width: u32,
    /// Height of the pictures in pixels.
    pub height: u32,
    /// Intrinsics as OpenCV has them, in pixels; pixel centres are at whole numbers.
    pub matrix: [[f64; 3]; 3],
    /// Coefficients of the lens as OpenCV orders them; none are a pinhole.
    #[serde(default)]
    pub distortion: Vec<f64>,
    /// Whether they are those of OpenCV's fisheye.
    #[serde(default)]
    pub fisheye: bool,
    /// Camera to world for each picture, with OpenCV's camera axes: x right, y down, z into the picture. Metres.
    pub poses: Vec<[[f64; 4]; 4]>,
    /// Object to world of instances that move, by name, one for each pose.
    #[serde(default)]
    pub moves: BTreeMap<String, Vec<[[f64; 4]; 4]>>,
}

impl Poses {
    /// Reads a list of poses.
    ///
    /// # Errors
    /// [`SensorError::Read`] or [`SensorError::Malformed`].
    pub fn read(path: &Path) -> Result<Self, SensorError> {
        let text = std::fs::read_to_string(path);
        let text = text.map_err(|source| SensorError::Read { path: path.to_owned(), source })?;
        let malformed = |reason| SensorError::Malformed { path: path.to_owned(), reason };
        let poses: Self = serde_json::from_str(&text).map_err(|e| malformed(e.to_string()))?;
        if poses.poses.is_empty() {
            return Err(malformed("there are no poses".into()));
        }
        if let Some((name, moves)) = poses.moves.iter().find(|(_, m)| m.len() != poses.poses.len()) {
            let (found, expected) = (moves.len(), poses.poses.len());
            return Err(malformed(format!("moves of `{name}`: {found} matrices for {expected} poses")));
        }
        let of_moves = poses.moves.values().flatten();
        if let Some(m) = poses.poses.iter().chain(of_moves).find(|m| m[3] != [0.0, 0.0, 0.0, 1.0]) {
            return Err(malformed(format!("the last row of a matrix is {:?} instead of 0, 0, 0, 1", m[3])));
        }
        Ok(poses)
    }

    /// Makes all poses relative to `origin`, as a scene with that [`alhazen::Scene::origin`] is.
    pub fn subtract(&mut self, origin: DVec3) {
        for pose in self.poses.iter_mut().chain(self.moves.values_mut().flatten()) {
            for (row, offset) in pose.iter_mut().zip(origin.to_array()) {
                row[3] -= offset;
            }
        }
    }

    /// The camera at each pose.
    ///
    /// # Errors
    /// [`SensorError::Camera`].
    pub fn cameras(&self) -> Result<Vec<Camera>, SensorError> {
        let camera = |(pose, &[x, y, z, _]): (usize, &[[f64; 4]; 4])| {
            let camera = Camera::from_opencv(self.matrix, [x, y, z], self.width, self.height)
                .and_then(|camera| camera.with_opencv_distortion(&self.distortion, self.fisheye));
            camera.map_err(|source| SensorError::Camera { pose, source })
        };
        self.poses.iter().enumerate().map(camera).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: &str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";

    fn read(text: &str) -> Result<Poses, SensorError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("poses.json");
        std::fs::write(&path, text).expect("written");
        Poses::read(&path)
    }

    #[test]
    fn lists_are_read_and_mistakes_named() {
        let matrix = "\"width\": 4, \"height\": 3, \"matrix\": [[4,0,2],[0,4,1],[0,0,1]]";
        let good = read(&format!("{{{matrix}, \"poses\": [{UNIT}, {UNIT}]}}")).expect("good");
        assert_eq!((good.poses.len(), good.cameras().expect("cameras").len()), (2, 2));
        for (text, reason) in [
            (format!("{{{matrix}, \"poses\": []}}"), "no poses"),
            (
                format!("{{{matrix}, \"poses\": [{UNIT}], \"moves\": {{\"car\": []}}}}"),
                "`car`: 0 matrices for 1",
            ),
            (format!("{{{matrix}, \"poses\": [{}]}}", UNIT.replace("0,0,0,1", "0,0,1,1")), "last row"),
            (format!("{{{matrix}, \"pose\": [{UNIT}]}}"), "unknown field `pose`"),
            ("{".into(), "EOF"),
        ] {
            let error = read(&text).expect_err("a mistake").to_string();
            assert!(error.contains("poses.json") && error.contains(reason), "{error}");
        }
        let lens = read(&format!(
            "{{{matrix}, \"distortion\": [0.1, 0, 0, 0], \"fisheye\": true, \"poses\": [{UNIT}]}}"
        ));
        let cameras = lens.expect("read").cameras().expect("cameras");
        assert!(matches!(cameras[0].distortion, Some(alhazen::Distortion::Fisheye { .. })));
        let wrong = read(&format!("{{{matrix}, \"distortion\": [0.1], \"poses\": [{UNIT}]}}")).expect("read");
        assert!(matches!(wrong.cameras(), Err(SensorError::Camera { pose: 0, .. })));
        let mirrored = UNIT.replace("[1,0,0,0]", "[-1,0,0,0]");
        let poses = read(&format!("{{{matrix}, \"poses\": [{UNIT}, {mirrored}]}}")).expect("read");
        assert!(matches!(poses.cameras(), Err(SensorError::Camera { pose: 1, .. })));
    }
}
