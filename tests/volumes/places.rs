//! Where media may lie: over and in each other with boundaries shared, around the camera and through it, far away, sheared and mirrored, in
//! huge empty spaces; and what has no volume. Against known answers, or the same image elsewhere.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`), those of blocks with 1e-6 a test
//! (`common::blocks`).

use crate::common::blocks::{Blocks, Family};
use crate::common::media::{DOME, FOREVER, SAMPLINGS, check, depth, grey, grid, homogeneous, list, tent};
use crate::common::{CUBE, FLOOR, Options, Shot, View, boundary, difference, image_mean, prepare_text, shuffled_grid};
use lanternfish::render::VolumeSampling;

/// Looks at `to` from `from` through so small a field that all rays are one.
fn ray(from: [f64; 3], to: [f64; 3]) -> Shot {
    Shot { from, to, fov: 5e-5, size: 8, depth: 3 }
}

fn options(spp: u32) -> Options {
    Options { spp, ..Options::default() }
}

fn cube(name: &str, size: f64) -> String {
    boundary(name, "", &format!("Scale {size} {size} {size} {CUBE}"))
}

/// What three media in each other, by adding up, let through: `camera` is where each of them begins for it. Cubes of 1, 0.6 and 0.3.
#[test]
fn three_media_deep() {
    let fog = homogeneous("a", [0.1, 0.2, 0.3], [0.0; 3], "");
    let ones = |name: &str, more: &str| grid(name, 4, &[1.0; 64], [[-2.0; 3], [2.0; 3]], more);
    let smoke = ones("b", "\"rgb sigma_a\" [0.5 0.3 0.1] \"rgb sigma_s\" [0 0 0]");
    let soot = ones("c", "\"rgb sigma_a\" [1 2 0] \"rgb sigma_s\" [0 0 0]");
    let added = [cube("a", 1.0), cube("b", 0.6), cube("c", 0.3)].concat();
    let inner =
        |name: &str, around: &str, size: f64| boundary(name, around, &format!("Scale {size} {size} {size} {CUBE}"));
    let replaced = [cube("a", 1.0), inner("b", "a", 0.6), inner("c", "b", 0.3)].concat();
    let sigma = [[0.1, 0.2, 0.3], [0.5, 0.3, 0.1], [1.0, 2.0, 0.0]];
    let edges = [1.0, 0.6, 0.3];
    // Before all, in one, in two, in three; and exactly on each boundary.
    for z in [-4.0, -0.8, -0.5, 0.0, -1.0, -0.6, -0.3, 0.3, 0.6, 1.0f64] {
        let shot = ray([0.05, 0.02, z], [0.05, 0.02, z + 1.0]);
        let ahead = edges.map(|edge| edge - z.max(-edge)).map(|length| length.max(0.0));
        let sum: [f64; 3] = std::array::from_fn(|c| (0..3).map(|m| sigma[m][c] * ahead[m]).sum());
        // Each lies around the next.
        let own = [ahead[0] - ahead[1], ahead[1] - ahead[2], ahead[2]];
        let instead: [f64; 3] = std::array::from_fn(|c| (0..3).map(|m| sigma[m][c] * own[m]).sum());
        for (what, boundaries, depths) in [("added", &added, sum), ("replaced", &replaced, instead)] {
            let world = format!("{DOME}{fog}{smoke}{soot}{boundaries}");
            check(&format!("{what}, from {z}"), &shot, &world, &options(512), depths.map(|d| (-d).exp()), 0.03);
        }
    }
}

