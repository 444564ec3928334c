use super::*;
use proptest::prelude::*;

fn block(x: u32, y: u32, width: u32, height: u32, samples: Range<u32>) -> Block {
    Block { window: Rect { x, y, width, height }, samples }
}

const WHOLE: Rect = Rect { x: 3, y: 1, width: 9, height: 7 };

/// Cuts a block into many at random places, as `cuts` say.
fn cut(whole: &Block, cuts: &[(u8, f64)]) -> Vec<Block> {
    let mut pieces = vec![whole.clone()];
    for (i, &(axis, place)) in cuts.iter().enumerate() {
        let index = (i * 7 + 3) % pieces.len();
        let piece = pieces.swap_remove(index);
        let at = |length: u32| (place * f64::from(length)) as u32;
        let Rect { x, y, width, height } = piece.window;
        let Range { start, end } = piece.samples.clone();
        let (a, b) = match axis {
            0 => {
                let n = at(width);
                (
                    block(x, y, n, height, piece.samples.clone()),
                    block(x + n, y, width - n, height, piece.samples),
                )
            }
            1 => {
                let n = at(height);
                (
                    block(x, y, width, n, piece.samples.clone()),
                    block(x, y + n, width, height - n, piece.samples),
                )
            }
            _ => {
                let n = start + at(end - start);
                (block(x, y, width, height, start..n), block(x, y, width, height, n..end))
            }
        };
        pieces.extend([a, b].into_iter().filter(|b| !b.is_empty()));
    }
    pieces
}

proptest! {
    #[test]
    fn pieces_of_a_block_make_the_block_again(
        cuts in prop::collection::vec((0_u8..3, 0.0..1.0_f64), 0..30),
        left_out in 0_usize..30,
    ) {
        let whole = Block { window: WHOLE, samples: 5..21 };
        let mut pieces = cut(&whole, &cuts);
        let all = Coverage::new(pieces.clone()).unwrap();
        prop_assert_eq!(all.blocks(), std::slice::from_ref(&whole));
        prop_assert!(all.missing(&whole).is_empty());

        let lost = pieces.swap_remove(left_out % pieces.len());
        let rest = Coverage::new(pieces.clone()).unwrap();
        prop_assert_eq!(rest.missing(&whole), Coverage::new([lost.clone()]).unwrap());
        prop_assert_eq!(rest.union(&Coverage::new([lost]).unwrap()), Ok(all.clone()));
        prop_assert_eq!(rest.to_text().parse::<Coverage>().unwrap(), rest.clone());

        // The counts say the same as the blocks.
        let counts = rest.counts(WHOLE);
        prop_assert_eq!(counts.iter().sum::<u64>(), rest.blocks().iter().map(Block::sample_count).sum::<u64>());
        let common = pieces.first().map(|p| all.overlap(&Coverage::new([p.clone()]).unwrap()));
        prop_assert!(common.is_none_or(|c| c.is_some()));
    }

    #[test]
    fn counts_are_enough_where_samples_come_in_order(counts in prop::collection::vec(0_u32..3, 63)) {
        let coverage = Coverage::of_counts(WHOLE, 4, counts.iter().copied());
        let back: Vec<u32> = coverage.counts(WHOLE).iter().map(|&n| n as u32).collect();
        prop_assert_eq!(back, counts);
        prop_assert!(coverage.blocks().iter().all(|b| b.samples.start == 4));
        prop_assert_eq!(Coverage::new(coverage.blocks().to_vec()), Ok(coverage));
    }
}

#[test]
fn overlaps_are_named() {
    let (a, b) = (block(0, 0, 4, 4, 0..8), block(3, 2, 4, 4, 7..9));
    let common = block(3, 2, 1, 2, 7..8);
    assert_eq!(Coverage::new([a.clone(), b.clone()]), Err(common.clone()));
    let sets = [a, b].map(|block| Coverage::new([block]).unwrap());
    assert_eq!(sets[0].union(&sets[1]), Err(common.clone()));
    assert_eq!(common.to_string(), "samples 7..8 of the 1×2 pixels at (3, 2)");
}

#[test]
fn texts_that_say_nothing_are_refused() {
    for text in [
        "1,2,3,4",
        "1,2,3,4,5",
        "1,2,3,x,0..1",
        "1,2,3,0..1",
        "4294967295,0,2,2,0..1",
        "0,0,1,1,0..2;0,0,1,1,1..3",
    ] {
        assert_eq!(text.parse::<Coverage>(), Err(UnknownBlock(text.into())));
    }
    assert_eq!("".parse::<Coverage>(), Ok(Coverage::default()));
}
