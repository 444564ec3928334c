//! Broken data of `KHR_meshopt_compression` and `EXT_meshopt_compression`: an error or other elements, never a panic or more memory than was asked for.

use proptest::prelude::*;
use scene::LoadOptions;
use scene::load::meshopt::{Filter, MeshoptError, decode_sequence, decode_triangles, decode_vertices};

/// Bytes behind a valid header.
fn behind(header: u8) -> impl Strategy<Value = Vec<u8>> {
    proptest::collection::vec(any::<u8>(), 0..600).prop_map(move |mut bytes| {
        bytes.insert(0, header);
        bytes
    })
}

proptest! {
    #[test]
    fn any_attributes_end(version in 0u8..2, data in behind(0xa0), count in 0usize..600, size in 0usize..300) {
        let mut data = data;
        data[0] += version;
        match decode_vertices(&data, count, size) {
            Ok(elements) => prop_assert_eq!(elements.len(), count * size),
            Err(MeshoptError::ElementSize(found)) => prop_assert_eq!(found, size),
            Err(_) => {}
        }
    }

    #[test]
    fn any_triangles_end(version in 0u8..2, data in behind(0xe0), count in 0usize..1800) {
        let mut data = data;
        data[0] += version;
        if let Ok(indices) = decode_triangles(&data, count) {
            prop_assert_eq!(indices.len(), count);
        }
    }

    #[test]
    fn any_sequence_ends(data in behind(0xd1), count in 0usize..600) {
        if let Ok(indices) = decode_sequence(&data, count) {
            prop_assert_eq!(indices.len(), count);
        }
    }

    #[test]
    fn any_elements_are_filtered(mut data in proptest::collection::vec(any::<u8>(), 0..256), size in 0usize..20) {
        for filter in [Filter::Octahedral, Filter::Quaternion, Filter::Exponential, Filter::Color] {
            let length = data.len();
            let _ = filter.undo(&mut data, size);
            prop_assert_eq!(data.len(), length);
        }
    }
}

/// One wrong byte of a real file.
#[test]
fn broken_files_end() {
    let Some(shared) = testkit::require_shared("broken_files_end") else { return };
    let file = std::fs::read(shared.join("scenes/gt_BoxMeshopt/BoxMeshopt.glb")).expect("readable");
    let path = std::path::Path::new("broken.glb");
    let compressed = file.len() - 228;
    let mut refused = 0;
    for at in compressed..file.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut broken = file.clone();
            broken[at] ^= flip;
            let loaded = scene::load::gltf::load_bytes(path, &broken, &LoadOptions::default());
            refused += usize::from(loaded.is_err());
        }
    }
    assert!(refused > 20, "only {refused} broken files were refused");
}
