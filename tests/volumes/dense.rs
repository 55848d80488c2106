//! Media so dense that light gets no deeper than a hair, and media so thin and bright that only their glow shows: what they reflect and what
//! they light, against theory and quadrature.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::media::{DOME, FOREVER, check, grey, grid, homogeneous, list, tent};
use crate::common::{CUBE, Options, Shot, View, assert_mean, boundary, integrate};
use lanternfish::render::{LightSelection, VolumeLights};
use lanternfish::stability::reference::half_space;

fn options(spp: u32) -> Options {
    Options { spp, ..Options::default() }
}

/// A box that has this albedo and extinction, seen at the middle of its face, looks like the half-space.
fn reflects(albedo: f64, sigma: f64) {
    let [a, s] = [(1.0 - albedo) * sigma, albedo * sigma];
    let mut media = vec![homogeneous("m", [a; 3], [s; 3], "")];
    // A voxel may have a depth of up to 1e6.
    if sigma < 1e6 {
        media.push(grid("m", 4, &[1.0; 64], [[-2.0; 3], [2.0; 3]], &grey(a, s)));
    }
    for medium in media {
        let shot = Shot { fov: 0.1, size: 8, depth: FOREVER, ..Shot::default() };
        let world = format!("{DOME}{medium}{}", boundary("m", "", CUBE));
        let what = format!("albedo {albedo}, extinction {sigma:e}");
        check(&what, &shot, &world, &options(64), [half_space(albedo); 3], 0.04);
    }
}

/// Deep within the box there is no light, however dense it is: the box looks like a half-space.
#[test]
fn dense_media_look_like_half_spaces() {
    for albedo in [0.5, 0.9] {
        for sigma in [1e2, 1e4] {
            reflects(albedo, sigma);
        }
    }
}

/// So do media whose mean free path is below what a position in f32 resolves: from a distance of 3 that is 2e-7.
#[test]
fn the_densest_media_look_like_half_spaces_too() {
    for sigma in [1e5, 1e6, 1e7, 1e9] {
        reflects(0.5, sigma);
    }
    reflects(0.9, 1e9);
}

/// A white medium as dense as can be gives back all light, but for what is still in it after the most bounces that a path has: 0.052 % of it, which is
/// counted.
#[test]
fn the_densest_white_medium_is_white() {
    let world = format!("{DOME}{}{}", homogeneous("m", [0.0; 3], [1e9; 3], ""), boundary("m", "", CUBE));
    let shot = Shot { fov: 0.1, size: 4, depth: FOREVER, ..Shot::default() };
    let outcome = shot.render(&world, &options(64));
    let (mean, error) = crate::common::image_mean(&outcome.film);
    let cut = outcome.counters.cut_paths as f64 / outcome.counters.paths as f64;
    println!("{mean:?} ± {error:?}, {cut:.2e} of the paths cut");
    // 1024 paths, of which one is cut in two renders: within five standard deviations of that.
    assert!(cut < 0.0045, "{cut}");
    for c in 0..3 {
        assert!(error[c] < 0.02, "{error:?}");
        // What rounding takes off half-spaces besides is below this.
        assert_mean("white", mean[c], error[c], 1.0 - 0.00052, 1e-3);
    }
}

/// Where the floor is lit, and the flame's half size.
const LIT: [f64; 3] = [0.4, -1.2, 0.3];
const HALF: f64 = 0.5;

/// The integral of μ_a e^{−τ} cos θ / r² over a flame of one voxel around the origin, seen from the floor: times L_e, its irradiance.
fn irradiance(sigma: f64) -> f64 {
    let inside = |p: [f64; 3]| p.iter().all(|c| c.abs() <= HALF);
    let density = |p: [f64; 3]| if inside(p) { tent(p.map(|c| c / (2.0 * HALF))) } else { 0.0 };
    let over = |f: &dyn Fn(f64) -> f64| integrate(-HALF, 0.0, 2, f) + integrate(0.0, HALF, 2, f);
    over(&|x| {
        over(&|y| {
            over(&|z| {
                let p = [x, y, z];
                let to: [f64; 3] = std::array::from_fn(|k| p[k] - LIT[k]);
                let r2 = to.iter().map(|c| c * c).sum::<f64>();
                let depth = if sigma < 1e-5 { 0.0 } else { sigma * crate::common::media::depth(p, LIT, 20, density) };
                sigma * density(p) * (-depth).exp() * to[1] / (r2 * r2.sqrt())
            })
        })
    })
}

