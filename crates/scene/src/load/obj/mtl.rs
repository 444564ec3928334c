//! MTL text to statements: what the file says, before any of it is interpreted.

use super::text::{self, Lines};
use crate::LoadReport;
use glam::{Vec2, Vec3};
use std::collections::BTreeMap;

/// A material as the MTL file writes it; `None` is what it leaves out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {
    /// Name after `newmtl`.
    pub name: String,
    /// `Ka`, ambient reflectance.
    pub ambient: Option<Vec3>,
    /// `Kd`, diffuse reflectance.
    pub diffuse: Option<Vec3>,
    /// `Ks`, specular reflectance.
    pub specular: Option<Vec3>,
    /// `Ke`, emitted radiance.
    pub emission: Option<Vec3>,
    /// `Tf` (or `Kt`), transmission filter.
    pub transmission: Option<Vec3>,
    /// `Ns`, Phong exponent.
    pub exponent: Option<f32>,
    /// `Ni`, index of refraction.
    pub ior: Option<f32>,
    /// `d`, opacity.
    pub dissolve: Option<f32>,
    /// `Tr`, 1 − opacity.
    pub transparency: Option<f32>,
    /// `illum`, the illumination model.
    pub illum: Option<u32>,
    /// `Pr`, perceptual roughness.
    pub roughness: Option<f32>,
    /// `Pm`, metalness.
    pub metallic: Option<f32>,
    /// `Pc`, clearcoat.
    pub clearcoat: Option<f32>,
    /// `Ps`, sheen.
    pub sheen: Option<f32>,
    /// `aniso`, anisotropy.
    pub anisotropy: Option<f32>,
    /// Textures by what they modulate.
    pub maps: BTreeMap<MtlTexture, Map>,
}

/// What a texture modulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MtlTexture {
    /// `map_Kd`.
    Diffuse,
    /// `map_Ke`.
    Emission,
    /// `map_Ks`.
    Specular,
    /// `map_d`, `map_Tr` is not used by anyone.
    Dissolve,
    /// `map_Pr`.
    Roughness,
    /// `map_Pm`.
    Metallic,
    /// `map_bump`, `bump`: a height map by the specification, a normal map in many files.
    Bump,
    /// `norm`: a normal map.
    Normal,
    /// `map_ORM`: occlusion, roughness and metalness in R, G and B.
    OcclusionRoughnessMetallic,
    /// `map_RMA`: roughness, metalness and occlusion in R, G and B.
    RoughnessMetallicOcclusion,
}

/// The use of a texture, with its options.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// File name, without a comment and options behind it.
    pub file: String,
    /// All that stands behind the options before the name: a file name may have blanks, `#` and `-` in it.
    pub whole: String,
    /// `-s`: texture coordinates, v upwards, are multiplied by this.
    pub scale: Vec2,
    /// `-o`: then this is added.
    pub offset: Vec2,
    /// `-clamp on`: the border goes on outside the image.
    pub clamp: bool,
    /// `-bm`: strength of a bump map.
    pub bump: f32,
    /// `-imfchan`: the channel that a scalar is taken from, one of `r g b m l z`.
    pub channel: Option<u8>,
    /// `-colorspace`: `Some(true)` for sRGB, `Some(false)` for linear.
    pub srgb: Option<bool>,
}

impl Default for Map {
    fn default() -> Self {
        Self {
            file: String::new(),
            whole: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            bump: 1.0,
            channel: None,
            srgb: None,
        }
    }
}

/// Parses an MTL file. Whatever it holds, this does not fail: what cannot be understood is noted in `report`.
///
/// Of materials with the same name, all are returned, in file order.
pub fn parse(bytes: &[u8], report: &mut LoadReport) -> Vec<MtlMaterial> {
    let text = text::with_line_feeds(bytes);
    let mut materials: Vec<MtlMaterial> = Vec::new();
    for line in Lines::new(&text) {
        let mut rest = &*line;
        let Some(keyword) = text::word(&mut rest) else { continue };
        if keyword[0] == b'#' {
            continue;
        }
        let keyword = String::from_utf8_lossy(keyword).to_ascii_lowercase();
        if keyword == "newmtl" {
            materials.push(MtlMaterial { name: text::name(rest), ..Default::default() });
        } else if let Some(material) = materials.last_mut() {
            material.statement(&keyword, rest, report);
        } else {
            report.ignored("a statement before the first `newmtl`");
        }
    }
    materials
}

