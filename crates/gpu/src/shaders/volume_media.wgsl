// What rays go through: the media of bodies and between them, and densities on grids. Decisions are the optics'
// (`interiors`, `volume`); here is what fetches records. Only in shaders of paths that know what they are in.
//
// Media and grids lie in `words`; MEDIUM_… and GRID_… are the places of their fields, in words.

#import medium_constants, scene, scene_records, surface, texels
#import optics::constants, optics::interiors, optics::intersect, optics::material, optics::math
#import optics::medium, optics::random, optics::volume

/// A part of a ray that lies in one medium.
struct Segment {
    /// Where its density is 1.
    medium: Medium,
    /// Where the grid of its density begins, in `words`, or NONE: 1 everywhere.
    grid: u32,
    /// Whether that is the inside of what looks like a surface.
    subsurface: bool,
    /// Whether light gets out of it without being bent.
    open: bool,
    /// Where it begins and ends, metres along the ray.
    start: f32,
    end: f32,
}

fn is_body(material: u32) -> bool {
    return (materials[material].flags & MATERIAL_BODY) != 0u;
}

fn is_boundary(material: u32) -> bool {
    return materials[material].model == ModelTag_Boundary;
}

fn bodies_nest() -> bool {
    return (scene.volume_flags & VOLUMES_NEST) != 0u;
}

/// What is around a ray after crossing the surface of a body from the side that is seen.
fn crossed(inside: Interiors, s: Surface) -> Interiors {
    return interiors_cross(inside, s.material, materials[s.material].priority, s.front);
}

/// Whether light goes straight on: through the boundary of a medium, or the surface of a body that another one hides.
fn passes(inside: Interiors, s: Surface) -> bool {
    let hidden = bodies_nest() && is_body(s.material) && interiors_hide(inside, materials[s.material].priority);
    return hidden || is_boundary(s.material);
}

/// Index of refraction of a body, or of the space between bodies.
fn body_ior(material: u32) -> f32 {
    if material == NONE {
        return 1.0;
    }
    return materials[material].ior;
}

/// The index of refraction of the body at a surface over that of what is around it.
fn relative_ior(inside: Interiors, s: Surface) -> f32 {
    var around = inside;
    if !s.front {
        around = interiors_leave(inside, s.material);
    }
    return ior_across(body_ior(s.material), body_ior(interiors_current(around)));
}

/// The medium that begins at word `at`.
fn medium_at(at: u32) -> Medium {
    return Medium(words_vec3(at + MEDIUM_ABSORPTION), words_vec3(at + MEDIUM_SCATTERING),
        words_vec3(at + MEDIUM_EMISSION), word_f32(at + MEDIUM_ANISOTROPY));
}

/// The part of a ray of length `end` that is in a medium; one that does nothing if it is in none. `s`: where the ray ends, if
/// it `hits` a surface.
fn segment_of(inside: Interiors, origin: vec3f, direction: vec3f, end: f32, hits: bool, s: Surface) -> Segment {
    var seen = NONE;
    if hits && !s.front && is_body(s.material) {
        seen = s.material;
    }
    var segment = Segment(vacuum(), NONE, false, true, 0.0, end);
    var at = scene.fog_medium;
    let material = interiors_along(inside, seen);
    if material != NONE {
        at = materials[material].medium;
        segment.open = is_boundary(material);
        segment.medium.absorption = materials[material].absorption;
    } else if at != NONE {
        let part = below_height(origin.y, direction.y, scene.fog_top, end);
        segment.start = part.x;
        segment.end = part.y;
        if part.y <= part.x {
            at = NONE;
            segment.end = part.x;
        }
    }
    if at != NONE {
        segment.medium = medium_at(at);
        segment.grid = words[at + MEDIUM_GRID];
        segment.subsurface = (words[at + MEDIUM_FLAGS] & MEDIUM_SUBSURFACE) != 0u;
    }
    return segment;
}

/// The next number of a stream.
fn stream_draw(stream: ptr<function, u32>) -> f32 {
    *stream = stream_next(*stream);
    return unit_float(*stream);
}

/// The extinction that paths are given in the grid at word `grid`; zero if it is empty.
fn majorant_of(medium: Medium, grid: u32) -> f32 {
    let diagonal = length(words_vec3(grid + GRID_HIGH) - words_vec3(grid + GRID_LOW));
    let majorant = grid_majorant(medium, word_f32(grid + GRID_LARGEST), diagonal);
    return select(0.0, majorant, is_finite(majorant));
}

/// The part of a segment within the bounds of its grid.
fn within_grid(origin: vec3f, direction: vec3f, segment: Segment) -> BoxHit {
    let low = words_vec3(segment.grid + GRID_LOW);
    let high = words_vec3(segment.grid + GRID_HIGH);
    return intersect_box(origin, 1.0 / direction, low, high, segment.start, segment.end);
}

/// The density at a point of the grid at word `grid`: trilinear between the centres of cells, constant from there to the
/// bounds.
fn grid_density(grid: u32, p: vec3f) -> f32 {
    let low = words_vec3(grid + GRID_LOW);
    let high = words_vec3(grid + GRID_HIGH);
    let columns = words[grid + GRID_SIZE];
    let rows = words[grid + GRID_SIZE + 1u];
    let x = grid_place(p.x, low.x, high.x, columns);
    let y = grid_place(p.y, low.y, high.y, rows);
    let z = grid_place(p.z, low.z, high.z, words[grid + GRID_SIZE + 2u]);
    let first = words[grid + GRID_FIRST];
    let near = first + z.cell * rows * columns;
    let far = first + z.next * rows * columns;
    let below = vec4u(near + y.cell * columns, near + y.next * columns, far + y.cell * columns, far + y.next * columns);
    var along_x: vec4f;
    for (var i = 0u; i < 4u; i++) {
        along_x[i] = grid_mix(x, word_f32(below[i] + x.cell), word_f32(below[i] + x.next));
    }
    return grid_mix(z, grid_mix(y, along_x.x, along_x.y), grid_mix(y, along_x.z, along_x.w));
}

/// An estimate of the transmittance of a grid's medium: ratio tracking.
fn ratio_track(origin: vec3f, direction: vec3f, segment: Segment, stream: ptr<function, u32>) -> vec3f {
    var left = vec3f(1.0);
    let majorant = majorant_of(segment.medium, segment.grid);
    let part = within_grid(origin, direction, segment);
    if majorant <= 0.0 || part.far <= part.near {
        return left;
    }
    var t = part.near;
    for (var i = 0u; i < MOST_COLLISIONS; i++) {
        t += collision_distance(majorant, stream_draw(stream));
        if t >= part.far {
            break;
        }
        let here = diluted(segment.medium, grid_density(segment.grid, origin + direction * t));
        left *= ratio_tracking_factor(medium_extinction(here), majorant);
        let most = max_component(left);
        if most < LITTLE_LIGHT {
            if stream_draw(stream) >= most {
                return vec3f(0.0);
            }
            left *= 1.0 / most;
        }
    }
    return left;
}

/// The transmittance of a segment, or an estimate of it.
fn segment_transmittance(origin: vec3f, direction: vec3f, segment: Segment, stream: ptr<function, u32>) -> vec3f {
    if segment.grid != NONE {
        return ratio_track(origin, direction, segment, stream);
    }
    return transmittance(medium_extinction(segment.medium), segment.end - segment.start);
}
