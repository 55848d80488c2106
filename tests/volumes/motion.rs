//! Volumes that move while the shutter is open, through .vdb files: against quadrature over time, and what is refused.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

#![cfg(feature = "openvdb")]

use std::path::Path;

use crate::common::{Options, SLACK, Shot, View, assert_mean, integrate, prepare_file, render_text};
use lanternfish::render::VolumeLights;
use lanternfish::scene::Warnings;
use openvdb::{Compression, Precision, VdbWriter, set_worker};

/// A block of 8³ voxels of edge 0.25 with density 1, from −1 to 1 along each axis, in a wind along x.
fn write(path: &Path, wind: [f32; 3]) {
    set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    let mut writer = VdbWriter::new().expect("a writer");
    let corner = [-0.875; 3];
    writer.fog_grid("density", Precision::Single, 0.0, 0.25, corner).expect("a grid");
    writer.dense([0; 3], [8; 3], 0.0, |_, _, _| 1.0).expect("voxels");
    // Everywhere, as far as anything moves.
    writer.vec3_grid("v", Precision::Single, [0.0; 3], 0.5, [-0.75; 3]).expect("a grid");
    let leaves: Vec<[i32; 3]> = (0..64).map(|i| [i / 16 - 2, i / 4 % 4 - 2, i % 4 - 2].map(|c| 8 * c)).collect();
    writer.vec3_leaves(&leaves, &vec![wind; 512 * leaves.len()]).expect("voxels");
    for (axis, name) in ["vel.x", "vel.y", "vel.z"].into_iter().enumerate() {
        let mut corner = [-0.75; 3];
        corner[axis] -= 0.25;
        writer.fog_grid(name, Precision::Half, 0.0, 0.5, corner).expect("a grid");
        writer.dense([-16; 3], [32; 3], 0.0, |_, _, _| wind[axis]).expect("voxels");
    }
    writer.write(path, Compression::Zip).expect("written");
}

fn medium(path: &Path, parameters: &str) -> String {
    format!(
        "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"{}\" \"rgb sigma_a\" [1.5 1.5 1.5] \"rgb sigma_s\" [0 0 0] {parameters}\n",
        path.display()
    )
}

/// Density along z through (x, ·, ·) of the block: linear over a voxel's edge around each side.
fn density(x: f64) -> f64 {
    ((1.125 - x.abs()) / 0.25).clamp(0.0, 1.0)
}

/// What one pixel sees through the block of a sky of radiance 1.
fn look(file: &Path, parameters: &str, x: f64, spp: u32) -> ([f64; 3], [f64; 3]) {
    let sky = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    let region = "AttributeBegin MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\" \"float radius\" 9 AttributeEnd\n";
    let shot = Shot { fov: 0.01, size: 4, depth: 1, from: [x, 0.0, -20.0], to: [x, 0.0, 0.0] };
    shot.mean(&format!("{sky}{}{region}", medium(file, parameters)), spp)
}

#[test]
fn a_moving_block_is_seen_as_long_as_it_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wind.vdb");
    // Along z the block is 2 long, with sides of a voxel that add up to the same.
    for (parameters, scale, written) in [
        ("\"string velocity\" \"v\"", 1.0, 0.0),
        ("\"string velocity\" \"v\" \"float velocityscale\" -0.5 \"float velocitytime\" 0.5", -0.5, 0.5),
        ("\"string velocity\" [\"vel.x\" \"vel.y\" \"vel.z\"] \"float velocityscale\" -1", -1.0, 0.0),
    ] {
        write(&file, [3.0, 0.0, 0.0]);
        for x in [0.9, 2.0] {
            let (mean, error) = look(&file, parameters, x, 2048);
            let expected = integrate(0.0, 1.0, 400, |t| (-1.5 * 2.0 * density(x - 3.0 * scale * (t - written))).exp());
            println!("{parameters} at {x}: {mean:?} ± {error:?}, {expected}");
            for c in 0..3 {
                assert_mean("moving block", mean[c], error[c], expected, SLACK);
            }
        }
    }
}

/// Fire that moves: as a light, and found by chance, it is as bright.
#[test]
fn a_moving_fire_lights_as_it_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wind.vdb");
    write(&file, [2.0, 0.5, 0.0]);
    let glow = "\"rgb Le\" [3 2 1] \"string velocity\" \"v\"";
    let region = "AttributeBegin MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\" \"float radius\" 4 AttributeEnd\n";
    let floor = "AttributeBegin Translate 0 -4.5 0 Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 8 AttributeEnd\n";
    let world = format!("{floor}{}{region}", medium(&file, glow));
    let shot = Shot { size: 12, depth: 2, from: [0.0, 2.0, -9.0], to: [0.0, -4.5, 0.0], ..Shot::default() };
    let of = |volume_lights, spp, seed| {
        let options = Options { spp, seed, volume_lights, ..Options::default() };
        let outcome = render_text(&shot.text(&world), &options);
        crate::common::image_mean(&outcome.film)
    };
    let (found, error) = of(VolumeLights::Off, 2048, 1);
    let (lit, other) = of(VolumeLights::Auto, 256, 2);
    for c in 0..3 {
        let both = (error[c].powi(2) + other[c].powi(2)).sqrt();
        assert!(lit[c] > 0.0 && both < 0.05 * lit[c], "{lit:?} ± {other:?}, {found:?} ± {error:?}");
        assert_mean("moving fire", found[c], both, lit[c], SLACK);
    }
}

#[test]
fn what_cannot_move_a_medium_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wind.vdb");
    write(&file, [3.0, 0.0, 0.0]);
    for (parameters, word) in [
        ("\"string velocity\" \"w\"", "no grid \"w\""),
        ("\"string velocity\" \"density\"", "vectors"),
        ("\"string velocity\" [\"density\" \"density\"]", "three of numbers"),
        ("\"string velocity\" [\"density\" \"v\" \"density\"]", "a grid of numbers, where there are three,"),
        ("\"string velocity\" \"v\" \"float velocityscale\" 1e6", "too many"),
    ] {
        let world = format!(
            "{}{}",
            medium(&file, parameters),
            crate::common::boundary("m", "", "Shape \"sphere\" \"float radius\" 4")
        );
        let scene = folder.path().join("scene.pbrt");
        std::fs::write(&scene, Shot::default().text(&world)).expect("written");
        let prepared = prepare_file(&scene, &Options::default(), &mut Warnings::default());
        let error = prepared.err().map_or(String::new(), |error| error.to_string());
        assert!(error.contains(word), "{parameters}: {error}");
    }
}
