use super::*;
use glam::{dvec2, vec3};
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::time::Instant;

fn triangulate(corners: &[Vec3]) -> (Vec<[u32; 3]>, bool) {
    let mut triangles = Vec::new();
    let clean = Triangulator::default().polygon(corners, &mut triangles);
    (triangles, clean)
}

/// Twice the signed area of an outline.
fn shoelace(points: &[DVec2]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| (*a - points[0]).perp_dot(*b - points[0])).sum()
}

/// Fills an outline of the plane in several planes of space, both ways round: every triangle faces as the polygon does,
/// and together they have its area. Returns how many triangles there are.
fn assert_filled(points: &[DVec2]) -> usize {
    let points: Vec<DVec2> = points.iter().map(|p| p.as_vec2().as_dvec2()).collect();
    let area = shoelace(&points).abs();
    let mut count = 0;
    for place in 0..6 {
        let mut corners: Vec<Vec3> = points
            .iter()
            .map(|p| {
                let p = p.as_vec2();
                let mut corner = Vec3::ZERO;
                (corner[place % 3], corner[(place + 1) % 3]) = (p.x, p.y);
                corner
            })
            .collect();
        let mut outline = points.clone();
        if place >= 3 {
            corners.reverse();
            outline.reverse();
        }
        let (triangles, clean) = triangulate(&corners);
        assert!(clean, "{points:?}");
        let sign = shoelace(&outline).signum();
        let areas = triangles.iter().map(|t| sign * shoelace(&t.map(|i| outline[i as usize])));
        let areas: Vec<f64> = areas.collect();
        assert!(areas.iter().all(|a| *a >= 0.0), "{points:?}: {areas:?}");
        let sum: f64 = areas.iter().sum();
        assert!((sum - area).abs() <= 1e-9 * area, "{sum} instead of {area}: {points:?}");
        count = triangles.len();
    }
    count
}

fn assert_all_corners(points: &[DVec2]) {
    assert_eq!(assert_filled(points), points.len() - 2);
}

/// A band of constant height above a line that goes up and down.
fn band(line: impl Iterator<Item = DVec2> + Clone, height: f64) -> Vec<DVec2> {
    let lower: Vec<DVec2> = line.clone().map(|p| p - dvec2(0.0, height)).collect();
    line.chain(lower.into_iter().rev()).collect()
}

fn polar(radius: f64, angle: f64) -> DVec2 {
    DVec2::from_angle(angle) * radius
}

/// A spiral of `corners` corners with arms closer to each other than its edges are long.
fn spiral(corners: usize) -> Vec<DVec2> {
    let point = |i: usize, inset: f64| {
        let t = (i + 20) as f64 * 0.05;
        polar(t + inset, t)
    };
    let half = corners / 2;
    (0..half).map(|i| point(i, 0.0)).chain((0..half).rev().map(|i| point(i, 0.3))).collect()
}

#[test]
fn concave_quadrilaterals_are_split_at_the_reflex_corner() {
    let arrow = [dvec2(0.0, 0.0), dvec2(2.0, -1.0), dvec2(0.5, 0.0), dvec2(2.0, 1.0)];
    for shift in 0..4 {
        let mut corners = arrow;
        corners.rotate_left(shift);
        assert_all_corners(&corners);
    }
    let bow = [vec3(0.0, 0.0, 0.0), vec3(2.0, 1.0, 0.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 1.5, 0.0)];
    assert!(!triangulate(&bow).1, "it crosses itself");
    assert!(triangulate(&[bow[0], bow[2], bow[1], bow[3]]).1);
}

#[test]
fn shapes_that_turn_often_are_filled() {
    for count in [2, 5, 12, 60] {
        let zigzag = (0..count).map(|i| dvec2(f64::from(i), f64::from(i % 2) * 3.0));
        assert_all_corners(&band(zigzag, 0.5));
        let river = (0..count).map(|i| dvec2(f64::from(i) * 0.1, (f64::from(i) * 0.6).sin()));
        assert_all_corners(&band(river, 0.06));
        // Corners on the straight backs of teeth and gaps.
        let mut gear = Vec::new();
        for tooth in 0..count + 1 {
            for (radius, at) in [(0.8, 0.0), (1.0, 0.1), (1.0, 0.3), (0.8, 0.5), (0.8, 0.75)] {
                gear.push(polar(radius, (f64::from(tooth) + at) * TAU / f64::from(count + 1)));
            }
        }
        assert_all_corners(&gear);
        let mut comb = vec![dvec2(f64::from(count) * 2.0, 3.0), dvec2(1.0, 3.0), dvec2(0.0, 3.0)];
        for tooth in 0..count {
            let x = f64::from(tooth) * 2.0;
            comb.extend([dvec2(x, 0.0), dvec2(x + 0.5, 0.0), dvec2(x + 1.0, 0.0)]);
            comb.extend([dvec2(x + 1.0, 2.0), dvec2(x + 2.0, 2.0)]);
        }
        assert_all_corners(&comb);
        comb.iter_mut().for_each(|p| *p = dvec2(p.y, p.x));
        assert_all_corners(&comb);
    }
}

