//! Media whose coefficients are extreme, against known answers: extinctions of eighteen decades in one scene, nothing and everything
//! scattered, the sharpest lobes, channels twelve decades apart.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::media::{DOME, FOREVER, SAMPLINGS, SHELL, check, columns_mean, grey, grid, homogeneous, list};
use crate::common::{CUBE, Options, SLACK, Shot, View, assert_mean, boundary, image_mean, integrate};
use lanternfish::render::{Outcome, VolumeSampling};

/// Looks along z at the box from −1 to 1.
fn along_z(depth: u32) -> Shot {
    Shot { fov: 0.01, size: 8, depth, ..Shot::default() }
}

const DECADES: std::ops::RangeInclusive<i32> = -9..=9;
/// Pixels of the wedge of one decade.
const WIDTH: usize = 3;

/// A wedge with its tip at the origin, cut off at `near` and `far`, `from..to` wide and 1 high at distance 1.
fn wedge([near, far]: [f64; 2], [from, to]: [f64; 2]) -> String {
    let corners: Vec<f64> = [near, far]
        .iter()
        .flat_map(|z| [[from, -1.0], [to, -1.0], [to, 1.0], [from, 1.0]].map(|[x, y]| [x * z, y * z, *z]))
        .flatten()
        .collect();
    // The indices of the cube.
    let indices = &CUBE[CUBE.find("\"integer").expect("it has indices")..];
    format!("Shape \"trianglemesh\" \"point3 P\" [{}] {indices}", list(&corners))
}

/// Side by side before the camera, the k-th ten times as large, as far away and as thin as the one before: all of optical depth
/// `depth` by the camera's axis. `medium` makes the medium of a name, an extinction, and a size.
fn decades(medium: impl Fn(&str, f64, f64) -> String) -> (Shot, String) {
    let count = DECADES.count() as f64;
    let world = DECADES.enumerate().map(|(i, k)| {
        let (name, size) = (format!("m{i}"), 10f64.powi(k));
        let place = |edge: f64| (2.0 * (i as f64 + edge) / count - 1.0) * 0.1;
        let shape = wedge([2.0 * size, 3.0 * size], [place(0.05), place(0.95)]);
        medium(&name, 1.0 / size, size) + &boundary(&name, "", &shape)
    });
    // The camera's axes: x to the right. The image is as wide as all wedges.
    let shot = Shot {
        from: [0.0; 3],
        to: [0.0, 0.0, 1.0],
        fov: 2.0 * 0.1f64.atan().to_degrees(),
        size: (WIDTH * DECADES.count()) as u32,
        depth: FOREVER,
    };
    (shot, world.collect())
}

/// Compares the middle of each wedge's columns with `expected`, which is given the mean of the ray's length over the wedge's size.
#[track_caller]
fn check_decades(what: &str, outcome: &Outcome, precision: f64, expected: impl Fn(f64) -> f64) {
    assert_eq!(outcome.film.rejected().0, 0, "{what}");
    let count = DECADES.count();
    for (i, k) in DECADES.enumerate() {
        let (mean, error) = columns_mean(&outcome.film, WIDTH * i + 1, WIDTH * i + 2);
        let x = 0.1 * (2.0 * (i as f64 + 0.5) / count as f64 - 1.0);
        let half = 0.1 / (WIDTH * count) as f64;
        let over = |f: &dyn Fn(f64, f64) -> f64| {
            integrate(-0.1, 0.1, 4, |y| integrate(x - half, x + half, 2, |x| f(x, y))) / (0.2 * 2.0 * half)
        };
        let expected = over(&|x, y| expected((1.0 + x * x + y * y).sqrt()));
        println!("{what}, extinction 1e{}: {:.5} ± {:.5}, expected {expected:.5}", -k, mean[1], error[1]);
        assert!(error[1] < precision * expected, "{what}, 1e{}: {} is vague", -k, error[1]);
        assert_mean(&format!("{what}, extinction 1e{}", -k), mean[1], error[1], expected, SLACK);
    }
}

/// A grid that is 1 wherever the wedge of this size is.
fn ones(name: &str, size: f64, more: &str) -> String {
    let by = |c: [f64; 3]| c.map(|x| x * size);
    grid(name, 4, &[1.0; 64], [by([-8.0, -8.0, -6.0]), by([8.0, 8.0, 10.0])], more)
}

