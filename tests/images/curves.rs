//! Curves of every kind, basis and degree, seen along z in parallel: how much of the image they cover, and how bright they are. Assertions fail by chance with
//! probability 1e-6 each (see `common::assert_mean`).

use crate::common::{Options, SLACK, assert_mean, image_mean, render_text};

/// The mean of the image over x and y from −1 to 1, seen along +z, and its error.
fn mean(world: &str) -> (f64, f64) {
    let text = format!(
        "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1 1 -1 1]\n\
         Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\nPixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n\
         Integrator \"volpath\" \"integer maxdepth\" 1\nWorldBegin\n{world}\n"
    );
    let outcome = render_text(&text, &Options { spp: 256, ..Options::default() });
    assert_eq!(outcome.film.rejected().0, 0);
    let (mean, error) = image_mean(&outcome.film);
    (mean[0], error[0])
}

#[track_caller]
fn assert_is(what: &str, world: &str, expected: f64) {
    let (found, error) = mean(world);
    println!("{what}: {found:.5} ± {error:.5}, expected {expected:.5}");
    assert!(error < 5e-3 * expected, "{what}: {error}");
    // Pieces of curves are straight to a twentieth of their width.
    assert_mean(what, found, error, expected, 2e-3 + SLACK);
}

/// What is not covered by black curves before a dome of radiance 1.
fn uncovered(curves: &str) -> String {
    format!("LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n{curves}")
}

/// A straight curve up the image, of width 0.4: a fifth of it, however the curve is written down.
#[test]
fn straight_curves_cover_their_width() {
    let line = |count: i32, scale: f64| {
        let points =
            (0..count).map(|i| format!("0.1 {} 0 ", (2.0 * f64::from(i) / f64::from(count - 1) - 1.0) * scale));
        points.collect::<String>()
    };
    for (basis, degree, count, scale) in [
        ("bezier", 3, 4, 1.5),
        ("bezier", 3, 7, 1.5),
        ("bezier", 2, 3, 1.5),
        ("bezier", 2, 5, 1.5),
        ("bspline", 3, 5, 4.0),
        ("bspline", 2, 4, 4.0),
    ] {
        let written =
            format!("\"string basis\" \"{basis}\" \"integer degree\" {degree} \"point3 P\" [{}]", line(count, scale));
        for kind in ["flat", "cylinder"] {
            let curve = format!(
                "Shape \"curve\" \"string type\" \"{kind}\" {written} \"float width\" 0.4 \"integer splitdepth\" 3"
            );
            assert_is(&format!("{kind} {basis} {degree}"), &uncovered(&curve), 0.8);
        }
        // A ribbon turned by 60° about its length is half as wide to the eye.
        let segments = if basis == "bezier" { (count - 1) / degree } else { count - degree };
        let normals = "0.8660254 0 -0.5 ".repeat(segments as usize + 1);
        let curve = format!(
            "Shape \"curve\" \"string type\" \"ribbon\" {written} \"normal N\" [{normals}] \"float width\" 0.4"
        );
        assert_is(&format!("ribbon {basis} {degree}"), &uncovered(&curve), 0.9);
    }
    // From one width to another, over both segments; twice as wide where all is twice as large.
    let two = format!("\"point3 P\" [{}]", line(7, 1.0));
    let curve = format!("Shape \"curve\" {two} \"float width0\" 0.2 \"float width1\" 0.6");
    assert_is("widths", &uncovered(&curve), 0.8);
    assert_is("scaled", &uncovered(&format!("Translate 0.1 0 0 Scale 2 2 2 {}", curve.replace("0.1 ", "0 "))), 0.6);
}

/// Lit from where it is seen: a flat curve as a wall, a cylinder as a round one, a ribbon as the plate that it is.
#[test]
fn curves_are_shaded_as_what_they_are() {
    let pi = std::f64::consts::PI;
    let lit = |kind: &str, more: &str| {
        format!(
            "LightSource \"distant\" \"rgb L\" [{pi} {pi} {pi}] \"point3 from\" [0 0 -1] \"point3 to\" [0 0 0]\n\
             Material \"diffuse\" \"rgb reflectance\" [1 1 1]\n\
             Shape \"curve\" \"string type\" \"{kind}\" \"point3 P\" [0 -2 0  0 -1 0  0 1 0  0 2 0] \"float width\" 1 {more}"
        )
    };
    assert_is("flat", &lit("flat", ""), 0.5);
    assert_is("cylinder", &lit("cylinder", ""), 0.5 * pi / 4.0);
    // A ribbon turned by 60°: half as wide, half as bright.
    assert_is("ribbon", &lit("ribbon", "\"normal N\" [0.8660254 0 -0.5 0.8660254 0 -0.5]"), 0.125);
    // Normals that turn between its ends: sin and cos of an angle from 0 to 60°, where the curve's own parameter is even in y.
    let turning = lit("ribbon", "\"normal N\" [0 0 -1 0.8660254 0 -0.5]")
        .replace("-2 0  0 -1 0  0 1 0  0 2 0", "-1 0  0 -0.3333333 0  0 0.3333333 0  0 1 0");
    // The mean of cos² over that angle.
    let angle = pi / 3.0;
    assert_is("turning ribbon", &turning, 0.5 * (0.5 + (2.0 * angle).sin() / (4.0 * angle)));
}
