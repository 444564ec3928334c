// What of the scene moves while the shutter is open, at the time of the invocation's ray. Only
// where SCENE_MOVES is defined.
//
// The words before the emitter boxes say where the tables of motions begin: segments, ranges of
// them for instances, and for lights ranges and the matrices that lead to the spaces that lights
// carry along.

#import ray_time, scene, texels
#import optics::light, optics::motion, optics::moving_light

fn motion_segment(at: u32) -> MotionSegment {
    return MotionSegment(words_vec4(at), words_vec4(at + 4u), words_vec4(at + 8u), words_vec4(at + 12u),
        words_vec4(at + 16u), words_vec4(at + 20u), words_vec4(at + 24u), words_vec4(at + 28u));
}

/// The transform of a motion now. `range`: its first segment, and how many there are.
fn motion_now(range: vec2u) -> AffineRows {
    let place = motion_place(ray_time, range.y);
    return motion_at(motion_segment(words[scene.emitter_boxes - 3u] + 32u * (range.x + place.segment)), place.fraction);
}

/// The segments of an instance; none if it stands still.
fn instance_motion(instance: u32) -> vec2u {
    let at = words[scene.emitter_boxes - 2u] + 2u * instance;
    return vec2u(words[at], words[at + 1u]);
}

/// Rows of the matrix from object to world space, now.
fn object_to_world_now(instance: u32) -> array<vec4f, 3> {
    let range = instance_motion(instance);
    if range.y == 0u {
        return instances[instance].object_to_world;
    }
    let m = motion_now(range);
    return array<vec4f, 3>(m.x, m.y, m.z);
}

/// Rows of the matrix from world to object space, now.
fn world_to_object_now(instance: u32) -> array<vec4f, 3> {
    let range = instance_motion(instance);
    if range.y == 0u {
        return instances[instance].world_to_object;
    }
    let m = affine_inverse(motion_now(range));
    return array<vec4f, 3>(m.x, m.y, m.z);
}

/// Where the motion of a light is: its range of segments, and the matrix from the world in the
/// middle.
fn light_motion(index: u32) -> u32 {
    return words[scene.emitter_boxes - 1u] + 14u * index;
}

/// A light where it is now; `light`: as it is in the middle.
fn light_now(index: u32, light: Light) -> Light {
    let at = light_motion(index);
    let range = vec2u(words[at], words[at + 1u]);
    if range.y == 0u {
        return light;
    }
    let rest = AffineRows(words_vec4(at + 2u), words_vec4(at + 6u), words_vec4(at + 10u));
    return moved_light(light, affine_product(motion_now(range), rest));
}

/// Rows of the matrix from world to object space, now, of a textured sphere. `places`: where they
/// are if it stands still.
fn light_to_object_now(index: u32, places: u32) -> array<vec4f, 3> {
    let at = light_motion(index);
    let range = vec2u(words[at], words[at + 1u]);
    if range.y == 0u {
        return array<vec4f, 3>(words_vec4(places), words_vec4(places + 4u), words_vec4(places + 8u));
    }
    let m = affine_inverse(motion_now(range));
    return array<vec4f, 3>(m.x, m.y, m.z);
}
