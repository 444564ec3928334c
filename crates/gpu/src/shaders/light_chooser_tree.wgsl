// Choosing among lights by what each can bring: a walk down a tree. Lists of few lights are trees of one node.

#import light_choice, scene, texels
#import optics::constants, optics::light_tree

/// Share of the choices that are uniform over all lights.
fn uniform_light_share() -> f32 {
    return word_f32(scene.light_tree + 1u);
}

/// What a path keeps to choose lights at a point, and to know later how likely a choice was.
fn light_key(p: vec3f, sampling_normal: u32) -> u32 {
    return sampling_normal;
}

/// Walks down the tree of lights. Bits of the remainder are used up.
fn choose_by_importance(p: vec3f, sampling_normal: u32, u: f32) -> LightChoice {
    let normal = octahedral_decode(sampling_normal);
    let width = node_width();
    var choice = LightChoice(0u, 1.0, u);
    var defends = words[scene.light_tree] != 0u;
    var link = 0u;
    while (link & LIGHT_NODE_LEAF) == 0u {
        let node = light_node(link);
        var importances: array<f32, LIGHT_NODE_WIDTH>;
        let together = node_importances(node, width, p, normal, &importances);
        let sum = node_weight(together, defends);
        let chosen = choice.remainder * sum;
        var child = child_choice_none();
        for (var i = 0u; i < width; i++) {
            child = child_choice_add(child, i, child_weight(importances[i], together, defends), chosen);
        }
        choice.probability *= light_share(child.weight, sum);
        if choice.probability <= 0.0 {
            return LightChoice(0u, 0.0, 0.0);
        }
        choice.remainder = child_remainder(child, chosen);
        link = words[node + LIGHT_NODE_LINKS + child.child];
        defends = false;
    }
    choice.index = link & LIGHT_NODE_INDEX;
    return choice;
}

/// Probability with which `choose_by_importance` takes a light.
fn probability_by_importance(index: u32, p: vec3f, sampling_normal: u32) -> f32 {
    let normal = octahedral_decode(sampling_normal);
    let width = node_width();
    let defends_root = words[scene.light_tree] != 0u;
    var place = words[scene.light_tree + LIGHT_TREE_PLACES + index];
    var probability = select(1.0, 0.0, place == NONE);
    while place != NONE {
        let node = light_node(place / LIGHT_NODE_WIDTH);
        let above = words[node + LIGHT_NODE_PLACE];
        let defends = defends_root && above == NONE;
        var importances: array<f32, LIGHT_NODE_WIDTH>;
        let together = node_importances(node, width, p, normal, &importances);
        let weight = child_weight(importances[place % LIGHT_NODE_WIDTH], together, defends);
        probability *= light_share(weight, node_weight(together, defends));
        place = above;
    }
    return probability;
}

/// Words of the tree of lights before the lights' places: whether the root's children are defended, and the share of choices that
/// are uniform over all lights.
const LIGHT_TREE_PLACES: u32 = 2u;

/// Children that a node can have: few lights are a list shorter than a node.
fn node_width() -> u32 {
    return min(scene.light_count, LIGHT_NODE_WIDTH);
}

/// Where node `index` of the tree of lights begins, in `words`.
fn light_node(index: u32) -> u32 {
    return scene.light_tree + LIGHT_TREE_PLACES + scene.light_count + LIGHT_NODE_WORDS * index;
}

/// How much each child of the node at word `node` promises, and all together.
fn node_importances(
    node: u32,
    width: u32,
    p: vec3f,
    normal: vec3f,
    importances: ptr<function, array<f32, LIGHT_NODE_WIDTH>>,
) -> NodeImportance {
    var together = node_importance_zero();
    for (var child = 0u; child < width; child++) {
        let importance = light_importance(light_group(node + child), p, normal);
        (*importances)[child] = importance;
        together = node_importance_add(together, importance);
    }
    return together;
}

/// What a node knows of a child. Numbers of one child are a node's width apart, from word `at` on.
fn light_group(at: u32) -> LightGroup {
    const STEP = LIGHT_NODE_WIDTH;
    let center = vec3f(word_f32(at), word_f32(at + STEP), word_f32(at + 2u * STEP));
    let axis = vec3f(word_f32(at + 5u * STEP), word_f32(at + 6u * STEP), word_f32(at + 7u * STEP));
    return LightGroup(center, word_f32(at + 3u * STEP), word_f32(at + 4u * STEP), axis, word_f32(at + 8u * STEP),
        word_f32(at + 9u * STEP), word_f32(at + 10u * STEP), word_f32(at + 11u * STEP));
}