/// Three media that fill the same box, sharing all of its faces, are the one medium whose coefficients are their sums; so are they where
/// their boxes are cut in two that touch.
#[test]
fn media_with_one_boundary_are_their_sum() {
    let of = |name: &str, a: [f64; 3], s: [f64; 3]| {
        let more = format!(
            "\"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] \"float g\" 0.3 \"rgb Le\" [0.2 0.1 0.4]",
            list(&a),
            list(&s)
        );
        grid(name, 4, &[1.0; 64], [[-2.0; 3], [2.0; 3]], &more)
    };
    let parts = [
        of("a", [0.05, 0.1, 0.0], [0.2, 0.5, 1.0]),
        of("b", [0.0, 0.2, 0.1], [0.9, 0.1, 0.0]),
        homogeneous("c", [0.15, 0.0, 0.2], [0.4, 0.4, 0.5], "\"float g\" 0.3 \"rgb Le\" [0.2 0.1 0.4]"),
    ];
    let whole = of("w", [0.2, 0.3, 0.3], [1.5, 1.0, 1.5]);
    let half = |name: &str, x: f64| boundary(name, "", &format!("Translate {x} 0 0 Scale 0.5 1 1 {CUBE}"));
    let light = "LightSource \"point\" \"rgb I\" [6 7 8] \"point3 from\" [-1 2 -2]
        AttributeBegin Translate 1.5 1 0.5 AreaLightSource \"diffuse\" \"rgb L\" [5 4 3] Shape \"sphere\" \"float radius\" 0.3 AttributeEnd\n";
    let world = |media: &str, boundaries: &[String]| format!("{FLOOR}{light}{media}{}", boundaries.concat());
    let shot = Shot { from: [0.5, 0.8, -4.5], fov: 40.0, size: 16, depth: 4, ..Shot::default() };
    let render = |world: &str, options: &Options, seeds| {
        Blocks::render(&mut prepare_text(&shot.text(world), options), options, [2, 2], seeds)
    };
    let one = world(&whole, &[cube("w", 1.0)]);
    let reference = render(&one, &Options { seed: 100, volume_sampling: VolumeSampling::Null, ..options(32) }, 24);
    let together = world(&parts.concat(), &["a", "b", "c"].map(|name| cube(name, 1.0)));
    let cut = world(&parts.concat(), &["a", "b", "c"].map(|name| half(name, -0.5) + &half(name, 0.5)));
    let mut family = Family::default();
    for (what, world) in [("together", &together), ("cut in two", &cut)] {
        for volume_sampling in SAMPLINGS {
            let image = render(world, &Options { volume_sampling, ..options(16) }, 12);
            family.compare(&format!("{what}, {volume_sampling:?}"), &image, &reference, 0.02);
        }
    }
    family.assert(1e-6);
}

/// Two media that touch in the plane x = 0, one of them given by a grid, in a cube; and their extinctions.
fn side_by_side() -> ([f64; 2], String) {
    let [left, right] = [0.7, 0.2];
    let media = format!(
        "{}{}",
        homogeneous("l", [left; 3], [0.0; 3], ""),
        grid("r", 4, &[1.0; 64], [[-2.0; 3], [2.0; 3]], &grey(right, 0.0))
    );
    let world = format!(
        "{DOME}{media}{}{}",
        boundary("l", "", &format!("Translate -0.5 0 0 Scale 0.5 1 1 {CUBE}")),
        boundary("r", "", &format!("Translate 0.5 0 0 Scale 0.5 1 1 {CUBE}")),
    );
    ([left, right], world)
}

fn along(from: [f64; 3], way: [f64; 3]) -> Shot {
    ray(from, std::array::from_fn(|k| from[k] + way[k]))
}

/// A camera on a face, an edge or a corner of media that touch: where it looks into one it sees it.
#[test]
fn a_camera_on_boundaries() {
    let ([left, right], world) = side_by_side();
    for (from, way, depth) in [
        ([0.0, 0.1, 0.2], [1.0, 0.0, 0.0], right),
        ([0.0, 0.1, 0.2], [-1.0, 0.0, 0.0], left),
        ([-1.0, 0.1, 0.2], [1.0, 0.0, 0.0], left + right),
        ([-1.0, 0.1, 0.2], [-1.0, 0.0, 0.0], 0.0),
        ([1.0, 0.1, 0.2], [-1.0, 0.0, 0.0], left + right),
        // From edges and corners into the interior.
        ([-1.0, 1.0, 0.2], [1.0, -1.0, 0.0], (left + right) * 2f64.sqrt()),
        ([1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], (right + left) * 3f64.sqrt()),
        ([0.0, 1.0, 1.0], [0.9, -1.0, -1.0], right * (2.0f64 + 0.81).sqrt() / 0.9),
    ] {
        let expected = [(-depth).exp(); 3];
        check(&format!("from {from:?} along {way:?}"), &along(from, way), &world, &options(512), expected, 0.02);
    }
}

