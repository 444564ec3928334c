//! Lights in the picture: they are selected by their signs, dragged through the sky, and aimed at what is seen.

use super::state::Viewer;
use crate::gizmo::markers::{self, Of};
use crate::queries::{Purpose, Seen};
use alhazen::edits::EnvironmentRecord;
use alhazen::{LightKind, LightParameter};
use egui::{Painter, Pos2};
use glam::Vec3;

/// Where a light is, metres; `None` for one that is infinitely far away.
pub(super) fn place_of(kind: &LightKind) -> Option<Vec3> {
    let mut kind = *kind;
    kind.parameters().into_iter().find_map(|(_, parameter)| match parameter {
        LightParameter::Position(position) => Some(*position),
        _ => None,
    })
}

/// A light of this kind, so that it falls on a point: a spot turns there; others are brought to where the point's
/// highlight is seen from the camera.
///
/// - `towards`: unit direction from the point to where its highlight comes from.
fn aimed(kind: &LightKind, point: Vec3, towards: Vec3) -> LightKind {
    let mut kind = *kind;
    match &mut kind {
        LightKind::Spot { position, direction, .. } => {
            *direction = (point - *position).try_normalize().unwrap_or(*direction);
        }
        LightKind::Projector { position, direction, up, .. } => {
            *direction = (point - *position).try_normalize().unwrap_or(*direction);
            // What is up in the picture stays at a right angle to where it is thrown.
            let level = *up - *direction * up.dot(*direction);
            *up = level.try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
        }
        LightKind::Directional { direction, .. } => *direction = -towards,
        LightKind::Point { position, .. } => *position = point + towards * position.distance(point),
    }
    kind
}

impl Viewer {
    /// The sign at a point of the window.
    pub(super) fn marker_at(&self, at: Pos2) -> Option<Of> {
        let scene = self.document.as_ref().filter(|_| self.settings.icons)?.scene();
        markers::nearest(&markers::markers(scene, &self.lens()), at)
    }

    /// Selects the light, or looks through the camera, whose sign is at a point. Returns whether there is one.
    pub(super) fn pick_marker(&mut self, at: Pos2) -> bool {
        match self.marker_at(at) {
            Some(Of::Light(number)) => self.select_light(number),
            Some(Of::Sun) => {
                (self.open.side, self.open.tab) = (true, crate::panels::Tab::Sky);
                self.notice("drag the sun through the sky, or aim it: J and a click", false);
            }
            Some(Of::Camera(number)) => {
                self.look_through_own(number);
                self.notice("looking through a camera of the scene; Home returns to the first", false);
            }
            None => return false,
        }
        true
    }

    /// Selects a light instead of what is selected.
    pub fn select_light(&mut self, number: usize) {
        self.deselect();
        self.gizmo.light = Some(number);
        (self.open.side, self.open.tab) = (true, crate::panels::Tab::Lights);
    }

    /// Removes the light that is selected.
    pub(super) fn remove_light(&mut self, number: usize) {
        self.gizmo.light = None;
        self.edit_lights("delete", |lights| {
            if number < lights.len() {
                lights.remove(number);
            }
        });
    }

    /// Whether a sign stands for something infinitely far away, which is dragged through the sky.
    pub(super) fn is_in_the_sky(&self, of: Of) -> bool {
        let kind = |i: usize| Some(self.document.as_ref()?.scene().lights.get(i)?.kind);
        match of {
            Of::Sun => true,
            Of::Light(i) => matches!(kind(i), Some(LightKind::Directional { .. })),
            Of::Camera(_) => false,
        }
    }

    /// Brings what is in the sky to a point of the window.
    pub(super) fn carry(&mut self, of: Of, pointer: Pos2) {
        let Some(ray) = self.lens().ray(pointer) else { return };
        match of {
            Of::Sun => self.set_sun(ray.direction),
            Of::Light(number) => self.turn_light(number, -ray.direction),
            Of::Camera(_) => {}
        }
    }

    fn turn_light(&mut self, number: usize, to: Vec3) {
        self.edit_lights("gizmo", |lights| {
            if let Some(LightKind::Directional { direction, .. }) =
                lights.get_mut(number).map(|l| &mut l.kind)
            {
                *direction = to;
            }
        });
    }

