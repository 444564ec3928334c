use super::*;
use optics::light_profile::{profile_cell, profile_mix};
use optics::vec3f;

/// A file with these angles and intensities; `head`: everything up to the line of the lamp.
fn file(head: &str, vertical: &[f64], horizontal: &[f64], candelas: &[f64]) -> String {
    file_of_type(1, head, vertical, horizontal, candelas)
}

/// The same with a type of photometry: 1 is C, 2 is B, 3 is A.
fn file_of_type(kind: u32, head: &str, vertical: &[f64], horizontal: &[f64], candelas: &[f64]) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(|n| n.to_string()).collect::<Vec<_>>().join(" ");
    format!(
        "{head}1 1000 2.0 {} {} {kind} 2 0 0 0\n0.5 1.0 60\n{}\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal),
        list(candelas)
    )
}

const HEAD: &str = "IESNA:LM-63-1995\n[TEST] none\n[MANUFAC] nobody\nTILT=NONE\n";

fn parsed(text: &str) -> LightProfile {
    parse(text.as_bytes()).unwrap_or_else(|(at, why)| panic!("{at}: {why}\n{text}"))
}

/// The intensity in a direction, degrees, by the optics, for a lamp that hangs: horizontal angle 0 is +X.
fn candela(profile: &LightProfile, vertical: f32, horizontal: f32) -> f32 {
    let (v, h) = (vertical.to_radians(), horizontal.to_radians());
    // Anticlockwise from above: from +X to −Z.
    let direction = vec3f(v.sin() * h.cos(), -v.cos(), -v.sin() * h.sin());
    let axis = vec3f(0.0, -1.0, 0.0);
    let zero = optics::light_profile::profile_azimuth(axis, 0.0, vec3f(1.0, 0.0, 0.0));
    let cell = profile_cell(axis, zero, direction, profile.rows(), profile.columns());
    let at = |i: u32| profile.values()[i as usize];
    profile.peak() * profile_mix(cell, at(cell.first), at(cell.second), at(cell.third), at(cell.fourth))
}

#[track_caller]
fn assert_near(a: f32, b: f32) {
    assert!((a - b).abs() < 2e-3 * b.abs().max(1.0), "{a} instead of {b}");
}

#[test]
fn round_lamps_are_interpolated_and_their_factors_count() {
    let profile = parsed(&file(HEAD, &[0.0, 45.0, 90.0], &[0.0], &[100.0, 80.0, 20.0]));
    assert_eq!((profile.rows(), profile.columns(), profile.peak()), (181, 1, 100.0));
    for horizontal in [0.0, 77.0, 200.0] {
        assert_near(candela(&profile, 0.0, horizontal), 100.0);
        assert_near(candela(&profile, 22.5, horizontal), 90.0);
        assert_near(candela(&profile, 60.0, horizontal), 60.0);
        assert_near(candela(&profile, 90.0, horizontal), 20.0);
        assert_eq!(candela(&profile, 92.0, horizontal), 0.0, "nothing was measured there");
    }
}

