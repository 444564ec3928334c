// Choosing between two lights by what each can bring. Paths keep the probability of the first light instead of the normal
// that it comes from, so that importances are computed once a vertex.

#import light_choice, light_list
#import optics::light_tree

/// Share of the choices that are uniform over all lights: as of lists.
fn uniform_light_share() -> f32 {
    return 0.0;
}

/// What a path keeps to choose lights at a point: the probability of the first one, negative if neither can bring anything.
fn light_key(p: vec3f, sampling_normal: u32) -> u32 {
    let normal = octahedral_decode(sampling_normal);
    let first = light_importance(listed_group(0u), p, normal);
    let second = light_importance(listed_group(1u), p, normal);
    let together = node_importance_add(node_importance_add(node_importance_zero(), first), second);
    let share = child_weight(first, together, true) / node_weight(together, true);
    return bitcast<u32>(select(-1.0, share, together.sum > 0.0));
}

/// Chooses a light; `key`: of `light_key`. Bits of the remainder are used up.
fn choose_by_importance(p: vec3f, key: u32, u: f32) -> LightChoice {
    let first = bitcast<f32>(key);
    let branch = light_branch(max(first, 0.0), select(1.0 - first, 0.0, first < 0.0), u);
    return LightChoice(listed_light(select(0u, 1u, branch.second)), branch.probability, branch.remainder);
}

/// Probability with which `choose_by_importance` takes a light.
fn probability_by_importance(index: u32, p: vec3f, key: u32) -> f32 {
    let first = bitcast<f32>(key);
    return select(select(1.0 - first, 0.0, first < 0.0), max(first, 0.0), index == listed_light(0u));
}