impl MtlMaterial {
    fn statement(&mut self, keyword: &str, rest: &[u8], report: &mut LoadReport) {
        let rest = if slot(keyword).is_some() { rest } else { text::before_hash(rest) };
        match keyword {
            "ka" => self.ambient = color(rest, report),
            "kd" => self.diffuse = color(rest, report),
            "ks" => self.specular = color(rest, report),
            "ke" => self.emission = color(rest, report),
            "tf" | "kt" => self.transmission = color(rest, report),
            "ns" => self.exponent = scalar(rest, report),
            "ni" => self.ior = scalar(rest, report),
            "d" => self.dissolve = dissolve(rest, report),
            "tr" => self.transparency = scalar(rest, report),
            "illum" => self.illum = scalar(rest, report).map(|v| v as u32),
            "pr" => self.roughness = scalar(rest, report),
            "pm" => self.metallic = scalar(rest, report),
            "pc" => self.clearcoat = scalar(rest, report),
            "ps" => self.sheen = scalar(rest, report),
            "aniso" => self.anisotropy = scalar(rest, report),
            // No influence without the value they belong to; ambient light is what global illumination computes.
            "pcr" | "anisor" | "map_ka" | "map_aat" | "sharpness" => {}
            _ => match slot(keyword) {
                Some(slot) => match map(rest, report) {
                    Some(map) => {
                        self.maps.insert(slot, map);
                    }
                    None => report.ignored(format!("`{keyword}` names no file")),
                },
                None => {
                    // Other words are not repeated: the library may be any file that its user did not choose.
                    let known = UNSUPPORTED.contains(&keyword);
                    let keyword = if known { format!(" `{keyword}`") } else { String::new() };
                    report.ignored(format!("the material statement{keyword} is not supported"));
                }
            },
        }
    }
}

/// Statements of MTL that are known to have no effect here.
const UNSUPPORTED: [&str; 9] =
    ["ka", "disp", "decal", "refl", "map_refl", "spectral", "xyz", "map_disp", "map_pcr"];

fn slot(keyword: &str) -> Option<MtlTexture> {
    Some(match keyword {
        "map_kd" => MtlTexture::Diffuse,
        "map_ke" => MtlTexture::Emission,
        "map_ks" => MtlTexture::Specular,
        "map_d" => MtlTexture::Dissolve,
        "map_pr" => MtlTexture::Roughness,
        "map_pm" => MtlTexture::Metallic,
        "map_bump" | "bump" => MtlTexture::Bump,
        "norm" | "map_norm" | "map_kn" => MtlTexture::Normal,
        "map_orm" => MtlTexture::OcclusionRoughnessMetallic,
        "map_rma" => MtlTexture::RoughnessMetallicOcclusion,
        _ => return None,
    })
}

fn number(word: &[u8], report: &mut LoadReport) -> f32 {
    let value = text::number(word).or_else(|| text::number_prefix(word));
    value.filter(|v| v.is_finite()).unwrap_or_else(|| {
        report.repaired("a number of a material is malformed; 0 is used");
        0.0
    })
}

fn scalar(mut rest: &[u8], report: &mut LoadReport) -> Option<f32> {
    let word = text::word(&mut rest);
    if word.is_none() {
        report.ignored("a material statement without a value");
    }
    word.map(|w| number(w, report))
}

fn dissolve(rest: &[u8], report: &mut LoadReport) -> Option<f32> {
    let mut after = rest;
    if text::word(&mut after) == Some(b"-halo") {
        report.approximated("`d -halo` is a constant opacity");
        return scalar(after, report);
    }
    scalar(rest, report)
}

/// `r g b`, or `r` for all three; CIE XYZ is converted.
fn color(mut rest: &[u8], report: &mut LoadReport) -> Option<Vec3> {
    let mut after = rest;
    let xyz = match text::word(&mut after) {
        Some(b"spectral") => {
            report.ignored("a spectral colour");
            return None;
        }
        Some(b"xyz") => {
            rest = after;
            true
        }
        _ => false,
    };
    let x = scalar(rest, report)?;
    text::word(&mut rest);
    let mut value = Vec3::splat(x);
    for component in 1..3 {
        if let Some(word) = text::word(&mut rest) {
            value[component] = number(word, report);
        }
    }
    if xyz {
        let Vec3 { x, y, z } = value;
        value = Vec3::new(
            3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
            -0.969266 * x + 1.8760108 * y + 0.041556 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
        );
    }
    if value.min_element() < 0.0 {
        report.repaired("a negative colour was set to 0");
        value = value.max(Vec3::ZERO);
    }
    Some(value)
}