/// A flame that emits a million times what it absorbs, or much more, and hardly absorbs at all, or all of it: a floor under it receives what
/// quadrature says, whether the flame is a light or found by chance, and whatever chooses the light.
#[test]
fn flames_of_a_million_times_their_extinction_light_a_floor() {
    let shot = Shot { from: [4.0, -1.1, 0.3], to: LIT, fov: 0.005, size: 8, depth: 2 };
    for (sigma, radiance) in [(1e-9, 1e15), (1e-6, 1e6), (1.0, 1e6), (30.0, 1e6f64)] {
        let more = format!("{} \"rgb Le\" [{}]", grey(sigma, 0.0), list(&[radiance; 3]));
        let flame = grid("g", 1, &[1.0], [[-HALF; 3], [HALF; 3]], &more);
        let world = format!(
            "{}{flame}{}",
            crate::common::FLOOR,
            boundary("g", "", &format!("Scale {HALF} {HALF} {HALF} {CUBE}"))
        );
        let expected = [0.7, 0.6, 0.5].map(|rho| rho / std::f64::consts::PI * radiance * irradiance(sigma));
        for volume_lights in [VolumeLights::Auto, VolumeLights::Off] {
            for lights in [LightSelection::Auto, LightSelection::CachePoints, LightSelection::Tree] {
                if volume_lights == VolumeLights::Off && lights != LightSelection::Auto {
                    continue;
                }
                let what = format!("extinction {sigma:e}, {volume_lights:?}, {lights:?}");
                // What is found by chance has more noise.
                let spp = if volume_lights == VolumeLights::Off { 4096 } else { 512 };
                let options = Options { volume_lights, lights, ..options(spp) };
                check(&what, &shot, &world, &options, expected, 0.02);
            }
        }
    }
}

/// Whatever is said of media, the built program is done with 96 paths in two seconds: walks that could go on for ever, bounds of a million
/// collisions a voxel, and thousands of voxels of those.
#[test]
fn no_render_hangs() {
    use crate::program::Folder;
    use crate::program::faults::{Faults, Renders};
    let head = crate::program::HEAD
        .replace("WorldBegin", "Integrator \"volpath\" \"integer maxdepth\" 2000000000\nWorldBegin");
    let inside = |name: &str| boundary(name, "", CUBE);
    let white = |sigma: f64, g: f64| homogeneous("m", [0.0; 3], [sigma; 3], &format!("\"float g\" {g}")) + &inside("m");
    let board: Vec<f64> = (0..16i32.pow(3)).map(|i| f64::from((i + i / 16 + i / 256) % 2)).collect();
    let checkered = |sigma: f64| grid("m", 16, &board, [[-1.0; 3], [1.0; 3]], &grey(sigma, 0.0)) + &inside("m");
    let nested: String = (0..32)
        .map(|i| {
            let size = 1.0 - 0.02 * f64::from(i);
            homogeneous(&format!("m{i}"), [1.0; 3], [9.0; 3], "")
                + &boundary(&format!("m{i}"), "", &format!("Scale {size} {size} {size} {CUBE}"))
        })
        .collect();
    let folder = Folder::new("hang");
    let mut faults = Faults::default();
    for (what, world) in [
        ("thin and white", white(1e-9, 0.0)),
        ("white", white(10.0, 0.0)),
        ("white, forward", white(10.0, 0.999)),
        ("white, backward", white(10.0, -0.999)),
        ("white and dense", white(1e7, 0.0)),
        ("white and as dense as can be", white(1e9, 0.0)),
        ("white and as dense as can be, forward", white(1e9, 0.999)),
        ("nearly white", homogeneous("m", [10.0; 3], [1e3; 3], "") + &inside("m")),
        ("dense and black", homogeneous("m", [1e9; 3], [0.0; 3], "") + &inside("m")),
        ("of all colours", homogeneous("m", [1e-6, 1.0, 1e6], [1e-6, 1.0, 1e6], "") + &inside("m")),
        ("a checkered grid", checkered(1e6)),
        ("a very dense checkered grid", checkered(7e6)),
        ("32 media in each other", nested),
    ] {
        folder.write("scene.pbrt", format!("{head}{DOME}{world}\n"));
        faults.render(&folder, what, Renders);
    }
}
