//! Leaves: a texture of a twig with its mask, and bunches of cards that show it.

use std::f32::consts::TAU;
use std::path::Path;

use fastnoise_lite::FastNoiseLite;
use glam::{Quat, Vec2, Vec3};

use super::super::GalleryError;
use super::super::mesh::Mesh;
use super::super::text::{Dice, SceneText};
use crate::film::image::{Image, write_png};

/// Pixels of the textures' sides.
const SIZE: usize = 256;
/// Cards of a bunch.
const CARDS: u32 = 64;

/// Leaves of the twig: where they start on the stem, which grows up the middle, and where they point.
fn leaves() -> impl Iterator<Item = (Vec2, Vec2)> {
    let pairs = (0..4).flat_map(|pair| {
        let foot = Vec2::new(0.5, 0.1 + 0.19 * pair as f32);
        [-1.0, 1.0].map(|side| (foot + Vec2::new(0.0, 0.045 * side), Vec2::new(side * 0.85, 0.62).normalize() * 0.34))
    });
    pairs.chain([(Vec2::new(0.5, 0.66), Vec2::new(0.0, 0.33))])
}

/// Where a point lies on the leaf over it: along it (0..1) and across (0 in its middle, 1 at its edge).
fn on_leaf(p: Vec2) -> Option<(f32, f32)> {
    let on = |(foot, to): (Vec2, Vec2)| {
        let along = (p - foot).dot(to) / to.length_squared();
        if !(0.0..=1.0).contains(&along) {
            return None;
        }
        let half = 0.5 * along.sqrt() * (1.0 - along).powf(0.75) * to.length();
        let across = (p - foot - along * to).length() / half.max(1e-6);
        (across < 1.0).then_some((along, across))
    };
    leaves().filter_map(on).last()
}

/// Writes the colours and the mask.
pub fn write_textures(colours: &Path, mask: &Path) -> Result<(), GalleryError> {
    let mut noise = FastNoiseLite::with_seed(12);
    noise.set_frequency(Some(9.0));
    let mut colour = Vec::with_capacity(3 * SIZE * SIZE);
    let mut cut = Vec::with_capacity(SIZE * SIZE);
    for row in 0..SIZE {
        for column in 0..SIZE {
            // The first row is the top, where v is 1.
            let p = (Vec2::new(column as f32, (SIZE - 1 - row) as f32) + 0.5) / SIZE as f32;
            let is_stem = (p.x - 0.5).abs() < 0.007 && p.y < 0.7;
            let leaf = on_leaf(p);
            let shade = 1.0 + 0.3 * noise.get_noise_2d(p.x, p.y);
            let green = match leaf {
                Some((along, across)) => {
                    let vein = across < 0.07 || ((9.0 * along - 1.6 * across).fract() < 0.12 && across < 0.85);
                    Vec3::new(0.13, 0.25, 0.055) * shade * if vein { 1.6 } else { 1.0 - 0.25 * across }
                }
                None => Vec3::new(0.12, 0.13, 0.05),
            };
            colour.extend(green.to_array());
            cut.push(f32::from(u8::from(leaf.is_some() || is_stem)));
        }
    }
    write_png(colours, &Image { width: SIZE, height: SIZE, channels: 3, pixels: colour }, 0.0)?;
    Ok(write_png(mask, &Image { width: SIZE, height: SIZE, channels: 1, pixels: cut }, 0.0)?)
}

/// A square that shows the twig.
pub struct Card {
    middle: Vec3,
    up: Vec3,
    across: Vec3,
    /// Half its side.
    half: f32,
}

impl Card {
    fn throw(dice: &mut Dice) -> Self {
        let middle = loop {
            let p = dice.within(Vec3::splat(-1.0), Vec3::splat(1.0));
            if p.length_squared() < 1.0 {
                break 0.52 * p * Vec3::new(1.0, 0.75, 1.0);
            }
        };
        let up = (middle + 0.3 * dice.within(Vec3::splat(-1.0), Vec3::splat(1.0))).normalize_or(Vec3::Y);
        let across = Quat::from_axis_angle(up, dice.between(0.0, TAU)) * up.any_orthonormal_vector();
        Self { middle, up, across, half: dice.between(0.12, 0.19) }
    }

    /// How far a point is from it.
    pub fn distance(&self, p: Vec3) -> f32 {
        let q = p - self.middle;
        let on = [self.up, self.across].map(|side| q.dot(side).clamp(-self.half, self.half) * side);
        q.distance(on[0] + on[1])
    }
}

/// Leaves at the end of a branch: cards within [`REACH`] of the origin, their twigs pointing outwards.
pub type Bunch = Vec<Card>;

/// How far cards reach from the middle of a bunch.
pub const REACH: f32 = 0.8;

/// The three kinds of bunches.
pub fn bunches(dice: &mut Dice) -> [Bunch; 3] {
    [(); 3].map(|()| (0..CARDS).map(|_| Card::throw(dice)).collect())
}

/// Bunches as the objects `leaves0` to `leaves2`.
pub fn define(t: &mut SceneText, bunches: &[Bunch]) {
    for (kind, bunch) in bunches.iter().enumerate() {
        let mut mesh = Mesh::default();
        for &Card { middle, up, across, half } in bunch {
            let first = mesh.positions.len() as u32;
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            mesh.positions.extend(corners.map(|(s, v)| middle + half * (s * across + v * up)));
            mesh.uv.extend(corners.map(|(s, v)| [0.5 + 0.5 * s, 0.5 + 0.5 * v]));
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        t.object(&format!("leaves{kind}"), |t| {
            t.add(format_args!("NamedMaterial \"leaf\""));
            t.mesh_with(&mesh, "\"texture alpha\" \"mask\"");
        });
    }
}
