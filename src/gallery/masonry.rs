//! What is built of stone: the texture of its blocks, meshes laid out for it, arches and walls with windows.

use std::f32::consts::FRAC_PI_2;
use std::path::Path;

use glam::{FloatExt, Vec2, Vec3};

use super::GalleryError;
use super::mesh::Mesh;
use super::text::{Dice, SceneText};
use super::volume::{noise, smoothstep};
use crate::film::image::{Image, write_png};

/// Metres that the texture shows along each side.
const SHOWN: f32 = 3.0;
const PIXELS: usize = 768;
const COURSES: usize = 8;
/// Blocks in a course.
const BLOCKS: usize = 4;

/// Writes the texture: blocks in courses, each with a tint of its own. It repeats without a seam.
pub fn write_texture(path: &Path) -> Result<(), GalleryError> {
    Ok(write_png(path, &texture(), 0.0)?)
}

fn texture() -> Image {
    let (fine, coarse) = (noise(61, 9.0, 4), noise(62, 1.7, 3));
    let mut dice = Dice::new(61);
    let tints: Vec<Vec3> = (0..COURSES * BLOCKS)
        .map(|_| {
            Vec3::new(0.47, 0.43, 0.37).lerp(Vec3::new(0.4, 0.4, 0.39), dice.between(0.0, 1.0))
                * dice.between(0.72, 1.1)
        })
        .collect();
    let shifts: Vec<f32> = (0..COURSES).map(|i| 0.5 * (i % 2) as f32 + dice.between(-0.15, 0.15)).collect();
    let mut pixels = Vec::with_capacity(3 * PIXELS * PIXELS);
    for row in 0..PIXELS {
        let v = (row as f32 + 0.5) / PIXELS as f32 * COURSES as f32;
        for column in 0..PIXELS {
            let course = v as usize;
            let u = (column as f32 + 0.5) / PIXELS as f32 * BLOCKS as f32 + shifts[course] + BLOCKS as f32;
            let block = course * BLOCKS + u as usize % BLOCKS;
            // Within the block, in metres; each block is cut from stone of its own.
            let p = Vec2::new(u.fract() * SHOWN / BLOCKS as f32, v.fract() * SHOWN / COURSES as f32);
            let far = 10.0 * block as f32;
            let to_edge = |x: f32, length: f32| x.min(length - x);
            let edge = to_edge(p.x, SHOWN / BLOCKS as f32).min(to_edge(p.y, SHOWN / COURSES as f32));
            let grain = fine.get_noise_3d(p.x, p.y, far);
            let stain = coarse.get_noise_3d(p.x, p.y, far + 5.0);
            let stone = tints[block] * (1.0 + 0.28 * grain + 0.22 * stain);
            let joint = smoothstep(0.006, 0.022, edge + 0.006 * grain);
            pixels.extend((stone * 0.42f32.lerp(1.0, joint)).to_array());
        }
    }
    Image { width: PIXELS, height: PIXELS, channels: 3, pixels }
}

/// The material `stone`, which shows the texture `stone.png`, darkened to `shade`.
pub fn material(t: &mut SceneText, shade: f32) {
    t.add(format_args!("Texture \"blocks\" \"spectrum\" \"imagemap\" \"string filename\" \"stone.png\""));
    t.add(format_args!("Texture \"stone\" \"spectrum\" \"scale\" \"texture tex\" \"blocks\" \"float scale\" {shade}"));
    t.add(format_args!("MakeNamedMaterial \"stone\" \"string type\" \"diffuse\" \"texture reflectance\" \"stone\""));
}

/// The mesh with texture coordinates: each triangle shows the blocks as they are seen along the axis that it faces most.
pub fn laid(mesh: &Mesh) -> Mesh {
    let mut laid = Mesh::default();
    for triangle in mesh.indices.chunks_exact(3) {
        let p = [0, 1, 2].map(|i| mesh.positions[triangle[i] as usize]);
        let n = (p[1] - p[0]).cross(p[2] - p[0]).abs();
        for p in p {
            laid.indices.push(laid.positions.len() as u32);
            laid.positions.push(p);
            let [u, v] = if n.y >= n.x.max(n.z) {
                [p.x, p.z]
            } else if n.x >= n.z {
                [p.z, p.y]
            } else {
                [p.x, p.y]
            };
            laid.uv.push([u / SHOWN, v / SHOWN]);
        }
    }
    laid
}

/// A pointed arch over a span of `2 half` from a foot at height 0, left to right. Its sides are parts of circles whose centres
/// lie `offset` beyond the middle: 0 for a round arch.
pub fn arch(half: f32, offset: f32, steps: u32) -> Vec<Vec2> {
    let radius = half + offset;
    let top = (offset / radius).acos();
    let side = |i: u32| {
        let angle = top * i as f32 / steps as f32;
        Vec2::new(radius * angle.cos() - offset, radius * angle.sin())
    };
    let left = (0..steps).map(|i| side(i) * Vec2::new(-1.0, 1.0));
    left.chain((0..=steps).rev().map(side)).collect()
}

