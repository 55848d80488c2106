//! Images on surfaces: levels of detail bring what the finest brings, with less noise; and memory that is short changes no bit.
//!
//! False-alarm rate: 1e-6 for each mean. Levels are means of texels, so what they bring differs from what the finest brings where a ray covers the edge of what it
//! sees: half a per cent is allowed for that.

use std::path::Path;

use lanternfish::material::mip_map::cache::TileCacheStatistics;
use lanternfish::material::mip_map::memory::TextureSettings;
use lanternfish::render::{Job, TextureLevels};
use lanternfish::scene::Warnings;

use crate::common::{Options, assert_mean, image_mean, prepare_file, render_job};

/// An image of single black and white texels, as likely the one as the other, in a folder.
fn write_noise(folder: &Path, name: &str, size: u32) {
    let texel =
        |x: u32, y: u32| (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 31;
    let image = image::GrayImage::from_fn(size, size, |x, y| image::Luma([255 * texel(x, y) as u8]));
    image.save(folder.join(name)).expect("the image can be written");
}

/// A camera over a floor that shows the image `name`, a few texels to a pixel close by and many farther off.
fn floor(name: &str, filter: &str, more: &str) -> String {
    format!(
        "LookAt 0 1 0  0 0.6 1  0 1 0 Camera \"perspective\" \"float fov\" 40
         Film \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 40 Sampler \"independent\" Integrator \"volpath\" \"integer maxdepth\" 3
         WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1]
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\" \"string encoding\" \"linear\" \"string filter\" \"{filter}\"
         \"float uscale\" 16 \"float vscale\" 16
         AttributeBegin Material \"diffuse\" \"texture reflectance\" \"t\"
         Shape \"bilinearmesh\" \"point3 P\" [-40 0 -40  40 0 -40  -40 0 40  40 0 40] AttributeEnd {more}"
    )
}

fn prepare(folder: &Path, text: &str, options: &Options) -> Job {
    let path = folder.join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    prepare_file(&path, options, &mut Warnings::default()).expect("the scene can be prepared")
}

#[test]
fn levels_of_detail_bring_what_the_finest_brings_with_less_noise() {
    let folder = tempfile::tempdir().expect("a folder");
    write_noise(folder.path(), "noise.png", 256);
    // Straight; in a ball that reflects; through a ball of glass; and by light from a wall, which the floor is seen by.
    let ball = |material: &str| {
        format!(
            "AttributeBegin Translate 0 0.5 1.4 Material {material} Shape \"sphere\" \"float radius\" 0.4 AttributeEnd"
        )
    };
    let views = [
        String::new(),
        ball("\"conductor\" \"float roughness\" 0"),
        ball("\"dielectric\""),
        ball("\"diffuse\" \"rgb reflectance\" [0.9 0.9 0.9]"),
    ];
    for filter in ["bilinear", "trilinear", "EWA"] {
        for view in &views {
            let render = |texture_levels, spp| {
                let options = Options { spp, texture_levels, ..Options::default() };
                let text = floor("noise.png", filter, view);
                image_mean(&render_job(&mut prepare(folder.path(), &text, &options), &options).film)
            };
            let (expected, error) = render(TextureLevels::Finest, 64);
            let (mean, own) = render(TextureLevels::Auto, 64);
            println!("{filter} {view:.60}: {:.5} ± {:.5}, {:.5} ± {:.5}", mean[0], own[0], expected[0], error[0]);
            assert_mean(filter, mean[0], own[0].hypot(error[0]), expected[0], 0.005);
            // What the texture adds to the noise is mostly gone; that of the light stays.
            assert!(own[0] < if view.is_empty() { 0.9 } else { 1.0 } * error[0], "{filter} {view}");
        }
    }
}

#[test]
fn memory_that_is_short_changes_no_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut more = String::new();
    for (i, filter) in ["point", "bilinear", "trilinear", "EWA"].into_iter().enumerate() {
        let name = format!("{i}.png");
        write_noise(folder.path(), &name, 300 + 50 * i as u32);
        more += &format!(
            "Texture \"{i}\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\" \"string filter\" \"{filter}\"
             AttributeBegin Translate {} 0.4 2 Material \"diffuse\" \"texture reflectance\" \"{i}\" Shape \"sphere\" \"float radius\" 0.3 AttributeEnd\n",
            i as f32 - 1.5
        );
    }
    write_noise(folder.path(), "floor.png", 256);
    let text = floor("floor.png", "trilinear", &more);
    let render = |limit, threads| {
        let textures = TextureSettings { limit, folder: None };
        let options = Options { spp: 8, threads, textures, ..Options::default() };
        let mut job = prepare(folder.path(), &text, &options);
        let film = render_job(&mut job, &options).film;
        (film.beauty(), job.world.materials.image_bytes(), job.world.materials.texture_cache())
    };
    let (expected, bytes, none) = render(1 << 30, 2);
    assert_eq!(none, None);
    for (limit, threads) in [(bytes, 2), (bytes - 1, 2), (bytes / 10, 2), (bytes / 10, 1), (1, 2)] {
        let (image, _, statistics) = render(limit, threads);
        assert!(image == expected, "{limit} of {bytes} bytes");
        match statistics {
            None => assert_eq!(limit, bytes),
            Some(TileCacheStatistics { held, lookups, reads, hit_rate, .. }) => {
                println!("{limit} of {bytes} bytes: {held} held, {lookups} look-ups, {reads} reads, {hit_rate}");
                assert!(held <= limit.max(1) && reads > 0);
            }
        }
    }
}