#[test]
fn extinctions_from_1e_minus_9_to_1e9_in_one_scene() {
    let fog = |name: &str, extinction: f64, _: f64| homogeneous(name, [extinction; 3], [0.0; 3], "");
    let smoke = |name: &str, extinction: f64, size: f64| ones(name, size, &grey(extinction, 0.0));
    let white_fog =
        |name: &str, extinction: f64, _: f64| homogeneous(name, [0.0; 3], [extinction; 3], "\"float g\" 0.4");
    let white_smoke = |name: &str, extinction: f64, size: f64| ones(name, size, &grey(0.0, extinction));
    for (what, (shot, world)) in [("fog", decades(fog)), ("smoke", decades(smoke))] {
        let outcome = shot.render(&format!("{DOME}{world}"), &Options { spp: 128, ..Options::default() });
        check_decades(what, &outcome, 0.02, |length| (-length).exp());
        // Each ray crosses one wedge; a homogeneous medium has one collision a channel at most, grids few more.
        assert!(outcome.counters.flight_steps < 4 * outcome.counters.paths, "{:?}", outcome.counters);
    }
    let [auto, null, in_scatter, both] = SAMPLINGS;
    for (what, (shot, world), samplings) in
        [("white fog", decades(white_fog), [auto, in_scatter]), ("white smoke", decades(white_smoke), [null, both])]
    {
        for volume_sampling in samplings {
            let options = Options { spp: 32, volume_sampling, ..Options::default() };
            let outcome = shot.render(&format!("{DOME}{world}"), &options);
            check_decades(&format!("{what}, {volume_sampling:?}"), &outcome, 0.02, |_| 1.0);
        }
    }
}

/// The box from −1 to 1, `size` times as large.
fn sized(name: &str, size: f64) -> String {
    boundary(name, "", &format!("Scale {size} {size} {size} {CUBE}"))
}

/// A closed room whose walls emit 0.5 and reflect 0.5 is at radiance 1 everywhere, whatever in it absorbs nothing: haze that hardly exists in all
/// of it, and in that a ball and a grid of up to twenty mean free paths. Paths go on until roulette ends them at a wall.
#[test]
fn an_albedo_of_exactly_1_loses_nothing() {
    let room = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [0.5 0.5 0.5] \"bool twosided\" true Scale 2 2 2
         Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] {CUBE} AttributeEnd\n"
    );
    let haze = homogeneous("h", [0.0; 3], [1e-6, 1e-9, 0.1], "\"float g\" 0.999");
    let ball = homogeneous("b", [0.0; 3], [10.0, 20.0, 30.0], "\"float g\" -0.5");
    let smoke = grid("s", 2, &[1.0, 0.0, 0.2, 1.0, 1e-6, 1.0, 0.7, 0.3], [[0.2; 3], [1.2; 3]], &grey(0.0, 20.0));
    let world = format!(
        "{room}{haze}{ball}{smoke}{}{}{}",
        boundary("h", "", &format!("Scale 1.9 1.9 1.9 {CUBE}")),
        boundary("b", "h", "Translate -0.6 0 0 Shape \"sphere\" \"float radius\" 0.3"),
        boundary("s", "", &format!("Translate 0.7 0.7 0.7 Scale 0.5 0.5 0.5 {CUBE}")),
    );
    let shot = Shot { from: [0.1, 0.2, -1.8], fov: 80.0, size: 8, depth: FOREVER, ..Shot::default() };
    for volume_sampling in SAMPLINGS {
        let options = Options { spp: 64, volume_sampling, ..Options::default() };
        let outcome = check(&format!("room, {volume_sampling:?}"), &shot, &world, &options, [1.0; 3], 0.02);
        let steps = outcome.counters.flight_steps / outcome.counters.paths;
        assert!(steps < 500, "{steps} steps a path");
    }
}

/// Nothing scatters: not one vertex, not one shadow ray, and what is transmitted is Beer's law; whatever the way of sampling scattering points.
#[test]
fn an_albedo_of_0_scatters_nothing() {
    let fog = homogeneous("h", [0.1, 0.5, 1e9], [0.0; 3], "");
    let smoke = grid("g", 1, &[1.0], [[-1.0; 3], [1.0; 3]], &grey(0.4, 0.0));
    let world = format!("{DOME}{fog}{smoke}{}{}", sized("h", 1.0), sized("g", 1.0));
    // Half of the grid's depth is lost to its fading towards the box's sides.
    let expected = [0.1, 0.5, f64::INFINITY].map(|sigma: f64| (-2.0 * sigma - 0.4 * 1.5).exp());
    for volume_sampling in SAMPLINGS {
        let options = Options { spp: 1024, volume_sampling, ..Options::default() };
        let outcome = check("black", &along_z(FOREVER), &world, &options, expected, 0.01);
        assert_eq!((outcome.counters.medium_vertices, outcome.counters.shadow_rays), (0, 0));
    }
}

/// Neither the sharpest lobes gain or lose anything: found by light samples and phase samples together, and by phase samples alone.
#[test]
fn lobes_of_g_0_999_keep_all_energy() {
    for g in [-0.999, 0.999] {
        let more = format!("\"float g\" {g}");
        let media = [
            homogeneous("m", [0.0; 3], [10.0; 3], &more),
            grid("m", 2, &[1.0; 8], [[-1.0; 3], [1.0; 3]], &format!("{} {more}", grey(0.0, 1.0))),
        ];
        for medium in media {
            let world = format!("{DOME}{medium}{}", sized("m", 1.0));
            let shot = Shot { size: 8, depth: FOREVER, ..Shot::default() };
            let options = Options { spp: 96, ..Options::default() };
            check(&format!("g {g}"), &shot, &world, &options, [1.0; 3], 0.01);
            // Within a shell nothing samples lights, and every path brings back 1.
            let (mean, _) = shot.mean(&format!("{SHELL}{world}"), 4);
            assert!(mean.iter().all(|m| (m - 1.0).abs() < 1e-4), "g {g}: {mean:?}");
        }
    }
}

