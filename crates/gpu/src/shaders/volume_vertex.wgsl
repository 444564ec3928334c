// What happens to a path through media between its vertices and at them: the same decisions with the same random numbers as
// the CPU's `volumes`. Nothing here asks a tracer. The paths are those of `path_vertex.wgsl`.

#import film, lights, material, path_vertex, rays, scattering, surface, texels, variant
#import volume_media
#import optics::constants, optics::frame, optics::interiors, optics::light, optics::light_tree
#import optics::math, optics::medium, optics::path, optics::random, optics::vertex, optics::volume

/// A path that knows what it is in.
struct VolumePath {
    path: Path,
    inside: Interiors,
    /// Segments so far, whatever they ended at.
    segments: u32,
    /// Where the path took its direction, and how far it has come since then.
    vertex: vec3f,
    since_vertex: f32,
}

/// A straight way through boundaries of media, on which somebody looks for something.
struct Way {
    origin: vec3f,
    /// Length of what is left of it, metres.
    end: f32,
    direction: vec3f,
    /// Boundaries passed.
    crossings: u32,
    /// To a light: what it adds to the sample by all that was passed. Zero: nobody needs to ask.
    contribution: vec3f,
    /// State of the stream of random numbers for what was passed.
    stream: u32,
    inside: Interiors,
}

/// The path ends where it is.
const EVENT_NONE: u32 = 0u;
/// It is behind a boundary, and goes straight on.
const EVENT_CROSSING: u32 = 1u;
const EVENT_IN_MEDIUM: u32 = 2u;
const EVENT_ON_SURFACE: u32 = 3u;

/// Where a path comes to at the end of a segment.
struct PathEvent {
    /// ARRIVES_….
    kind: u32,
    // The others are of a point in a medium.
    position: vec3f,
    anisotropy: f32,
    /// Whether the medium is the inside of what looks like a surface, so that the point does not count as a vertex.
    subsurface: bool,
    /// Whether light gets out without being bent.
    open: bool,
}

/// How far a path gets in a medium.
struct Stop {
    scattered: bool,
    /// Metres along the ray.
    distance: f32,
}

fn start_volume_path(pixel: vec2u, sample: u32, inside: Interiors) -> VolumePath {
    let path = start_path(pixel, sample);
    return VolumePath(path, inside, 0u, path.origin, 0.0);
}

fn no_way() -> Way {
    return Way(vec3f(0.0), 0.0, vec3f(0.0), 0u, vec3f(0.0), 0u, interiors_nothing());
}

/// A way without end.
fn way_along(origin: vec3f, direction: vec3f) -> Way {
    var way = no_way();
    way.origin = origin;
    way.direction = direction;
    way.end = RAY_END;
    return way;
}

/// Random numbers of the current segment and the vertex at its end.
fn draw(walk: VolumePath, pair: u32) -> vec2f {
    return sample_2d(walk.path.sampler, segment_pair(walk.segments) + pair);
}

/// Follows a path through a grid's medium, which it may scatter in: delta tracking.
fn track(walk: ptr<function, VolumePath>, segment: Segment) -> Stop {
    let origin = (*walk).path.origin;
    let direction = (*walk).path.direction;
    let majorant = majorant_of(segment.medium, segment.grid);
    let part = within_grid(origin, direction, segment);
    if majorant <= 0.0 || part.far <= part.near {
        return Stop(false, 0.0);
    }
    var stream = stream_start((*walk).path.sampler, (*walk).segments, STREAM_PATH);
    var t = part.near;
    for (var i = 0u; i < MOST_COLLISIONS; i++) {
        t += collision_distance(majorant, stream_draw(&stream));
        if t >= part.far {
            break;
        }
        let here = diluted(segment.medium, grid_density(segment.grid, origin + direction * t));
        let throughput = (*walk).path.state.throughput;
        (*walk).path.state.radiance += throughput * here.emission * (1.0 / majorant);
        let c = collide(here, majorant, throughput, stream_draw(&stream));
        (*walk).path.state.throughput = throughput * c.weight;
        if c.scattered {
            return Stop(true, t);
        }
        if max_component((*walk).path.state.throughput) <= 0.0 {
            break;
        }
    }
    return Stop(false, 0.0);
}

/// Goes through a medium: adds what it emits, and says where the path scatters in it, if it does.
fn pass_through(walk: ptr<function, VolumePath>, segment: Segment) -> Stop {
    if segment.grid != NONE {
        return track(walk, segment);
    }
    let way = segment.end - segment.start;
    let throughput = (*walk).path.state.throughput;
    (*walk).path.state.radiance += throughput * medium_emitted(segment.medium, way);
    if !medium_scatters(segment.medium) {
        (*walk).path.state.throughput = throughput * transmittance(medium_extinction(segment.medium), way);
        return Stop(false, 0.0);
    }
    let sample = medium_sample(segment.medium, throughput, way, draw(*walk, PAIR_DISTANCE));
    (*walk).path.state.throughput = throughput * sample.weight;
    return Stop(sample.scattered, segment.start + sample.distance);
}

