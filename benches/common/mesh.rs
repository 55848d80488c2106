//! Scenes of a million triangles, made on the spot: a closed cavern, where every path stays inside, and open hills, where
//! many leave. Diffuse, one area light.

use std::f32::consts::{PI, TAU};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The scenes.
pub const SCENES: [&str; 2] = ["cavern", "hills"];

/// Writes the scene and its mesh of about `triangles` triangles to `folder`; the path of the scene file.
pub fn write_scene(folder: &Path, scene: &str, triangles: u64, size: u64) -> io::Result<PathBuf> {
    let steps = ((triangles / 2) as f32).sqrt().round().max(4.0) as u32;
    let (place, view, light): (fn(f32, f32) -> [f32; 3], _, _) = match scene {
        "cavern" => (cavern, "LookAt 0.9 0.2 0.1  -1 -0.3 0  0 1 0", [-0.35, 0.9, -0.35]),
        _ => (hills, "LookAt 0 0.9 -2.2  0 -0.1 0  0 1 0", [-0.35, 1.6, -0.35]),
    };
    write_mesh(&folder.join("mesh.ply"), steps, place)?;
    let [x, y, z] = light;
    let (x1, z1) = (x + 0.7, z + 0.7);
    let text = format!(
        r#"{view}
Camera "perspective" "float fov" 70
Sampler "zsobol"
Integrator "volpath" "integer maxdepth" 5
Film "rgb" "integer xresolution" {size} "integer yresolution" {size}
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 12 11 9 ] "bool twosided" true
  Material "diffuse" "rgb reflectance" [ 0 0 0 ]
  Shape "trianglemesh" "point3 P" [ {x} {y} {z}  {x1} {y} {z}  {x1} {y} {z1}  {x} {y} {z1} ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.5 ]
Shape "plymesh" "string filename" "mesh.ply"
"#
    );
    let path = folder.join("scene.pbrt");
    std::fs::write(&path, text)?;
    Ok(path)
}

/// Bumps of ever smaller size on (u, v) of the torus 0..1 × 0..1.
pub fn bumps(u: f32, v: f32) -> f32 {
    let (mut height, mut amplitude, mut frequency) = (0.0, 0.5, 3.0);
    for octave in 0..7 {
        let turn = octave as f32;
        let (a, b) = (TAU * frequency * u + 1.7 * turn, TAU * frequency * v + 2.3 * turn);
        height += amplitude * (a + (b + 0.8 * turn).sin()).sin() * (b + (a * 0.5).sin()).cos();
        amplitude *= 0.55;
        frequency = (frequency * 1.9).round();
    }
    height
}

/// A sphere around the origin, dented and bulged.
fn cavern(u: f32, v: f32) -> [f32; 3] {
    let (theta, phi) = (PI * v, TAU * u);
    let radius = 1.6 + 0.35 * bumps(u, v) * theta.sin();
    [radius * theta.sin() * phi.cos(), radius * theta.cos(), radius * theta.sin() * phi.sin()]
}

/// A square of hilly ground.
fn hills(u: f32, v: f32) -> [f32; 3] {
    [4.0 * u - 2.0, 0.35 * bumps(u, v) - 0.2, 4.0 * v - 2.0]
}

/// A grid of `steps`² quads, two triangles each, as binary PLY; `place` takes (u, v) of 0..1 × 0..1.
pub fn write_mesh(path: &Path, steps: u32, place: impl Fn(f32, f32) -> [f32; 3]) -> io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    let (vertices, faces) = ((steps + 1) * (steps + 1), 2 * steps * steps);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    let share = |i: u32| i as f32 / steps as f32;
    for j in 0..=steps {
        for i in 0..=steps {
            for coordinate in place(share(i), share(j)) {
                out.write_all(&coordinate.to_le_bytes())?;
            }
        }
    }
    for j in 0..steps {
        for i in 0..steps {
            let [a, b] = [j * (steps + 1) + i, (j + 1) * (steps + 1) + i];
            for face in [[a, a + 1, b + 1], [a, b + 1, b]] {
                out.write_all(&[3])?;
                for index in face {
                    out.write_all(&index.to_le_bytes())?;
                }
            }
        }
    }
    out.flush()
}
