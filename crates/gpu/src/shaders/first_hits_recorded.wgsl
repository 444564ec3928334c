// What `direct` does at first hits: it records them for auxiliary layers.

#import film, surface, variant

fn camera_missed(pixel: vec2u, sample: u32) {
    if WANTS_AOVS {
        record_miss(pixel, sample);
    }
}

fn camera_hit(pixel: vec2u, sample: u32, s: Surface, distance: f32) {
    if WANTS_AOVS {
        record_hit(pixel, sample, s, distance);
    }
}
