//! The integrators with the settings that the user has given each, one of which renders.

use alhazen::{Integrator, PathSettings, RealtimeSettings};

/// One of each integrator, and which is chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Integrators {
    all: Vec<Integrator>,
    chosen: usize,
}

impl Integrators {
    /// With usual settings, but for the one that renders.
    pub fn with(integrator: Integrator) -> Self {
        let mut integrators = Self { all: Integrator::all().into(), chosen: 0 };
        integrators.choose(integrator.name());
        *integrators.chosen_mut() = integrator;
        integrators
    }

    /// The one that renders.
    pub fn chosen(&self) -> &Integrator {
        &self.all[self.chosen]
    }

    /// As [`Integrators::chosen`], to set what it does.
    pub fn chosen_mut(&mut self) -> &mut Integrator {
        &mut self.all[self.chosen]
    }

    /// Has the integrator of this name render, with the settings that it had. Returns whether there
    /// is one.
    pub fn choose(&mut self, name: &str) -> bool {
        let found = self.all.iter().position(|integrator| integrator.name() == name);
        self.chosen = found.unwrap_or(self.chosen);
        found.is_some()
    }

    /// All of them, in the order in which users read them.
    pub fn iter(&self) -> impl Iterator<Item = &Integrator> {
        self.all.iter()
    }

    /// The settings of `path`.
    pub fn path(&self) -> PathSettings {
        let path = |i: &Integrator| if let Integrator::Path(path) = i { Some(*path) } else { None };
        self.all.iter().find_map(path).unwrap_or_default()
    }

    /// The settings of `realtime`, to set them.
    pub fn realtime_mut(&mut self) -> Option<&mut RealtimeSettings> {
        self.all.iter_mut().find_map(|integrator| match integrator {
            Integrator::Realtime(realtime) => Some(realtime),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_integrator_keeps_its_settings() {
        for integrator in Integrator::all() {
            let mut integrators = Integrators::with(integrator);
            assert_eq!(*integrators.chosen(), integrator);
            assert!(integrators.choose("direct") && !integrators.choose("ray casting"));
            assert_eq!(integrators.chosen().name(), "direct");
            let ambient = integrators.chosen_mut().ambient_mut().expect("ambient occlusion");
            ambient.set_distance(2.5);
            assert!(integrators.choose("path") && integrators.choose("direct"));
            assert_eq!(integrators.chosen().ambient().map(|ambient| ambient.distance), Some(2.5));
        }
    }
}
