//! What frames keep of those before them.

use super::*;

/// Where nothing moves every sample counts, for ever: the past is not clipped, limited or
/// resampled.
pub(super) fn still_views_lose_nothing(stage: &mut Stage) {
    stage.begin();
    let frames = 40;
    stage.frames(&view(0.0, settings()), frames);
    let histories = stage.histories();
    let wall: Vec<_> = (0..AREA).filter(|&p| wall_behind(p, 0.0, 1.2).is_some()).collect();
    assert!(wall.len() > AREA / 8, "{} pixels of the wall", wall.len());
    for &pixel in &wall {
        let count = histories[pixel].diffuse_count;
        assert_eq!(count, frames as f32, "samples of pixel {pixel}");
    }
}

/// A camera that moves: motion is that of the projection, what was seen is found, and what comes
/// out from behind the ball has no past.
pub(super) fn moving_views_find_their_past(stage: &mut Stage) {
    stage.begin();
    let step = 1.8;
    stage.frames(&view(0.0, settings()), 8);
    stage.frames(&view(step, settings()), 1);
    let histories = stage.histories();
    let words: Vec<u32> = stage.read(stage.kernel.first_hits().expect("hits"));
    let pixels = crate::gbuffer::HybridPixel::from_planes(&words);
    let (mut seen, mut hidden) = (0, 0);
    for pixel in 0..AREA {
        let Some(point) = wall_behind(pixel, step, 1.1) else { continue };
        let expected = place(point, step) - place(point, 0.0);
        let motion = Vec2::from(pixels[pixel].motion());
        assert!((motion - expected).length() < 0.05, "pixel {pixel} moved by {motion}, not by {expected}");
        let before = place(point, 0.0);
        let inside = before.cmpgt(Vec2::ONE).all()
            && before.cmplt(Vec2::new(WIDTH as f32 - 1.0, HEIGHT as f32 - 1.0)).all();
        let count = histories[pixel].diffuse_count;
        if inside && is_seen(point, 0.0, 1.25) {
            seen += 1;
            assert!(count > 8.0, "pixel {pixel} has forgotten: {count} samples");
        } else if !is_seen(point, 0.0, 0.6) {
            hidden += 1;
            assert_eq!(count, 1.0, "pixel {pixel} remembers what it has not seen");
        }
    }
    assert!(seen > 100 && hidden > 10, "{seen} pixels seen before, {hidden} hidden");
}

/// One bad number in what is kept, and in what was shown: the next frame has none, and its
/// neighbours keep their past.
pub(super) fn what_is_no_number_is_gone(stage: &mut Stage) {
    stage.begin();
    stage.frames(&view(0.0, settings()), 6);
    let pixel = (0..AREA).rfind(|&p| wall_behind(p, 0.0, 1.3).is_some()).expect("a pixel of the wall");
    let bad = [f32::NAN; 4];
    let (histories, shown) = (&stage.buffers().histories[stage.odd()], &stage.buffers().shown[stage.odd()]);
    let at = |plane: usize| 16 * (plane * AREA + pixel) as u64;
    let write = |buffer, at, words: &[f32]| {
        crate::scene::upload::write_buffer_at(&stage.gpu, "bad", buffer, at, bytemuck::cast_slice(words))
    };
    (0..3).for_each(|plane| write(histories, at(plane), &bad).expect("memory"));
    // Whose it is stays.
    write(histories, at(3), &bad[..1]).expect("memory");
    write(shown, at(0), &bad).expect("memory");
    stage.frames(&view(0.0, settings()), 1);
    let (after, shown) = (stage.histories(), stage.read::<f32>(&stage.buffers().shown[stage.odd()]));
    assert!(after.iter().flat_map(|h| h.numbers).all(f32::is_finite), "what is kept");
    assert!(shown.iter().all(|x| x.is_finite()), "what is shown");
    assert_eq!(after[pixel - 1].diffuse_count, 7.0, "the neighbour's past");
}