    /// Brings the sun of the sky there. That of daylight does not set.
    fn set_sun(&mut self, towards: Vec3) {
        let Some(document) = &self.document else { return };
        let original = || EnvironmentRecord::from(&document.unchanged().environment);
        let mut environment = document.edits().environment.clone().unwrap_or_else(original);
        match &mut environment {
            EnvironmentRecord::Sky(sky) => {
                if let Some(sun) = &mut sky.sun {
                    sun.direction = towards.to_array();
                }
            }
            EnvironmentRecord::Daylight(daylight) => {
                let direction = towards.as_dvec3();
                daylight.elevation = direction.y.clamp(0.0, 1.0).asin();
                // North is -Z, east is +X.
                daylight.azimuth = direction.x.atan2(-direction.z);
            }
            _ => return,
        }
        self.edit("gizmo", |edits| edits.environment = Some(environment));
    }

    /// The light that is aimed: the selected one, or else the only one, or else the sun.
    fn aimed_light(&self) -> Option<Of> {
        let scene = self.document.as_ref()?.scene();
        let only = (scene.lights.len() == 1).then_some(0);
        let light = self.gizmo.light.filter(|i| *i < scene.lights.len()).or(only).map(Of::Light);
        light.or_else(|| scene.environment.sun().map(|_| Of::Sun))
    }

    /// Has the next click say where the light should fall; again ends that.
    pub(super) fn begin_to_aim(&mut self) {
        if self.aimed_light().is_none() {
            return self.notice("there is no light to aim: select one, or choose a sky with a sun", false);
        }
        self.gizmo.aims = !self.gizmo.aims;
        let text = if self.gizmo.aims {
            "click where the light should fall; a click into the sky puts it there"
        } else {
            "aiming has ended"
        };
        self.notice(text, false);
    }

    /// Asks what is seen where the light should fall.
    pub(super) fn aim_at(&mut self, at: Pos2) {
        self.gizmo.aims = false;
        self.aimed_at = Some(at);
        self.ask(at, Purpose::Aim);
    }

    /// Aims the light at what is seen, or at the sky where nothing is.
    pub(super) fn aim(&mut self, seen: Option<Seen>) {
        let (Some(of), Some(at)) = (self.aimed_light(), self.aimed_at.take()) else { return };
        let lens = self.lens();
        let Some(seen) = seen else {
            if self.is_in_the_sky(of) {
                self.carry(of, at);
            } else {
                self.notice("there is nothing for the light to fall on", false);
            }
            return;
        };
        let view = lens.towards_camera(seen.position);
        let normal = if seen.normal.dot(view) < 0.0 { -seen.normal } else { seen.normal };
        let towards = (normal * (2.0 * normal.dot(view)) - view).normalize_or(normal);
        match of {
            Of::Light(number) => self.edit_lights("aim", |lights| {
                if let Some(light) = lights.get_mut(number) {
                    light.kind = aimed(&light.kind, seen.position, towards);
                    *light = light.valid();
                }
            }),
            _ => self.set_sun(towards),
        }
        self.notice("aimed", false);
    }

    /// Draws the signs of lights and cameras.
    pub(super) fn paint_markers(&self, painter: &Painter) {
        if let Some(document) = self.document.as_ref().filter(|_| self.settings.icons) {
            markers::paint(painter, document.scene(), &self.lens(), self.gizmo.light, self.scene_size());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_turn_and_others_come_to_where_the_highlight_is() {
        let (position, intensity) = (Vec3::new(0.0, 4.0, 0.0), Vec3::ONE);
        let (point, towards) = (Vec3::new(3.0, 0.0, 0.0), Vec3::Y);
        let direction = Vec3::NEG_Y;
        let spot = LightKind::Spot { position, direction, intensity, inner_angle: 0.1, outer_angle: 0.2 };
        let LightKind::Spot { direction, .. } = aimed(&spot, point, towards) else { panic!("a spot") };
        assert!(direction.distance(Vec3::new(0.6, -0.8, 0.0)) < 1e-6);
        let LightKind::Point { position, .. } =
            aimed(&LightKind::Point { position, intensity }, point, towards)
        else {
            panic!("a point")
        };
        assert!(position.distance(Vec3::new(3.0, 5.0, 0.0)) < 1e-6, "as far away as before");
        let far = LightKind::Directional { direction, irradiance: Vec3::ONE, angular_diameter: 0.0 };
        let LightKind::Directional { direction, .. } = aimed(&far, point, towards) else { panic!("the sun") };
        assert_eq!(direction, Vec3::NEG_Y);
        assert_eq!((place_of(&far), place_of(&spot)), (None, Some(Vec3::new(0.0, 4.0, 0.0))));
    }
}
