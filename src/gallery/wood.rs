//! The texture of the planks: eight boards above each other, each with its own tint, grain along u and a few knots.

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{FloatExt, Vec2, Vec3};

use super::GalleryError;
use super::text::Dice;
use crate::film::image::{Image, write_png};

const WIDTH: usize = 1024;
const BOARDS: usize = 8;
/// Pixels of a board's height.
const BOARD: usize = 64;

/// Writes the texture.
pub fn write_texture(path: &Path) -> Result<(), GalleryError> {
    Ok(write_png(path, &texture(), 0.0)?)
}

fn texture() -> Image {
    let mut noise = FastNoiseLite::with_seed(5);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(4));
    noise.set_frequency(Some(1.0));
    let mut dice = Dice::new(5);
    let mut pixels = Vec::with_capacity(WIDTH * BOARDS * BOARD * 3);
    for board in 0..BOARDS {
        let tint = Vec3::new(0.2, 0.15, 0.11) * dice.between(0.55, 1.25);
        let knots = [(); 2].map(|()| Vec2::new(dice.between(0.3, 14.0), dice.between(0.1, 0.9)));
        let far = 37.0 * board as f32;
        for row in 0..BOARD {
            for column in 0..WIDTH {
                // A board is 16 times as long as it is high.
                let p = Vec2::new(16.0 * column as f32 / WIDTH as f32, (row as f32 + 0.5) / BOARD as f32);
                let knot =
                    knots.iter().map(|k| (-((p - *k) * Vec2::new(4.0, 7.0)).length_squared()).exp()).sum::<f32>();
                let bent = p.y + 0.05 * noise.get_noise_2d(0.4 * p.x, far) + 0.12 * knot;
                let rings = 0.5 + 0.5 * noise.get_noise_3d(0.25 * p.x, 9.0 * bent, far);
                let fibres = noise.get_noise_3d(1.5 * p.x, 60.0 * bent, far + 5.0);
                let worn = 0.5 + 0.5 * noise.get_noise_3d(0.8 * p.x, 1.5 * p.y, far + 11.0);
                // Gaps and worn edges are darker.
                let edge = (p.y.min(1.0 - p.y) / 0.06).min(1.0);
                let shade = 0.55f32.lerp(1.25, rings) * (1.0 + 0.25 * fibres) * (1.0 - 0.55 * knot.min(1.0));
                let colour = tint * shade * 0.7f32.lerp(1.2, worn) * 0.5f32.lerp(1.0, edge);
                pixels.extend(colour.to_array());
            }
        }
    }
    Image { width: WIDTH, height: BOARDS * BOARD, channels: 3, pixels }
}
