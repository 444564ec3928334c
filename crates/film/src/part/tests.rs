use super::*;
use crate::{Aov, AovSample, Merger};
use proptest::prelude::*;
use std::path::Path;

const WINDOW: Rect = Rect { x: 2, y: 1, width: 13, height: 11 };
const SPP: u32 = 9;

fn whole() -> Block {
    Block { window: WINDOW, samples: 0..SPP }
}

/// A number in `[0, 1)` that depends on all three.
fn noise(x: u32, y: u32, sample: u32) -> f32 {
    let hash = (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_add(sample * 0xc2b2_ae35);
    (hash.wrapping_mul(0x27d4_eb2f) >> 8) as f32 / 16_777_216.0
}

/// What a back end would make of some blocks: bright, dark and invalid samples, and every layer.
fn render(blocks: &[Block]) -> Part {
    let window = blocks.iter().map(|b| b.window).reduce(|a, b| a.hull(&b)).unwrap();
    let mut film = Film::with_window(20, 15, window, &Aov::ALL).unwrap();
    for block in blocks {
        for y in block.window.y..block.window.y + block.window.height {
            for x in block.window.x..block.window.x + block.window.width {
                for sample in block.samples.clone() {
                    let v = noise(x, y, sample);
                    film.add(x, y, [v, 1e7 * v * v, if v > 0.98 { f32::NAN } else { 1e-9 * v }]);
                    let depth = if v < 0.02 { f32::INFINITY } else { v };
                    let seen =
                        AovSample { depth, normal: [v, -v, 0.1], material_id: x, ..Default::default() };
                    let seen = AovSample { instance_id: (5.0 * v) as u32, ..seen };
                    film.add_aovs(x, y, u64::from(sample), &seen);
                }
            }
        }
    }
    let mut part = Part::new(film, Coverage::new(blocks.to_vec()).unwrap(), whole()).unwrap();
    part.identity.insert("seed".into(), "7".into());
    part.metadata.insert("scene".into(), "Çınar".into());
    part.backends.insert("cpu".into());
    part.render_time = Duration::from_nanos(blocks.iter().map(Block::sample_count).sum());
    part
}

/// Cuts the picture into tiles, and each of them into ranges of samples; deals them to `count` parts in an order that
/// `seed` decides.
fn split(tiles: u32, ranges: u32, count: usize, seed: u64) -> Vec<Vec<Block>> {
    let mut blocks = Vec::new();
    for tile in (0..tiles).filter_map(|i| WINDOW.tile(i, tiles)) {
        for i in 0..ranges {
            let samples = SPP * i / ranges..SPP * (i + 1) / ranges;
            blocks.push(Block { window: tile, samples });
        }
    }
    let count = count.min(blocks.len());
    blocks.sort_by_key(|b| blake3::hash(format!("{seed}{b}").as_bytes()).as_bytes()[0]);
    let mut parts = vec![Vec::new(); count];
    blocks.into_iter().enumerate().for_each(|(i, block)| parts[i % count].push(block));
    parts
}

fn through_bytes(part: &Part) -> Part {
    Part::from_bytes("a part", &part.to_bytes().unwrap()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_split_merges_to_the_same_bits(
        tiles in 1_u32..12, ranges in 1_u32..7, count in 2_usize..65, seed: u64,
    ) {
        let mut merger = Merger::new();
        for (i, blocks) in split(tiles, ranges, count, seed).iter().enumerate() {
            merger.add(&format!("part {i}"), through_bytes(&render(blocks))).unwrap();
        }
        let merged = merger.finish().unwrap();
        prop_assert!(merged.missing().is_empty());
        prop_assert!(merged == render(&[whole()]));
    }

    #[test]
    fn merging_in_a_tree_gives_the_same_bits(tiles in 2_u32..12, count in 2_usize..65, seed: u64) {
        let mut parts: Vec<Part> = split(tiles, 3, count, seed).iter().map(|b| render(b)).collect();
        while parts.len() > 1 {
            let mut next = Vec::new();
            for pair in parts.chunks(2) {
                let mut sum = pair[0].clone();
                pair.get(1).map_or(Ok(()), |b| sum.merge("a", b, "b")).unwrap();
                next.push(through_bytes(&sum));
            }
            parts = next;
        }
        prop_assert!(parts[0] == render(&[whole()]));
    }

    #[test]
    fn no_damage_goes_unnoticed(place in 0.0..1.0_f64, flip in 1_u8..=255) {
        let part = render(&split(3, 2, 2, 5)[0]);
        let mut bytes = part.to_bytes().unwrap();
        let i = (place * bytes.len() as f64) as usize;
        bytes[i] ^= flip;
        // Some bytes mean nothing to us: the program's name, or the primaries. Nothing else may change.
        if let Ok(read) = Part::from_bytes("broken.exr", &bytes) {
            prop_assert!(read == part, "byte {i} changed the part");
        }
        bytes[i] ^= flip;
        bytes.truncate(i);
        prop_assert!(Part::from_bytes("cut.exr", &bytes).unwrap_err().to_string().contains("cut.exr"));
    }
}

/// The comparison of the tests above would notice one wrong bit.
#[test]
fn a_lost_sample_is_another_part() {
    let mut changed = render(&[whole()]);
    changed.film.add(5, 5, [0.0; 3]);
    assert!(changed != render(&[whole()]));
}

#[test]
fn damaged_sums_are_named() {
    let part = render(&[whole()]);
    let mut file = part.to_exr();
    let channel = file.channels.iter_mut().find(|c| c.name == "square.G.1").unwrap();
    let crate::ExrSamples::Uint(values) = &mut channel.samples else { panic!("whole numbers") };
    values[17] ^= 1;
    let error = Part::from_exr(Path::new("bad.exr"), &file).unwrap_err().to_string();
    assert!(error.contains("bad.exr") && error.contains("checksum"), "{error}");
}

#[test]
fn pictures_and_other_formats_are_no_parts() {
    let read = |file: &crate::ExrFile| Part::from_exr(Path::new("a.exr"), file).unwrap_err();
    let film = render(&[whole()]).into_whole_film().unwrap();
    let picture = crate::ExrFile::from_film(&film, crate::Precision::Float);
    assert!(matches!(read(&picture), PartError::NotAPart { .. }));
    let newer = picture.with_metadata("part.format", "2");
    assert!(matches!(read(&newer), PartError::Version { found, .. } if found == "2"));
    let lying = newer.with_metadata("part.format", "1");
    assert!(matches!(read(&lying), PartError::Damaged { .. }));
}

#[test]
fn what_does_not_belong_together_is_named() {
    let halves = [WINDOW.tile(0, 2).unwrap(), WINDOW.tile(1, 2).unwrap()];
    let [a, b] = halves.map(|window| render(&[Block { window, samples: 0..SPP }]));
    let merged = |a: &Part, b: &Part| {
        let mut sum = a.clone();
        let result = sum.merge("a.exr", b, "b.exr").map_err(|e| e.to_string());
        assert!(result.is_ok() || sum == *a, "a failed merge changed the part");
        result
    };
    assert_eq!(merged(&a, &b), Ok(()));
    let mut other = b.clone();
    other.identity.insert("seed".into(), "8".into());
    let expected = "a.exr and b.exr do not belong together: seed is `7` in the one and `8` in the other";
    assert_eq!(merged(&a, &other), Err(expected.into()));
    let mut other = b.clone();
    other.identity.insert("sky".into(), "blue".into());
    assert!(merged(&a, &other).unwrap_err().contains("sky is `nothing` in the one and `blue` in the other"));
    let error = merged(&a, &a).unwrap_err();
    assert!(error.contains("a.exr and b.exr both have samples 0..9 of the"), "{error}");
    let mut other = b.clone();
    other.whole.window.width += 1;
    assert!(merged(&a, &other).unwrap_err().contains("size is"));
}

#[test]
fn overlaps_name_the_two_files_whatever_came_between() {
    let mut merger = Merger::new();
    for i in 0..4 {
        let window = WINDOW.tile(i, 4).unwrap();
        merger.add(&format!("{i}.exr"), render(&[Block { window, samples: 0..SPP }])).unwrap();
    }
    let again = Block { window: WINDOW.tile(2, 4).unwrap(), samples: 3..4 };
    let error = merger.add("again.exr", render(&[again])).unwrap_err().to_string();
    assert!(error.contains("2.exr and again.exr both have samples 3..4"), "{error}");
    assert!(matches!(Merger::new().finish(), Err(PartError::Nothing)));
}

#[test]
fn films_must_have_what_is_said_to_be_covered() {
    let part = render(&[whole()]);
    let less = Coverage::new([Block { window: WINDOW, samples: 0..SPP - 1 }]).unwrap();
    let error = Part::new(part.film.clone(), less, whole()).unwrap_err().to_string();
    assert!(error.contains("pixel (2, 1) has 9 samples instead of 8"), "{error}");
    let beyond = Block { window: Rect { x: 0, ..WINDOW }, samples: 0..SPP };
    assert!(Part::new(part.film, Coverage::new([beyond]).unwrap(), whole()).is_err());
}
