// The picture as the network's filter sees it.

/// Three words of a pixel each (`post::PREPARED_VALUES`): scaled radiance and the albedo's first
/// value; the albedo's others and the normal's first two; the normal's last, the compressed
/// deviation, whether that is known, and zero.
@group(3) @binding(1) var<storage, read> picture: array<vec4f>;

struct DenoisePixel {
    /// Scaled radiance.
    colour: vec3f,
    albedo: vec3f,
    normal: vec3f,
    /// The compressed standard deviation of the irradiance, whether it is known, and zero.
    deviation: vec3f,
}

/// Pixel `place`, row by row.
fn picture_pixel(place: u32) -> DenoisePixel {
    let a = picture[3u * place];
    let b = picture[3u * place + 1u];
    let c = picture[3u * place + 2u];
    return DenoisePixel(a.xyz, vec3f(a.w, b.xy), vec3f(b.zw, c.x), c.yzw);
}

/// What irradiance is multiplied by.
fn demodulator_of(albedo: vec3f) -> vec3f {
    return albedo + 0.05;
}
