// What the network sees: channel 4 k + 2 i + j of a pixel of half the resolution is feature k of
// the pixel in row i and column j of the 2×2 that it stands for. Twelve features, the last of which
// is zero.

#import denoise_numbers, denoise_picture, denoise_step

@group(3) @binding(2) var<storage, read_write> features: array<Quad>;

/// Irradiance as the network sees it: steep in the dark, logarithmic in the light.
fn compressed_irradiance(pixel: DenoisePixel) -> vec3f {
    return log(1.0 + 16.0 * (pixel.colour / demodulator_of(pixel.albedo))) / 3.0;
}

/// Writes three features of four pixels.
fn write_features(first: u32, a: vec3f, b: vec3f, c: vec3f, d: vec3f) {
    features[first] = Quad(vec4f(a.x, b.x, c.x, d.x));
    features[first + 1u] = Quad(vec4f(a.y, b.y, c.y, d.y));
    features[first + 2u] = Quad(vec4f(a.z, b.z, c.z, d.z));
}

@compute @workgroup_size(8, 8)
fn find_features(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= denoise_step.size) {
        return;
    }
    let pitch = 2u * denoise_step.size.x;
    let at = 2u * id.y * pitch + 2u * id.x;
    let a = picture_pixel(at);
    let b = picture_pixel(at + 1u);
    let c = picture_pixel(at + pitch);
    let d = picture_pixel(at + pitch + 1u);
    let irradiances = array(
        compressed_irradiance(a),
        compressed_irradiance(b),
        compressed_irradiance(c),
        compressed_irradiance(d),
    );
    let first = (id.y * denoise_step.size.x + id.x) * 12u;
    write_features(first, irradiances[0], irradiances[1], irradiances[2], irradiances[3]);
    write_features(first + 3u, a.albedo, b.albedo, c.albedo, d.albedo);
    write_features(first + 6u, a.normal, b.normal, c.normal, d.normal);
    write_features(first + 9u, a.deviation, b.deviation, c.deviation, d.deviation);
}