/// Goes on to the next surface at distance `t`, if the ray `hits` one, or to where the path scatters before it; adds the light
/// found on the way and at its end.
fn advance(walk: ptr<function, VolumePath>, hits: bool, t: f32, s: Surface) -> PathEvent {
    var event = PathEvent(EVENT_NONE, vec3f(0.0), 0.0, false, false);
    if (*walk).segments >= MOST_SEGMENTS {
        return event;
    }
    (*walk).segments += 1u;
    let origin = (*walk).path.origin;
    let direction = (*walk).path.direction;
    let segment = segment_of((*walk).inside, origin, direction, select(FAR, t, hits), hits, s);
    let stop = pass_through(walk, segment);
    if stop.scattered {
        let distance = stopping_distance(origin, stop.distance, segment.end);
        (*walk).path.length += distance;
        let position = origin + direction * distance;
        return PathEvent(EVENT_IN_MEDIUM, position, segment.medium.anisotropy, segment.subsurface, segment.open);
    }
    if !hits {
        (*walk).path.state = shade_miss((*walk).path, (*walk).vertex);
        return event;
    }
    (*walk).since_vertex += t;
    (*walk).path.length += t;
    if passes((*walk).inside, s) {
        (*walk).inside = crossed((*walk).inside, s);
        (*walk).path.origin = ray_origin(s, false);
        event.kind = EVENT_CROSSING;
        return event;
    }
    let emitted = surface_emission(s, pixel_spread() * (*walk).path.length);
    if emitted.x + emitted.y + emitted.z > 0.0 {
        let pdf = surface_light_pdf(s, (*walk).vertex, (*walk).path.sampling_normal, direction, (*walk).since_vertex);
        let before = (*walk).path.state.radiance;
        (*walk).path.state = limit_found(path_add_emission((*walk).path.state, emitted, pdf, MIS), before);
    }
    event.kind = EVENT_ON_SURFACE;
    return event;
}

/// Goes on from `origin` after scattering at `vertex`.
fn leave(walk: ptr<function, VolumePath>, vertex: vec3f, origin: vec3f, wi: vec3f) {
    (*walk).path.origin = origin;
    (*walk).path.direction = wi;
    (*walk).vertex = vertex;
    (*walk).since_vertex = 0.0;
}

/// What scatters light where a path has arrived: a surface, prepared for the path's direction, or the phase function.
struct Scatterer {
    bsdf: Scattering,
    frame: Frame,
    wo: vec3f,
    /// What is behind the surface.
    through: Interiors,
}

/// Next-event estimation and the path's continuation where it has arrived. Returns whether there is one; `way` becomes the
/// question whether a light sample counts.
///
/// Points below a surface are steps of a random walk, which do not count as vertices; where that surface hides all lights,
/// none is sampled, and what the path finds counts in full.
fn scatter_where(walk: ptr<function, VolumePath>, at: PathEvent, seen: Surface, way: ptr<function, Way>) -> bool {
    let in_medium = at.kind == EVENT_IN_MEDIUM;
    let hidden = at.subsurface && !at.open;
    let depth = (*walk).path.state.depth;
    var s = seen;
    var scatterer: Scatterer;
    var position = at.position;
    var samples_light = !hidden && scene.light_count > 0u;
    (*walk).path.sampling_normal = select((*walk).path.sampling_normal, ALL_SIDES, samples_light && in_medium);
    if at.subsurface {
        // What lights bring to a random walk counts as indirect light: see `limit_sampled`.
        (*walk).path.state.depth = (*walk).segments;
    }
    if !in_medium {
        position = s.origin;
        scatterer = prepare_surface(*walk, &s);
        if !scatters(scatterer.bsdf) {
            return false;
        }
        samples_light = samples_light && scattering_has_smooth_part(scatterer.bsdf);
        if LIGHT_TREE && samples_light {
            let transmits = scattering_transmits(scatterer.bsdf);
            (*walk).path.sampling_normal = sampling_normal(scatterer.frame.normal, transmits);
        }
    }
    if samples_light {
        let light = sample_light(position, (*walk).path.sampling_normal, draw(*walk, PAIR_LIGHT));
        if in_medium {
            *way = way_from_medium(*walk, at, light);
        } else {
            *way = way_from_surface(*walk, s, scatterer, light);
        }
    }
    let u_lobe = draw(*walk, PAIR_LOBE);
    let u = draw(*walk, PAIR_BSDF);
    if !in_medium {
        return go_on_from_surface(walk, s, scatterer, u_lobe, u);
    }
    (*walk).path.state.depth = depth;
    let next = phase_scatter(-(*walk).path.direction, at.anisotropy, hidden, u);
    let steps = select(0u, (*walk).segments, at.subsurface);
    let continuation = continue_in_medium((*walk).path.state, next, steps, path_roulette(), u_lobe.y);
    (*walk).path.state = continuation.state;
    leave(walk, position, position, continuation.wi);
    return continuation.alive;
}

