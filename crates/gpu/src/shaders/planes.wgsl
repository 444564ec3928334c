// Records of pixels and of paths lie in planes: the first 16 bytes of all of them, then the next 16 bytes of all, and so on.
// Neighbours in a workgroup read and write places beside each other then, four words at a time. As structs one after the other,
// records went to memory word by word, each word far from the neighbour's: `docs/performance.md` has what that cost.

/// A vector and a number, as a plane has them.
fn plane_words(v: vec3f, last: u32) -> vec4u {
    return vec4u(bitcast<vec3u>(v), last);
}

/// The same with a number that is no integer.
fn plane_floats(v: vec3f, last: f32) -> vec4u {
    return bitcast<vec4u>(vec4f(v, last));
}

/// The vector of `plane_words` and `plane_floats`.
fn plane_vector(words: vec4u) -> vec3f {
    return bitcast<vec3f>(words.xyz);
}
