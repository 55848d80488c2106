//! A corridor whose walls are pictures from end to end: as many files as are asked for, each under a name of its own, of a few different images.

use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};

/// Different images; all others are further names of their files.
const IMAGES: u32 = 4;

/// How pictures are filtered, by turns.
const FILTERS: [&str; 3] = ["bilinear", "trilinear", "EWA"];

/// What the corridor is made of.
pub struct Gallery {
    pub pictures: u32,
    /// Along each side of a picture.
    pub texels: u32,
    pub seed: u32,
}

impl Gallery {
    /// Bytes of all pictures at all levels of detail, tiles that are not full included: the renderer's own count.
    pub fn bytes(&self) -> u64 {
        let levels = lanternfish::material::mip_map::level::Level::all(self.texels as usize, self.texels as usize);
        levels.iter().map(|level| 3 * level.texels() as u64).sum::<u64>() * u64::from(self.pictures)
    }

    /// Writes scene and pictures to `folder`; the path of the scene file.
    pub fn write(&self, folder: &Path) -> io::Result<PathBuf> {
        for number in 0..self.pictures {
            let path = folder.join(format!("{number}.png"));
            if number < IMAGES {
                self.image(number).save(path).map_err(io::Error::other)?;
                continue;
            }
            let first = folder.join(format!("{}.png", number % IMAGES));
            std::fs::hard_link(&first, &path).or_else(|_| std::fs::copy(&first, &path).map(|_| ()))?;
        }
        let path = folder.join("gallery.pbrt");
        std::fs::write(&path, self.scene())?;
        Ok(path)
    }

    /// Waves with grain, which PNG packs about as well as photographs.
    fn image(&self, number: u32) -> RgbImage {
        let key = self.seed.wrapping_mul(IMAGES).wrapping_add(number).wrapping_mul(0x9e37_79b9);
        let scale = 40.0 / self.texels as f32;
        RgbImage::from_fn(self.texels, self.texels, |x, y| {
            let place = x.wrapping_mul(0x85eb_ca6b) ^ y.wrapping_mul(0xc2b2_ae35) ^ key;
            let grain = (place ^ place >> 15).wrapping_mul(0x2c1b_3c6d) >> 28;
            let (u, v) = (scale * x as f32, scale * y as f32);
            let wave = |turn: f32| 120.0 + 90.0 * (u + turn + (v * (1.0 + number as f32)).sin()).sin();
            Rgb([0.0, 0.7, 1.9].map(|turn| wave(turn) as u8 + grain as u8))
        })
    }

    /// Two rows of pictures on either wall, a metre each; lamps in the ceiling.
    fn scene(&self) -> String {
        let length = self.pictures.div_ceil(4);
        let mut text = format!(
            "LookAt 0 1 0.2  0.35 0.95 1.2  0 1 0
Camera \"perspective\" \"float fov\" 75
Film \"rgb\" \"integer xresolution\" 640 \"integer yresolution\" 360
Sampler \"zsobol\" \"integer pixelsamples\" 16
Integrator \"volpath\" \"integer maxdepth\" 4
WorldBegin
Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
Shape \"bilinearmesh\" \"point3 P\" [-1.5 0 0  1.5 0 0  -1.5 0 {length}  1.5 0 {length}]
Shape \"bilinearmesh\" \"point3 P\" [-1.5 2 0  1.5 2 0  -1.5 2 {length}  1.5 2 {length}]
Shape \"bilinearmesh\" \"point3 P\" [-1.5 0 {length}  1.5 0 {length}  -1.5 2 {length}  1.5 2 {length}]
"
        );
        for lamp in (0..length).step_by(3) {
            let (near, far) = (f64::from(lamp) + 0.6, f64::from(lamp) + 1.4);
            _ = writeln!(
                text,
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 6 5] \"bool twosided\" true
Shape \"bilinearmesh\" \"point3 P\" [-0.4 1.98 {near}  0.4 1.98 {near}  -0.4 1.98 {far}  0.4 1.98 {far}] AttributeEnd"
            );
        }
        for number in 0..self.pictures {
            let (z, place) = (number / 4, number % 4);
            let x = if place < 2 { "-1.5" } else { "1.5" };
            let (y, top, end) = (place % 2, place % 2 + 1, z + 1);
            let filter = FILTERS[number as usize % FILTERS.len()];
            _ = writeln!(
                text,
                "Texture \"{number}\" \"spectrum\" \"imagemap\" \"string filename\" \"{number}.png\" \"string filter\" \"{filter}\"
Material \"diffuse\" \"texture reflectance\" \"{number}\"
Shape \"bilinearmesh\" \"point3 P\" [{x} {y} {z}  {x} {y} {end}  {x} {top} {z}  {x} {top} {end}]"
            );
        }
        text
    }
}
