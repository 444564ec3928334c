//! Cryptomatte: which objects or materials a pixel shows, and how much of it each covers.
//!
//! Source: Friedman and Jones, "Fully Automatic ID Mattes with Support for Motion Blur and Transparency", SIGGRAPH 2015
//! posters; Psyop, "Cryptomatte Specification", version 1.2.0.

use super::{ExrChannel, ExrFile, ExrSamples};
use crate::{Aov, IdShares};
use std::collections::{BTreeSet, HashMap};

/// Ids that a pixel has room for, those with the most coverage. Two make a layer of four channels.
pub const CRYPTOMATTE_RANKS: usize = 6;

impl ExrFile {
    /// Adds a matte: the channels `crypto_object00.R` to `crypto_object02.A` (or `crypto_material…`) and the attributes
    /// that describe them.
    ///
    /// - `matte`: [`Aov::ObjectMatte`] or [`Aov::MaterialMatte`]; others are ignored.
    /// - `pixels`: the window's, row by row from the top.
    /// - `names`: what is called how. An id without a name gets one with its number. Things of the same name are one.
    pub fn push_cryptomatte(&mut self, matte: Aov, pixels: &[IdShares], names: &[String]) {
        let (layer, thing) = match matte {
            Aov::ObjectMatte => ("crypto_object", "object"),
            Aov::MaterialMatte => ("crypto_material", "material"),
            _ => return,
        };
        let named = |id: u32| match names.get(id as usize) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("{thing} {id}"),
        };
        // What is called something, but not seen, belongs to the manifest, too: other frames may show it.
        let seen = pixels.iter().flatten().map(|&(id, _)| id);
        let ids: BTreeSet<u32> = (0..).take(names.len()).chain(seen).collect();
        let hashes: HashMap<u32, u32> = ids.iter().map(|&id| (id, cryptomatte_hash(&named(id)))).collect();

        let mut channels = vec![vec![0.0; pixels.len()]; 2 * CRYPTOMATTE_RANKS];
        for (i, shares) in pixels.iter().enumerate() {
            for (rank, (hash, coverage)) in ranked(shares, &hashes).into_iter().enumerate() {
                channels[2 * rank][i] = f32::from_bits(hash);
                channels[2 * rank + 1][i] = coverage;
            }
        }
        for (i, values) in channels.into_iter().enumerate() {
            let name = format!("{layer}{:02}.{}", i / 4, ["R", "G", "B", "A"][i % 4]);
            self.channels.push(ExrChannel { name, samples: ExrSamples::Float(values) });
        }
        let hex = ids.iter().map(|&id| (named(id), format!("{:08x}", hashes[&id]).into()));
        let manifest = serde_json::Value::Object(hex.collect());
        let key = &format!("{:08x}", cryptomatte_hash(layer))[..7];
        let facts = [
            ("name", layer.to_owned()),
            ("hash", "MurmurHash3_32".to_owned()),
            ("conversion", "uint32_to_float32".to_owned()),
            ("manifest", manifest.to_string()),
        ];
        let attributes = facts.map(|(fact, value)| (format!("cryptomatte/{key}/{fact}"), value));
        self.attributes.extend(attributes);
    }
}

/// The hashes that cover most of a pixel, the largest coverage first.
fn ranked(shares: &IdShares, hashes: &HashMap<u32, u32>) -> Vec<(u32, f32)> {
    let mut ranked: Vec<(u32, f32)> = Vec::with_capacity(shares.len());
    for &(id, share) in shares {
        let hash = hashes[&id];
        match ranked.iter_mut().find(|(known, _)| *known == hash) {
            Some((_, coverage)) => *coverage += share,
            None => ranked.push((hash, share)),
        }
    }
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    ranked.truncate(CRYPTOMATTE_RANKS);
    ranked
}

/// The hash of a name, made such that its bits are a normal floating-point number: programs that know nothing of mattes may
/// change NaNs and denormal numbers.
#[must_use]
pub fn cryptomatte_hash(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    let exponent = (hash >> 23) & 0xff;
    if exponent == 0 || exponent == 0xff { hash ^ 1 << 23 } else { hash }
}

/// MurmurHash3_x86_32 with seed 0. Source: Austin Appleby, "SMHasher", MurmurHash3.cpp.
fn murmur3(bytes: &[u8]) -> u32 {
    let scrambled = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
    let words = bytes.chunks_exact(4);
    let rest = scrambled(word(words.remainder()));
    let mixed = words.fold(0_u32, |hash, bytes| {
        (hash ^ scrambled(word(bytes))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    // The hash is defined for lengths below 2³².
    let mut hash = mixed ^ rest ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rect;

    #[test]
    fn hashes_are_those_of_the_specification() {
        // From the tests of Psyop's own plugin.
        let known = [("hello", 0x248b_fa47), ("равнина", 0x9623_511e), ("mädchen", 0x6a4e_5613)];
        for (name, bits) in known {
            assert_eq!(cryptomatte_hash(name), bits, "{name}");
        }
        assert_eq!(format!("{:08x}", cryptomatte_hash("crypto_object"))[..7], *"f834d0a");
        // The reference implementation's verification of single lengths.
        assert_eq!(
            (murmur3(b""), murmur3(b"test"), murmur3(b"Hello, world!")),
            (0, 0xba6b_d213, 0xc036_3e43)
        );
        for i in 0..20_000 {
            assert!(f32::from_bits(cryptomatte_hash(&i.to_string())).is_normal(), "{i}");
        }
        assert!(f32::from_bits(cryptomatte_hash("")).is_normal());
    }

    #[test]
    fn pixels_have_their_ids_by_coverage() {
        let names = ["cube", "ball", "", "cube"].map(String::from);
        let many = (0..9).map(|id| (id + 4, (id + 1) as f32 / 64.0)).collect();
        let pixels = [vec![(0, 0.25), (1, 0.375), (3, 0.25)], vec![(2, 1.0)], vec![], many];
        let mut file = ExrFile::new(4, 1, Rect::full(4, 1));
        file.push_cryptomatte(Aov::ObjectMatte, &pixels, &names);
        let channel = |name: &str| {
            let found = file.channels.iter().find(|c| c.name == format!("crypto_object{name}"));
            let ExrSamples::Float(values) = &found.unwrap().samples else { panic!("not 32 bits") };
            values
        };
        let id = |name: &str| f32::from_bits(cryptomatte_hash(name));
        // Both cubes are one.
        assert_eq!(channel("00.R"), &[id("cube"), id("object 2"), 0.0, id("object 12")]);
        assert_eq!(channel("00.G"), &[0.5, 1.0, 0.0, 9.0 / 64.0]);
        assert_eq!(channel("00.B"), &[id("ball"), 0.0, 0.0, id("object 11")]);
        assert_eq!(channel("00.A"), &[0.375, 0.0, 0.0, 0.125]);
        assert_eq!((channel("02.B")[3], channel("02.A")[3]), (id("object 7"), 0.0625));
        assert_eq!(file.channels.len(), 12);

        let manifest = &file.attributes["cryptomatte/f834d0a/manifest"];
        let manifest: serde_json::Value = serde_json::from_str(manifest).unwrap();
        assert_eq!(manifest["ball"], format!("{:08x}", cryptomatte_hash("ball")));
        assert_eq!(manifest.as_object().unwrap().len(), 2 + 10);
        assert_eq!(file.attributes["cryptomatte/f834d0a/name"], "crypto_object");
    }
}
