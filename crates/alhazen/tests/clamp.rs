//! `clamp_indirect`: off it does nothing, on it bounds what a sample gathers after its first
//! bounce.

mod common;

use alhazen::{Integrator, Job, LoadOptions, PathSettings, Scene, Source};
use common::{job, render};

fn cornell() -> Scene {
    Source::parse("cornell").load(&LoadOptions::default()).expect("built in").scene
}

fn settings(scene: &Scene, max_depth: u32, clamp_indirect: Option<f32>, splitting: u32) -> Job {
    let path = PathSettings {
        max_depth,
        clamp_indirect,
        splitting,
        roulette_start: u32::MAX,
        ..PathSettings::default()
    };
    Job { integrator: Integrator::Path(path), ..job(scene, 24, 24, 1) }
}

#[test]
fn a_limit_that_nothing_reaches_changes_no_bit() {
    let scene = cornell();
    for splitting in [1, 3] {
        let picture = |clamp| render(&scene, &settings(&scene, 8, clamp, splitting), 4).to_image();
        assert_eq!(picture(None), picture(Some(1e30)));
    }
}

#[test]
fn what_a_sample_gathers_indirectly_is_bounded() {
    const MOST: f32 = 1e-3;
    const DEPTH: u32 = 8;
    let scene = cornell();
    for splitting in [1, 3] {
        let picture = |depth, clamp| render(&scene, &settings(&scene, depth, clamp, splitting), 1).to_image();
        // The same random numbers: what differs is what longer paths add.
        let direct = picture(2, None);
        let indirect = |clamp| {
            let all = picture(DEPTH, clamp);
            all.data().iter().zip(direct.data()).map(|(all, direct)| all - direct).fold(f32::MIN, f32::max)
        };
        // A light sample and light come upon at each vertex.
        let bound = MOST * 2.0 * (DEPTH - 2) as f32;
        let (free, limited) = (indirect(None), indirect(Some(MOST)));
        assert!(free > 2.0 * bound, "the scene has indirect light: {free}");
        assert!(limited > 0.0 && limited < 1.01 * bound + 1e-6, "{limited} is more than {bound}");
    }
}
