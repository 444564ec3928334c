//! Photometric lights (`EXT_lights_ies`): points with a lamp's profile, which is aimed along their node's −Z axis.

use super::document::Document;
use super::json;
use super::motion::Motion;
use super::nodes::{Carried, Hierarchy};
use super::uri::{self, Target};
use crate::animation::{AnimatedLight, Punctual, PunctualKind};
use crate::load::ies;
use crate::photometry::LightProfile;
use crate::report::without_quotes;
use crate::{Light, LoadError, LoadReport, Photometry};
use glam::{DAffine3, Vec3};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

/// Stands for "no light of `KHR_lights_punctual`", which animations could name.
const NO_NUMBER: u32 = u32::MAX;

impl Document<'_> {
    /// Adds all photometric lights of the scene, and what carries each. Lights that are shown later only are there without strength.
    ///
    /// # Errors
    /// A profile that does not exist, cannot be read or is damaged. Lenient loading leaves its lights out instead.
    pub fn photometric_lights(
        &self,
        hierarchy: &Hierarchy,
        motion: &Motion,
        lights: &mut Carried<Light, AnimatedLight>,
        report: &mut LoadReport,
    ) -> Result<(), LoadError> {
        let mut profiles: HashMap<u32, Option<Arc<LightProfile>>> = HashMap::new();
        for placed in hierarchy.placed.iter().filter(|p| p.visible || motion.moves(p.node)) {
            let Some(reference) = &self.json.nodes[placed.node as usize].extensions.photometric else {
                continue;
            };
            let profile = match profiles.get(&reference.light) {
                Some(known) => known.clone(),
                None => {
                    let profile = match self.profile(reference.light, report) {
                        Ok(profile) => Some(Arc::new(profile)),
                        Err(error) if self.options.lenient => {
                            report.ignored(format!("{error}: its lights are left out"));
                            None
                        }
                        Err(error) => return Err(error),
                    };
                    profiles.entry(reference.light).or_insert(profile).clone()
                }
            };
            let Some(profile) = profile else { continue };
            let world = &hierarchy.worlds[placed.node as usize];
            let source = source(reference, &profile, report);
            let shown = if placed.visible { source } else { Punctual { intensity: 0.0, ..source } };
            let Some(kind) = shown.at(world) else {
                report.ignored("a photometric light has impossible values and is left out");
                continue;
            };
            let (light, root) = (lights.objects.len() as u32, DAffine3::IDENTITY);
            lights.carriers.push((NO_NUMBER, AnimatedLight { light, node: placed.node, source, root }));
            let name = self.node_name(placed.node, None);
            lights.objects.push(Light { name, kind, profile: Some(Photometry::at_node(profile, world)) });
        }
        Ok(())
    }

    /// The profile `index` of the file's list.
    fn profile(&self, index: u32, report: &mut LoadReport) -> Result<LightProfile, LoadError> {
        let sources = self.json.extensions.photometric.as_ref().map(|l| &l.lights[..]).unwrap_or_default();
        let source = self.get(sources, index, "photometric light")?;
        let object = format!("photometric light {index}");
        let bytes = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => match uri::resolve(self.path, uri, self.options) {
                Ok(Target::Data(bytes)) => Cow::Owned(bytes),
                Ok(Target::File(path)) => {
                    let bytes = self.options.read(&path)?;
                    report.bytes_read += bytes.len() as u64;
                    Cow::Owned(bytes)
                }
                Err(reason) => return Err(self.malformed(object, reason)),
            },
            (None, Some(view)) => Cow::Borrowed(self.view(view)?.0),
            (None, None) => return Err(self.malformed(object, "has neither a URI nor a buffer view")),
        };
        // The file may be any that this one names: what it says is not repeated.
        ies::parse(&bytes).map_err(|(place, message)| {
            self.malformed(format!("{object}, {place}"), without_quotes(&message))
        })
    }
}

/// The light without its place: candela where the profile is greatest.
fn source(node: &json::NodePhotometric, profile: &LightProfile, report: &mut LoadReport) -> Punctual {
    let multiplier = node.multiplier.unwrap_or(1.0);
    let color = Vec3::from(node.color.unwrap_or([1.0; 3]));
    let clamped = color.clamp(Vec3::ZERO, Vec3::ONE);
    if color != clamped {
        report.repaired("colours of photometric lights are from 0 to 1: others were moved there");
    }
    Punctual { kind: PunctualKind::Point, color: clamped, intensity: profile.peak() * multiplier }
}
