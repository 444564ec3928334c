//! The text for matrix units on devices that have none: each subgroup is one invocation, which
//! multiplies matrices by itself. So every index is tested wherever tests run; that devices
//! multiply matrices is theirs.

use super::*;
use crate::MatrixUnits;
use crate::denoise::passes::shape;

/// What stands for the device's functions. Matrices are the places where they begin; sums lie in an
/// array of the invocation.
const FUNCTIONS: &str = "
const SIDE: u32 = 16u;
var<private> sums: array<f32, OUTPUTS * 32u>;
fn multiply_add(a: u32, b: u32, sum: u32) {
    for (var row = 0u; row < SIDE; row++) {
        for (var column = 0u; column < SIDE; column++) {
            var products = 0.0;
            for (var k = 0u; k < SIDE; k++) {
                products += f32(chunk_inputs[a + row * PIXEL_STRIDE + k]) * f32(weights[b + column * 16u + k]);
            }
            sums[(sum * SIDE + row) * SIDE + column] += products;
        }
    }
}
fn store(sum: u32, at: u32) {
    for (var i = 0u; i < SIDE * SIDE; i++) { row_sums[at + i / SIDE * 16u + i % SIDE] = sums[sum * SIDE * SIDE + i]; }
}
";

/// The text of products with those functions instead of the device's.
fn emulated(outputs: u32) -> String {
    let mut text = FUNCTIONS.to_owned();
    let mut sums = 0;
    for line in matrices::products(outputs).lines() {
        let line = match line.strip_suffix(" = MatrixC();").and_then(|line| line.strip_prefix("var ")) {
            Some(name) => {
                sums += 1;
                format!("let {name} = {}u;", sums - 1)
            }
            None => line.replace(", @builtin(subgroup_id) subgroup: u32) {", ") {\nlet subgroup = thread;"),
        };
        let is_of_device = line.contains("wgpu_cooperative_matrix") || line.starts_with("alias");
        let call = line.split_once(" = coopMultiplyAdd(").map(|(_, of)| format!("multiply_add({of}"));
        let line = call.unwrap_or(line).replace("coopStoreT(", "store(").replace(", &row_sums[", ", ");
        let line = line.replace("coopLoadT<MatrixA>(&chunk_inputs[", "(").replace("], PIXEL_STRIDE);", ");");
        let line = line.replace("coopLoad<MatrixB>(&weights[", "(").replace("], 16u);", ");");
        text += if is_of_device { "" } else { &line };
        text += "\n";
    }
    assert!(!text.contains("coop"), "{text}");
    text
}

/// The network on the device, with emulated products.
fn network(gpu: &Gpu) -> GpuNetwork {
    let units = MatrixUnits { subgroup_size: 1 };
    let products = Products::Matrices(units);
    let linkage = |id: PassId| match id {
        PassId::Convolve(outputs) => id
            .linkage(products)
            .generate("denoise_shape", shape(outputs, Some(units)))
            .generate("denoise_products", emulated(outputs)),
        _ => id.linkage(products),
    };
    let weights = NetworkWeights::trained().expect("weights");
    let weights = DeviceWeights::upload(gpu, &weights, products).expect("memory");
    GpuNetwork { products, weights, passes: Passes::new(gpu, products, linkage).expect("compiled") }
}

#[test]
fn products_of_matrices_are_the_cpus() {
    let test = "products_of_matrices_are_the_cpus";
    let Some(gpu) = crate::open_for_test(test, &GpuOptions::default()) else { return };
    if !gpu.features.contains(Features::SHADER_F16) {
        return;
    }
    // Four invocations do the work of a workgroup: small pictures only.
    let picture = Picture::noisy(20, 27, 1.0);
    let expected = Network::trained().denoise(&picture.input());
    let network = network(&gpu);
    let found = difference(&denoised(&gpu, &network, &picture), &expected);
    println!("{found:.2e}");
    assert!(found <= tolerance(network.products()), "{found:e}");
}
