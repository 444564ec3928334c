//! Any bytes as compressed attributes and indices; the first two say how many, and of which size.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::load::meshopt::{Filter, decode_sequence, decode_triangles, decode_vertices};

fuzz_target!(|bytes: &[u8]| {
    let [count, size, data @ ..] = bytes else { return };
    let (count, size) = (usize::from(*count) * 7, usize::from(*size));
    let _ = decode_triangles(data, count);
    let _ = decode_sequence(data, count);
    if let Ok(mut elements) = decode_vertices(data, count, size) {
        for filter in [Filter::Octahedral, Filter::Quaternion, Filter::Exponential] {
            let _ = filter.undo(&mut elements, size);
        }
    }
});
