//! Images on surfaces that do not fit into the memory they are given: what is said of them, and what is done where they are damaged.

use crate::program::Folder;

/// A wall before the camera that shows an image.
const SCENE: &str = "Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16 Sampler \"zsobol\" \"integer pixelsamples\" 4\n\
     WorldBegin LightSource \"infinite\"\n\
     Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wall.png\" \"string filter\" \"trilinear\"\n\
     Material \"diffuse\" \"texture reflectance\" \"t\"\n\
     Shape \"bilinearmesh\" \"point3 P\" [-2 -2 1  2 -2 1  -2 2 1  2 2 1]\n";

/// The start of every render here.
const RENDER: [&str; 4] = ["render", "scene.pbrt", "-o", "out.exr"];

fn scene(name: &str) -> Folder {
    let folder = Folder::new(name);
    let image = image::RgbImage::from_fn(300, 200, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    image.save(folder.path("wall.png")).expect("the image can be written");
    folder.write("scene.pbrt", SCENE);
    folder
}

#[test]
fn tiles_are_kept_and_told() {
    let folder = scene("texture-tiles");
    folder.run(&RENDER).code(0);
    let whole = folder.read("out.exr");
    let images = |folder: &Folder| folder.run(&["compare", "out.exr", "whole.exr"]).code(0).out;
    folder.write("whole.exr", whole);
    let short = ["--texture-memory", "20kB", "--texture-cache", "tiles", "--stats", "s.json"];
    for _ in 0..2 {
        let run = folder.run(&[&RENDER[..], &short].concat());
        run.code(0).says("textures: at most");
        let statistics: serde_json::Value = serde_json::from_slice(&folder.read("s.json")).expect("JSON");
        assert!(statistics["texture_cache"]["reads"].as_u64() > Some(0), "{statistics}");
        assert!(images(&folder).contains("RMSE          0.000000"), "{}", images(&folder));
        assert_eq!(std::fs::read_dir(folder.path("tiles")).expect("a folder").count(), 1);
    }
    // With the tiles kept, the image is not even read.
    let size = folder.read("wall.png").len();
    let times = std::fs::metadata(folder.path("wall.png")).expect("it is there").modified().expect("a time");
    let mut damaged = folder.read("wall.png");
    damaged[size / 2..].fill(0);
    folder.write("wall.png", damaged);
    std::fs::File::options()
        .write(true)
        .open(folder.path("wall.png"))
        .and_then(|file| file.set_modified(times))
        .expect("a time can be set");
    folder.run(&[&RENDER[..], &short].concat()).code(0);
    assert!(images(&folder).contains("RMSE          0.000000"));
}

#[test]
fn images_that_are_damaged_are_told_also_when_they_are_read_late() {
    let folder = scene("texture-faults");
    let size = folder.read("wall.png").len();
    folder.write("wall.png", &folder.read("wall.png")[..size / 2]);
    for memory in ["1GiB", "1kB"] {
        let late = ["--texture-memory", memory];
        folder.run(&[&RENDER[..], &late].concat()).code(0).says("wall.png").says("magenta");
        std::fs::remove_file(folder.path("out.exr")).expect("an image was written");
        folder.run(&[&RENDER[..], &late, &["--strict"]].concat()).code(3).says("wall.png").says("scene.pbrt:3");
        assert!(!folder.listing().contains_key("out.exr"), "{memory}");
    }
}

#[test]
fn images_that_are_too_large_to_be_cut_are_named() {
    let folder = scene("texture-whole");
    let image = image::RgbImage::from_fn(900, 600, |x, y| image::Rgb([x as u8, y as u8, 7]));
    image.save(folder.path("wall.jpg")).expect("the image can be written");
    image.save(folder.path("wall.png")).expect("the image can be written");
    folder.write("jpeg.pbrt", SCENE.replace("wall.png", "wall.jpg"));
    let render = |scene: &str| folder.run(&["render", scene, "-o", "out.exr", "--texture-memory", "100kB"]);
    render("jpeg.pbrt").code(0).says("jpeg.pbrt:3").says("wall.jpg").says("row by row");
    assert!(!render("scene.pbrt").code(0).err.contains("row by row"));
}

#[test]
fn tiles_that_cannot_be_written_end_the_render() {
    let folder = scene("texture-room");
    let nowhere = ["--texture-memory", "1kB", "--texture-cache", "wall.png/tiles"];
    folder.run(&[&RENDER[..], &nowhere].concat()).code(1).says("wall.png/tiles").says("--texture-cache");
    assert!(!folder.listing().contains_key("out.exr"));
    for wrong in ["lots", "1 parsec"] {
        folder.run(&[&RENDER[..], &["--texture-memory", wrong]].concat()).code(2).says("--texture-memory");
    }
}
