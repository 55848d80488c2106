//! The scene `foliage`: a path through a grove at night. Leaves are cards that a texture cuts out; small bulbs hang in the
//! crowns among them, so that what a bulb lights depends on which leaves are in between. A dim sky, lanterns along the path,
//! thin mist. Metres; y is up, the path leads along z.

mod leaf;
mod tree;

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{Affine3A, FloatExt, Vec2, Vec3};

use self::leaf::Bunch;
use self::tree::Tree;
use super::glow::Glow;
use super::mesh::Mesh;
use super::text::{Dice, Number, Point, SceneText, View, share};
use super::{GalleryError, furniture};

/// Bulbs of a tree, about.
const BULBS: u32 = 640;
/// Bulbs that can be seen: of more than this, those of the farthest trees are points.
const SPHERES: u32 = 100_000;
/// Kinds of trees.
const KINDS: usize = 4;
/// How far the grove reaches to the sides, and along the path.
const REACH: [Vec3; 2] = [Vec3::new(-26.0, -1.5, -14.0), Vec3::new(26.0, 11.0, 62.0)];

/// A tree of the grove.
struct Place {
    kind: usize,
    at: Vec3,
    degrees: f32,
    size: f32,
}

/// Writes the scene with `lights` lights.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    leaf::write_textures(&folder.join("leaf.png"), &folder.join("leaf-mask.png"))?;
    text(lights).write(&folder.join("foliage.pbrt"))
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let (eye, target) = (Vec3::new(-0.9, 1.65, -8.5), Vec3::new(0.3, 2.35, 6.0));
    let what = "A path through a grove at night; units are metres";
    t.begin("foliage", what, &View { eye, target, fov: 48.0, iso: 170.0, samples: 96, bounces: 5 });
    t.add(format_args!("LightSource \"infinite\" \"rgb L\" [0.0035 0.0055 0.01]"));
    t.haze(REACH, 0.008, 0.0004, 0.5, [0.0; 3]);
    materials(&mut t);
    furniture::define(&mut t);
    let mut dice = Dice::new(3110);
    let ground = Ground::new();
    let count = (lights / BULBS).clamp(3, 90);
    let small = lights < BULBS;
    let trees: Vec<Tree> = (0..KINDS).map(|_| Tree::grow(&mut dice, if small { 2 } else { 3 })).collect();
    let bunches = leaf::bunches(&mut dice);
    leaf::define(&mut t, &bunches);
    for (kind, tree) in trees.iter().enumerate() {
        tree.define(&mut t, &format!("tree{kind}"));
    }
    t.add(format_args!("\n# The ground"));
    t.of("grass", |t| t.mesh(&ground.mesh()));
    path(&mut t, &mut dice, &ground, small);
    let places = places(&mut dice, &ground, count);
    t.add(format_args!("\n# The trees"));
    for place in &places {
        let Place { kind, at, degrees, size } = *place;
        let (degrees, size) = (Number(degrees), Number(size));
        t.block(|t| {
            t.add(format_args!(
                "Translate {} Rotate {degrees} 0 1 0 Scale {size} {size} {size} ObjectInstance \"tree{kind}\"",
                Point(at)
            ));
        });
    }
    // One light is the sky.
    let lanterns = (lights / 400).clamp(2, 24);
    along_the_path(&mut t, &mut dice, &ground, lanterns);
    bulbs(&mut t, &mut dice, (&trees, &bunches), &places, lights - 1 - lanterns);
    t
}

fn materials(t: &mut SceneText) {
    t.add(format_args!("\n# Materials"));
    t.add(format_args!("Texture \"leaf\" \"spectrum\" \"imagemap\" \"string filename\" \"leaf.png\""));
    t.add(format_args!(
        "Texture \"mask\" \"float\" \"imagemap\" \"string filename\" \"leaf-mask.png\" \"string encoding\" \"linear\""
    ));
    t.add(format_args!("MakeNamedMaterial \"leaf\" \"string type\" \"diffuse\" \"texture reflectance\" \"leaf\""));
    t.diffuse(&[("bark", [0.17, 0.12, 0.08]), ("grass", [0.06, 0.085, 0.03]), ("stone", [0.3, 0.28, 0.25])]);
}