/// Options and a file name, which goes to the end of the line, to a comment, or to further options.
fn map(mut rest: &[u8], report: &mut LoadReport) -> Option<Map> {
    let mut map = Map::default();
    loop {
        let mut after = rest;
        let Some(word) = text::word(&mut after) else { break };
        if word[0] != b'-' || !option(word, &mut after, &mut map, true, report) {
            break;
        }
        rest = after;
    }
    map.whole = text::name(rest).trim_matches('"').to_owned();
    let statement = text::before_comment(rest);
    let (name, mut options) = statement.split_at(name_length(statement));
    map.file = text::name(name).trim_matches('"').to_owned();
    while let Some(word) = text::word(&mut options) {
        if !option(word, &mut options, &mut map, false, report) {
            report.ignored("what follows the file name of a texture");
        }
    }
    (!map.file.is_empty()).then_some(map)
}

/// Where the options behind a file name begin; a name in quotes ends at the second one.
fn name_length(statement: &[u8]) -> usize {
    let quoted =
        statement.strip_prefix(b"\"").and_then(|rest| memchr::memchr(b'"', rest)).map_or(0, |end| end + 2);
    let mut rest = &statement[quoted..];
    let mut is_name = quoted > 0;
    while let Some(word) = text::word(&mut rest) {
        let before = statement.len() - rest.len() - word.len();
        if is_name && OPTIONS.contains(&word.to_ascii_lowercase().as_slice()) {
            return before;
        }
        is_name = true;
    }
    statement.len()
}

/// The options of textures.
const OPTIONS: [&[u8]; 14] = [
    b"-s",
    b"-o",
    b"-t",
    b"-bm",
    b"-clamp",
    b"-mm",
    b"-imfchan",
    b"-colorspace",
    b"-cc",
    b"-boost",
    b"-texres",
    b"-type",
    b"-blendu",
    b"-blendv",
];

/// Reads one option; `false` if the word is not one. `name_follows`: the line's last word is the file name.
fn option(word: &[u8], rest: &mut &[u8], map: &mut Map, name_follows: bool, report: &mut LoadReport) -> bool {
    let vector = |rest: &mut &[u8], default| vector(rest, default, name_follows);
    match word.to_ascii_lowercase().as_slice() {
        b"-s" => map.scale = vector(rest, Vec2::ONE),
        b"-o" => map.offset = vector(rest, Vec2::ZERO),
        b"-t" => {
            if vector(rest, Vec2::ZERO) != Vec2::ZERO {
                report.ignored("texture turbulence (`-t`)");
            }
        }
        b"-bm" => map.bump = text::word(rest).map_or(1.0, |w| number(w, report)),
        b"-clamp" => map.clamp = text::word(rest) == Some(b"on"),
        b"-mm" => {
            if vector(rest, Vec2::new(0.0, 1.0)) != Vec2::new(0.0, 1.0) {
                report.ignored("base and gain of a texture (`-mm`)");
            }
        }
        b"-imfchan" => map.channel = text::word(rest).map(|w| w[0].to_ascii_lowercase()),
        b"-colorspace" => {
            map.srgb = text::word(rest).map(|w| w.eq_ignore_ascii_case(b"srgb"));
        }
        b"-cc" | b"-boost" | b"-texres" | b"-type" => {
            let name = String::from_utf8_lossy(word).into_owned();
            text::word(rest);
            report.ignored(format!("the texture option `{name}`"));
        }
        // How the image is filtered is not the file's affair.
        b"-blendu" | b"-blendv" => {
            text::word(rest);
        }
        _ => return false,
    }
    true
}

