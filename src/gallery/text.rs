//! Writing pbrt-v4 text: numbers without noise, attribute blocks, meshes; and the dice that scenes are strewn with.

use std::fmt::{self, Write as _};
use std::io::Write as _;
use std::path::Path;

use glam::Vec3;
use rand_core::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg32;

use super::GalleryError;
use super::mesh::Mesh;
use crate::system::output::write_atomically;

/// How a scene is looked at.
pub struct View {
    /// Where the camera is.
    pub eye: Vec3,
    /// What it looks at.
    pub target: Vec3,
    /// Degrees across the shorter side.
    pub fov: f32,
    /// Exposure: 100 leaves radiance as it is.
    pub iso: f32,
    /// Samples a pixel.
    pub samples: u32,
    /// The most bounces.
    pub bounces: u32,
}

/// pbrt text that grows.
#[derive(Default)]
pub struct SceneText(String);

impl SceneText {
    /// Adds a line: `add(format_args!(…))`.
    pub fn add(&mut self, line: fmt::Arguments) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "{line}");
    }

    /// What goes before the world: a camera with y up, a film that is named after the scene, and `WorldBegin`.
    pub fn begin(&mut self, name: &str, what: &str, view: &View) {
        let View { eye, target, fov, iso, samples, bounces } = view;
        self.add(format_args!("# {what}. Written by `lanternfish scene {name}`; y is up."));
        self.add(format_args!("LookAt {}  {}  0 1 0", Point(*eye), Point(*target)));
        self.add(format_args!("Camera \"perspective\" \"float fov\" {fov}"));
        self.add(format_args!(
            "Film \"rgb\" \"integer xresolution\" 640 \"integer yresolution\" 360 \"float iso\" {iso} \"string filename\" \"{name}.exr\""
        ));
        self.add(format_args!("PixelFilter \"gaussian\""));
        self.add(format_args!("Sampler \"zsobol\" \"integer pixelsamples\" {samples}"));
        self.add(format_args!("Integrator \"volpath\" \"integer maxdepth\" {bounces}"));
        self.add(format_args!("WorldBegin"));
    }

    /// Named materials that reflect diffusely.
    pub fn diffuse(&mut self, materials: &[(&str, [f32; 3])]) {
        for (name, [r, g, b]) in materials {
            self.add(format_args!(
                "MakeNamedMaterial \"{name}\" \"string type\" \"diffuse\" \"rgb reflectance\" [{r} {g} {b}]"
            ));
        }
    }

    /// What stands in the block is of the material `name`.
    pub fn of(&mut self, name: &str, inner: impl FnOnce(&mut Self)) {
        self.block(|t| {
            t.add(format_args!("NamedMaterial \"{name}\""));
            inner(t);
        });
    }

    /// A box of the material in force.
    pub fn cuboid(&mut self, low: Vec3, high: Vec3) {
        self.mesh(&Mesh::cuboid(low, high, None));
    }

    /// An even haze in a box: `scattering` and `absorption` per unit length, `g` as of Henyey and Greenstein, and the radiance
    /// that it tends to by its own glow.
    pub fn haze(&mut self, [low, high]: [Vec3; 2], scattering: f32, absorption: f32, g: f32, glow: [f32; 3]) {
        self.add(format_args!("\n# Haze"));
        self.add(format_args!("MakeNamedMedium \"haze\" \"string type\" \"homogeneous\" \"float g\" {g}"));
        self.add(format_args!("  \"float sigma_s\" {scattering} \"float sigma_a\" {absorption}"));
        if glow != [0.0; 3] {
            let [r, g, b] = glow;
            self.add(format_args!("  \"rgb Le\" [{r} {g} {b}]"));
        }
        self.block(|t| {
            t.add(format_args!("Material \"interface\" MediumInterface \"haze\" \"\""));
            t.cuboid(low, high);
        });
    }

    /// Lines between `AttributeBegin` and `AttributeEnd`.
    pub fn block(&mut self, inner: impl FnOnce(&mut Self)) {
        self.enclosed(format_args!("AttributeBegin"), "AttributeEnd", inner);
    }

    /// An object definition for instances.
    pub fn object(&mut self, name: &str, inner: impl FnOnce(&mut Self)) {
        self.enclosed(format_args!("ObjectBegin \"{name}\""), "ObjectEnd", inner);
    }

    fn enclosed(&mut self, begin: fmt::Arguments, end: &str, inner: impl FnOnce(&mut Self)) {
        self.add(begin);
        inner(self);
        self.add(format_args!("{end}"));
    }

    /// An instance of `object` at `p`, turned by `degrees` about the vertical.
    pub fn instance(&mut self, object: &str, p: Vec3, degrees: f32) {
        let (p, degrees) = (Point(p), Number(degrees));
        self.block(|t| {
            t.add(format_args!("Translate {p} Rotate {degrees} 0 1 0 ObjectInstance \"{object}\""));
        });
    }

    /// A triangle mesh with further parameters.
    pub fn mesh_with(&mut self, mesh: &Mesh, parameters: &str) {
        self.mesh(mesh);
        self.add(format_args!("  {parameters}"));
    }

    /// A triangle mesh.
    pub fn mesh(&mut self, mesh: &Mesh) {
        let points = |list: &[Vec3]| list.iter().map(|p| Point(*p).to_string()).collect::<Vec<_>>().join("  ");
        self.add(format_args!("Shape \"trianglemesh\" \"point3 P\" [{}]", points(&mesh.positions)));
        let indices: Vec<String> = mesh.indices.iter().map(u32::to_string).collect();
        self.add(format_args!("  \"integer indices\" [{}]", indices.join(" ")));
        if !mesh.normals.is_empty() {
            self.add(format_args!("  \"normal3 N\" [{}]", points(&mesh.normals)));
        }
        if !mesh.uv.is_empty() {
            let uv: Vec<String> = mesh.uv.iter().map(|[u, v]| format!("{} {}", Number(*u), Number(*v))).collect();
            self.add(format_args!("  \"point2 uv\" [{}]", uv.join(" ")));
        }
    }

    /// A rope from `a` to `b` that sags by `sag` in its middle: one cubic Bézier segment.
    pub fn rope(&mut self, a: Vec3, b: Vec3, sag: f32, width: f32) {
        // Quadratic with its middle control point 2 sag down, raised to degree 3.
        let down = Vec3::new(0.0, 4.0 / 3.0 * sag, 0.0);
        let p = [a, a.lerp(b, 1.0 / 3.0) - down, a.lerp(b, 2.0 / 3.0) - down, b].map(|p| Point(p).to_string());
        let (p, width) = (p.join("  "), Number(width));
        self.add(format_args!(
            "Shape \"curve\" \"string type\" \"cylinder\" \"point3 P\" [{p}] \"float width\" {width}"
        ));
    }

    /// Writes the text to a file.
    pub fn write(&self, path: &Path) -> Result<(), GalleryError> {
        write_atomically(path, |file| file.write_all(self.0.as_bytes()).map_err(|e| e.to_string())).map_err(Into::into)
    }
}

