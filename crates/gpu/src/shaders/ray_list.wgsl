// Rays from a list, and what they hit: for scripts and benchmarks. Nothing is shaded.
//
// `question` says what is asked of a ray; of any hit only the instance is known then, NONE or something else:
//   fn ask(ray: Ray, salt: u32, wanted: bool) -> Hit

#import question, ray, scene

struct RayList {
    count: u32,
    // Rays in a row. Those of eight neighbours in each of eight rows are traced together.
    width: u32,
}

@group(2) @binding(0) var<uniform> ray_list: RayList;
@group(2) @binding(1) var<storage, read> rays: array<Ray>;
@group(2) @binding(2) var<storage, read_write> hits: array<Hit>;

fn answer_ray(at: vec2u) {
    let index = at.y * ray_list.width + at.x;
    let wanted = at.x < ray_list.width && index < ray_list.count;
    let hit = ask(rays[select(0u, index, wanted)], index, wanted);
    if wanted {
        hits[index] = hit;
    }
}