/// One to three numbers, of which two are kept. A file name that follows may be a number itself.
fn vector(rest: &mut &[u8], mut value: Vec2, name_follows: bool) -> Vec2 {
    for component in 0..3 {
        let mut after = *rest;
        let Some(number) = text::word(&mut after).and_then(text::number).filter(|n| n.is_finite()) else {
            break;
        };
        if name_follows && text::trim(after).is_empty() {
            break;
        }
        if component < 2 {
            value[component] = number;
        }
        *rest = after;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(text: &str) -> (MtlMaterial, LoadReport) {
        let mut report = LoadReport::default();
        let mut materials = parse(format!("newmtl m\n{text}").as_bytes(), &mut report);
        assert_eq!(materials.len(), 1);
        (materials.remove(0), report)
    }

    #[test]
    fn options_and_names_with_spaces() {
        let (m, report) =
            one("map_Kd -s 2 3 1 -o 0.5 -clamp on -mm 0 1 my wood 01.png\n\tbump -bm 2 bump 01.png\n");
        let kd = &m.maps[&MtlTexture::Diffuse];
        assert_eq!(kd.file, "my wood 01.png");
        assert_eq!((kd.scale, kd.offset, kd.clamp), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0), true));
        assert_eq!(
            (m.maps[&MtlTexture::Bump].bump, m.maps[&MtlTexture::Bump].file.as_str()),
            (2.0, "bump 01.png")
        );
        assert!(report.notes.is_empty());
        assert_eq!(one("map_Kd -o 1 2").0.maps[&MtlTexture::Diffuse].file, "2");
        assert_eq!(one("map_Kd \"a b.png\"").0.maps[&MtlTexture::Diffuse].file, "a b.png");
        assert_eq!(one("map_Kd -mine.png").0.maps[&MtlTexture::Diffuse].file, "-mine.png");
        assert!(one("map_Kd -s 1").0.maps[&MtlTexture::Diffuse].file == "1");
    }

    #[test]
    fn comments_and_options_behind_names() {
        for (text, file, scale) in [
            ("map_Kd t.png -s 2 3 2", "t.png", Vec2::new(2.0, 3.0)),
            ("map_Kd my t.png -clamp on -s 2 2 # x", "my t.png", Vec2::splat(2.0)),
            ("map_Kd -s 2 2 t.png # x -s 3 3", "t.png", Vec2::splat(2.0)),
            ("map_Kd \"a b.png\" -s 2 2", "a b.png", Vec2::splat(2.0)),
            ("map_Kd wood#2.png", "wood#2.png", Vec2::ONE),
            ("map_Kd a-s 2.png", "a-s 2.png", Vec2::ONE),
        ] {
            let (m, report) = one(text);
            let map = &m.maps[&MtlTexture::Diffuse];
            assert_eq!((map.file.as_str(), map.scale), (file, scale), "{text}");
            assert!(report.notes.is_empty(), "{text}: {:?}", report.notes);
        }
        assert_eq!(one("map_Kd my #1.png").0.maps[&MtlTexture::Diffuse].whole, "my #1.png");
        let (m, report) = one("Kd 0.5 # grey\nillum 2# x\nNs 10 #\nd 0.5 # -halo");
        assert_eq!(
            (m.diffuse, m.illum, m.exponent, m.dissolve),
            (Some(Vec3::splat(0.5)), Some(2), Some(10.0), Some(0.5))
        );
        assert!(report.notes.is_empty());
    }

    #[test]
    fn colours() {
        assert_eq!(one("Kd 0.5").0.diffuse, Some(Vec3::splat(0.5)));
        assert_eq!(one("kd .1 .2 .3 # x").0.diffuse, Some(Vec3::new(0.1, 0.2, 0.3)));
        let white = one("Kd xyz 0.9505 1 1.089").0.diffuse.unwrap();
        assert!(white.distance(Vec3::ONE) < 1e-3, "{white}");
        let (m, report) =
            one("Kd spectral a.rfl 1\nKs -1 0 nan\nrefl -type sphere x.png\nKe\nillum 2.0\nd -halo 0.5");
        assert_eq!((m.diffuse, m.specular, m.emission), (None, Some(Vec3::ZERO), None));
        assert_eq!((m.illum, m.dissolve), (Some(2), Some(0.5)));
        assert_eq!(report.notes.len(), 6);
    }

    #[test]
    fn statements_need_a_material() {
        let mut report = LoadReport::default();
        assert!(parse(b"Kd 1 1 1\r\n# x\r\n", &mut report).is_empty());
        assert_eq!(report.notes.len(), 1);
    }
}