/// The point of [`SceneText::rope`] at `t` in 0..=1.
pub fn on_rope(a: Vec3, b: Vec3, sag: f32, t: f32) -> Vec3 {
    a.lerp(b, t) - Vec3::new(0.0, 4.0 * sag * t * (1.0 - t), 0.0)
}

/// A number to four decimals.
pub struct Number(pub f32);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding 0 turns −0 into 0.
        write!(f, "{}", (f64::from(self.0) * 1e4).round() / 1e4 + 0.0)
    }
}

/// Three numbers.
pub struct Point(pub Vec3);

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", Number(self.0.x), Number(self.0.y), Number(self.0.z))
    }
}

/// How many of `total` things go to the place `index` of `places`, as evenly as can be.
pub fn share(total: u32, places: u32, index: u32) -> u32 {
    let up_to = |i: u32| (u64::from(total) * u64::from(i) / u64::from(places)) as u32;
    up_to(index + 1) - up_to(index)
}

/// Random numbers that are the same each time.
pub struct Dice(Pcg32);

impl Dice {
    /// The sequence number `seed`.
    pub fn new(seed: u64) -> Self {
        Self(Pcg32::seed_from_u64(seed))
    }

    /// Uniform between `low` and `high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.0.next_u32() >> 8) as f32 / 16_777_216.0
    }

    /// Uniform in a box.
    pub fn within(&mut self, low: Vec3, high: Vec3) -> Vec3 {
        Vec3::new(self.between(low.x, high.x), self.between(low.y, high.y), self.between(low.z, high.z))
    }

    /// An index into a list of `count`, which must not be 0.
    pub fn below(&mut self, count: usize) -> usize {
        self.0.next_u32() as usize % count
    }

    /// Whether something of probability `chance` happens.
    pub fn happens(&mut self, chance: f32) -> bool {
        self.between(0.0, 1.0) < chance
    }

    /// One of `list`, which must not be empty.
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_are_even() {
        for (total, places) in [(0, 1), (5, 7), (7, 5), (4_881_396, 1000), (u32::MAX, 3)] {
            let shares: Vec<u32> = (0..places).map(|i| share(total, places, i)).collect();
            assert_eq!(shares.iter().map(|&s| u64::from(s)).sum::<u64>(), u64::from(total));
            let [least, most] = [shares.iter().min(), shares.iter().max()].map(|s| *s.expect("there are places"));
            assert!(most - least <= 1, "{total} over {places}: {least} to {most}");
        }
    }
}