/// The lie of the land.
struct Ground(FastNoiseLite);

impl Ground {
    fn new() -> Self {
        let mut noise = FastNoiseLite::with_seed(77);
        noise.set_noise_type(Some(NoiseType::OpenSimplex2));
        noise.set_fractal_type(Some(FractalType::FBm));
        noise.set_fractal_octaves(Some(4));
        noise.set_frequency(Some(0.09));
        Self(noise)
    }

    /// Its height: level on the path.
    fn height(&self, x: f32, z: f32) -> f32 {
        let off = (x - path_at(z)).abs();
        let hills = 0.7 * self.0.get_noise_2d(x, z) + 0.0012 * off * off;
        hills * ((off - 0.8) / 3.0).clamp(0.0, 1.0)
    }

    fn mesh(&self) -> Mesh {
        const N: u32 = 150;
        let [low, high] = REACH;
        let mut mesh = Mesh::default();
        for row in 0..=N {
            let z = low.z.lerp(high.z, row as f32 / N as f32);
            mesh.positions.extend((0..=N).map(|i| {
                let x = low.x.lerp(high.x, i as f32 / N as f32);
                Vec3::new(x, self.height(x, z), z)
            }));
        }
        mesh.join_rings(N + 1, N + 1, false);
        mesh
    }
}

/// Where the path is.
fn path_at(z: f32) -> f32 {
    0.9 * (0.16 * z).sin() + 0.5 * (0.07 * z + 1.0).sin() - 0.4
}

/// Stepping stones, bushes at both sides, and someone on a walk.
fn path(t: &mut SceneText, dice: &mut Dice, ground: &Ground, small: bool) {
    t.of("stone", |t| {
        let mut z = REACH[0].z + 1.0;
        while z < 40.0 {
            let p = Point(Vec3::new(path_at(z) + dice.between(-0.3, 0.3), -0.03, z));
            let (turn, long, wide) =
                (Number(dice.between(0.0, 180.0)), Number(dice.between(0.28, 0.42)), Number(dice.between(0.2, 0.3)));
            t.block(|t| {
                t.add(format_args!("Translate {p} Rotate {turn} 0 1 0 Scale {long} 1 {wide}"));
                let profile = [(1.0, 0.0), (1.0, 0.05), (0.9, 0.07), (0.01, 0.07)];
                t.mesh(&Mesh::revolved(&profile.map(|(r, y)| Vec2::new(r, y)), 11));
            });
            z += dice.between(0.6, 0.8);
        }
    });
    t.add(format_args!("\n# Bushes"));
    for i in 0..if small { 20 } else { 150 } {
        let z = dice.between(-9.0, if small { 12.0 } else { 45.0 });
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let x = path_at(z) + side * dice.between(1.6, 6.0);
        if Vec2::new(x + 0.9, z + 8.5).length() < 2.2 {
            continue;
        }
        let p = Point(Vec3::new(x, ground.height(x, z) + 0.15, z));
        let (turn, size) = (Number(dice.between(0.0, 360.0)), Number(dice.between(0.5, 1.1)));
        let kind = dice.pick(&[0, 1, 2]);
        t.block(|t| {
            t.add(format_args!(
                "Translate {p} Rotate {turn} 0 1 0 Scale {size} {size} {size} ObjectInstance \"leaves{kind}\""
            ));
        });
    }
    t.add(format_args!("\n# Someone on a walk"));
    for (z, across, turn) in [(4.2, -0.3, 172.0), (4.5, 0.35, 186.0), (17.0, 0.2, 10.0)] {
        t.instance("person", Vec3::new(path_at(z) + across, 0.0, z), turn);
    }
}

