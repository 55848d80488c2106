//! What media emit, gathered along rays: against quadrature, however thin the medium; and in equilibrium with what is around it.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::{
    CUBE, Options, SLACK, Shot, View, assert_mean, boundary, glow, grid_medium, image_mean, integrate, render_text,
    shuffled_grid,
};

/// Looks along z through the middle of the box from −1 to 1.
fn along_z(depth: u32) -> Shot {
    Shot { fov: 0.001, size: 8, depth, ..Shot::default() }
}

/// What a grid of samples at the centres of `values.len()` cells from −1 to 1 holds at z: nothing outside, linear between.
fn sampled(values: &[f64], z: f64) -> f64 {
    let x = (z + 1.0) / 2.0 * values.len() as f64 - 0.5;
    let at = |i: f64| if i >= 0.0 && i < values.len() as f64 { values[i as usize] } else { 0.0 };
    at(x.floor()) * (1.0 - x.fract().rem_euclid(1.0)) + at(x.floor() + 1.0) * x.fract().rem_euclid(1.0)
}

fn list(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

const DENSITY: [f64; 8] = [0.1, 0.9, 0.4, 0.0, 1.0, 0.3, 0.7, 0.2];
const GLOW: [f64; 8] = [1.0, 0.0, 0.1, 0.5, 0.02, 1.0, 0.0, 0.3];

/// A column of grid cells with these densities and radiances.
fn flame(scale: f64, radiance: f64) -> String {
    flame_of("f", scale, radiance, &GLOW)
}

fn flame_of(name: &str, scale: f64, radiance: f64, glow: &[f64]) -> String {
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"uniformgrid\" \"integer nx\" 1 \"integer ny\" 1 \"integer nz\" 8
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1] \"rgb sigma_a\" [1 2 0.5] \"rgb sigma_s\" [0 0 0] \"float scale\" {scale}
         \"float density\" [{}] \"float Lescale\" [{}] \"rgb Le\" [{} {radiance} {}]\n",
        list(&DENSITY),
        list(glow),
        0.5 * radiance,
        3.0 * radiance
    )
}

/// The radiance that leaves it towards −z, per channel: ∫ e^{−τ(z)} μ_a L_e dz.
fn expected(scale: f64, radiance: f64) -> [f64; 3] {
    expected_from(-1.0, 1.0, scale, radiance)
}

const SIGMA: [f64; 3] = [1.0, 2.0, 0.5];
const COLOUR: [f64; 3] = [0.5, 1.0, 3.0];

/// The same of what is seen from z = `from`, looking to `to`.
fn expected_from(from: f64, to: f64, scale: f64, radiance: f64) -> [f64; 3] {
    std::array::from_fn(|c| {
        let mu = |z: f64| scale * SIGMA[c] * sampled(&DENSITY, z);
        seen(from, to, mu, |z| mu(z) * COLOUR[c] * radiance * sampled(&GLOW, z))
    })
}

/// ∫ e^{−τ} e ds from `from` to `to`, τ being the depth from `from` on.
fn seen(from: f64, to: f64, extinction: impl Fn(f64) -> f64, emission: impl Fn(f64) -> f64) -> f64 {
    let depth = |z: f64| integrate(from, z, 64, &extinction).abs();
    integrate(from, to, 64, |z| (-depth(z)).exp() * emission(z)).abs()
}

/// A medium of extinction 1e-6 is met by one ray in a million; its glow is seen by all. One sample of all of it, dense or thin, is off by a fifth of it,
/// channel by channel; what is gathered at collisions, up to the first real one, by 0.5 to 1 (and so fails).
#[test]
fn flames_glow_as_quadrature_says_however_thin_they_are() {
    for (scale, radiance, noise) in [(1e-6, 1e6, 0.2), (1.0, 1.0, 0.2), (1e-9, 1e12, 0.2), (30.0, 1e3, 0.3)] {
        let world = format!("{}{}", flame(scale, radiance), boundary("f", "", CUBE));
        let (spp, expected) = (2048, expected(scale, radiance));
        let (mean, error) = along_z(1).mean(&world, spp);
        for c in 0..3 {
            let deviation = error[c] * f64::from(spp * 64).sqrt() / expected[c];
            println!("{scale}, channel {c}: {} ± {} and {}, noise {deviation:.3}", mean[c], error[c], expected[c]);
            assert!(deviation < noise, "extinction {scale}: one sample is off by {deviation} of the mean");
            assert_mean("flame", mean[c], error[c], expected[c], SLACK);
        }
    }
}

