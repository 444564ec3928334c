//! The settings of the page Image.

use super::{Setting, setting};
use crate::panels::Tab::Image;

/// All controls and numbers with a label.
pub const IMAGE: &[Setting] = &[
    setting(
        Image,
        "Above 1",
        "The share of pixels whose luminance after exposure is above 1, where linear display ends.",
        "clipping highlights histogram",
    ),
    setting(
        Image,
        "Least, mean, greatest",
        "Luminance of the picture before exposure.",
        "histogram statistics minimum maximum average",
    ),
    setting(
        Image,
        "Zebra",
        "Red stripes where a channel has the greatest display value, blue ones where all have the least.",
        "clipping overexposed blown highlights",
    ),
    setting(
        Image,
        "Pixel grid",
        "Pixels that are 12 points large have borders, from 54 points on values: linear red, green, blue.",
        "numbers inspect zoom",
    ),
    setting(
        Image,
        "Shown",
        "A and B on both sides of a line, one of them alone, or how far A is from B.",
        "compare flip toggle wipe",
    ),
    setting(
        Image,
        "Difference",
        "Of linear values, B being the reference r: a - r, |a - r|, (a - r)², |a - r| / (|r| + 0.01), \
         (a - r)² / (r² + 0.01).",
        "error map compare diff",
    ),
    setting(
        Image,
        "Split position",
        "Where the line between A and B is. 0: left edge, 1: right edge.",
        "compare wipe",
    ),
    setting(
        Image,
        "MSE",
        "Mean squared error of linear values over all pixels and channels.",
        "error metric compare",
    ),
    setting(
        Image,
        "Relative MSE",
        "Mean of (a - r)² / (r² + 0.01), r being the reference.",
        "error metric relmse compare",
    ),
    setting(
        Image,
        "PSNR",
        "Peak signal-to-noise ratio of sRGB values, decibels; greater is nearer.",
        "error metric compare",
    ),
    setting(
        Image,
        "FLIP",
        "What an observer notices when flipping between both, from 0 (nothing) to 1, at the exposure shown.",
        "error metric perceptual compare",
    ),
    setting(
        Image,
        "Mean difference",
        "Mean of the chosen difference over all pixels and channels.",
        "error bias compare",
    ),
    setting(
        Image,
        "Greatest difference",
        "Luminance of the chosen difference where it is greatest, and that pixel.",
        "error outlier firefly compare",
    ),
];
