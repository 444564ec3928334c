//! Records that the CPU and shaders share: one declaration, two languages.
//!
//! A record is a structure of a `#[wgsl]` module, so rustc and WGSL see the same fields in the same order. Rust puts
//! 4-byte fields one after the other; WGSL aligns `vec2f` to 8 bytes and `vec3f` and `vec4f` to 16. Fields are ordered
//! so that both agree without gaps, which a test checks by naga's layout ([`WgslRecord`] is how it finds the size).

/// A structure whose bytes a back end copies to the device as they are.
pub trait WgslRecord: bytemuck::NoUninit {
    /// The structure's name in WGSL.
    const NAME: &'static str;
}

/// Declares that structures of `#[wgsl]` modules are plain data: `wgsl_records!(Instance, Vertex);`.
///
/// Each has to be `Copy` and `repr(C)`, with fields that are 4-byte numbers, `repr(u32)` enumerations, or vectors and
/// arrays of these, so that it has no padding.
#[macro_export]
macro_rules! wgsl_records {
    ($($record:ident),+ $(,)?) => {
        $(
            const _: () = assert!(
                size_of::<$record>() % 4 == 0 && align_of::<$record>() == 4,
                "a record has only fields of 4 bytes and vectors of them",
            );

            // SAFETY: as the macro asks, the record is `Copy` and `repr(C)`, and all of its fields are 4-byte numbers
            // or vectors and arrays of them: it has alignment 4, and no byte of it is padding.
            unsafe impl ::bytemuck::NoUninit for $record {}

            impl $crate::WgslRecord for $record {
                const NAME: &'static str = stringify!($record);
            }
        )+
    };
}
pub(crate) use wgsl_records;
