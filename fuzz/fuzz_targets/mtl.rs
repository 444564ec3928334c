//! Any bytes as a material library, each material interpreted.
#![no_main]

use libfuzzer_sys::fuzz_target;
use scene::LoadReport;
use scene::load::obj;

fuzz_target!(|bytes: &[u8]| {
    let mut report = LoadReport::default();
    for material in obj::mtl::parse(bytes, &mut report) {
        let material = obj::interpret(&material, &mut report);
        assert!(material.base_color.is_finite() && material.emission.is_finite());
    }
});
