// From the world to clip space.

/// Clip position of a point, by a map that is relative to `eye`.
fn clip_from(map: mat4x4f, eye: vec3f, point: vec3f) -> vec4f {
    return map * vec4f(point - eye, 1.0);
}