#[test]
fn holes_touching_corners_and_doubled_ones_are_filled() {
    let p = |x: i32, y: i32| dvec2(f64::from(x), f64::from(y));
    let square = [p(0, 0), p(9, 0), p(9, 9), p(0, 9)];
    let hole = [p(3, 3), p(3, 6), p(6, 6), p(6, 3)];
    // A slit from the square's first corner to the hole's; then with a corner in the middle of one side of it.
    let slit: Vec<DVec2> = [&square[..], &square[..1], &hole[..], &hole[..1]].concat();
    assert_eq!(shoelace(&slit), 2.0 * 72.0);
    assert_eq!(assert_filled(&slit), 8);
    let mut odd = slit.clone();
    odd.insert(5, p(1, 1));
    assert_filled(&odd);
    // The hole touches the outline: in a corner, and in the middle of an edge.
    let touching = [&square[..], &square[..1], &[p(3, 6), p(6, 3)]].concat();
    assert_filled(&touching);
    let on_edge = [p(0, 0), p(9, 0), p(9, 9), p(0, 9), p(0, 4), p(4, 6), p(4, 2), p(0, 4)];
    assert_filled(&on_edge);
    // Two squares that share a corner only.
    assert_filled(&[p(0, 0), p(2, 0), p(2, 2), p(4, 2), p(4, 4), p(2, 4), p(2, 2), p(0, 2)]);
    // Every corner twice, and an edge that leads out and back.
    let doubled: Vec<DVec2> = slit.iter().flat_map(|p| [*p, *p]).collect();
    assert_eq!(assert_filled(&doubled), 8);
    assert_eq!(assert_filled(&[&square[..], &[p(0, 4), p(-3, 4), p(0, 4)]].concat()), 3);
}

#[test]
fn what_bends_a_little_is_filled_as_what_does_not() {
    let river = (0..30).map(|i| dvec2(f64::from(i) * 0.1, (f64::from(i) * 0.6).sin()));
    let outline = band(river, 0.2);
    let corners: Vec<Vec3> = (0..outline.len())
        .map(|i| outline[i].as_vec2().extend((i as f32 * 12.9).sin() * 0.01))
        .map(|p| glam::Quat::from_rotation_x(1.0) * p)
        .collect();
    let (triangles, clean) = triangulate(&corners);
    assert!(clean);
    let normal = glam::Quat::from_rotation_x(1.0) * -Vec3::Z;
    let mut sum = 0.0;
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|i| corners[i as usize]);
        let area = (b - a).cross(c - a).dot(normal);
        assert!(area > 0.0);
        sum += f64::from(area);
    }
    let area = shoelace(&outline).abs();
    assert!((sum - area).abs() < 1e-2 * area, "{sum} instead of {area}");
}

#[test]
fn what_crosses_itself_is_reported_and_filled_in_some_way() {
    let star: Vec<Vec3> = (0..5).map(|i| polar(1.0, f64::from(i) * 2.0 * TAU / 5.0)).map(flat).collect();
    let (triangles, clean) = triangulate(&star);
    assert_eq!((triangles.len(), clean), (3, false));
    let twice: Vec<Vec3> = (0..12).map(|i| polar(1.0, f64::from(i) * 2.0 * TAU / 12.0)).map(flat).collect();
    assert!(!triangulate(&twice).1, "it goes round twice");
    let line: Vec<Vec3> = (0..6).map(|i| flat(dvec2(f64::from(i), 0.0))).collect();
    assert_eq!(triangulate(&line).0.len(), 4);
    assert!(!triangulate(&line).1, "it has no area");
}

fn flat(p: DVec2) -> Vec3 {
    p.as_vec2().extend(0.0)
}

/// No shape makes the time grow with more than n log n: arms of a spiral, spikes, long slanted needles side by side.
#[test]
fn a_hundred_thousand_corners_take_little_time() {
    let count = 100_000;
    let needles = (0..count / 2).map(|i| dvec2(f64::from(i + i % 2 * 30_000), f64::from(i % 2) * 1e4));
    let along = needles.clone().rev().map(|p| p - dvec2(30.0, 10.0));
    let needles: Vec<DVec2> = needles.chain(along).collect();
    let spikes: Vec<DVec2> = (0..count)
        .map(|i| polar(if i % 2 == 0 { 1.0 } else { 0.2 }, f64::from(i) * TAU / f64::from(count)))
        .collect();
    // Edges cross: the ears, too, have a limit.
    let knot: Vec<DVec2> =
        (0..count).map(|i| polar(1.0 + f64::from(i * 7919 % count), f64::from(i))).collect();
    let start = Instant::now();
    for (outline, simple) in [(needles, true), (spikes, true), (spiral(count as usize), true), (knot, false)]
    {
        let corners: Vec<Vec3> = outline.into_iter().map(flat).collect();
        let (triangles, clean) = triangulate(&corners);
        assert_eq!((triangles.len(), clean), (corners.len() - 2, simple));
    }
    let seconds = start.elapsed().as_secs_f32();
    assert!(seconds < 10.0, "{seconds} s");
}

