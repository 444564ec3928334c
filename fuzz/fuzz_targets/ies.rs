//! Any bytes as a photometric file.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let _ = scene::load::ies::parse(bytes);
});
