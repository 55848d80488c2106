//! What tests of media share: media as text, the answers that are known of them, and means of parts of an image.

use lanternfish::film::Film;
use lanternfish::render::VolumeSampling;

use super::{Options, SLACK, Shot, assert_mean, image_mean, integrate};

/// Bounces without limit in practice.
pub const FOREVER: u32 = 2_000_000_000;

/// An environment of radiance 1.
pub const DOME: &str = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";

/// Glass without refraction hides the surrounding from light sampling: paths find it by themselves, and where nothing is absorbed
/// each must bring back exactly 1.
pub const SHELL: &str =
    "AttributeBegin Material \"dielectric\" \"float eta\" 1 Shape \"sphere\" \"float radius\" 3 AttributeEnd\n";

/// All ways of sampling scattering points.
pub const SAMPLINGS: [VolumeSampling; 4] =
    [VolumeSampling::Auto, VolumeSampling::Null, VolumeSampling::InScatter, VolumeSampling::Both];

/// Numbers as a scene file has them.
pub fn list(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" ")
}

/// A medium that is the same everywhere.
pub fn homogeneous(name: &str, sigma_a: [f64; 3], sigma_s: [f64; 3], more: &str) -> String {
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] {more}\n",
        list(&sigma_a),
        list(&sigma_s)
    )
}

/// A medium of type `uniformgrid`: `n` values of density along each axis of the box `low` to `high`.
pub fn grid(name: &str, n: usize, values: &[f64], [low, high]: [[f64; 3]; 2], more: &str) -> String {
    assert_eq!(values.len(), n * n * n);
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"uniformgrid\" \"integer nx\" {n} \"integer ny\" {n} \"integer nz\" {n}
         \"point3 p0\" [{}] \"point3 p1\" [{}] \"float density\" [{}] {more}\n",
        list(&low),
        list(&high),
        list(values)
    )
}

/// "rgb sigma_a" and "rgb sigma_s" of one grey value each.
pub fn grey(absorption: f64, scattering: f64) -> String {
    format!("\"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}]", list(&[absorption; 3]), list(&[scattering; 3]))
}

/// What a grid of one voxel of density 1 holds at an index position, whose centre is 0: nothing but this one voxel enters the interpolation.
pub fn tent(index: [f64; 3]) -> f64 {
    index.iter().map(|x| (1.0 - x.abs()).max(0.0)).product()
}

/// The integral of `density` along the line from `from` to `to`.
pub fn depth(from: [f64; 3], to: [f64; 3], pieces: usize, density: impl Fn([f64; 3]) -> f64) -> f64 {
    let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
    integrate(0.0, 1.0, pieces, |t| length * density(std::array::from_fn(|k| from[k] + t * way[k])))
}

/// Renders `world` and compares the image's mean with `expected` (`common::assert_mean`), every channel. The standard error must be below
/// `precision` (relative), so that the test can see errors of five times that. What was rendered comes back.
#[track_caller]
pub fn check(
    what: &str,
    shot: &Shot,
    world: &str,
    options: &Options,
    expected: [f64; 3],
    precision: f64,
) -> lanternfish::render::Outcome {
    let outcome = shot.render(world, options);
    assert_eq!(outcome.film.rejected().0, 0, "{what}: samples were NaN or infinite");
    assert_eq!(outcome.counters.region_overflows, 0, "{what}");
    let (mean, error) = image_mean(&outcome.film);
    for c in 0..3 {
        let (m, e, x) = (mean[c], error[c], expected[c]);
        println!("{what}[{c}]: {m:.6} ± {e:.6}, expected {x:.6}");
        assert!(e <= precision * x.abs(), "{what}: the error {e:.6} is too large to say much about {x:.6}");
        assert_mean(&format!("{what}[{c}]"), m, e, x, SLACK);
    }
    outcome
}

/// Mean and standard error of the pixels in the columns `from..to`, per channel.
pub fn columns_mean(film: &Film, from: usize, to: usize) -> ([f64; 3], [f64; 3]) {
    let image = film.channels();
    let width = image.bounds.width() as usize;
    let sum = |name: &str| {
        let values = image.channel(name).expect("every render has it").iter().enumerate();
        values.filter(|(i, _)| (from..to).contains(&(i % width))).map(|(_, v)| f64::from(*v)).sum::<f64>()
    };
    let count = (image.bounds.area() / width * (to - from)) as f64;
    (["R", "G", "B"].map(|c| sum(c) / count), ["R", "G", "B"].map(|c| sum(&format!("variance.{c}")).sqrt() / count))
}
