//! Parameter lists: `"type name" value` or `"type name" [ values ]`.

use super::tokens::Place;
use glam::Vec3;
use std::cell::Cell;
use std::collections::BTreeMap;

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Numbers(Vec<f32>),
    Texts(Vec<String>),
    Truths(Vec<bool>),
}

/// A parameter and its declared type.
#[derive(Clone, Debug)]
struct Parameter {
    kind: String,
    values: Values,
    used: Cell<bool>,
}

/// The parameters of a directive.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    pub place: Place,
    all: BTreeMap<String, Parameter>,
}

/// A colour, or the name of a texture in its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Spectrum {
    Color(Vec3),
    Texture(String),
    /// A spectrum by name or by samples, which is not evaluated.
    Named(String),
}

impl Parameters {
    pub fn new(place: Place) -> Self {
        Self { place, all: BTreeMap::new() }
    }

    pub fn insert(&mut self, kind: &str, name: &str, values: Values) {
        let parameter = Parameter { kind: kind.to_owned(), values, used: Cell::new(false) };
        self.all.insert(name.to_owned(), parameter);
    }

    /// Names of parameters that nobody asked for.
    pub fn unused(&self) -> impl Iterator<Item = &str> {
        self.all.iter().filter(|(_, p)| !p.used.get()).map(|(name, _)| name.as_str())
    }

    fn find(&self, name: &str) -> Option<&Parameter> {
        let found = self.all.get(name)?;
        found.used.set(true);
        Some(found)
    }

    /// All numbers of a parameter; none if it is not there or not made of numbers.
    pub fn numbers(&self, name: &str) -> &[f32] {
        match self.find(name).map(|p| &p.values) {
            Some(Values::Numbers(numbers)) => numbers,
            _ => &[],
        }
    }

    pub fn number(&self, name: &str) -> Option<f32> {
        self.numbers(name).first().copied()
    }

    pub fn number_or(&self, name: &str, default: f32) -> f32 {
        self.number(name).unwrap_or(default)
    }

    /// A whole number that is not negative.
    pub fn count(&self, name: &str) -> Option<u32> {
        self.number(name).filter(|n| *n >= 0.0).map(|n| n as u32)
    }

    pub fn text(&self, name: &str) -> Option<&str> {
        match self.find(name).map(|p| &p.values) {
            Some(Values::Texts(texts)) => texts.first().map(String::as_str),
            _ => None,
        }
    }

    pub fn truth(&self, name: &str) -> Option<bool> {
        match self.find(name).map(|p| &p.values) {
            Some(Values::Truths(truths)) => truths.first().copied(),
            // Older files write them as strings.
            Some(Values::Texts(texts)) => texts.first().map(|t| t == "true"),
            _ => None,
        }
    }

    pub fn vector(&self, name: &str) -> Option<Vec3> {
        self.numbers(name).first_chunk::<3>().map(|v| Vec3::from_array(*v))
    }

    /// Points, vectors or normals; what is left of the last one is dropped.
    pub fn vectors(&self, name: &str) -> Vec<Vec3> {
        self.numbers(name).as_chunks::<3>().0.iter().map(|v| Vec3::from_array(*v)).collect()
    }

    /// The texture that stands in place of a value.
    pub fn texture(&self, name: &str) -> Option<&str> {
        self.find(name).filter(|p| p.kind == "texture").and_then(|_| self.text(name))
    }

    /// A colour: `rgb`, `blackbody`, or the name of a texture or of a spectrum.
    pub fn spectrum(&self, name: &str) -> Option<Spectrum> {
        let parameter = self.find(name)?;
        match (parameter.kind.as_str(), &parameter.values) {
            ("texture", Values::Texts(texts)) => texts.first().map(|t| Spectrum::Texture(t.clone())),
            ("rgb" | "color", Values::Numbers(numbers)) => {
                numbers.first_chunk::<3>().map(|c| Spectrum::Color(Vec3::from_array(*c)))
            }
            ("blackbody", Values::Numbers(numbers)) => {
                numbers.first().map(|kelvin| Spectrum::Color(blackbody(*kelvin)))
            }
            ("spectrum", Values::Texts(texts)) => texts.first().map(|t| Spectrum::Named(t.clone())),
            // Wavelengths and values: constant ones are grey.
            ("spectrum", Values::Numbers(samples)) => {
                let values: Vec<f32> = samples.iter().skip(1).step_by(2).copied().collect();
                let first = *values.first()?;
                let same = values.iter().all(|v| *v == first);
                Some(if same {
                    Spectrum::Color(Vec3::splat(first))
                } else {
                    Spectrum::Named("samples".into())
                })
            }
            (_, Values::Numbers(numbers)) => numbers.first().map(|v| Spectrum::Color(Vec3::splat(*v))),
            _ => None,
        }
    }
}

/// The linear Rec. 709 colour of a black body of `kelvin`, scaled to a luminance of 1.
///
/// Source: chromaticity by Kim et al., "Design of advanced color temperature control system for HDTV applications",
/// Journal of the Korean Physical Society 41, 2002; 1667 K to 25000 K.
fn blackbody(kelvin: f32) -> Vec3 {
    let t = f64::from(kelvin).clamp(1667.0, 25000.0);
    let cubic = |c: [f64; 4], x: f64| ((c[0] * x + c[1]) * x + c[2]) * x + c[3];
    let r = 1e3 / t;
    let x = if t < 4000.0 {
        cubic([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910], r)
    } else {
        cubic([-3.025_846_9, 2.107_037_9, 0.222_634_7, 0.240_390], r)
    };
    let y = if t < 2222.0 {
        cubic([-1.106_381_4, -1.348_110_2, 2.185_558_32, -0.202_196_83], x)
    } else if t < 4000.0 {
        cubic([-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67], x)
    } else {
        cubic([3.081_758, -5.873_386_7, 3.751_129_97, -0.370_014_83], x)
    };
    let (big_x, big_z) = (x / y, (1.0 - x - y) / y);
    let rgb = [
        3.240_454_2 * big_x - 1.537_138_5 - 0.498_531_4 * big_z,
        -0.969_266 * big_x + 1.876_010_8 + 0.041_556 * big_z,
        0.055_643_4 * big_x - 0.204_025_9 + 1.057_225_2 * big_z,
    ];
    Vec3::from_array(rgb.map(|c| c.max(0.0) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hot_bodies_are_blue_and_cool_ones_are_red() {
        let luminance = |c: Vec3| c.dot(Vec3::new(0.212_6, 0.715_2, 0.072_2));
        for kelvin in [1800.0, 3000.0, 6500.0, 15000.0] {
            assert!((luminance(blackbody(kelvin)) - 1.0).abs() < 0.1, "{kelvin}: {}", blackbody(kelvin));
        }
        let (warm, white, cold) = (blackbody(2700.0), blackbody(6500.0), blackbody(12000.0));
        assert!(warm.x > 2.0 * warm.z && cold.z > cold.x);
        assert!((white - Vec3::ONE).abs().max_element() < 0.1, "{white}");
    }
}
