//! Cameras: a node with a camera looks along its −Z axis, +Y up.

use super::document::Document;
use super::json;
use super::nodes::{Carried, Hierarchy};
use crate::animation::{AnimatedCamera, view_of};
use crate::{Camera, LoadError, LoadReport, Projection};

impl Document<'_> {
    /// All cameras of the scene in the order of their nodes, and what carries each, with its number in the file.
    ///
    /// # Errors
    /// A camera that does not exist.
    pub fn cameras(
        &self,
        hierarchy: &Hierarchy,
        report: &mut LoadReport,
    ) -> Result<Carried<Camera, AnimatedCamera>, LoadError> {
        let mut nodes: Vec<_> = hierarchy.placed.iter().map(|p| p.node).collect();
        nodes.sort_unstable();
        let (mut cameras, mut carriers) = (Vec::new(), Vec::new());
        for node in nodes {
            let Some(index) = self.json.nodes[node as usize].camera else { continue };
            let source = self.get(&self.json.cameras, index, "camera")?;
            match projection(source).zip(view_of(&hierarchy.worlds[node as usize])) {
                Some(((projection, aspect), (eye, forward, up))) => {
                    let camera = cameras.len() as u32;
                    carriers.push((index, AnimatedCamera { camera, node, projection }));
                    let name = self.node_name(node, source.name.as_deref());
                    let size = size_of::<(Camera, AnimatedCamera)>() + name.len();
                    self.options.budget().take(size as u64, "cameras")?;
                    let view = Camera::perspective(name, eye, eye + forward, 1.0);
                    cameras.push(Camera { up, projection, aspect, ..view });
                }
                None => report.ignored("a camera has impossible values and is left out"),
            }
        }
        if !cameras.is_empty() {
            report.info("near and far planes of cameras are not used: nothing is clipped");
        }
        Ok(Carried { objects: cameras, carriers })
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
