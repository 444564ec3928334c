// One pass of the spatial filter: an average over 5 × 5 pixels, some steps apart, of those that show the same plane and differ by no
// more than their noise explains.

@group(3) @binding(10) var<storage, read> guides: array<Guide>;
@group(3) @binding(15) var<storage, read> signals_in: array<Signal>;
@group(3) @binding(16) var<storage, read_write> signals_out: array<Signal>;
@group(3) @binding(17) var<storage, read> keys: array<vec4f>;
/// x: pixels of a step in this pass.
@group(3) @binding(27) var<uniform> filter_step: vec4u;

/// Power of the cosine between normals.
const NORMAL_POWER: f32 = 64.0;
/// Standard deviations of luminance that leave 1/e of a weight.
const LUMINANCE_TOLERANCE: f32 = 4.0;
/// Radii of a pixel's footprint by which neighbours one pixel away may be off the plane.
const PLANE_TOLERANCE: f32 = 1.0;

/// The variances around a pixel, smoothed over 3 × 3: one pixel's own is too noisy to judge by.
fn smooth_variances(pixel: vec2u) -> vec2f {
    var sum = vec2f(0.0);
    var weights = 0.0;
    for (var i = 0; i < 9; i++) {
        let offset = vec2i(i % 3 - 1, i / 3 - 1);
        let there = vec2i(pixel) + offset;
        if any(there < vec2i(0)) || any(there >= vec2i(realtime.size)) {
            continue;
        }
        let weight = 1.0 / f32(1u << u32(abs(offset.x) + abs(offset.y)));
        let at = place_of(vec2u(there));
        sum += vec2f(signals_in[at].diffuse_variance, signals_in[at].specular_variance) * weight;
        weights += weight;
    }
    return sum / weights;
}

@compute @workgroup_size(8, 8)
fn filter_signals(@builtin(global_invocation_id) id: vec3u) {
    if !is_in_picture(id.xy) {
        return;
    }
    let at = place_of(id.xy);
    let center = signals_in[at];
    let distance = guides[at].distance;
    if distance <= 0.0 {
        signals_out[at] = center;
        return;
    }
    let key = keys[at];
    let normal = octahedral_decode(bitcast<u32>(key.w));
    let deviations = sqrt(max(smooth_variances(id.xy), vec2f(0.0)));
    let luminances = vec2f(luminance(center.diffuse), luminance(center.specular));
    let lobe = lobe_share(unpack_colors(guides[at].colors).roughness);
    let allowed = PLANE_TOLERANCE * realtime.pixel_spread * distance * sqrt(f32(filter_step.x)) + 1e-4 * distance;
    var sum = Signal(vec3f(0.0), 0.0, vec3f(0.0), 0.0);
    var weights = vec2f(0.0);
    for (var i = 0; i < 25; i++) {
        let steps = vec2i(i % 5 - 2, i / 5 - 2);
        let there = vec2i(id.xy) + steps * i32(filter_step.x);
        if any(there < vec2i(0)) || any(there >= vec2i(realtime.size)) {
            continue;
        }
        let other_at = place_of(vec2u(there));
        let other = signals_in[other_at];
        let other_key = keys[other_at];
        let cos_between = dot(normal, octahedral_decode(bitcast<u32>(other_key.w)));
        let geometry = spline_weight(u32(abs(steps.x))) * spline_weight(u32(abs(steps.y)))
            * normal_weight(cos_between, NORMAL_POWER)
            * plane_weight(dot(normal, other_key.xyz - key.xyz), allowed);
        let differences = vec2f(luminance(other.diffuse), luminance(other.specular)) - luminances;
        let of_lobe = select(lobe, 1.0, i == 12);
        let weight = geometry * vec2f(luminance_weight(differences.x, deviations.x, LUMINANCE_TOLERANCE),
            luminance_weight(differences.y, deviations.y, LUMINANCE_TOLERANCE) * of_lobe);
        sum.diffuse += other.diffuse * weight.x;
        sum.diffuse_variance += other.diffuse_variance * weight.x * weight.x;
        sum.specular += other.specular * weight.y;
        sum.specular_variance += other.specular_variance * weight.y * weight.y;
        weights += weight;
    }
    // The pixel itself always counts, so no weight is zero.
    signals_out[at] = Signal(sum.diffuse / weights.x, sum.diffuse_variance / (weights.x * weights.x),
        sum.specular / weights.y, sum.specular_variance / (weights.y * weights.y));
}
