//! The lie of the land: a terrace, a hollow below it, and a hillside that climbs up to a crest; and the path that leads there.

use std::f32::consts::TAU;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{FloatExt, Vec2, Vec3};

use super::super::mesh::Mesh;
use super::super::text::{Dice, Number, Point, SceneText};

/// The ground's corners, across and along the path.
pub const LOW: Vec2 = Vec2::new(-95.0, -14.0);
pub const HIGH: Vec2 = Vec2::new(95.0, 130.0);
/// Half the width of the path.
pub const PATH: f32 = 0.85;

/// The ground.
pub struct Ground(FastNoiseLite);

impl Ground {
    pub fn new() -> Self {
        let mut noise = FastNoiseLite::with_seed(77);
        noise.set_noise_type(Some(NoiseType::OpenSimplex2));
        noise.set_fractal_type(Some(FractalType::FBm));
        noise.set_fractal_octaves(Some(4));
        noise.set_frequency(Some(0.045));
        Self(noise)
    }

    /// Its height: without bumps on the path.
    pub fn height(&self, x: f32, z: f32) -> f32 {
        let off = (x - path_at(z)).abs();
        let bumps = 1.5 * self.0.get_noise_2d(x, z) * smooth(off, PATH, 9.0);
        // The sides of the valley.
        let sides = 0.0011 * (off * off).min(6000.0);
        along(z) + sides + bumps
    }

    /// A point on it.
    pub fn at(&self, x: f32, z: f32) -> Vec3 {
        Vec3::new(x, self.height(x, z), z)
    }

    pub fn mesh(&self) -> Mesh {
        const N: u32 = 170;
        let mut mesh = Mesh::default();
        for row in 0..=N {
            let z = LOW.y.lerp(HIGH.y, row as f32 / N as f32);
            mesh.positions.extend((0..=N).map(|i| self.at(LOW.x.lerp(HIGH.x, i as f32 / N as f32), z)));
        }
        mesh.normals = mesh.positions.iter().map(|p| self.normal(p.x, p.z)).collect();
        mesh.join_rings(N + 1, N + 1, false);
        mesh
    }

    fn normal(&self, x: f32, z: f32) -> Vec3 {
        const STEP: f32 = 0.5;
        let slope = |dx: f32, dz: f32| self.height(x + dx, z + dz) - self.height(x - dx, z - dz);
        Vec3::new(-slope(STEP, 0.0), 2.0 * STEP, -slope(0.0, STEP)).normalize()
    }

    /// A ribbon of gravel, and kerb stones.
    pub fn path(&self, t: &mut SceneText, dice: &mut Dice) {
        const STEPS: u32 = 220;
        let mut gravel = Mesh::default();
        for step in 0..=STEPS {
            let z = LOW.y.lerp(HIGH.y, step as f32 / STEPS as f32);
            let out = across(z);
            gravel.positions.extend([-PATH, 0.0, PATH].map(|off| {
                let p = Vec3::new(path_at(z), 0.0, z) + off * out;
                self.at(p.x, p.z) + 0.05 * Vec3::Y
            }));
        }
        gravel.join_rings(STEPS + 1, 3, false);
        t.of("gravel", |t| t.mesh(&gravel));
        t.of("stone", |t| {
            let profile = [(1.0, 0.0), (0.95, 0.7), (0.7, 1.0), (0.01, 1.05)].map(|(r, y)| Vec2::new(r, y));
            let stone = Mesh::revolved(&profile, 7);
            let mut mesh = Mesh::default();
            for side in [-1.0, 1.0] {
                let mut z = -8.0;
                while z < 45.0 {
                    let p = Vec3::new(path_at(z), 0.0, z) + side * (PATH + 0.05) * across(z);
                    let (turn, size) = (dice.between(0.0, TAU), dice.between(0.07, 0.13));
                    let foot = self.at(p.x, p.z) - 0.02 * Vec3::Y;
                    let first = mesh.positions.len() as u32;
                    mesh.positions.extend(stone.positions.iter().map(|q| {
                        let (x, z) =
                            (1.3 * q.x * turn.cos() - q.z * turn.sin(), 1.3 * q.x * turn.sin() + q.z * turn.cos());
                        foot + size * Vec3::new(x, q.y, z)
                    }));
                    mesh.indices.extend(stone.indices.iter().map(|i| first + i));
                    z += dice.between(0.24, 0.36);
                }
            }
            t.mesh(&mesh);
        });
    }

    /// Bunches of leaves that lie about, clear of the feet of what has bulbs.
    pub fn bushes(&self, t: &mut SceneText, dice: &mut Dice, (count, far): (u32, f32), feet: &[Vec2]) {
        t.add(format_args!("\n# Bushes"));
        for i in 0..count {
            let z = far.min(-5.0 + (far + 5.0) * dice.between(0.0, 1.0).powf(1.5));
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let x = path_at(z) + side * dice.between(3.2, 7.0 + 0.35 * (z + 5.0));
            if feet.iter().any(|foot| foot.distance(Vec2::new(x, z)) < 2.4) {
                continue;
            }
            let size = dice.between(0.5, 1.2);
            leaves(t, dice, self.at(x, z) + 0.12 * Vec3::Y, size);
        }
    }

    /// Low plants in the grass nearby.
    pub fn tufts(&self, t: &mut SceneText, dice: &mut Dice, count: u32) {
        t.add(format_args!("\n# Tufts"));
        for i in 0..count {
            let z = -6.5 + 24.0 * dice.between(0.0, 1.0).powf(1.4);
            let side = if i % 2 == 0 { -1.0 } else { 1.0 };
            let x = path_at(z) + side * dice.between(1.25, 6.0 + 0.2 * (z + 6.5));
            let size = dice.between(0.1, 0.22);
            leaves(t, dice, self.at(x, z), size);
        }
    }
}

/// A bunch of leaves.
fn leaves(t: &mut SceneText, dice: &mut Dice, p: Vec3, size: f32) {
    let (p, size, turn, kind) = (Point(p), Number(size), Number(dice.between(0.0, 360.0)), dice.below(3));
    t.block(|t| {
        t.add(format_args!(
            "Translate {p} Rotate {turn} 0 1 0 Scale {size} {size} {size} ObjectInstance \"leaves{kind}\""
        ));
    });
}

/// 0 up to `low`, 1 from `high` on, smooth in between.
fn smooth(x: f32, low: f32, high: f32) -> f32 {
    let s = ((x - low) / (high - low)).clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// The height of the path.
fn along(z: f32) -> f32 {
    const STEEPEST: f32 = 0.42;
    const BEND: f32 = 0.0045;
    let up = (z - 20.0).max(0.0);
    let bent = up.min(STEEPEST / (2.0 * BEND));
    let climb = BEND * bent * bent + STEEPEST * (up - bent);
    5.5 * (1.0 - smooth(z, -6.0, 24.0)) + climb - 20.0 * smooth(z, 88.0, 135.0)
}

/// Where the path is.
pub fn path_at(z: f32) -> f32 {
    0.9 * (0.16 * z).sin() + 9.0 * (0.055 * (z - 12.0)).sin() * smooth(z, 8.0, 70.0) - 0.4
}

/// The direction across the path, level.
pub fn across(z: f32) -> Vec3 {
    let slope = path_at(z + 0.5) - path_at(z - 0.5);
    Vec3::new(1.0, 0.0, -slope).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_faces_up() {
        let mesh = Ground::new().mesh();
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
