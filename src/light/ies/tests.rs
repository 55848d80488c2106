//! Reading photometric files, good and damaged; what the profiles say of directions.

use std::f32::consts::PI;

use super::read::{IesError, parse};
use super::*;
use crate::math::sampler::Stream;
use crate::math::warp::uniform_sphere;

/// A file of type `kind` whose intensity is `value(vertical, horizontal)`.
pub fn file(kind: u32, vertical: &[f32], horizontal: &[f32], value: impl Fn(f32, f32) -> f32) -> String {
    let list = |values: &[f32]| values.iter().map(|v| v.to_string()).collect::<Vec<_>>().join(" ");
    let mut text = format!(
        "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 1 {} {} {kind} 2 0 0 0\n1 1 10\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal)
    );
    for &h in horizontal {
        text += &list(&vertical.iter().map(|&v| value(v, h)).collect::<Vec<_>>());
        text += "\n";
    }
    text
}

fn profile(text: &str) -> IesProfile {
    IesProfile::new(&parse(text, 0.0, &|_| Err("there is none".into())).expect("it is a good file"))
}

fn steps(from: f32, to: f32, step: f32) -> Vec<f32> {
    (0..=((to - from) / step).round() as usize).map(|k| from + step * k as f32).collect()
}

/// The direction of type C with these angles in degrees.
fn direction(vertical: f32, horizontal: f32) -> Vec3 {
    let (v, h) = (vertical.to_radians(), horizontal.to_radians());
    Vec3::new(v.sin() * h.cos(), v.sin() * h.sin(), v.cos())
}

#[test]
fn values_are_bilinear_between_angles() {
    let profile = profile(&file(1, &[0.0, 45.0, 90.0], &[0.0, 180.0, 360.0], |v, h| v + h));
    for (v, h, expected) in [(45.0, 0.0, 45.0), (45.0, 180.0, 225.0), (22.5, 90.0, 112.5), (60.0, 270.0, 330.0)] {
        let found = profile.candela(direction(v, h));
        // 360° has the values of 0°.
        let expected = if h > 180.0 { expected - (h - 180.0) / 180.0 * 360.0 } else { expected };
        assert!((found - expected).abs() < 1e-3, "{v} {h}: {found} {expected}");
    }
    assert_eq!(profile.candela(direction(90.1, 40.0)), 0.0, "beyond the last angle there is nothing");
    assert_eq!(profile.greatest(), 270.0);
}

