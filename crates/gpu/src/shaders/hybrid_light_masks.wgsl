// What `light_masks` holds: masks of clusters, a bit for each light; then which light samples are hidden, a word of each pixel
// after the other; then shafts.

#import film, hybrid_frame

/// Where a pixel's bits for sample `i` of 32 lights are, in `light_masks`.
fn hidden_word(pixel: u32, i: u32, word: u32) -> u32 {
    let masks = frame.clusters.x * frame.clusters.y * frame.clusters.z * frame.light_words;
    return masks + (i * frame.light_words + word) * view.window_width * view.window_height + pixel;
}