/// A polygon that does not cross itself, grown from a triangle by bending edges out to random points.
fn random_polygon(corners: usize, grid: Option<i32>, seed: u64) -> Vec<DVec2> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f64 / (1u64 << 24) as f64
    };
    let mut point = || {
        let p = dvec2(random(), random());
        grid.map_or(p, |n| (p * f64::from(n)).round())
    };
    let scale = grid.map_or(1.0, f64::from);
    let mut polygon = vec![dvec2(0.0, 0.0), dvec2(scale, 0.0), dvec2(0.0, scale)];
    // A corner on an edge is no crossing, but the polygon would touch itself.
    let meets = |a: [DVec2; 2], b: [DVec2; 2]| {
        let side =
            |l: [DVec2; 2], p: DVec2| orientation(l[0], l[1], p).partial_cmp(&0.0).map_or(0, |o| o as i32);
        let apart = |l: [DVec2; 2], m: [DVec2; 2]| side(l, m[0]) * side(l, m[1]) > 0;
        !apart(a, b) && !apart(b, a)
    };
    let mut tries = 0;
    while polygon.len() < corners && tries < 50 * corners {
        tries += 1;
        let (new, at) = (point(), tries * 31 % polygon.len());
        let (from, to) = (polygon[at], polygon[(at + 1) % polygon.len()]);
        let free = (0..polygon.len()).all(|i| {
            let edge = [polygon[i], polygon[(i + 1) % polygon.len()]];
            let touches = |a: DVec2| meets([a, new], edge) && a != edge[0] && a != edge[1];
            let on_line = edge.contains(&new) || orientation(edge[0], edge[1], new) == 0.0;
            i == at || !(touches(from) || touches(to) || on_line)
        });
        if free && orientation(from, to, new) != 0.0 {
            polygon.insert(at + 1, new);
        }
    }
    polygon
}

#[test]
fn random_polygons_are_filled_exactly() {
    for seed in 0..150 {
        for (corners, grid) in [(6, Some(4)), (16, Some(9)), (40, Some(100)), (40, None)] {
            assert_all_corners(&random_polygon(corners, grid, seed * 4 + corners as u64));
        }
    }
    assert_all_corners(&random_polygon(400, None, 7));
}

/// The outline comes back to a corner and goes on to the other side of itself.
#[test]
fn outlines_that_cross_in_a_corner_are_reported() {
    let corners = [(0, 2), (2, 0), (2, 1), (1, 2), (2, 0), (3, 3)];
    let corners = corners.map(|(x, y)| flat(dvec2(f64::from(x), f64::from(y))));
    let (triangles, clean) = triangulate(&corners);
    assert_eq!((triangles.len(), clean), (4, false));
}

proptest! {
    /// Corners on the edges of a polygon, in one direction only.
    #[test]
    fn corners_on_straight_edges_are_kept(radii in prop::collection::vec(1i32..20, 5..40), parts in 1i32..5) {
        let count = radii.len();
        let corner = |i: usize| (polar(f64::from(radii[i % count]), i as f64 * TAU / count as f64) * 64.0).round();
        let outline: Vec<DVec2> = (0..count)
            .flat_map(|i| {
                // Quarters of even numbers are exact.
                let (a, b) = (corner(i) * 4.0, corner(i + 1) * 4.0);
                (0..parts.min(4)).map(move |k| a + (b - a) * f64::from(k) / f64::from(if parts == 3 { 4 } else { parts }))
            })
            .collect();
        assert_all_corners(&outline);
    }

    #[test]
    fn anything_becomes_triangles(values in prop::collection::vec(prop::num::f32::ANY, 0..90)) {
        let corners: Vec<Vec3> = values.as_chunks::<3>().0.iter().map(|v| Vec3::from(*v)).collect();
        let (triangles, _) = triangulate(&corners);
        prop_assert!(triangles.len() <= corners.len().saturating_sub(2));
        prop_assert!(triangles.iter().flatten().all(|i| (*i as usize) < corners.len()));
    }

    /// Few places, so that corners coincide and edges lie on each other.
    #[test]
    fn outlines_on_a_small_grid_are_filled_or_reported(values in prop::collection::vec((0i32..4, 0i32..4), 3..14)) {
        let points: Vec<DVec2> = values.iter().map(|(x, y)| dvec2(f64::from(*x), f64::from(*y))).collect();
        let corners: Vec<Vec3> = points.iter().copied().map(flat).collect();
        let (triangles, clean) = triangulate(&corners);
        prop_assert!(triangles.len() <= corners.len() - 2);
        if clean {
            let sum: f64 = triangles.iter().map(|t| shoelace(&t.map(|i| points[i as usize])).abs()).sum();
            prop_assert!((sum - shoelace(&points).abs()).abs() < 1e-9, "{points:?}");
        }
    }
}
