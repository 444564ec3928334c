// Each pixel chooses a light for its tile.

#import hybrid_pixels, lights, lights_found, realtime_found, realtime_frame, realtime_tiles, texels
#import optics::constants, optics::light_tree, optics::random, optics::reservoir

/// How far behind the tile's first candidate for its centre the nearest pixel is that sees anything.
var<workgroup> steps_to_center: atomic<u32>;

/// Random bits of a frame, other ones for each `number`.
fn presample_hash(number: u32) -> u32 {
    let of_frame = hash_combine(hash_combine(realtime.seed, realtime.number), realtime.sample);
    return hash_combine(of_frame ^ 0x6a09e667u, number);
}

/// Chooses a light for `center`; `u`: which; `rest`: another number for the bits that the choice uses up.
fn choose_for_tile(center: vec3f, u: f32, rest: f32) -> LightChoice {
    let branch = light_branch(tile_share(), 1.0 - tile_share(), u);
    if branch.second {
        let index = uniform_light(branch.remainder, scene.light_count);
        return LightChoice(index, tile_probability(index, center), 0.0);
    }
    var choice = choose_light(center, ALL_SIDES, branch.remainder, rest);
    if choice.probability > 0.0 {
        choice.probability =
            tile_light_probability(tile_share(), choice.probability, any_light_probability());
    }
    return choice;
}

@compute @workgroup_size(8, 8)
fn presample_lights(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let inside = is_in_picture(id.xy) && scene.light_count > 0u;
    let tile = candidate_tile_of(min(id.xy, realtime.size - 1u));
    let area = tile_area(tile);
    let index = local.y * tile.size.x + local.x;
    // Any pixel that sees something may be the centre, another one in each frame.
    let begin = presample_hash(place_of(tile.first)) % area;
    if local.x + local.y == 0u {
        atomicStore(&steps_to_center, area);
    }
    workgroupBarrier();
    if inside && first_hit(place_of(id.xy)).instance != NONE {
        atomicMin(&steps_to_center, (index + area - begin) % area);
    }
    workgroupBarrier();
    let steps = atomicLoad(&steps_to_center);
    if !inside || steps == area {
        return;
    }
    let at = place_of(id.xy);
    let center = tile_place(tile, (begin + steps) % area);
    let bits = presample_hash(~at);
    // One number from each of as many parts of the unit interval: what the tile has chosen is spread over all lights.
    let u = stratified_number(index, unit_float(bits), area);
    let choice = choose_for_tile(seen_point(center), u, unit_float(pcg_hash(bits)));
    let offer = in_plane(FOUND_OFFER, at);
    lights_found[offer] = vec4u(choice.index, bitcast<u32>(choice.probability), center, lights_found[offer].w);
}
