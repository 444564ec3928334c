// Choosing among few lights by what each can bring: one node of a tree whose length the shader knows. All that is known of
// the lights stands in the scene's constants, and no place in them is computed, so that loops unroll and nothing is loaded.

#import light_choice, light_list, variant
#import optics::light_tree

/// Share of the choices that are uniform over all lights: importances alone decide, and every light is defended.
fn uniform_light_share() -> f32 {
    return 0.0;
}

/// What a path keeps to choose lights at a point, and to know later how likely a choice was.
fn light_key(p: vec3f, sampling_normal: u32) -> u32 {
    return sampling_normal;
}

/// Chooses a light in proportion to its weight. Bits of the remainder are used up.
fn choose_by_importance(p: vec3f, sampling_normal: u32, u: f32) -> LightChoice {
    let normal = octahedral_decode(sampling_normal);
    var importances: array<f32, LIGHT_LIST>;
    var together = node_importance_zero();
    for (var place = 0u; place < LIGHT_LIST; place++) {
        importances[place] = light_importance(listed_group(place), p, normal);
        together = node_importance_add(together, importances[place]);
    }
    let sum = node_weight(together, true);
    var choice = child_choice_none();
    for (var place = 0u; place < LIGHT_LIST; place++) {
        let weight = child_weight(importances[place], together, true);
        choice = child_choice_add(choice, listed_light(place), weight, u * sum);
    }
    return LightChoice(choice.child, light_share(choice.weight, sum), child_remainder(choice, u * sum));
}

/// Probability with which `choose_by_importance` takes a light.
fn probability_by_importance(index: u32, p: vec3f, sampling_normal: u32) -> f32 {
    let normal = octahedral_decode(sampling_normal);
    var own = 0.0;
    var together = node_importance_zero();
    for (var place = 0u; place < LIGHT_LIST; place++) {
        let importance = light_importance(listed_group(place), p, normal);
        own = select(own, importance, listed_light(place) == index);
        together = node_importance_add(together, importance);
    }
    return light_share(child_weight(own, together, true), node_weight(together, true));
}