/// The camera looks through the hole of a ring that shines (or has it behind): all light is scattered once, off the lobe's axis by a few times its
/// width up to a hundred times. Under Henyey and Greenstein's distribution the cosine follows from a uniform number, so ∫ p dω is ∫ du.
#[test]
fn single_scattering_in_lobes_of_g_0_999_is_its_integral() {
    let (distance, hole, rim) = (3.0f64, 0.003, 0.5);
    let [sigma_a, sigma_s] = [0.1, 0.2];
    let sigma = sigma_a + sigma_s;
    let g = 0.999f64;
    let root = |cosine: f64| (1.0 + g * g - 2.0 * g * cosine).sqrt();
    let share = |cosine: f64| (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 - g) - 1.0 / root(cosine));
    let cosine = |share: f64| {
        let s = 1.0 / (1.0 / (1.0 - g) - 2.0 * g * share / (1.0 - g * g));
        (1.0 + g * g - s * s) / (2.0 * g)
    };
    let at = |radius: f64, z: f64| z / z.hypot(radius);
    // `z` is how far the ring's plane is from the vertex at `t`.
    let from = |t: f64, z: f64| {
        let [near, far] = [share(at(hole, z)), share(at(rim, z))];
        sigma_s * (-sigma * t).exp() * integrate(near, far, 8, |u| (-sigma * z / cosine(u)).exp())
    };
    // Before the camera the ring ends what is seen; behind it, a wall.
    let ahead =
        integrate(0.0, 2.9, 64, |t| from(t, distance - t)) + integrate(2.9, distance, 64, |t| from(t, distance - t));
    let behind = integrate(0.0, distance, 64, |t| from(t, distance + t));
    for (g, place, expected) in [(g, distance, ahead), (-g, -distance, behind)] {
        let ring = format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true
             Material \"diffuse\" \"rgb reflectance\" [0 0 0]
             Shape \"disk\" \"float radius\" {rim} \"float innerradius\" {hole} \"float height\" {place} AttributeEnd
             Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"disk\" \"float height\" {} \"float radius\" 0.6\n",
            distance * 1.0001
        );
        let fog = homogeneous("m", [sigma_a; 3], [sigma_s; 3], &format!("\"float g\" {g}"));
        let world = format!("{ring}{fog}{}", boundary("m", "", "Shape \"sphere\" \"float radius\" 20"));
        let shot = Shot { from: [0.0; 3], to: [0.0, 0.0, 1.0], fov: 1e-3, size: 8, depth: 1 };
        for volume_sampling in SAMPLINGS {
            let spp = if volume_sampling == VolumeSampling::Null { 256 } else { 128 };
            let options = Options { spp, volume_sampling, ..Options::default() };
            check(&format!("g {g}, {volume_sampling:?}"), &shot, &world, &options, [expected; 3], 0.05);
        }
    }
}

/// Channels twelve decades apart: where nothing is absorbed all are white, whichever decides; where all is, each is by its own Beer's law. The
/// scene is as small as the densest channel demands: there its depth is 20, in the others 2e-5 and 2e-11.
#[test]
fn channels_1e_minus_6_to_1_to_1e6() {
    let size = 1e-5;
    let sigma = [1e-6, 1.0, 1e6];
    let shot = Shot { from: [0.0, 0.0, -4.0 * size], size: 8, depth: FOREVER, ..Shot::default() };
    let straight = Shot { fov: 0.01, ..along_z(FOREVER) };
    let straight = Shot { from: shot.from, ..straight };
    let text = list(&sigma);
    let media = |absorbs: bool| {
        let more = if absorbs {
            format!("\"rgb sigma_a\" [{text}] \"rgb sigma_s\" [0 0 0]")
        } else {
            format!("\"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [{text}]")
        };
        let [a, s] = if absorbs { [sigma, [0.0; 3]] } else { [[0.0; 3], sigma] };
        // One more cell on each side: within the boundary it is 1.
        [homogeneous("m", a, s, ""), grid("m", 4, &[1.0; 64], [[-2.0 * size; 3], [2.0 * size; 3]], &more)]
    };
    for volume_sampling in [VolumeSampling::Null, VolumeSampling::Both] {
        let options = |spp| Options { spp, volume_sampling, ..Options::default() };
        for medium in media(false) {
            let world = format!("{DOME}{medium}{}", sized("m", size));
            check("white", &shot, &world, &options(256), [1.0; 3], 0.02);
        }
        for medium in media(true) {
            let world = format!("{DOME}{medium}{}", sized("m", size));
            let outcome = straight.render(&world, &options(64));
            let (mean, error) = image_mean(&outcome.film);
            for (c, &sigma) in sigma.iter().enumerate().take(2) {
                assert!(error[c] < 0.02, "{error:?}");
                assert_mean("black", mean[c], error[c], (-2.0 * size * sigma).exp(), SLACK);
            }
            // One in 5e8 passes.
            assert!(mean[2] < 1e-6, "{mean:?}");
        }
    }
}