/// A band of stone under an arch, `thick` towards its inside, from `near` to `far` along z.
pub fn band(arch: &[Vec2], thick: f32, near: f32, far: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for (i, p) in arch.iter().enumerate() {
        let (before, after) = (arch[i.saturating_sub(1)], arch[(i + 1).min(arch.len() - 1)]);
        let along = (after - before).normalize_or_zero();
        let inner = *p + thick * Vec2::new(along.y, -along.x);
        mesh.positions.extend([p.extend(near), inner.extend(near), inner.extend(far), p.extend(far)]);
    }
    mesh.join_rings(arch.len() as u32, 4, false);
    mesh
}

/// The surface that an arch sweeps from `near` to `far` along z.
pub fn vault(arch: &[Vec2], near: f32, far: f32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.positions.extend(arch.iter().flat_map(|p| [p.extend(near), p.extend(far)]));
    mesh.join_rings(arch.len() as u32, 2, false);
    mesh
}

/// A window's opening: half its width, and the heights of its sill and of the foot of its pointed arch.
pub struct Opening {
    /// Half the width.
    pub half: f32,
    /// Where it begins.
    pub sill: f32,
    /// Where its arch begins.
    pub spring: f32,
}

impl Opening {
    /// How high it is at `x` from its middle.
    fn top(&self, x: f32) -> f32 {
        // As high as wide: an equilateral arch.
        let reach = 2.0 * self.half;
        self.spring + (reach * reach - (x.abs() + self.half).powi(2)).max(0.0).sqrt()
    }

    /// A wall along x, from −`half_wall` to `half_wall` and from 0 to `height`, `thick` along z, with the opening in its middle.
    pub fn wall(&self, half_wall: f32, height: f32, thick: f32) -> Mesh {
        const STEPS: u32 = 24;
        let mut mesh = Mesh::default();
        let mut add = |low: Vec3, high: Vec3| join(&mut mesh, Mesh::cuboid(low, high, None));
        let h = self.half;
        add(Vec3::new(-half_wall, 0.0, 0.0), Vec3::new(-h, height, thick));
        add(Vec3::new(h, 0.0, 0.0), Vec3::new(half_wall, height, thick));
        add(Vec3::new(-h, 0.0, 0.0), Vec3::new(h, self.sill, thick));
        let mut over = Mesh::default();
        for i in 0..=STEPS {
            // Closer where the arch is steep.
            let x = -h * (2.0 * FRAC_PI_2 * i as f32 / STEPS as f32).cos();
            let y = self.top(x);
            over.positions.extend([
                Vec3::new(x, y, 0.0),
                Vec3::new(x, height, 0.0),
                Vec3::new(x, height, thick),
                Vec3::new(x, y, thick),
            ]);
        }
        over.join_rings(STEPS + 1, 4, true);
        join(&mut mesh, over);
        mesh
    }

    /// The window's bars, as boxes: a mullion `wide`, and thinner bars across, at even heights.
    pub fn bars(&self, wide: f32, across: u32, z: f32) -> Mesh {
        let mut mesh = Mesh::default();
        let mut add = |low: Vec3, high: Vec3| join(&mut mesh, Mesh::cuboid(low, high, None));
        let w = 0.5 * wide;
        add(Vec3::new(-w, self.sill, z - w), Vec3::new(w, self.top(0.0) - 0.2 * self.half, z + w));
        for i in 1..=across {
            let y = self.sill + (self.spring - self.sill) * i as f32 / across as f32;
            add(Vec3::new(-self.half, y - 0.4 * w, z - 0.4 * w), Vec3::new(self.half, y + 0.4 * w, z + 0.4 * w));
        }
        // Two small arches that meet on the mullion.
        let half = 0.5 * self.half;
        for side in [-half, half] {
            let small: Vec<Vec2> = arch(half, half, 8).iter().map(|p| *p + Vec2::new(side, self.spring)).collect();
            join(&mut mesh, band(&small, wide, z - w, z + w));
        }
        mesh
    }
}

/// Puts the triangles of `more` to those of `mesh`.
pub fn join(mesh: &mut Mesh, more: Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(more.positions);
    mesh.indices.extend(more.indices.iter().map(|i| first + i));
}

/// A round pillar from the floor to `height`, with base and capital.
pub fn pillar(radius: f32, height: f32) -> Mesh {
    let r = radius;
    let profile = [
        (1.45 * r, 0.0),
        (1.45 * r, 0.35 * r),
        (1.25 * r, 0.5 * r),
        (1.25 * r, 0.7 * r),
        (r, 0.9 * r),
        (0.95 * r, height - 1.1 * r),
        (1.1 * r, height - 1.05 * r),
        (1.0 * r, height - 0.95 * r),
        (1.5 * r, height - 0.35 * r),
        (1.55 * r, height),
        (0.01 * r, height),
    ];
    Mesh::revolved(&profile.map(|(r, y)| Vec2::new(r, y)), 24)
}
