// Which lights count where, if weak light may be left out.

#import film, lights, scene
#import optics::constants, optics::light

/// Where a light counts. One whose texture may be brighter than its mean counts everywhere.
fn counting_reach(index: u32) -> LightReach {
    if lights[index].textured_material != NONE {
        return LightReach(vec3f(0.0), FAR);
    }
    return light_reach(load_light(index), view.light_cutoff, view.falloff);
}

/// Whether a light counts at a point.
fn light_counts(index: u32, p: vec3f) -> bool {
    if view.light_cutoff <= 0.0 {
        return true;
    }
    return is_reached(counting_reach(index), p);
}