/// Where the trees stand: none on the path or before the camera, nearest ones first.
fn places(dice: &mut Dice, ground: &Ground, count: u32) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    let far = (6.0 + 0.65 * count as f32).min(REACH[1].z - 4.0);
    let wide = (5.0 + 0.4 * count as f32).min(REACH[1].x - 3.0);
    let mut apart: f32 = 3.4;
    while places.len() < count as usize {
        let z = dice.between(-5.0, far);
        let off = dice.between(2.5, wide) * dice.pick(&[-1.0, 1.0]);
        let x = path_at(z) + off;
        // In a crowded grove they stand closer.
        apart *= 0.9985;
        if places.iter().any(|other| Vec2::new(other.at.x - x, other.at.z - z).length() < apart) {
            continue;
        }
        let at = Vec3::new(x, ground.height(x, z) - 0.1, z);
        let kind = dice.pick(&[0, 1, 2, 3]) % KINDS;
        places.push(Place { kind, at, degrees: dice.between(0.0, 360.0), size: dice.between(0.85, 1.3) });
    }
    places.sort_by(|a, b| a.at.z.total_cmp(&b.at.z));
    places
}

/// Lanterns on posts at both sides.
fn along_the_path(t: &mut SceneText, dice: &mut Dice, ground: &Ground, count: u32) {
    t.add(format_args!("\n# Lanterns along the path"));
    for i in 0..count {
        let z = -4.5 + 3.1 * i as f32;
        let x = path_at(z) + if i % 2 == 0 { -1.25 } else { 1.25 };
        let p = Vec3::new(x, ground.height(x, z), z);
        t.of("metal", |t| {
            t.add(format_args!("Translate {}", Point(p)));
            t.mesh(&Mesh::pole(0.025, -0.2, 0.69));
            let lid = [(0.15, 1.03), (0.02, 1.12)].map(|(r, y)| Vec2::new(r, y));
            t.mesh(&Mesh::revolved(&lid, 8));
        });
        Glow::Kelvin(dice.pick(&[2000.0, 2200.0])).bulb(t, p + Vec3::Y * 0.83, 0.11, 6.0);
    }
}

/// Bulbs in the crowns, of one colour a tree: frosted globes that hang clear of bark and leaves.
fn bulbs(t: &mut SceneText, dice: &mut Dice, (trees, bunches): (&[Tree], &[Bunch]), places: &[Place], count: u32) {
    t.add(format_args!("\n# Bulbs in the trees"));
    let few = (300.0 * places.len() as f32 / count.max(1) as f32).clamp(1.0, 60.0).sqrt();
    let many = (BULBS as f32 * places.len() as f32 / count.max(1) as f32).min(1.0);
    // The fewer, the larger; as bright together as globes of 27 mm and a radiance of 10.
    let radius = (0.027 * few).min(0.12);
    let radiance = 0.0073 * many * few * few / (radius * radius);
    let clear = radius + 0.05;
    let mut seen = 0;
    for (i, place) in places.iter().enumerate() {
        let bulbs = share(count, places.len() as u32, i as u32);
        let to_world = Affine3A::from_translation(place.at)
            * Affine3A::from_rotation_y(place.degrees.to_radians())
            * Affine3A::from_scale(Vec3::splat(place.size));
        let tree = &trees[place.kind];
        let list: Vec<Vec3> = (0..bulbs)
            .map(|_| to_world.transform_point3(tree.place_of_bulb(dice, bunches, clear / place.size)))
            .collect();
        let glow = dice.pick(&[
            Glow::Kelvin(2000.0),
            Glow::Kelvin(2200.0),
            Glow::Kelvin(2600.0),
            Glow::Kelvin(3200.0),
            Glow::Paper([1.7, 0.45, 0.18]),
            Glow::Paper([0.5, 1.2, 1.1]),
            Glow::Paper([1.5, 0.55, 1.0]),
        ]);
        seen += bulbs;
        if seen <= SPHERES {
            glow.bulbs(t, &list, radius, radiance);
        } else {
            glow.points(t, &list, radiance * std::f32::consts::PI * radius * radius);
        }
    }
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