/// Fires so thick that what is ahead is their own radiance alone, seen from within (towards the sides of the box they fade).
#[test]
fn what_glows_by_temperature_and_rgbgrids_are_as_bright_as_in_pbrt() {
    let ones = |n: usize| vec!["1"; n].join(" ");
    let thick = "\"float scale\" 30 \"rgb sigma_s\" [0 0 0] \"float Lescale\" 0.25";
    let hot = grid_medium(4, &ones(64), &format!("{thick} \"float temperature\" [{}]", vec!["5500"; 64].join(" ")));
    let colours = format!(
        "MakeNamedMedium \"g\" \"string type\" \"rgbgrid\" \"integer nx\" 4 \"integer ny\" 4 \"integer nz\" 4
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1] \"float scale\" 30 \"float Lescale\" 0.25 \"rgb sigma_a\" [{}]
         \"rgb sigma_s\" [{}] \"rgb Le\" [{}]\n",
        ones(192),
        vec!["0"; 192].join(" "),
        vec!["1 2 3"; 64].join(" ")
    );
    let seen = |medium: &str| {
        let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], ..along_z(1) };
        shot.mean(&format!("{medium}{}", boundary("g", "", CUBE)), 2048).0
    };
    // 0.25 times ∫ ȳ dλ times the mean of Planck's curve under ȳ over its peak.
    let [r, g, b] = seen(&hot);
    let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    assert!((luminance / 26.2 - 1.0).abs() < 0.01, "{luminance}");
    for (c, found) in seen(&colours).into_iter().enumerate() {
        let expected = 0.25 * 106.857 * (c + 1) as f64;
        assert!((found / expected - 1.0).abs() < 0.01, "channel {c}: {found}, {expected}");
    }
}

/// From within, to either side.
#[test]
fn a_camera_inside_a_fire_sees_what_is_ahead() {
    let world = format!("{}{}", flame(3.0, 1.0), boundary("f", "", CUBE));
    for (from, to) in [(-0.3, 1.0), (0.4, -1.0), (0.4, 1.0)] {
        let shot = Shot { from: [0.0, 0.0, from], to: [0.0, 0.0, 2.0 * to], ..along_z(1) };
        shot.assert(&format!("from {from}"), &world, 2048, expected_from(from, to, 3.0, 1.0), 0.01);
    }
}

/// Two fires, of which the second is bright where the first is dark, and fog in one box: emission and extinction add up.
#[test]
fn fires_that_overlap_add_up() {
    let other: [f64; 8] = std::array::from_fn(|i| 1.0 - GLOW[i]);
    let (glow, thick) = ([0.1, 0.2, 0.3], [0.4, 0.1, 0.9]);
    let fog = "MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.4 0.1 0.9] \"rgb sigma_s\" [0 0 0] \"rgb Le\" [0.1 0.2 0.3]\n";
    let boxes: String = ["f", "g", "h"].map(|name| boundary(name, "", CUBE)).concat();
    let world = format!("{}{}{fog}{boxes}", flame(1.5, 1.0), flame_of("g", 0.2, 20.0, &other));
    let expected = std::array::from_fn(|c| {
        let of = |scale: f64, z: f64| scale * SIGMA[c] * sampled(&DENSITY, z);
        let emission = |z: f64| {
            let fires = of(1.5, z) * sampled(&GLOW, z) + of(0.2, z) * 20.0 * sampled(&other, z);
            COLOUR[c] * fires + thick[c] * glow[c]
        };
        seen(-1.0, 1.0, |z| of(1.7, z) + thick[c], emission)
    });
    along_z(1).assert("overlapping", &world, 4096, expected, 0.01);
}

/// Through a fire into a mirror behind it, and back through the fire: the line ends at the mirror and a new one begins there.
#[test]
fn a_mirror_shows_a_fire_from_behind() {
    let mirror =
        "AttributeBegin Translate 0 0 2 Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" 0
        Shape \"disk\" \"float radius\" 1 AttributeEnd\n";
    let world = format!("{}{}{mirror}", flame(0.5, 1.0), boundary("f", "", CUBE));
    let (there, back) = (expected_from(-1.0, 1.0, 0.5, 1.0), expected_from(1.0, -1.0, 0.5, 1.0));
    let passed = |c: usize| (-integrate(-1.0, 1.0, 64, |z| 0.5 * SIGMA[c] * sampled(&DENSITY, z))).exp();
    let expected = std::array::from_fn(|c| there[c] + passed(c) * back[c]);
    along_z(3).assert("mirror", &world, 4096, expected, 0.01);
}

/// What is a thousand times as bright takes no more points.
#[test]
fn the_unit_of_radiance_does_not_matter() {
    let steps = |radiance: f64| {
        let world = format!("{}{}", flame(0.5, radiance), boundary("f", "", CUBE));
        along_z(1).render(&world, &Options::default()).counters.emission_points
    };
    let (dim, bright) = (steps(1e-3) as f64, steps(1e6) as f64);
    assert!((dim / bright - 1.0).abs() < 0.01, "{dim} and {bright}");
    // 64 × 64 rays, at most about one point for each of the 8 voxels.
    assert!((2.0..10.0).contains(&(bright / 4096.0)), "{bright} points");
}

