//! Patterns that are computed: what they weigh two textures by, and noises.
//!
//! Sources: pbrt-v4, section 10.5 (mixes) and its program's checkerboards; pbrt's third edition, section 10.5.2 (polka dots) and 10.6 (fbm, wrinkled, windy,
//! marble).

use glam::{Affine3A, Vec2, Vec3};

use super::TexturePoint;
use super::texture::{FloatInput, Textures};
use super::texture_mapping::Mapping2d;
use crate::math::Rgb;
use crate::math::noise::{fbm, noise, turbulence};

/// How much the second of two textures counts.
#[derive(Clone, Copy, Debug)]
pub enum Weight {
    /// What another texture says.
    Input(FloatInput),
    /// 1 less the cosine between the surface's normal, of either sign, and a unit vector.
    Direction(Vec3),
    /// 0 and 1 in turn, in squares of side 1.
    Squares(Mapping2d),
    /// 0 and 1 in turn, in cubes of side 1 of the texture's space.
    Cubes(Affine3A),
    /// 1 within dots, at most one a square.
    Dots(Mapping2d),
}

impl Weight {
    /// That at `point`.
    pub fn at(&self, textures: &Textures, point: &TexturePoint) -> f32 {
        // In whole numbers, where 1e30 is as even as 0.
        let is_odd = |c: f32| c.floor().rem_euclid(2.0) == 1.0;
        match self {
            Self::Input(input) => input.evaluate(textures, point),
            Self::Direction(direction) => 1.0 - point.n.dot(*direction).abs(),
            Self::Squares(mapping) => {
                let st = mapping.at(point);
                f32::from(is_odd(st.x) != is_odd(st.y))
            }
            Self::Cubes(to_texture) => {
                let p = to_texture.transform_point3(point.p);
                f32::from(is_odd(p.x) ^ is_odd(p.y) ^ is_odd(p.z))
            }
            Self::Dots(mapping) => f32::from(is_in_dot(mapping.at(point))),
        }
    }
}

/// Whether a dot covers the place: half of all squares have one, moved about within them.
fn is_in_dot(st: Vec2) -> bool {
    const RADIUS: f32 = 0.35;
    const MOST_SHIFT: f32 = 0.5 - RADIUS;
    let cell = (st + 0.5).floor();
    let noise = |x: f32, y: f32| noise(Vec3::new(cell.x + x, cell.y + y, 0.5));
    if noise(0.5, 0.5) <= 0.0 {
        return false;
    }
    let centre = cell + MOST_SHIFT * Vec2::new(noise(1.5, 2.8), noise(4.5, 9.8));
    st.distance_squared(centre) < RADIUS * RADIUS
}

/// A float that varies in space.
#[derive(Clone, Copy, Debug)]
pub struct NoiseTexture {
    /// Render space to the texture's.
    pub to_texture: Affine3A,
    /// How it varies.
    pub kind: NoiseKind,
}

/// Sums of noise.
#[derive(Clone, Copy, Debug)]
pub enum NoiseKind {
    /// Fractional Brownian motion.
    Fbm {
        /// How strong each octave is, relative to the one before.
        omega: f32,
        /// How many there are.
        octaves: u32,
    },
    /// Its absolute value octave by octave.
    Wrinkled {
        /// As above.
        omega: f32,
        /// As above.
        octaves: u32,
    },
    /// Waves that are higher here and lower there.
    Windy,
}

impl NoiseKind {
    /// Look-ups of noise in one of this.
    pub fn lookups(self) -> u32 {
        match self {
            Self::Fbm { octaves, .. } | Self::Wrinkled { octaves, .. } => octaves,
            Self::Windy => 9,
        }
    }
}

impl NoiseTexture {
    /// The value at `point`.
    pub fn at(&self, point: &TexturePoint) -> f32 {
        let p = self.to_texture.transform_point3(point.p);
        match self.kind {
            NoiseKind::Fbm { omega, octaves } => fbm(p, omega, octaves),
            NoiseKind::Wrinkled { omega, octaves } => turbulence(p, omega, octaves),
            NoiseKind::Windy => fbm(0.1 * p, 0.5, 3).abs() * fbm(p, 0.5, 6),
        }
    }
}

/// Veins of marble.
#[derive(Clone, Copy, Debug)]
pub struct Marble {
    /// Render space to the texture's.
    pub to_texture: Affine3A,
    /// Factor on the texture's coordinates.
    pub scale: f32,
    /// How far noise bends the veins.
    pub variation: f32,
    /// As in [`NoiseKind::Fbm`].
    pub omega: f32,
    /// As in [`NoiseKind::Fbm`].
    pub octaves: u32,
}

/// Control points of the spline that goes across a vein.
const VEIN: [[f32; 3]; 9] = [
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.5, 0.5, 0.5],
    [0.6, 0.59, 0.58],
    [0.58, 0.58, 0.6],
    [0.58, 0.58, 0.6],
    [0.2, 0.2, 0.33],
    [0.58, 0.58, 0.6],
];

impl Marble {
    /// The colour at `point`.
    pub fn at(&self, point: &TexturePoint) -> Rgb {
        const SEGMENTS: usize = VEIN.len() - 3;
        let p = self.scale * self.to_texture.transform_point3(point.p);
        let bent = p.y + self.variation * fbm(p, self.omega, self.octaves);
        let t = (0.5 + 0.5 * bent.sin()) * SEGMENTS as f32;
        let first = (t as usize).min(SEGMENTS - 1);
        let t = t - first as f32;
        // De Casteljau on four neighbours.
        let mut points = [0, 1, 2, 3].map(|k| Rgb::from(VEIN[first + k]));
        for left in (1..4).rev() {
            for k in 0..left {
                points[k] = points[k].lerp(points[k + 1], t);
            }
        }
        points[0] * 1.5
    }
}