/// What a surface does; of nested bodies, by the indices of refraction on both of its sides.
fn prepare_surface(walk: VolumePath, s: ptr<function, Surface>) -> Scatterer {
    let material = (*s).material;
    var scatterer: Scatterer;
    scatterer.through = walk.inside;
    if is_body(material) {
        scatterer.through = crossed(walk.inside, *s);
        if bodies_nest() {
            (*s).relative_ior = relative_ior(walk.inside, *s);
        }
    }
    var u_model = 0.0;
    if wants_model_number(material) {
        u_model = draw(walk, PAIR_MODEL).x;
    }
    let footprint = pixel_spread() * walk.path.length;
    let throughput = walk.path.state.throughput;
    scatterer.bsdf = surface_scattering(*s, footprint, throughput, u_model, view.single_scatter != 0u);
    scatterer.frame = scattering_frame(scatterer.bsdf, *s);
    scatterer.wo = to_local(scatterer.frame, (*s).wo);
    return scatterer;
}

/// The way from a point in a medium to a light sample.
fn way_from_medium(walk: VolumePath, at: PathEvent, light: LightSample) -> Way {
    let phase = phase_value(-walk.path.direction, light.wi, at.anisotropy);
    let throughput = walk.path.state.throughput;
    let found = path_light_contribution(throughput, phase, light.radiance, light.pdf, light.delta, MIS);
    let contribution = limit_sampled(found, walk.path.state);
    let stream = stream_start(walk.path.sampler, walk.segments, STREAM_SHADOW);
    return Way(at.position, light.distance * SHADOW_END, light.wi, 0u, contribution, stream, walk.inside);
}

/// The way from a surface to a light sample.
fn way_from_surface(walk: VolumePath, s: Surface, scatterer: Scatterer, light: LightSample) -> Way {
    let ray = light_shadow_ray(walk.path, s, scatterer.frame, scatterer.bsdf, scatterer.wo, light);
    let stream = stream_start(walk.path.sampler, walk.segments, STREAM_SHADOW);
    var way = Way(ray.origin, ray.distance, ray.direction, 0u, ray.contribution, stream, walk.inside);
    if dot(light.wi, s.horizon) <= 0.0 {
        way.inside = scatterer.through;
    }
    return way;
}

/// The path's continuation at a surface. Returns whether there is one.
fn go_on_from_surface(
    walk: ptr<function, VolumePath>,
    s: Surface,
    scatterer: Scatterer,
    u_lobe: vec2f,
    u: vec2f,
) -> bool {
    let next = scattering_sample(scatterer.bsdf, scatterer.wo, u_lobe.x, u);
    let continuation = continue_from_surface((*walk).path.state, next, scatterer.frame, s.horizon,
        scattering_eta(scatterer.bsdf), path_roulette(), u_lobe.y);
    if !continuation.alive {
        return false;
    }
    (*walk).path.state = continuation.state;
    if next.transmitted {
        (*walk).inside = scatterer.through;
    }
    leave(walk, s.origin, ray_origin(s, continuation.above), continuation.wi);
    return true;
}

/// Follows a way to a light sample past a surface at distance `t`, if it `hits` one. Returns whether it goes on; if not, its
/// contribution is what the light adds.
fn follow_way(way: ptr<function, Way>, hits: bool, t: f32, s: Surface) -> bool {
    if hits && !passes((*way).inside, s) {
        (*way).contribution = vec3f(0.0);
        return false;
    }
    let origin = (*way).origin;
    let direction = (*way).direction;
    let segment = segment_of((*way).inside, origin, direction, select((*way).end, t, hits), hits, s);
    var stream = (*way).stream;
    (*way).contribution *= segment_transmittance(origin, direction, segment, &stream);
    (*way).stream = stream;
    if !hits || all((*way).contribution == vec3f(0.0)) {
        return false;
    }
    (*way).crossings += 1u;
    if (*way).crossings >= MOST_CROSSINGS {
        (*way).contribution = vec3f(0.0);
        return false;
    }
    (*way).inside = crossed((*way).inside, s);
    (*way).origin = ray_origin(s, false);
    (*way).end -= dot((*way).origin - origin, direction);
    return true;
}
