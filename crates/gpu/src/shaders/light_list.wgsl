// Few lights, all that is known of which stands in the scene's constants.

#import texels
#import optics::light_tree

/// What is known of the light at a place of the list.
fn listed_group(place: u32) -> LightGroup {
    let sphere = scene.light_list[3u * place];
    let axis = scene.light_list[3u * place + 1u];
    let cone = scene.light_list[3u * place + 2u];
    return LightGroup(sphere.xyz, sphere.w, axis.w, axis.xyz, cone.x, cone.y, cone.z, cone.w);
}

/// Index of the light at a place of the list.
fn listed_light(place: u32) -> u32 {
    return scene.light_list_indices[place / 4u][place % 4u];
}