/// A camera on a sphere that holds a medium sees it within and not without.
#[test]
fn a_camera_on_a_sphere() {
    let sphere = boundary("m", "", "Shape \"sphere\" \"float radius\" 1");
    let world = format!("{DOME}{}{sphere}", homogeneous("m", [0.7; 3], [0.0; 3], ""));
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let mut from = [0.0; 3];
            from[axis] = side;
            for (to, depth) in [(from.map(|x| 2.0 * x), 0.0), ([0.0; 3], 1.4f64)] {
                let expected = [(-depth).exp(); 3];
                check(&format!("from {from:?} to {to:?}"), &ray(from, to), &world, &options(512), expected, 0.02);
            }
        }
    }
}

/// Along a face every pixel is finite, and between what one side and the other would let through.
#[test]
fn a_camera_that_looks_along_faces() {
    let ([left, right], world) = side_by_side();
    for (from, way) in [
        // In the face between both, and in outer faces and edges.
        ([0.0, 0.0, -0.9], [0.0, 0.0, 1.0]),
        ([0.0, 0.0, -4.0], [0.0, 0.0, 1.0]),
        ([-1.0, 0.0, -1.0], [0.0, 0.0, 1.0]),
        ([-1.0, 1.0, -1.0], [0.0, 0.0, 1.0]),
        ([0.0, -1.0, -1.0], [0.0, 1.0, 1.0]),
    ] {
        let outcome = along(from, way).render(&world, &options(64));
        assert_eq!(outcome.film.rejected().0, 0);
        for value in outcome.film.beauty().pixels {
            assert!((0.0..=1.0 + 1e-5).contains(&value), "from {from:?}: {value}");
        }
        let (mean, _) = image_mean(&outcome.film);
        let length = 2.0 * way.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(mean[0] > (-(left + right) * length).exp() - 0.1, "from {from:?}: {mean:?}");
    }
}

/// A grid of one voxel, turned, stretched, sheared and mirrored, as its own box and as part of a larger one: along rays across it, against the tent
/// that trilinear interpolation of one voxel is.
#[test]
fn one_voxel_under_any_transform() {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Rows: what x, y, z of the medium become.
    for (what, rows) in [
        ("plain", identity),
        ("mirrored", [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        ("sheared", [[1.0, 0.0, 0.0], [3.0, 1.0, 0.0], [-2.0, 0.7, 1.0]]),
        ("flat", [[1.0, 0.0, 0.0], [0.0, 1e-3, 0.0], [0.0, 0.0, 1.0]]),
        ("long", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e3]]),
        ("all of it", [[-0.8, 0.3, 0.1], [5.0, 0.02, 0.9], [0.4, -0.6, 2.0]]),
    ] {
        let [x, y, z] = rows;
        let matrix: Vec<f64> =
            [x, y, z].iter().flat_map(|row| [row[0], row[1], row[2], 0.0]).chain([0.3, -0.1, 0.2, 1.0]).collect();
        // The medium's coordinates of a point: Cramer's rule.
        let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        let whole = det(x, y, z);
        let within = |p: [f64; 3]| {
            let p = [p[0] - 0.3, p[1] + 0.1, p[2] - 0.2];
            [det(p, y, z) / whole, det(x, p, z) / whole, det(x, y, p) / whole]
        };
        let place = |q: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| [0.3, -0.1, 0.2][k] + q[0] * x[k] + q[1] * y[k] + q[2] * z[k])
        };
        // A box of one voxel from −1 to 1, cut off at half way to the next voxel; and one of 3³ of which the middle one is 1, whose neighbours let it
        // fade all the way.
        let mut middle = [0.0; 27];
        middle[13] = 1.0;
        let alone = |q: [f64; 3]| if q.iter().all(|c| c.abs() <= 1.0) { tent(q.map(|c| c / 2.0)) } else { 0.0 };
        let among = |q: [f64; 3]| tent(q.map(|c| c / 2.0));
        type Density<'a> = &'a dyn Fn([f64; 3]) -> f64;
        for (kind, n, values, half, density) in
            [("alone", 1, &[1.0][..], 1.0, &alone as Density), ("among others", 3, &middle[..], 3.0, &among)]
        {
            for (from, to) in [
                ([-3.5, 0.4, -0.2], [3.5, 0.1, 0.3]),
                ([0.3, -3.5, 3.4], [-0.1, 3.5, -3.3]),
                ([0.6, -0.4, -3.5], [0.6, -0.4, 3.5]),
            ] {
                let (from, to) = (place(from), place(to));
                let length = depth(from, to, 1400, |p| density(within(p)));
                // A depth of about 1, so that a wrong one shows.
                let sigma = 1.0 / length;
                let medium = grid("g", n, values, [[-half; 3], [half; 3]], &grey(sigma, 0.0));
                let world = format!(
                    "{DOME}AttributeBegin Transform [{}] {medium}{} AttributeEnd\n",
                    list(&matrix),
                    boundary("g", "", &format!("Scale 3.2 3.2 3.2 {CUBE}"))
                );
                check(&format!("{what}, {kind}"), &ray(from, to), &world, &options(512), [(-1f64).exp(); 3], 0.02);
            }
        }
    }
}

