// Hands out the colours of a batch of views, and leaves their film empty for the next one.

/// The pixels of the film: sum and count, sum of squares and invalid samples.
@group(3) @binding(0) var<storage, read_write> film: array<array<vec4u, 2>>;
/// For each, the sum of its samples, and how many they are: valid ones in the lower half of the word, invalid ones above.
@group(3) @binding(1) var<storage, read_write> colors: array<vec4u>;

@compute @workgroup_size(64)
fn hand_out_colors(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let pixel = id.y * groups.x * 64u + id.x;
    if pixel >= arrayLength(&colors) {
        return;
    }
    let sum = film[pixel][0];
    let counts = sum.w | (film[pixel][1].w << 16u);
    colors[pixel] = vec4u(sum.xyz, counts);
    film[pixel][0] = vec4u(0u);
    film[pixel][1] = vec4u(0u);
}
