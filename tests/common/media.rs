//! What tests of media share: media as text, the answers that are known of them, and means of parts of an image.

use lanternfish::film::Film;
use lanternfish::render::VolumeSampling;
pub use lanternfish::stability::reference::{depth, tent};
pub use lanternfish::stability::scene::{DOME, FOREVER, SHELL, grey, grid, homogeneous, list};

use super::{Options, SLACK, Shot, View, assert_mean, image_mean};

/// All ways of sampling scattering points.
pub const SAMPLINGS: [VolumeSampling; 4] =
    [VolumeSampling::Auto, VolumeSampling::Null, VolumeSampling::InScatter, VolumeSampling::Both];

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