/// A grid of a thousandth in a boundary of a million: as seen from near by, and scattering as if it were alone. Empty space takes no steps.
#[test]
fn a_tiny_grid_in_a_huge_boundary() {
    let size = 1e-3;
    let near = |depth| Shot { from: [0.0, 0.0, -4.0 * size], fov: 0.01, size: 8, depth, ..Shot::default() };
    let ones = |more: &str| grid("g", 1, &[1.0], [[-size; 3], [size; 3]], more);
    let huge = |shape: &str| boundary("g", "", shape);
    let sphere = "Shape \"sphere\" \"float radius\" 1e6";
    let square = format!("Scale 1e6 1e6 1e6 {CUBE}");
    for (what, shape) in [("sphere", sphere), ("box", square.as_str())] {
        let black = format!("{DOME}{}{}", ones(&grey(1.0 / size, 0.0)), huge(shape));
        let outcome = check(what, &near(3), &black, &options(1024), [(-1.5f64).exp(); 3], 0.01);
        // Depth 1.5; the bound is 1 for some voxels more.
        let steps = outcome.counters.flight_steps as f64 / outcome.counters.paths as f64;
        assert!(steps < 10.0, "{steps} steps a ray");
        let wide = Shot { fov: 60.0, size: 16, ..near(FOREVER) };
        let white = format!("{DOME}{}{}", ones(&grey(0.0, 3.0 / size)), huge(shape));
        for volume_sampling in SAMPLINGS {
            let options = Options { volume_sampling, ..options(128) };
            let outcome = check(&format!("white in a {what}"), &wide, &white, &options, [1.0; 3], 0.01);
            let steps = outcome.counters.flight_steps as f64 / outcome.counters.paths as f64;
            assert!(steps < 50.0, "{steps} steps a ray");
        }
        // From a million units away, where its box is all that is left of it.
        let far = Shot { from: [0.0, 0.0, -0.9e6], fov: 0.2 * (size / 0.9e6f64).to_degrees(), ..near(3) };
        let (mean, error) = far.mean(&black, 64);
        assert!(mean.iter().zip(error).all(|(m, e)| m.is_finite() && *m <= 1.0 + 6.0 * e), "{mean:?}");
    }
}

/// Smoke that glows and scatters, with lamps and a floor, as large as `scale` and at `place` of every axis.
fn scenery(scale: f64, place: f64) -> (Shot, String) {
    let more = format!(
        "\"rgb sigma_a\" [0.2 0.4 0.8] \"rgb sigma_s\" [2 1.5 1] \"float scale\" {:e} \"float g\" 0.6 \"rgb Le\" [1 0.6 0.2]",
        1.0 / scale
    );
    let haze = homogeneous("h", [0.002 / scale; 3], [0.02 / scale; 3], "\"float g\" 0.3");
    let intensity = list(&[4.0 * scale * scale; 3]);
    let world = format!(
        "Translate {place} {place} {place} Scale {scale} {scale} {scale}\n{FLOOR}
         LightSource \"point\" \"rgb I\" [{intensity}] \"point3 from\" [1.8 2 -1.5]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 6 7] Translate -1.6 1 0.5 Shape \"sphere\" \"float radius\" 0.3 AttributeEnd
         {haze}{}{}{}",
        shuffled_grid("g", &more),
        boundary("g", "", &format!("Rotate 20 0 1 0 {CUBE}")),
        boundary("h", "", "Shape \"sphere\" \"float radius\" 8"),
    );
    let at = |p: [f64; 3]| p.map(|c| c * scale + place);
    (Shot { from: at([0.0, 1.0, -5.0]), to: at([0.0; 3]), fov: 40.0, size: 12, depth: 4 }, world)
}

