//! Convolutions by the device's matrix units (tensor cores, WMMA, XMX): which it has, and the text of the products.
//!
//! Loops over matrices are written out: an array of matrices that is indexed at run time would not stay in registers.

use crate::Gpu;
use std::fmt::Write;
use wgpu::{CooperativeMatrixProperties, CooperativeScalarType, Features};

/// Square matrices of 16-bit floats that the subgroups of a device multiply, with sums in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatrixUnits {
    /// Rows and columns: 8 or 16.
    pub side: u32,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
}

/// What devices need to use their matrix units.
pub(crate) const MATRIX_FEATURES: Features =
    Features::EXPERIMENTAL_COOPERATIVE_MATRIX.union(Features::SHADER_F16).union(Features::SUBGROUP);

impl MatrixUnits {
    /// Those of an adapter of which `features` may be used: the largest matrices. None where the driver chooses the size of
    /// subgroups.
    pub(crate) fn of(adapter: &wgpu::Adapter, features: Features) -> Option<Self> {
        let info = adapter.get_info();
        let has_one_size = info.subgroup_min_size == info.subgroup_max_size;
        if !features.contains(MATRIX_FEATURES) || !has_one_size {
            return None;
        }
        let properties = adapter.cooperative_matrix_properties();
        let fits = |side: u32| {
            let wanted = CooperativeMatrixProperties {
                m_size: side,
                n_size: side,
                k_size: side,
                ab_type: CooperativeScalarType::F16,
                cr_type: CooperativeScalarType::F32,
                saturating_accumulation: false,
            };
            properties.contains(&wanted)
        };
        let side = [16, 8].into_iter().find(|side| fits(*side))?;
        Some(Self { side, subgroup_size: info.subgroup_max_size })
    }

    /// Those of an open device, if it has the shared memory that the shader needs.
    pub(crate) fn usable(gpu: &Gpu) -> Option<Self> {
        /// Bytes of `chunk_inputs` and `row_sums` in `shaders/denoise_matrices.wgsl`.
        const SHARED: u32 = 18 * 10 * 24 * 2 + 8 * 16 * 16 * 4;
        gpu.matrix_units.filter(|_| gpu.limits.max_compute_workgroup_storage_size >= SHARED)
    }
}

/// Rows of pixels of a subgroup.
const ROWS: u32 = 2;
/// Pixels of a row, channels of a chunk, and channels of a block of outputs.
const BLOCK: u32 = 16;

/// The module with the entry point `convolve` for so many output channels.
pub(super) fn products(units: MatrixUnits, outputs: u32) -> String {
    let side = units.side;
    let parts = BLOCK / side;
    let (tiles, columns) = (ROWS * parts, outputs / side);
    let sums: Vec<(u32, u32)> = (0..tiles).flat_map(|t| (0..columns).map(move |c| (t, c))).collect();
    let mut text = format!(
        "enable f16;\nenable wgpu_cooperative_matrix;\n\
         #import denoise_inputs, denoise_matrices, denoise_shape\n\
         alias MatrixA = coop_mat{side}x{side}<f16, A>;\n\
         alias MatrixB = coop_mat{side}x{side}<f16, B>;\n\
         alias MatrixC = coop_mat{side}x{side}<f32, C>;\n\
         @compute @workgroup_size(SUBGROUPS * SUBGROUP_SIZE)\n\
         fn convolve(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32, \
         @builtin(subgroup_id) subgroup: u32) {{\n"
    );
    // Writing to a string cannot fail.
    for (t, c) in &sums {
        let _ = writeln!(text, "var sum_{t}_{c} = MatrixC();");
    }
    let _ = writeln!(
        text,
        "for (var chunk = 0u; chunk < chunk_count(); chunk++) {{\nload_chunk(group.xy, chunk, thread);\n\
         for (var tap = 0u; tap < 9u; tap++) {{\n\
         let at = (({ROWS}u * subgroup + tap / 3u) * HALO_WIDTH + tap % 3u) * PIXEL_STRIDE;\n\
         let w = (chunk * 9u + tap) * OUTPUTS * {BLOCK}u;"
    );
    for k in 0..parts {
        write_products(&mut text, side, k, [tiles, columns]);
    }
    text += "}\n}\n";
    for block in 0..outputs / BLOCK {
        for t in 0..tiles {
            for part in 0..parts {
                let at = t * side * BLOCK + part * side;
                let c = block * parts + part;
                let _ = writeln!(
                    text,
                    "coopStoreT(sum_{t}_{c}, &row_sums[subgroup * ROW_SUMS + {at}u], {BLOCK}u);"
                );
            }
        }
        let _ = writeln!(text, "write_block(group.xy, {block}u, thread);");
    }
    text + "}\n"
}

/// Adds the products of `side` input channels, part `k` of a chunk.
fn write_products(text: &mut String, side: u32, k: u32, [tiles, columns]: [u32; 2]) {
    let parts = BLOCK / side;
    for t in 0..tiles {
        let (row, x) = (t / parts, t % parts * side);
        let _ = writeln!(
            text,
            "let a_{k}_{t} = coopLoadT<MatrixA>(&chunk_inputs[at + ({row}u * HALO_WIDTH + {x}u) * PIXEL_STRIDE + {}u], PIXEL_STRIDE);",
            k * side
        );
    }
    for c in 0..columns {
        // Weights of a tap: [block of 16 outputs][16 inputs][16 outputs].
        let at = c / parts * BLOCK * BLOCK + k * side * BLOCK + c % parts * side;
        let _ = writeln!(text, "let b_{k}_{c} = coopLoadT<MatrixB>(&weights[w + {at}u], {BLOCK}u);");
        for t in 0..tiles {
            let _ = writeln!(text, "sum_{t}_{c} = coopMultiplyAdd(a_{k}_{t}, b_{k}_{c}, sum_{t}_{c});");
        }
    }
}
