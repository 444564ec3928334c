//! Convolutions by the device's matrix units: whether it can do them, and the text of the products.
//!
//! Loops over matrices are written out: an array of matrices that is indexed at run time would not
//! stay in registers.

use crate::Gpu;
use crate::matrix_units::{MatrixUnits, SIDE};
use std::fmt::Write;

/// Rows of pixels of a subgroup.
const ROWS: u32 = 2;

/// The matrix units of an open device, if it has the shared memory and the invocations that the
/// shader needs.
pub(super) fn usable(gpu: &Gpu) -> Option<MatrixUnits> {
    /// Bytes of `chunk_inputs` and `row_sums` in `shaders/denoise_matrices.wgsl`.
    const SHARED: u32 = 18 * 10 * 24 * 2 + 8 * 16 * 16 * 4;
    /// `SUBGROUPS` there.
    const SUBGROUPS: u32 = 4;
    let limits = &gpu.limits;
    let fits = |units: &MatrixUnits| {
        limits.max_compute_workgroup_storage_size >= SHARED
            && limits.max_compute_invocations_per_workgroup >= SUBGROUPS * units.subgroup_size
    };
    gpu.matrix_units.filter(fits)
}

/// The module with the entry point `convolve` for so many output channels: subgroups add up, for
/// each block of outputs, the products of two rows of 16 pixels and the weights. A matrix is 16
/// pixels by the 16 channels of a chunk, or those by the 16 of a block.
pub(super) fn products(outputs: u32) -> String {
    let blocks = outputs / SIDE;
    let mut text = format!(
        "enable f16;\nenable wgpu_cooperative_matrix;\n\
         #import denoise_inputs, denoise_matrices, denoise_shape\n\
         alias MatrixA = coop_mat{SIDE}x{SIDE}<f16, A>;\n\
         alias MatrixB = coop_mat{SIDE}x{SIDE}<f16, B>;\n\
         alias MatrixC = coop_mat{SIDE}x{SIDE}<f32, C>;\n\
         @compute @workgroup_size(SUBGROUPS * SUBGROUP_SIZE)\n\
         fn convolve(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32, \
         @builtin(subgroup_id) subgroup: u32) {{\n"
    );
    let sums = |block| (0..ROWS).map(move |row| (row, format!("sum_{row}_{block}")));
    // Writing to a string cannot fail.
    for (_, sum) in (0..blocks).flat_map(sums) {
        let _ = writeln!(text, "var {sum} = MatrixC();");
    }
    text += "for (var chunk = 0u; chunk < chunk_count(); chunk++) {\nload_chunk(group.xy, chunk, thread);\n\
             for (var tap = 0u; tap < 9u; tap++) {\n";
    for row in 0..ROWS {
        let _ = writeln!(
            text,
            "let place_{row} = ({ROWS}u * subgroup + {row}u + tap / 3u) * HALO_WIDTH + tap % 3u;\n\
             let a_{row} = coopLoadT<MatrixA>(&chunk_inputs[place_{row} * PIXEL_STRIDE], PIXEL_STRIDE);"
        );
    }
    let _ = writeln!(text, "let first = (chunk * 9u + tap) * OUTPUTS * {SIDE}u;");
    for block in 0..blocks {
        // Of each block the inputs of an output lie side by side, and so does what a lane needs of
        // them.
        let at = block * SIDE * SIDE;
        let _ = writeln!(text, "let b_{block} = coopLoad<MatrixB>(&weights[first + {at}u], {SIDE}u);");
        for (row, sum) in sums(block) {
            let _ = writeln!(text, "{sum} = coopMultiplyAdd(a_{row}, b_{block}, {sum});");
        }
    }
    text += "}\n}\n";
    for block in 0..blocks {
        for (row, sum) in sums(block) {
            let at = row * SIDE * SIDE;
            let _ = writeln!(text, "coopStoreT({sum}, &row_sums[subgroup * ROW_SUMS + {at}u], {SIDE}u);");
        }
        let _ = writeln!(text, "write_block(group.xy, {block}u, thread);");
    }
    text + "}\n"
}