/// The same lamp, whole, half, quarter and from the other half, wherever it is symmetric.
#[test]
fn parts_of_lamps_stand_for_the_whole() {
    let vertical = [0.0, 90.0, 180.0];
    let lamp = |horizontal: &[f64], of: &dyn Fn(f64) -> f64| {
        let column = |h: &f64| [50.0, of(*h), 10.0];
        let candelas: Vec<f64> = horizontal.iter().flat_map(column).collect();
        parsed(&file(HEAD, &vertical, horizontal, &candelas))
    };
    let every = |step: f64, from: f64, to: f64| -> Vec<f64> {
        (0..=((to - from) / step) as u32).map(|i| from + step * f64::from(i)).collect()
    };
    let quarter = |h: f64| 20.0 + 30.0 * h.to_radians().cos().powi(2);
    let half = |h: f64| 20.0 + 5.0 * h.to_radians().cos();
    let other = |h: f64| 20.0 + 5.0 * h.to_radians().sin();
    let pairs = [
        (lamp(&every(15.0, 0.0, 90.0), &quarter), lamp(&every(15.0, 0.0, 360.0), &quarter)),
        (lamp(&every(15.0, 0.0, 180.0), &half), lamp(&every(15.0, 0.0, 360.0), &half)),
        (lamp(&every(15.0, 90.0, 270.0), &other), lamp(&every(15.0, 0.0, 345.0), &other)),
    ];
    for (i, (part, whole)) in pairs.iter().enumerate() {
        assert_eq!((part.columns(), whole.columns()), (24, 24));
        let far = part.values().iter().zip(whole.values()).any(|(a, b)| (a - b).abs() > 1e-6);
        assert!(!far, "part {i} is another lamp than the whole");
    }
    assert_near(candela(&pairs[1].0, 90.0, 60.0), 22.5);
    assert_near(candela(&pairs[1].0, 90.0, 300.0), 22.5);
    assert_near(candela(&pairs[2].0, 90.0, 90.0), 25.0);
    assert_near(candela(&pairs[2].0, 90.0, 270.0), 15.0);
    assert_near(candela(&pairs[0].0, 180.0, 33.0), 10.0);
}

#[test]
fn all_editions_and_ways_to_write_are_read() {
    let expected = parsed(&file(HEAD, &[0.0, 90.0], &[0.0], &[8.0, 4.0]));
    for head in [
        "TILT=NONE\n",
        "IESNA91\nTILT=NONE\r\n",
        "IES:LM-63-2019\n[OTHER] TILT=INCLUDE\n  TILT= NONE \n",
        "IESNA:LM-63-2002\nTILT=INCLUDE\n1\n3\n0 45 90\n1.0 0.9\n0.8\n",
    ] {
        assert_eq!(parsed(&file(head, &[0.0, 90.0], &[0.0], &[8.0, 4.0])), expected, "{head}");
    }
    let scattered =
        "Lampe f\u{fc}r alle\nTILT=NONE\n1,1000,2.0,\n2\n1 1 2\n0 0 0 0.5 1.0 60 0,90\n0\n8.0\n\n4e0 \u{1a}";
    assert_eq!(parsed(scattered), expected);
    assert!(
        parse(b"Lampe f\xfcr alle\nTILT=NONE\n1 0 1 2 1 1 2 0 0 0 1 1 0 0 90 0 1 1").is_ok(),
        "any code page"
    );
}

#[test]
fn angles_off_the_steps_have_finer_ones() {
    let fine = parsed(&file(HEAD, &[0.0, 2.5, 90.0], &[0.0, 22.5, 90.0], &[1.0; 9]));
    assert_eq!((fine.rows(), fine.columns()), (361, 16));
    let odd = parsed(&file(HEAD, &[0.0, 33.333, 90.0], &[0.0, 41.7, 180.0], &[1.0; 9]));
    assert_eq!((odd.rows(), odd.columns()), (1801, 720));
    assert_near(candela(&odd, 33.0, 10.0), 1.0);
    let dark = parsed(&file(HEAD, &[0.0, 90.0], &[0.0], &[0.0, 0.0]));
    assert_eq!((dark.peak(), dark.values().iter().sum::<f32>()), (0.0, 0.0));
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let lamp = |rest: &str| format!("IESNA91\nTILT=NONE\n{rest}");
    for (text, at, why) in [
        (String::new(), "the file", "TILT="),
        ("IESNA91\nTILT=lamp.tlt\n".into(), "line 2", "lamp.tlt"),
        (lamp(""), "line 2", "ends before the number of lamps"),
        (lamp("1 1000 x"), "line 3", "`x`"),
        (lamp("1 1000 nan"), "line 3", "no number"),
        (lamp("1 1000 -1"), "line 3", "multiplier"),
        (lamp("1 1000 1 1 1"), "line 3", "vertical angles must be"),
        (lamp("1 1000 1 1e9 1"), "line 3", "10000"),
        (lamp("1 1000 1 2.5 1"), "line 3", "whole number"),
        (lamp("1 1000 1 2 1\n4 1 0 0 0"), "line 4", "type 4"),
        (lamp("1 0 1 2 1 2 1 0 0 0\n1 1 0\n-90 90\n0\n1 1"), "line 6", "two horizontal angles"),
        (lamp("1 0 1 2 2 3 1 0 0 0\n1 1 0\n-90 100\n0 90\n1 1 1 1"), "line 5", "from -90 to 90"),
        (lamp("1 0 1 2 1 1 1 0 0 0\n1 1 0\n0 200\n0\n1 1"), "line 5", "from 0 to 180"),
        (lamp("1 0 1 2 1 1 1 0 0 0\n1 1 0\n90 0\n0\n1 1"), "line 5", "ascend"),
        (lamp("1 0 1 2 2 1 1 0 0 0\n1 1 0\n0 90\n0 100\n1 1 1 1"), "line 6", "from 0 to 100"),
        (lamp("1 0 1 2 1 1 1 0 0 0\n1 1 0\n0 90\n0\n1\n-1"), "line 8", "-1"),
        (lamp("1 0 1 2 1 1 1 0 0 0\n1 1 0\n0 90\n0\n1"), "line 7", "ends before an intensity"),
        (lamp("1 0 1e9 2 1 1 1 0 0 0\n1e9 1e9 0\n0 90\n0\n1 1e300"), "the intensities", "candela"),
    ] {
        let (object, message) = parse(text.as_bytes()).expect_err(&text);
        assert!(object == at && message.contains(why), "{text}\n{object}: {message}");
    }
}

