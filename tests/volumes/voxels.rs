//! Voxels that no density can be: NaN, infinite, negative. They are counted in a warning and count as 0 (the image is, bit by bit, that of a file which has
//! zeros there), or with `--strict` named in an error. And files of one voxel, of none, and far out in index space.
//!
//! Every comparison of means fails by chance with probability 1e-6 (`common::assert_mean`).

use crate::common::{CUBE, Options, Shot, boundary, grid_medium, render_file};
use lanternfish::film::Film;

fn shot() -> Shot {
    Shot { fov: 40.0, size: 8, ..Shot::default() }
}

/// Renders a world whose files lie in `folder`; the image, and all warnings.
fn render(folder: &std::path::Path, shot: &Shot, world: &str, spp: u32) -> (Film, String) {
    let path = folder.join("scene.pbrt");
    std::fs::write(&path, shot.text(world)).expect("the scene can be written");
    let (outcome, warnings) = render_file(&path, &Options { spp, ..Options::default() }).expect("it renders");
    assert_eq!(outcome.film.rejected().0, 0, "samples were NaN or infinite");
    (outcome.film, warnings.list().iter().map(|w| format!("{}\n", w.message)).collect())
}

const LAMP: &str = "LightSource \"point\" \"rgb I\" [9 9 9] \"point3 from\" [1 2 -2]\n";

/// Negative numbers in the text of every kind of grid.
#[test]
fn negative_values_in_text_are_zeros_and_are_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let density = "\"rgb sigma_a\" [1 1 1] \"rgb sigma_s\" [2 2 2]";
    let glow = |values: &str| format!("{density} \"float Lescale\" [{values}] \"rgb Le\" [1 2 3]");
    let heat = |values: &str| format!("{density} \"float temperature\" [{values}] \"float Lescale\" 1");
    let colours = |which: &str, a: &str| {
        let other = if which == "sigma_a" { "sigma_s" } else { "sigma_a" };
        format!(
            "MakeNamedMedium \"g\" \"string type\" \"rgbgrid\" \"integer nx\" 2 \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1]
             \"rgb {other}\" [1 1 1 2 2 2] \"rgb {which}\" [1 {a} 2 1 1 1]\n"
        )
    };
    let cases = [
        ("\"density\"", 2, grid_medium(2, "1 -1 1 -1e30 1 0 1 1", density), grid_medium(2, "1 0 1 0 1 0 1 1", density)),
        (
            "\"Lescale\"",
            1,
            grid_medium(2, "1 1 1 1 1 1 1 1", &glow("1 2 -3 1 1 1 0 0")),
            grid_medium(2, "1 1 1 1 1 1 1 1", &glow("1 2 0 1 1 1 0 0")),
        ),
        (
            "\"temperature\"",
            3,
            grid_medium(2, "1 1 1 1 1 1 1 1", &heat("900 -1 1500 -2 -3 0 0 100")),
            grid_medium(2, "1 1 1 1 1 1 1 1", &heat("900 0 1500 0 0 0 0 100")),
        ),
        ("\"sigma_s\"", 1, colours("sigma_s", "-2"), colours("sigma_s", "0")),
        ("\"sigma_a\"", 1, colours("sigma_a", "-2"), colours("sigma_a", "0")),
    ];
    for (grid, count, bad, good) in cases {
        let of =
            |medium: &str| render(folder.path(), &shot(), &format!("{LAMP}{medium}{}", boundary("g", "", CUBE)), 4);
        let ((image, warnings), (expected, none)) = (of(&bad), of(&good));
        let told = format!(
            "{grid} of MakeNamedMedium \"g\" has {count} values that are NaN, infinite or negative; they are set to 0"
        );
        assert!(warnings.contains(&told), "{grid}: {warnings}");
        assert!(!none.contains("NaN"), "{none}");
        assert!(image.beauty().pixels.iter().any(|v| *v > 0.0));
        assert!(image.beauty().pixels == expected.beauty().pixels, "{grid}");
    }
}

#[cfg(feature = "openvdb")]
mod files {
    use std::path::Path;

    use openvdb::{Compression, Precision, Tile, VdbWriter, set_worker};

