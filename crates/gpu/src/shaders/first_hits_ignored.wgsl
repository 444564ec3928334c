// What `direct` does at first hits where another pass records them: nothing.

#import surface

fn camera_missed(pixel: vec2u, sample: u32) {}
fn camera_hit(pixel: vec2u, sample: u32, s: Surface, distance: f32) {}
