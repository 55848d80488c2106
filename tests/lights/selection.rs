//! In the project's own scenes, made small, whatever chooses the lights gives the same image as asking every light at every vertex.
//!
//! Every scene's test fails by chance with probability 2.5e-5, the four together with 1e-4 (`common::blocks`): over its seeds a block's mean
//! has some 14,000 samples (5,000 in `beams`), so that it is near normal.

use crate::common::blocks::{Blocks, Family};
use crate::common::{Options, prepare_file};
use lanternfish::cache_points::CacheSettings;
use lanternfish::cache_points::gather::Gathering::{Hierarchy, Lists};
use lanternfish::cache_points::learn::VisibilityRule::{Clusters, Off, Root, Threshold};
use lanternfish::film::FilmOverrides;
use lanternfish::render::LightSelection;
use lanternfish::scene::Warnings;

const RATE: f64 = 2.5e-5;
const GRID: [usize; 2] = [4, 3];
const SEEDS: u32 = 16;

/// A way of choosing lights.
struct Rival {
    name: &'static str,
    /// How noisy it may be beside the best.
    noise: f64,
    options: Options,
}

/// Every way there is.
fn rivals(base: &Options) -> Vec<Rival> {
    let rival = |name, noise, options| Rival { name, noise, options };
    let of = |lights| Options { lights, ..base.clone() };
    let of_4 = |options| Options { light_candidates: Some(4), ..options };
    let points = |cache| Options { cache, ..of(LightSelection::CachePoints) };
    let way = |gathering, visibility| CacheSettings { gathering, visibility, ..CacheSettings::default() };
    let few = |cache| CacheSettings { entries: 4, ..cache };
    let flat = CacheSettings { normals: false, ..way(Hierarchy, Clusters) };
    let without = CacheSettings { beams: false, ..way(Hierarchy, Off) };
    vec![
        rival("uniform", 4.0, of(LightSelection::Uniform)),
        rival("power", 4.0, of(LightSelection::Power)),
        rival("optimal of 4", 1.0, of_4(of(LightSelection::Optimal))),
        rival("tree", 4.0, Options { splitting: Some(0.0), ..of(LightSelection::Tree) }),
        rival("tree that splits", 1.0, of(LightSelection::Tree)),
        rival("tree that splits, of 4", 1.0, of_4(of(LightSelection::Tree))),
        rival("points", 1.0, points(way(Hierarchy, Clusters))),
        rival("points of 4", 1.0, of_4(points(way(Hierarchy, Root)))),
        rival("points without visibility", 4.0, points(without)),
        rival("points, few and without normals", 4.0, points(few(flat))),
        rival("points by lists", 1.0, points(way(Lists, Threshold))),
        rival("points by lists, few, of 4", 1.0, of_4(points(few(way(Lists, Root))))),
    ]
}

/// A scene of the gallery, made small.
struct Small {
    name: &'static str,
    lights: u32,
    depth: u32,
    spp: u32,
    /// The part of the image.
    crop: Option<[f32; 4]>,
}

/// Renders a scene in every way; the noise of the whole image must be below `precision`.
fn agree(small: &Small, precision: f64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = lanternfish::gallery::find(small.name).expect("there is such a scene");
    let path = scene.write(folder.path(), Some(small.lights)).expect("it can be written");
    let text = std::fs::read_to_string(&path).expect("it was written");
    // Of beams of 1° hardly any path would meet one; wider ones would not leave their housings.
    let text =
        text.replace("\"float coneangle\" 1 ", "\"float coneangle\" 8 ").replace("ObjectInstance \"housing\"", "");
    std::fs::write(&path, text).expect("it can be written");
    let film = FilmOverrides { resolution: Some([48, 27]), crop: small.crop };
    let base = Options { spp: small.spp, film, max_depth: Some(small.depth), ..Options::default() };
    let render = |options: &Options, seeds| {
        let mut job = prepare_file(&path, options, &mut Warnings::default()).expect("it can be prepared");
        Blocks::render(&mut job, options, GRID, seeds)
    };
    let reference = render(&Options { lights: LightSelection::Optimal, seed: 1000, ..base.clone() }, 2 * SEEDS);
    let mut family = Family::default();
    for Rival { name, noise, options } in rivals(&base) {
        family.compare(&format!("{}, {name}", small.name), &render(&options, SEEDS), &reference, noise * precision);
    }
    family.assert(RATE);
}

#[test]
fn house() {
    agree(&Small { name: "house", lights: 40, depth: 1, spp: 8, crop: None }, 0.03);
}

#[test]
fn rooms() {
    agree(&Small { name: "rooms", lights: 40, depth: 2, spp: 8, crop: None }, 0.01);
}

#[test]
fn foliage() {
    agree(&Small { name: "foliage", lights: 40, depth: 1, spp: 8, crop: None }, 0.04);
}

/// Above the searchlights: close to them, in haze, light of points is without bounds, and its noise too.
#[test]
fn beams() {
    agree(&Small { name: "beams", lights: 16, depth: 1, spp: 16, crop: Some([0.0, 1.0, 0.0, 0.4]) }, 0.04);
}
