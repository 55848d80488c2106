//! The sea, a headland with a lighthouse, and islands far out.

use glam::{Vec2, Vec3};

use super::super::mesh::Mesh;
use super::super::text::{Point, SceneText};
use super::super::volume::{at, noise, smoothstep};

/// Adds them.
pub fn add(t: &mut SceneText) {
    t.add(format_args!("\n# The sea"));
    t.add(format_args!(
        "MakeNamedMaterial \"sea\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [0.012 0.045 0.06] \"float roughness\" 0.22 \"bool remaproughness\" false"
    ));
    t.diffuse(&[
        ("grass", [0.13, 0.17, 0.05]),
        ("rock", [0.2, 0.18, 0.15]),
        ("far", [0.16, 0.21, 0.24]),
        ("white", [0.75, 0.74, 0.7]),
        ("red", [0.5, 0.07, 0.05]),
    ]);
    const WIDE: f32 = 60_000.0;
    t.of("sea", |t| t.cuboid(Vec3::new(-WIDE, -60.0, -2_000.0), Vec3::new(WIDE, 0.0, WIDE)));
    t.add(format_args!("\n# Land"));
    t.of("grass", |t| t.mesh(&land(Vec3::new(-330.0, 0.0, 560.0), Vec2::new(330.0, 250.0), 74.0, 71)));
    t.of("grass", |t| t.mesh(&land(Vec3::new(60.0, 0.0, 20.0), Vec2::new(320.0, 130.0), 58.0, 72)));
    for (x, z, wide, tall, seed) in [(2600.0, 6200.0, 1500.0, 260.0, 73), (-3600.0, 8800.0, 2100.0, 330.0, 74)] {
        t.of("far", |t| t.mesh(&land(Vec3::new(x, 0.0, z), Vec2::new(wide, 700.0), tall, seed)));
    }
    t.add(format_args!("\n# The lighthouse"));
    t.block(|t| {
        t.add(format_args!("Translate {}", Point(Vec3::new(-205.0, 58.0, 560.0))));
        let tower = |t: &mut SceneText, name: &str, profile: &[(f32, f32)]| {
            let profile: Vec<Vec2> = profile.iter().map(|&(r, y)| Vec2::new(r, y)).collect();
            t.of(name, |t| t.mesh(&Mesh::revolved(&profile, 24)));
        };
        tower(t, "white", &[(5.2, -14.0), (3.6, 26.0), (5.0, 26.8), (5.0, 27.8), (0.1, 27.8)]);
        tower(t, "red", &[(2.6, 27.8), (2.6, 32.0), (3.4, 32.0), (0.1, 36.0)]);
        t.of("white", |t| t.cuboid(Vec3::new(8.0, -14.0, -5.0), Vec3::new(22.0, 6.0, 5.0)));
    });
}

/// Hilly land around a place in the sea, of half its size, `tall` at its highest or so.
fn land(middle: Vec3, half: Vec2, tall: f32, seed: i32) -> Mesh {
    const STEPS: u32 = 72;
    let hills = noise(seed, 1.3, 5);
    let mut mesh = Mesh::default();
    for i in 0..=STEPS {
        for k in 0..=STEPS {
            let s = 2.0 * Vec2::new(i as f32, k as f32) / STEPS as f32 - 1.0;
            let shape = at(&hills, Vec3::new(1.4 * s.x, 0.0, 1.4 * s.y));
            let coast = 1.0 - s.length() + 0.3 * shape;
            let height = tall * (smoothstep(0.0, 0.3, coast) * (0.7 + 0.45 * shape)) - 0.1 * tall;
            mesh.positions.push(middle + Vec3::new(half.x * s.x, height, half.y * s.y));
        }
    }
    mesh.join_rings(STEPS + 1, STEPS + 1, false);
    mesh
}