    use super::{CUBE, LAMP, SLACK, render, shot};
    use crate::common::media::{DOME, depth, tent};
    use crate::common::{Options, Shot, assert_mean, boundary, image_mean, render_file};
    use crate::program::Folder;

    fn writer() -> VdbWriter {
        set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
        VdbWriter::new().expect("a writer")
    }

    fn medium(file: &str, more: &str) -> String {
        format!("MakeNamedMedium \"g\" \"string type\" \"openvdb\" \"string filename\" \"{file}\" {more}\n")
    }

    const BAD: [f32; 5] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -f32::NAN];

    /// Density, temperature and colour of 8³ voxels, each with five `bad` values, and a tile that has one.
    fn write(path: &Path, precision: Precision, bad: [f32; 5]) {
        let mut writer = writer();
        let value = |i: usize, other: f32| if i % 100 == 7 && i < 500 { bad[i / 100] } else { other };
        let leaf = |other: f32| (0..512).map(|i| value(i, other * (1.0 + (i % 5) as f32))).collect::<Vec<f32>>();
        for (name, scale) in [("density", 0.5), ("temperature", 500.0)] {
            writer.fog_grid(name, precision, 0.0, 0.25, [-1.0; 3]).expect("a grid");
            writer.leaves(&[[0; 3]], &leaf(scale)).expect("a leaf");
            writer
                .tiles(&[Tile { origin: [8, 0, 0], size: 8, value: [bad[0], 0.0, 0.0], active: true }])
                .expect("a tile");
        }
        writer.vec3_grid("Cd", precision, [0.0; 3], 0.25, [-1.0; 3]).expect("a grid");
        let colours: Vec<[f32; 3]> = (0..512).map(|i| [1.0, value(i, 0.5), 0.25]).collect();
        writer.vec3_leaves(&[[0; 3]], &colours).expect("a leaf");
        writer.write(path, Compression::Zip).expect("written");
    }

    #[test]
    fn bad_voxels_of_files_are_zeros_and_are_counted_or_named() {
        let folder = Folder::new("voxels");
        let more = "\"string temperature\" \"temperature\" \"string color\" \"Cd\" \"rgb sigma_s\" [2 2 2]";
        for precision in [Precision::Half, Precision::Single, Precision::Double] {
            write(&folder.path("bad.vdb"), precision, BAD);
            write(&folder.path("good.vdb"), precision, [0.0; 5]);
            let world = |file: &str| format!("{LAMP}{}{}", medium(file, more), boundary("g", "", CUBE));
            let place = folder.path("");
            let (image, warnings) = render(&place, &shot(), &world("bad.vdb"), 4);
            let (expected, none) = render(&place, &shot(), &world("good.vdb"), 4);
            for (grid, count) in [("density", 6), ("temperature", 6), ("Cd", 5)] {
                let told = format!(
                    "grid \"{grid}\" of MakeNamedMedium \"g\" has {count} values that are NaN, infinite or negative"
                );
                assert!(warnings.contains(&told), "{precision:?}: {warnings}");
            }
            assert!(!none.contains("NaN"), "{none}");
            assert!(image.beauty().pixels.iter().any(|v| *v > 0.0));
            assert!(image.beauty().pixels == expected.beauty().pixels, "{precision:?}");
            // As the user chooses.
            folder.write("scene.pbrt", shot().text(&world("bad.vdb")));
            let arguments = ["render", "scene.pbrt", "-o", "out.exr", "--spp", "1"];
            folder.run(&arguments).code(0).says("grid \"density\" of MakeNamedMedium \"g\" has 6 values");
            std::fs::remove_file(folder.path("out.exr")).expect("it rendered");
            let strict = folder.run(&[&arguments[..], &["--strict"]].concat()).code(3);
            strict.says("grid \"density\" of MakeNamedMedium \"g\" has 6 values").says("scene.pbrt:");
            assert!(!folder.path("out.exr").exists());
        }
    }

    /// A background that is no density is one value among the others; around what is stored there is nothing then.
    #[test]
    fn a_bad_background_is_nothing() {
        let folder = Folder::new("background");
        for background in [f32::NAN, f32::INFINITY, -3.0] {
            let mut writer = writer();
            writer.scalar_grid("density", openvdb::GridClass::FogVolume, background, 0.25, [-1.0; 3]).expect("a grid");
            writer.leaves(&[[0; 3]], &[1.0; 512]).expect("a leaf");
            writer.write(&folder.path("grid.vdb"), Compression::None).expect("written");
            let world = format!(
                "{DOME}{}{}",
                medium("grid.vdb", "\"rgb sigma_s\" [0 0 0]"),
                boundary("g", "", "Shape \"sphere\" \"float radius\" 50")
            );
            // Past the voxels.
            let past = Shot { from: [3.0, 3.0, -9.0], to: [3.0, 3.0, 0.0], fov: 1.0, size: 4, ..Shot::default() };
            let (image, _) = render(&folder.path(""), &past, &world, 4);
            assert!(image_mean(&image).0.iter().all(|m| (m - 1.0).abs() < 1e-5), "{background}");
            let (image, _) = render(&folder.path(""), &shot(), &world, 4);
            assert!(image_mean(&image).0[0] < 0.9, "{background}: what is stored is still there");
        }
    }

    /// What reaches to infinity around the whole scene must stop every colour; where it does, or lies within a boundary, and even where rays without end
    /// come into it, every render ends.
    #[test]
    fn media_without_end() {
        use crate::program::HEAD;
        use crate::program::faults::{Faults, Refused, Renders};
        let folder = Folder::new("endless");
        let mut writer = writer();
        writer.fog_grid("density", Precision::Single, 0.0, 0.25, [-1.0; 3]).expect("a grid");
        writer.leaves(&[[0; 3]], &[1.0; 512]).expect("a leaf");
        writer.write(&folder.path("grid.vdb"), Compression::None).expect("written");
        let red = "\"rgb sigma_a\" [1 0 0] \"rgb sigma_s\" [0 0 0]";
        let all = "\"rgb sigma_a\" [1 0.5 0.1] \"rgb sigma_s\" [0.1 0.1 0.1]";
        let direct = "\"string emission\" \"density\" \"bool emissiondirect\" true";
        let (filled, glows) = ("\"float densityoffset\" 0.5", "\"float emissionoffset\" 0.5");
        let endless = "reaches to infinity";
        let around = HEAD.replace("Camera", "MediumInterface \"\" \"g\"\nCamera");
        let sheet = "Scale 9 9 1 Shape \"trianglemesh\" \"point3 P\" [-1 -1 -3 1 -1 -3 1 1 -3 -1 1 -3] \"integer indices\" [0 2 1 0 3 2]";
        let mut faults = Faults::default();
        for (more, fate) in [
            (red.to_owned(), Renders),
            (format!("{red} {direct}"), Renders),
            (format!("{red} {filled}"), Refused(endless)),
            (format!("{red} {filled} {direct}"), Refused(endless)),
            (format!("{red} {filled} {direct} {glows}"), Refused(endless)),
            (format!("{all} {direct} {glows}"), Refused(endless)),
            (format!("{all} {filled}"), Renders),
            (format!("{all} {filled} {direct} {glows}"), Renders),
        ] {
            let medium = medium("grid.vdb", &more);
            folder.write("scene.pbrt", format!("{around}{DOME}{medium}"));
            faults.render(&folder, &format!("around the scene: {more}"), fate);
            for (what, shape) in [("in a box", CUBE), ("behind a sheet", sheet)] {
                folder.write("scene.pbrt", format!("{HEAD}{DOME}{medium}{}", boundary("g", "", shape)));
                faults.render(&folder, &format!("{what}: {more}"), Renders);
            }
        }
    }

    /// A file of one voxel, at the origin and 10⁹ voxels out, and where the grid's own transform puts it a million units away: along a ray past
    /// its centre, against trilinear interpolation.
    #[test]
    fn a_file_of_one_voxel() {
        let folder = tempfile::tempdir().expect("a folder");
        for (what, voxel, offset) in [
            ("near", [3, -5, 7], [0.0; 3]),
            ("far in index space", [1_000_000_003, -900_000_005, 7], [0.0; 3]),
            ("far away", [3, -5, 7], [1e6, -1e6, 1e6]),
            ("far and back", [1_000_000_003, -900_000_005, 7], [-5e8, 4.5e8, 0.0]),
        ] {
            for precision in [Precision::Half, Precision::Single] {
                let mut writer = writer();
                writer.fog_grid("density", precision, 0.0, 0.5, offset).expect("a grid");
                let mut values = [0.0; 512];
                let at = voxel.map(|c: i32| (c & 7) as usize);
                values[at[0] << 6 | at[1] << 3 | at[2]] = 0.75;
                writer.leaves(&[voxel.map(|c| c & !7)], &values).expect("a leaf");
                writer.write(&folder.path().join("one.vdb"), Compression::Zip).expect("written");
                let centre: [f64; 3] = std::array::from_fn(|k| f64::from(voxel[k]) * 0.5 + offset[k]);
                let [from, to] = [[0.15, 0.1, -2.0], [-0.05, 0.05, 2.0]];
                let length = depth(from, to, 400, |p| 0.75 * tent(p.map(|c| c / 0.5)));
                let [from, to]: [[f64; 3]; 2] = [from, to].map(|p| std::array::from_fn(|k| centre[k] + p[k]));
                let more = format!("\"float scale\" {} \"rgb sigma_s\" [0 0 0]", 1.0 / length);
                let [x, y, z] = centre;
                let around = boundary("g", "", &format!("Translate {x} {y} {z} Shape \"sphere\" \"float radius\" 5"));
                let world = format!("{DOME}{}{around}", medium("one.vdb", &more));
                let shot = Shot { from, to, fov: 0.005, size: 8, depth: 2 };
                let (image, _) = render(folder.path(), &shot, &world, 256);
                let (mean, error) = image_mean(&image);
                println!("{what}, {precision:?}: {mean:?} ± {error:?}");
                assert!(error[0] < 5e-3);
                assert_mean(what, mean[0], error[0], (-1f64).exp(), SLACK);
            }
        }
    }

    /// No voxel at all, none that is active, tiles of nothing: nothing is there, which a warning says of the former, and no ray takes a step.
    #[test]
    fn files_without_voxels() {
        let folder = tempfile::tempdir().expect("a folder");
        type Fill<'a> = &'a dyn Fn(&mut VdbWriter);
        let cases: [(&str, Fill); 3] = [
            ("none", &|_| ()),
            ("zeros", &|w| w.leaves(&[[0; 3], [800, 0, 0]], &[0.0; 1024]).expect("leaves")),
            ("tiles of zero", &|w| {
                let tile = |size, x| Tile { origin: [x, 0, 0], size, value: [0.0; 3], active: true };
                w.tiles(&[tile(128, 0), tile(4096, 8192)]).expect("tiles");
            }),
        ];
        for (what, fill) in cases {
            let mut writer = writer();
            writer.fog_grid("density", Precision::Single, 0.0, 0.1, [0.0; 3]).expect("a grid");
            fill(&mut writer);
            writer.write(&folder.path().join("empty.vdb"), Compression::Zip).expect("written");
            let world = format!(
                "{DOME}{}{}",
                medium("empty.vdb", "\"rgb Le\" [5 5 5]"),
                boundary("g", "", "Shape \"sphere\" \"float radius\" 50")
            );
            let path = folder.path().join("scene.pbrt");
            std::fs::write(&path, shot().text(&world)).expect("written");
            let (outcome, warnings) =
                render_file(&path, &Options { spp: 4, ..Options::default() }).expect("it renders");
            let (mean, _) = image_mean(&outcome.film);
            assert!(mean.iter().all(|m| (m - 1.0).abs() < 1e-5), "{what}: {mean:?}");
            assert_eq!(outcome.counters.flight_steps, 0, "{what}");
            let is_told = warnings.list().iter().any(|w| w.message.contains("has no active voxels"));
            // Zeros are what is there anyway, and so is not stored as active.
            assert_eq!(is_told, what != "tiles of zero", "{what}");
        }
    }
}

#[cfg(feature = "openvdb")]
use crate::common::SLACK;