#[test]
fn symmetry_fills_what_is_left_out() {
    // A smooth distribution with each symmetry, stated in full and in part.
    let vertical = steps(0.0, 180.0, 15.0);
    type Shape = fn(f32) -> f32;
    let cases: [(&[f32], Shape); 4] = [
        (&[0.0], |_| 1.0),
        (&[0.0, 90.0], |h| 2.0 + (2.0 * h).to_radians().cos()),
        (&[0.0, 180.0], |h| 2.0 + h.to_radians().cos()),
        (&[90.0, 270.0], |h| 2.0 + h.to_radians().sin()),
    ];
    let mut stream = Stream::from_seed(1);
    for (ends, shape) in cases {
        let value = |v: f32, h: f32| (1.0 + v) * shape(h);
        let part = if ends.len() == 1 { ends.to_vec() } else { steps(ends[0], ends[1], 15.0) };
        let [part, full] = [part, steps(0.0, 360.0, 15.0)].map(|h| profile(&file(1, &vertical, &h, value)));
        for _ in 0..2000 {
            let w = uniform_sphere([stream.next_f32(), stream.next_f32()]);
            let [a, b] = [&part, &full].map(|profile| profile.candela(w));
            assert!((a - b).abs() < 2e-3 * (1.0 + b), "{ends:?} {w}: {a} {b}");
        }
        assert!((part.flux() / full.flux() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn the_three_types_agree_about_one_distribution() {
    // What any of them can say: a smooth function of the direction.
    let shape = |w: Vec3| 3.0 + w.x + 2.0 * w.y * w.z + w.z;
    let of_angles = |kind: u32, v: f32, h: f32| {
        let ((sv, cv), (sh, ch)) = (v.to_radians().sin_cos(), h.to_radians().sin_cos());
        match kind {
            1 => Vec3::new(sv * ch, sv * sh, cv),
            2 => Vec3::new(ch * sv, -sh, ch * cv),
            _ => Vec3::new(sv, -cv * sh, cv * ch),
        }
    };
    let (half, full) = (steps(-90.0, 90.0, 3.0), steps(0.0, 360.0, 3.0));
    let (above, all) = (steps(0.0, 180.0, 3.0), steps(-180.0, 180.0, 3.0));
    let [a, b, c] = [(3, &half, &all), (2, &half, &half), (1, &above, &full)]
        .map(|(kind, v, h)| profile(&file(kind, v, h, |v, h| shape(of_angles(kind, v, h)))));
    let mut stream = Stream::from_seed(2);
    for _ in 0..5000 {
        let w = uniform_sphere([stream.next_f32(), stream.next_f32()]);
        let expected = shape(w);
        for (profile, what) in [(&a, "A"), (&c, "C")] {
            let found = profile.candela(w);
            assert!((found - expected).abs() < 0.02, "{what} {w}: {found} {expected}");
        }
        // Type B's vertical angles end at the horizontal.
        let expected = if w.z >= 0.0 { expected } else { 0.0 };
        assert!(w.z.abs() < 1e-3 || (b.candela(w) - expected).abs() < 0.02, "B {w}: {} {expected}", b.candela(w));
    }
    // ∫ over the sphere and, with the cosine, over the upper half.
    for profile in [&a, &c] {
        assert!((profile.flux() / (12.0 * PI) - 1.0).abs() < 1e-3, "{}", profile.flux());
        let forward = 3.0 * PI + 2.0 * PI / 3.0;
        assert!((profile.forward() / forward - 1.0).abs() < 1e-3, "{}", profile.forward());
    }
}

#[test]
fn flux_and_forward_flux_are_exact_for_a_cosine() {
    // Straight pieces under a cosine: 5° apart they lose (Δ²/12) = 0.06 %.
    let lambert = profile(&file(1, &steps(0.0, 90.0, 5.0), &[0.0], |v, _| 100.0 * v.to_radians().cos().max(0.0)));
    assert!((lambert.flux() / (100.0 * PI) - 1.0).abs() < 1e-3, "{}", lambert.flux());
    assert!((lambert.forward() / (100.0 * 2.0 * PI / 3.0) - 1.0).abs() < 1e-3, "{}", lambert.forward());
    let (axis, cos) = lambert.cone();
    assert!(axis == Vec3::Z && (-1e-4..1e-4).contains(&cos));
    // One value in all directions.
    let even = profile(&file(1, &[0.0, 180.0], &[0.0], |_, _| 7.0));
    assert!((even.flux() / (28.0 * PI) - 1.0).abs() < 1e-5 && even.cone().1 < -0.999);
}

#[test]
fn the_cone_holds_all_light() {
    let narrow = |v: f32, _: f32| if v <= 10.0 { 1.0 } else { 0.0 };
    let up = |v: f32, _: f32| if v >= 160.0 { 1.0 } else { 0.0 };
    let flood = |v: f32, h: f32| if v.abs() <= 20.0 && h.abs() <= 30.0 { 1.0 } else { 0.0 };
    let files = [
        file(1, &steps(0.0, 90.0, 5.0), &[0.0], narrow),
        file(1, &steps(0.0, 180.0, 5.0), &steps(0.0, 90.0, 45.0), up),
        file(2, &steps(-90.0, 90.0, 10.0), &steps(-90.0, 90.0, 10.0), flood),
        file(3, &steps(-90.0, 90.0, 10.0), &steps(0.0, 90.0, 10.0), flood),
    ];
    let mut stream = Stream::from_seed(3);
    for text in files {
        let profile = profile(&text);
        let (axis, cos) = profile.cone();
        assert!(cos > 0.6, "{axis} {cos}");
        let mut lit = 0;
        for _ in 0..50_000 {
            let w = uniform_sphere([stream.next_f32(), stream.next_f32()]);
            if profile.candela(w) > 0.0 {
                assert!(w.dot(axis) >= cos, "{w} {axis} {cos}");
                lit += 1;
            }
        }
        assert!(lit > 100);
    }
}

#[test]
fn multipliers_and_versions() {
    let text = |version: &str, tilt: &str| {
        format!("{version}TILT={tilt}\n1 1000 2 2 1 1 1 0 0 0\n0.5 0.25 60\n0, 90\n0\n100,100\n")
    };
    let value = |text: &str, tilt: f32| {
        let file = |name: &str| {
            if name == "lamp.tlt" { Ok("1 2 0 90 1 0.5".to_owned()) } else { Err(format!("no {name}")) }
        };
        IesProfile::new(&parse(text, tilt, &file).expect("it is good")).candela(Vec3::Z)
    };
    // Up to 1995 the ballast-lamp factor counts, afterwards the number means something else.
    assert_eq!(value(&text("", "NONE"), 0.0), 25.0);
    assert_eq!(value(&text("IESNA91\n", "NONE"), 0.0), 25.0);
    assert_eq!(value(&text("IESNA:LM-63-1995\n", "NONE"), 0.0), 25.0);
    assert_eq!(value(&text("IESNA:LM-63-2002\n", "NONE"), 0.0), 100.0);
    assert_eq!(value(&text("IES:LM-63-2019\n[TEST] 1\n", "NONE"), 0.0), 100.0);
    // The tilt is that of the luminaire as it hangs.
    let include = text("IESNA:LM-63-2002\n", "INCLUDE\n1\n3\n0 45 90\n1 0.8 0.4");
    assert_eq!(value(&include, 0.0), 100.0);
    assert!((value(&include, 67.5) - 60.0).abs() < 1e-4 && (value(&include, 120.0) - 40.0).abs() < 1e-4);
    assert_eq!(value(&text("IESNA:LM-63-2002\n", " lamp.tlt"), 90.0), 50.0);
    assert_eq!(value(&text("IESNA:LM-63-2002\r\n", "none\r"), 0.0), 100.0);
}

#[test]
fn damage_is_told_with_its_line() {
    let good = "IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 -1 1 3 2 1 2 0 0 0\n1 1 10\n0 45 90\n0 90\n3 2 1\n3 2 1\n";
    let parse = |text: &str| parse(text, 0.0, &|name| Err(format!("no file {name}")));
    assert!(parse(good).is_ok());
    let cases = [
        ("TILT=NONE", "TLIT=NONE", 9, "not an IES file"),
        ("TILT=NONE", "TILT=", 3, "must say NONE"),
        ("TILT=NONE", "TILT=lamp.tlt", 3, "no file lamp.tlt"),
        ("TILT=NONE", "TILT=INCLUDE\n1 2 0 0 1 1", 4, "do not rise"),
        ("TILT=NONE", "TILT=INCLUDE\n1 2 0 9 1 -1", 4, "tilt factor is negative"),
        ("3 2 1 2 0 0 0", "4000000000 2 1 2 0 0 0", 4, "whole number from 2 to 36001, not 4000000000"),
        ("3 2 1 2 0 0 0", "36000 36000 1 2 0 0 0", 7, "do not rise"),
        ("3 2 1 2 0 0 0", "2.5 2 1 2 0 0 0", 4, "whole number"),
        ("3 2 1 2 0 0 0", "-3 2 1 2 0 0 0", 4, "whole number"),
        ("3 2 1 2 0 0 0", "3 2 9 2 0 0 0", 4, "photometric type"),
        ("1 -1 1 3", "1 -1 -2 3", 4, "multiplier must be above 0"),
        ("1 -1 1 3", "1 -1 NaN 3", 4, "\"NaN\", which is no number"),
        ("1 1 10", "0 1 10", 5, "ballast factor must be above 0"),
        ("0 45 90", "0 45 45", 6, "do not rise"),
        ("0 45 90", "0 45 190", 6, "from 0 to 180"),
        ("0 45 90", "0 inf 90", 6, "no number"),
        ("0 90\n", "0 70\n", 7, "go from 0 to 90"),
        ("3 2 1\n3", "3 -2 1\n3", 8, "negative"),
        ("3 2 1\n3", "3 two 1\n3", 8, "\"two\", which is no number"),
        ("3 2 1\n3", "3 1e400 1\n3", 8, "no number"),
        ("3 2 1\n3", "3 1e39 1\n3", 8, "too large"),
        ("3 2 1\n3 2 1\n", "3 2 1\n3 2\n", 9, "the file ends before a candela value"),
    ];
    for (from, to, line, reason) in cases {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good);
        let error = parse(&text).expect_err(reason);
        assert!(error.reason.contains(reason), "{to}: {error}");
        assert_eq!(error.line, Some(line), "{to}: {error}");
        assert!(error.to_string().starts_with(&format!("line {line}: ")));
    }
    let error: IesError = parse("").expect_err("it is empty");
    assert!(error.reason.contains("not an IES file"));
}

#[test]
fn cut_short_anywhere_it_is_an_error_and_never_a_panic() {
    let good = file(1, &steps(0.0, 90.0, 30.0), &steps(0.0, 90.0, 45.0), |v, h| 100.0 + v + h);
    let end = good.trim_end().len();
    let mut stream = Stream::from_seed(4);
    for cut in 0..end - 3 {
        assert!(parse(&good[..cut], 0.0, &|_| Err("none".into())).is_err(), "cut at {cut}");
    }
    // Bytes turned into others: whatever is read is a profile without NaN.
    for _ in 0..5000 {
        let mut bytes = good.clone().into_bytes();
        for _ in 0..3 {
            let at = (stream.next_f32() * bytes.len() as f32) as usize;
            bytes[at] = b" 0123456789.-e,\nN"[(stream.next_f32() * 17.0) as usize];
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if let Ok(table) = parse(&text, 0.0, &|_| Err("none".into())) {
            let profile = IesProfile::new(&table);
            let w = uniform_sphere([stream.next_f32(), stream.next_f32()]);
            assert!(profile.candela(w) >= 0.0 && profile.flux() >= 0.0 && profile.flux().is_finite());
        }
    }
}