/// Intensities that are a function of the direction: forward, up and to the right of who looks where the lamp is aimed.
#[test]
fn lamps_of_types_a_and_b_shine_where_they_were_measured() {
    let strength = |[forward, up, right]: [f64; 3]| {
        forward.max(0.0) * (60.0 + 20.0 * up + 30.0 * right + 10.0 * right * right)
    };
    let every = |from: i32| (from..=90).step_by(5).map(f64::from).collect::<Vec<f64>>();
    let direction = |kind: u32, v: f64, h: f64| {
        let [(sin_v, cos_v), (sin_h, cos_h)] = [v, h].map(|a| a.to_radians().sin_cos());
        match kind {
            2 => [cos_h * cos_v, cos_h * sin_v, sin_h],
            _ => [cos_v * cos_h, sin_v, cos_v * sin_h],
        }
    };
    let lamp = |kind: u32, horizontal: &[f64], of: &dyn Fn([f64; 3]) -> f64| {
        let vertical = every(-90);
        let at = |h: &f64| vertical.iter().map(|v| of(direction(kind, *v, *h))).collect::<Vec<_>>();
        let candelas: Vec<f64> = horizontal.iter().flat_map(at).collect();
        parsed(&file_of_type(kind, HEAD, &vertical, horizontal, &candelas))
    };
    for kind in [2, 3] {
        let whole = lamp(kind, &every(-90), &strength);
        for (vertical, around) in
            [(0.0, 0.0), (35.0, 0.0), (50.0, 120.0), (50.0, 240.0), (75.0, 301.0), (20.0, 66.0)]
        {
            let (sin, cos) = f64::from(vertical).to_radians().sin_cos();
            let (left, up) = f64::from(around).to_radians().sin_cos();
            let expected = strength([cos, sin * up, -sin * left]) as f32;
            // Between angles that are 5° apart, intensities are linear.
            let found = candela(&whole, vertical, around);
            assert!((found - expected).abs() < 0.005 * 60.0, "type {kind}: {found} instead of {expected}");
        }
        // To the right it is brighter than to the left, and behind it is dark.
        assert!(candela(&whole, 60.0, 270.0) > 1.5 * candela(&whole, 60.0, 90.0));
        assert_eq!([0.0, 140.0, 270.0].map(|around| candela(&whole, 95.0, around)), [0.0; 3]);
        // What begins at 0° is the same on both sides.
        let even = |[forward, up, right]: [f64; 3]| strength([forward, up, right.abs()]);
        let (half, both) = (lamp(kind, &every(0), &even), lamp(kind, &every(-90), &even));
        assert!(half.values().iter().zip(both.values()).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}
