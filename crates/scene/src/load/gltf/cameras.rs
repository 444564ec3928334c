//! Cameras: a node with a camera looks along its −Z axis, +Y up.

use super::document::Document;
use super::json;
use super::nodes::Hierarchy;
use crate::{Camera, LoadError, LoadReport, Projection};

impl Document<'_> {
    /// All cameras of the scene in the order of their nodes.
    ///
    /// # Errors
    /// A camera that does not exist.
    pub fn cameras(&self, hierarchy: &Hierarchy, report: &mut LoadReport) -> Result<Vec<Camera>, LoadError> {
        let mut nodes: Vec<_> = hierarchy.placed.iter().map(|p| p.node).collect();
        nodes.sort_unstable();
        let mut cameras = Vec::new();
        for node in nodes {
            let Some(index) = self.json.nodes[node as usize].camera else { continue };
            let source = self.get(&self.json.cameras, index, "camera")?;
            let world = &hierarchy.worlds[node as usize];
            let eye = world.translation.as_vec3();
            let forward = -world.matrix3.z_axis.as_vec3().normalize_or_zero();
            let up = world.matrix3.y_axis.as_vec3().normalize_or_zero();
            let sound = eye.is_finite() && forward.cross(up).length() > 1e-6;
            match projection(source).filter(|_| sound) {
                Some((projection, aspect)) => cameras.push(Camera {
                    up,
                    projection,
                    aspect,
                    ..Camera::perspective(
                        self.node_name(node, source.name.as_deref()),
                        eye,
                        eye + forward,
                        1.0,
                    )
                }),
                None => report.ignored("a camera has impossible values and is left out"),
            }
        }
        if !cameras.is_empty() {
            report.info("near and far planes of cameras are not used: nothing is clipped");
        }
        Ok(cameras)
    }
}

/// The projection and width divided by height.
fn projection(camera: &json::Camera) -> Option<(Projection, Option<f32>)> {
    let positive = |value: &f32| value.is_finite() && *value > 0.0;
    match camera.kind.as_str() {
        "perspective" => {
            let lens = camera.perspective.as_ref()?;
            let fov_y = lens.yfov.filter(positive).filter(|f| *f < std::f32::consts::PI)?;
            Some((Projection::Perspective { fov_y }, lens.aspect_ratio.filter(positive)))
        }
        "orthographic" => {
            let lens = camera.orthographic.as_ref()?;
            // Negative magnifications mirror the picture; nobody means that.
            let (x, y) = (lens.xmag?.abs(), lens.ymag?.abs());
            let aspect = Some(x / y).filter(positive);
            Some(y).filter(positive).map(|y| (Projection::Orthographic { height: 2.0 * y }, aspect))
        }
        _ => None,
    }
}
