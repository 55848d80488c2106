//! What is tracked through: worlds of nothing but one medium, and rays across its box.

use std::fmt::Write as _;
use std::path::Path;

use glam::Vec3;
use lanternfish::geometry::Ray;
use lanternfish::integrator::World;
use lanternfish::math::sampler::Stream;
use lanternfish::medium::Medium;
use lanternfish::render::{Job, RenderSettings, Timings};
use lanternfish::scene::{Sources, Warnings};

/// Edge of the fire made on the spot, in voxels.
pub const MADE_UP: usize = 128;

/// Prepares a scene given as text.
pub fn prepare(text: &str, settings: &RenderSettings) -> Job {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    let (mut sources, mut warnings) = (Sources::default(), Warnings::default());
    let (scene, _) = lanternfish::render::load(&path, &mut sources, &mut warnings).expect("the scene is valid");
    Job::prepare(&scene, settings, Timings::default(), &mut warnings).expect("the scene builds")
}

/// A world of nothing but a medium "fire", which fills it from the camera on.
fn world(medium: &str) -> World {
    let text =
        format!("{medium}\nMediumInterface \"\" \"fire\"\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n");
    prepare(&text, &RenderSettings::default()).world
}

/// A world of nothing but the fire of a file, or one made on the spot.
pub fn fire(file: Option<&Path>, scale: f32, glows: bool) -> World {
    let glow = if glows { r#""string temperature" "temperature" "float temperaturescale" 1000"# } else { "" };
    match file {
        Some(path) => world(&format!(
            r#"MakeNamedMedium "fire" "string type" "openvdb" "string filename" "{}" "string density" "density"
               {glow} "float scale" {scale}"#,
            std::path::absolute(path).expect("a path").display()
        )),
        None => world(&made_up(scale)),
    }
}

/// A world of nothing but this medium.
pub fn of(medium: Medium) -> World {
    let mut world = world(r#"MakeNamedMedium "fire" "string type" "uniformgrid" "float density" 1"#);
    world.media = vec![medium];
    world
}

/// Tongues of fire in a box of 128³ voxels: the density of the i-th.
pub fn tongues(i: usize) -> f32 {
    const N: usize = MADE_UP;
    let [x, y, z] = [i % N, i / N % N, i / (N * N)].map(|k| k as f32 / N as f32 - 0.5);
    let sway = 0.12 * (14.0 * z).sin() + 0.05 * (41.0 * z + 9.0 * x).sin();
    let radius = ((x - sway).powi(2) + (y + 0.7 * sway).powi(2)).sqrt() / (0.28 - 0.2 * z);
    let value = (1.0 - radius).max(0.0) * (0.6 + 0.4 * (60.0 * x).sin() * (50.0 * y).cos() * (33.0 * z).sin());
    // As text has it.
    (value * 1e3).round() * 1e-3
}

fn made_up(scale: f32) -> String {
    const N: usize = MADE_UP;
    let mut density = String::new();
    for i in 0..N * N * N {
        write!(density, "{:.3} ", tongues(i)).expect("strings grow");
    }
    format!(
        r#"MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" {N} "integer ny" {N} "integer nz" {N}
           "float density" [ {density} ] "float scale" {scale}"#
    )
}

/// Chords between random points of the box.
pub fn chords(low: Vec3, high: Vec3, count: u64, seed: u64) -> Vec<Ray> {
    let mut stream = Stream::from_seed(seed);
    let mut point = || {
        let mut u = || stream.next_f32();
        let mut p = Vec3::new(u(), u(), u());
        // On one of the six faces.
        let face = (u() * 6.0) as usize;
        p[face % 3] = (face / 3) as f32;
        low + (high - low) * p
    };
    let mut ends = std::iter::repeat_with(|| (point(), point())).filter(|(a, b)| a.distance(*b) > 0.0);
    let ray = |(a, b): (Vec3, Vec3)| {
        let t_max = a.distance(b);
        Ray { origin: a, direction: (b - a) / t_max, t_max, time: 0.0, opacity_seed: 0 }
    };
    (0..count).map(|_| ray(ends.next().expect("endless"))).collect()
}

/// The largest bound along any of the rays.
pub fn densest(medium: &Medium, rays: &[Ray]) -> f32 {
    let segments = rays.iter().flat_map(|ray| medium.majorants(ray.origin, ray.direction, 0.0, ray.t_max));
    segments.map(|segment| segment.majorant).fold(0.0, f32::max)
}
