//! The learned filter.

use super::*;
use film::{Image, metrics};

fn picture(stage: &mut Stage, settings: RealtimeSettings, frames: u32) -> Image {
    stage.begin();
    stage.frames(&view(0.0, settings), frames);
    stage.film().to_image()
}

/// What the network makes of a few frames is nearer to the truth than what time alone does, keeps
/// its light, and what is emitted stays as it is. Views of what goes on before are not filtered,
/// and the filter by edges is as before when it comes again.
pub(super) fn the_network_filters_what_frames_have_gathered(stage: &mut Stage) {
    let truth = picture(stage, RealtimeSettings { filter: false, ..settings() }, 400);
    let by_edges = picture(stage, settings(), 4);
    let unfiltered = picture(stage, RealtimeSettings { filter_passes: 0, ..settings() }, 4);
    let learned = RealtimeSettings { spatial: SpatialFilter::Learned, ..settings() };
    let filtered = picture(stage, learned, 4);
    let error = |image: &Image| metrics::rel_mse(&truth, image).expect("one size");
    let [before, after, edges] = [&unfiltered, &filtered, &by_edges].map(error);
    println!("relMSE {before} became {after}, by edges {edges}");
    assert!(after < before / 3.0, "{before} became {after}, by edges {edges}");
    // A view that stands still goes on to converge.
    let [many, many_by_time] = [learned, RealtimeSettings { filter_passes: 0, ..settings() }]
        .map(|settings| error(&picture(stage, settings, 64)));
    println!("after 64 frames {many}, without a filter {many_by_time}");
    assert!(
        many < after && many < 1.2 * many_by_time,
        "{many} after 64 frames, of time alone {many_by_time}"
    );
    for (found, expected) in filtered.mean().into_iter().zip(truth.mean()) {
        assert!((found / expected - 1.0).abs() < 0.04, "{found} instead of {expected}");
    }
    let shown = picture(stage, RealtimeSettings { show: FrameView::History, ..learned }, 2);
    assert!(shown.data().iter().all(|v| (0.0..=1.0).contains(v)) && shown.mean()[0] > 0.01);
    let again = error(&picture(stage, settings(), 4));
    assert!((again / edges - 1.0).abs() < 0.1, "{again} instead of {edges}");
    assert!(after < edges, "{after}, by edges {edges}");
    // Larger than before by what is bound for the network.
    assert!(stage.kernel.memory_bytes() > stage.buffers().memory_bytes());
}