/// Nothing but radiance 1 in and around a room whose walls shine with it, whatever is in the room emits as it absorbs.
#[test]
fn equilibrium_is_uniform() {
    let room = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
         Material \"diffuse\" \"rgb reflectance\" [0 0 0] Scale 2 2 2 {CUBE} AttributeEnd\n"
    );
    let fog = "MakeNamedMedium \"h\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.4 0.1 0.9] \"rgb sigma_s\" [0.5 0.7 0.2]
               \"rgb Le\" [1 1 1] \"float g\" 0.5\n";
    let smoke =
        shuffled_grid("g", "\"rgb sigma_a\" [0.4 2 1] \"rgb sigma_s\" [2 1.5 1] \"float g\" -0.3 \"rgb Le\" [1 1 1]");
    let thin = shuffled_grid("g", "\"rgb sigma_a\" [1e-3 2e-3 1e-3] \"rgb sigma_s\" [2 1.5 1] \"rgb Le\" [1 1 1]");
    let inside = |name: &str, size: f64| boundary(name, "", &format!("Scale {size} {size} {size} {CUBE}"));
    let cases = [
        ("fog", format!("{fog}{}", inside("h", 1.9))),
        ("smoke", format!("{smoke}{}", inside("g", 0.95))),
        ("thin smoke", format!("{thin}{}", inside("g", 0.95))),
        ("smoke in fog", format!("{fog}{smoke}{}{}", inside("h", 1.9), inside("g", 0.95))),
        ("smoke and fog side by side", {
            format!("{fog}{smoke}{}{}", boundary("h", "", &format!("Translate 0.3 0 0 {CUBE}")), inside("g", 0.95))
        }),
    ];
    for (what, media) in cases {
        for from in [[0.0, 0.0, -1.95], [0.1, 0.2, 0.3]] {
            let shot = Shot { from, to: [0.0, 0.1, 1.5], fov: 60.0, size: 16, depth: 60 };
            shot.assert(what, &format!("{room}{media}"), 256, [1.0; 3], 5e-3);
        }
    }
}

/// No sample is NaN or infinite, and no ray takes more steps than it crosses voxels (and collisions come).
#[test]
fn extremes_end() {
    let grid = |n: u32, values: &str, more: &str| grid_medium(n, values, &format!("\"rgb sigma_s\" [0 0 0] {more}"));
    let le = glow;
    let cases = [
        ("one voxel", grid(1, "1", &le(1.0, 1.0)), 200),
        ("empty", grid(2, "0 0 0 0 0 0 0 0", &le(1.0, 1.0)), 1),
        ("dark", grid(1, "1", &le(1.0, 0.0)), 200),
        ("thin and bright", grid(2, "1 0 0 0 0 0 0 1", &le(1e-9, 1e15)), 200),
        ("bright", grid(2, "1 0 0 0 0 0 0 1", &le(1.0, 1e6)), 200),
        ("dense", grid(2, "1 0 0 0 0 0 0 1", &le(1e5, 1e6)), 200),
        ("all of it", grid(2, "1e-9 1e5 0 0 1 0 0 1e-9", &le(1.0, 1e6)), 20_000_000),
        ("brightest", grid(1, "1", &le(1.0, 1e37)), 200),
        ("fog", homogeneous("1e-9 1 1e9", 1e6), 200),
        ("thin fog", homogeneous("1e-30 1e-20 0", 1e30), 200),
    ];
    for (what, medium, most) in cases {
        for world in [
            format!("{medium}{}", boundary("g", "", CUBE)),
            // Without an end.
            format!("{medium}{}", boundary("", "g", "Translate 0 0 -4 Shape \"sphere\" \"float radius\" 0.5")),
        ] {
            let outcome = along_z(3).render(&world, &Options { spp: 4, ..Options::default() });
            let (mean, _) = image_mean(&outcome.film);
            let counters = outcome.counters;
            let steps = counters.flight_steps + counters.transmittance_steps + counters.emission_points;
            assert!(steps <= most * 256, "{what}: {steps} steps");
            assert_eq!(outcome.film.rejected().0, 0, "{what}: {mean:?}");
            assert!(mean.iter().all(|m| m.is_finite()), "{what}: {mean:?}");
        }
    }
}

fn homogeneous(sigma: &str, radiance: f64) -> String {
    format!(
        "MakeNamedMedium \"g\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{sigma}] \"rgb sigma_s\" [0 0 0]
         \"rgb Le\" [{radiance} {radiance} {radiance}]\n"
    )
}

#[test]
fn fog_that_glows_shows_no_noise() {
    let world = format!("{}{}", homogeneous("1e-6 2e-6 3e-6", 1e6), boundary("g", "", CUBE));
    let outcome = render_text(&along_z(1).text(&world), &Options { spp: 4, ..Options::default() });
    let (mean, error) = image_mean(&outcome.film);
    for c in 0..3 {
        assert!((mean[c] / (2.0 * (c + 1) as f64) - 1.0).abs() < 1e-4, "{mean:?}");
        assert!(error[c] < 1e-4 * mean[c], "{error:?}");
    }
}