/// Powers of two change no digit of what lies at the origin. A million units away a last digit differs here and there, and a sample in a
/// thousand may go another way; other factors change the last digit of everything, so there means are compared.
#[test]
fn media_a_million_units_away_and_of_any_size() {
    for volume_sampling in [VolumeSampling::Null, VolumeSampling::Both] {
        let render = |scale: f64, place: f64, spp| {
            let (shot, world) = scenery(scale, place);
            let outcome = shot.render(&world, &Options { volume_sampling, ..options(spp) });
            assert_eq!(outcome.film.rejected().0, 0, "{volume_sampling:?}, {scale:e}, {place:e}");
            outcome.film
        };
        let here = render(1.0, 0.0, 8);
        for (scale, place, most) in
            [(1.0, 1e6, 0.02), (1.0, -1e6, 0.02), (2f64.powi(20), 0.0, 1e-3), (2f64.powi(-20), 0.0, 1e-3)]
        {
            let apart = difference(&render(scale, place, 8), &here);
            println!("{volume_sampling:?}, × {scale:e} at {place:e}: relative RMSE {apart:.1e}");
            assert!(apart < most, "{volume_sampling:?}, × {scale:e} at {place:e}: relative RMSE {apart:.1e}");
        }
        let (expected, expected_error) = image_mean(&render(1.0, 0.0, 32));
        for (scale, place) in [(1e-6, 0.0), (1e6, 0.0), (1e6, 1e12)] {
            let (mean, error) = image_mean(&render(scale, place, 32));
            for c in 0..3 {
                let both = error[c].hypot(expected_error[c]);
                assert!(both < 0.1 * expected[c], "{both} is vague beside {}", expected[c]);
                crate::common::assert_mean(
                    &format!("{volume_sampling:?}, × {scale:e} at {place:e}"),
                    mean[c],
                    both,
                    expected[c],
                    0.0,
                );
            }
        }
    }
}

/// Boundaries that enclose nothing, and grids that hold nothing: the image is the one without them, and no ray takes a step.
#[test]
fn what_has_no_volume_or_no_density_is_not_there() {
    let lamps = "LightSource \"point\" \"rgb I\" [5 5 5] \"point3 from\" [1 2 -2]\n";
    let shot = Shot { from: [0.0, 0.5, -4.0], fov: 40.0, size: 16, ..Shot::default() };
    let bare = image_mean(&shot.render(&format!("{FLOOR}{lamps}"), &options(256)).film);
    let glowing = |values: &str| {
        crate::common::grid_medium(2, values, "\"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [1 1 1] \"rgb Le\" [9 9 9]")
    };
    let dense = glowing("1 1 1 1 1 1 1 1");
    let point = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 0 0 0 0 0 0] \"integer indices\" [0 1 2]";
    let sheet = "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"integer indices\" [0 1 2 0 2 3 0 2 1 0 3 2]";
    let cases = [
        ("empty grid", glowing("0 0 0 0 0 0 0 0") + &cube("g", 1.0)),
        ("empty grid around the camera", glowing("0 0 0 0 0 0 0 0") + &cube("g", 9.0)),
        (
            "no light passes through it either",
            format!("{}{}", homogeneous("g", [0.0; 3], [0.0; 3], ""), cube("g", 1.0)),
        ),
        ("a point", dense.clone() + &boundary("g", "", point)),
        ("a sheet", dense.clone() + &boundary("g", "", sheet)),
        ("elsewhere", dense + &boundary("g", "", &format!("Translate 0 5 0 {CUBE}"))),
    ];
    for (what, media) in cases {
        for volume_sampling in SAMPLINGS {
            let outcome = shot.render(&format!("{FLOOR}{lamps}{media}"), &Options { volume_sampling, ..options(256) });
            let (mean, error) = image_mean(&outcome.film);
            for c in 0..3 {
                crate::common::assert_mean(what, mean[c], error[c].hypot(bare.1[c]), bare.0[c], 1e-5);
            }
            if what != "a sheet" {
                let counters = outcome.counters;
                assert_eq!(
                    (counters.flight_steps, counters.transmittance_steps),
                    (0, 0),
                    "{what}, {volume_sampling:?}"
                );
            }
        }
    }
}
