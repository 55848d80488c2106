//! The water: a disk of triangles around the camera's foot, its rings wider the farther out, gently swelling; finer ripples
//! are the roughness of its surface. Below it lies a bed that swallows nearly all light.

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{Vec2, Vec3};

use super::super::mesh::Mesh;
use super::super::text::SceneText;
use super::EYE;

const RINGS: u32 = 110;
const SPOKES: u32 = 120;
/// Radius of the first ring and of the last.
const REACH: [f32; 2] = [0.8, 260.0];

/// The surface and the bed.
pub fn text() -> SceneText {
    let mut t = SceneText::default();
    t.add(format_args!("# Water: part of pier.pbrt"));
    t.block(|t| {
        t.add(format_args!(
            "Material \"dielectric\" \"float eta\" 1.33 \"float roughness\" 0.15 \"bool remaproughness\" false"
        ));
        t.mesh(&surface());
    });
    t.block(|t| {
        t.add(format_args!("Material \"diffuse\" \"rgb reflectance\" [0.012 0.02 0.022]"));
        t.add(format_args!("Translate 0 -3 0 Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 280"));
    });
    t
}

/// Height of the swell at a place: two trains of noise, stretched along the wind.
struct Swell {
    noise: FastNoiseLite,
}

impl Swell {
    fn new() -> Self {
        let mut noise = FastNoiseLite::with_seed(11);
        noise.set_noise_type(Some(NoiseType::OpenSimplex2));
        noise.set_fractal_type(Some(FractalType::FBm));
        noise.set_fractal_octaves(Some(3));
        noise.set_frequency(Some(0.55));
        Self { noise }
    }

    /// In metres; fades where the mesh is too coarse to carry it.
    fn height(&self, p: Vec2) -> f32 {
        let distance = p.distance(Vec2::new(EYE.x, EYE.z));
        0.03 * self.noise.get_noise_2d(0.5 * p.x, p.y) * (1.0 - distance / 60.0).max(0.0)
    }

    fn normal(&self, p: Vec2) -> Vec3 {
        const STEP: f32 = 0.05;
        let slope = |d: Vec2| (self.height(p + d) - self.height(p - d)) / (2.0 * STEP);
        Vec3::new(-slope(Vec2::new(STEP, 0.0)), 1.0, -slope(Vec2::new(0.0, STEP))).normalize()
    }
}

fn surface() -> Mesh {
    let swell = Swell::new();
    let mut mesh = Mesh::default();
    let [first, last] = REACH;
    // From the outermost ring inwards, so that the mesh faces up.
    for ring in (0..RINGS).rev() {
        let radius = first * (last / first).powf(ring as f32 / (RINGS - 1) as f32);
        for spoke in 0..SPOKES {
            let angle = std::f32::consts::TAU * spoke as f32 / SPOKES as f32;
            let p = Vec2::new(EYE.x, EYE.z) + radius * Vec2::from_angle(angle);
            mesh.positions.push(Vec3::new(p.x, swell.height(p), p.y));
            mesh.normals.push(swell.normal(p));
        }
    }
    mesh.join_rings(RINGS, SPOKES, true);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_faces_up() {
        let mesh = surface();
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
