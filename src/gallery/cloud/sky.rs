//! The sky without its sun: blue above, paler towards the horizon, in the equal-area octahedral mapping.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::super::GalleryError;
use super::super::volume::smoothstep;
use crate::film::image::{Image, write_png};
use crate::light::sphere_image::equal_area_square_to_sphere;

const PIXELS: usize = 256;

/// Writes the image; its pole is z.
pub fn write(path: &Path) -> Result<(), GalleryError> {
    let mut pixels = Vec::with_capacity(3 * PIXELS * PIXELS);
    for y in 0..PIXELS {
        for x in 0..PIXELS {
            let p = (Vec2::new(x as f32, y as f32) + 0.5) / PIXELS as f32;
            pixels.extend(radiance(equal_area_square_to_sphere(p).z).to_array());
        }
    }
    Ok(write_png(path, &Image { width: PIXELS, height: PIXELS, channels: 3, pixels }, 0.0)?)
}

/// In a direction of which `up` is the height.
fn radiance(up: f32) -> Vec3 {
    let (zenith, middle, horizon) =
        (Vec3::new(0.05, 0.13, 0.36), Vec3::new(0.13, 0.27, 0.52), Vec3::new(0.5, 0.58, 0.66));
    let above = middle.lerp(zenith, smoothstep(0.15, 0.9, up));
    horizon.lerp(above, smoothstep(-0.06, 0.34, up).sqrt())
}
