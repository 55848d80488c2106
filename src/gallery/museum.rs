//! The scene `museum`: a hall hung with large paintings, each an image of its own under a lamp of its own. Metres; the floor is at y = 0 and the hall runs
//! along z. With many paintings their images are larger than most memories.

use std::path::Path;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use glam::{FloatExt, Vec3};
use rayon::prelude::*;

use super::mesh::Mesh;
use super::text::{Dice, Number, Point, SceneText, View};
use super::{GalleryError, wood};
use crate::film::image::{encode_png, linear_to_srgb, to_byte};
use crate::system::output::write_atomically;

/// Paintings unless told otherwise.
pub const DEFAULT_LIGHTS: u32 = 24;
/// From this many on paintings are as fine as photographs of paintings are.
const FINE: u32 = 16;
/// Texels along a painting's sides: of few, and of many.
const SIZES: [usize; 2] = [256, 2048];
/// Half the hall's width, and its height.
const HALF: f32 = 4.2;
const HEIGHT: f32 = 4.8;
/// From painting to painting along a wall.
const PITCH: f32 = 2.9;
/// A painting's half width, and the heights of its edges.
const PAINTING: [f32; 3] = [1.05, 0.9, 3.0];

/// Writes every file of the scene.
pub fn write(folder: &Path, lights: u32) -> Result<(), GalleryError> {
    wood::write_texture(&folder.join("planks.png"))?;
    let size = SIZES[usize::from(lights >= FINE)];
    (0..lights).into_par_iter().try_for_each(|number| {
        let pixels = painting(number, size);
        write_atomically(&folder.join(name(number)), |file| {
            let png = encode_png(size as u32, size as u32, &pixels)?;
            std::io::Write::write_all(file, &png).map_err(|error| error.to_string())
        })
    })?;
    text(lights).write(&folder.join("museum.pbrt"))
}

fn name(number: u32) -> String {
    format!("painting-{number:04}.png")
}

fn text(lights: u32) -> SceneText {
    let mut t = SceneText::default();
    let view = View {
        eye: Vec3::new(-1.3, 1.65, -2.6),
        target: Vec3::new(0.5, 1.9, 6.0),
        fov: 52.0,
        iso: 320.0,
        samples: 64,
        bounces: 5,
    };
    t.begin("museum", "A hall of paintings; units are metres", &view);
    t.add(format_args!("Texture \"boards\" \"spectrum\" \"imagemap\" \"string filename\" \"planks.png\""));
    t.add(format_args!(
        "MakeNamedMaterial \"floor\" \"string type\" \"coateddiffuse\" \"texture reflectance\" \"boards\" \"float roughness\" 0.15"
    ));
    t.add(format_args!(
        "MakeNamedMaterial \"gilt\" \"string type\" \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\" \"float roughness\" 0.3"
    ));
    t.diffuse(&[("wall", [0.34, 0.1, 0.09]), ("ceiling", [0.62, 0.6, 0.56]), ("lamp", [0.05, 0.05, 0.05])]);
    let length = PITCH * lights.div_ceil(2) as f32;
    hall(&mut t, length);
    for number in 0..lights {
        hang(&mut t, number);
    }
    t
}

fn hall(t: &mut SceneText, length: f32) {
    const THICK: f32 = 0.2;
    let (start, end) = (-4.0, length + 1.0);
    t.add(format_args!("\n# The hall"));
    t.of("wall", |t| {
        for side in [-1.0, 1.0] {
            let (a, b) = (Vec3::new(side * HALF, 0.0, start), Vec3::new(side * (HALF + THICK), HEIGHT, end));
            t.cuboid(a.min(b), a.max(b));
        }
        t.cuboid(Vec3::new(-HALF, 0.0, end), Vec3::new(HALF, HEIGHT, end + THICK));
        t.cuboid(Vec3::new(-HALF, 0.0, start - THICK), Vec3::new(HALF, HEIGHT, start));
    });
    t.of("ceiling", |t| t.cuboid(Vec3::new(-HALF, HEIGHT, start), Vec3::new(HALF, HEIGHT + THICK, end)));
    t.of("floor", |t| {
        // Boards lie across the hall, eight of the texture's to a piece.
        let pieces = ((end - start) / 1.6).ceil() as u32;
        let depth = (end - start) / pieces as f32;
        for piece in 0..pieces {
            let z = start + depth * piece as f32;
            t.mesh(&Mesh::cuboid(
                Vec3::new(-HALF, -0.05, z),
                Vec3::new(HALF, 0.0, z + depth),
                Some([0.0, 0.0, 1.0, 1.0]),
            ));
        }
    });
}

/// A painting in its frame, and the lamp over it. They hang to the left and to the right in turn.
fn hang(t: &mut SceneText, number: u32) {
    let side = if number.is_multiple_of(2) { -1.0 } else { 1.0 };
    let z = PITCH * (0.5 + (number / 2) as f32);
    let [half, low, high] = PAINTING;
    let file = name(number);
    t.add(format_args!("\n# Painting {number}"));
    t.add(format_args!(
        "Texture \"p{number}\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\" \"string filter\" \"trilinear\""
    ));
    t.block(|t| {
        t.add(format_args!("Material \"diffuse\" \"texture reflectance\" \"p{number}\""));
        let x = side * (HALF - 0.04);
        let corner = |s: f32, y: f32| Point(Vec3::new(x, y, z + side * s * half));
        // Seen from within the hall u runs to the right.
        let corners = [corner(1.0, low), corner(-1.0, low), corner(-1.0, high), corner(1.0, high)];
        let [a, b, c, d] = corners;
        t.add(format_args!(
            "Shape \"trianglemesh\" \"point3 P\" [{a}  {b}  {c}  {d}] \"integer indices\" [0 1 2 0 2 3]"
        ));
        t.add(format_args!("  \"point2 uv\" [0 0 1 0 1 1 0 1]"));
    });
    t.of("gilt", |t| {
        const WIDE: f32 = 0.09;
        let bar = |t: &mut SceneText, y: [f32; 2], along: [f32; 2]| {
            let (a, b) =
                (Vec3::new(side * HALF, y[0], z + along[0]), Vec3::new(side * (HALF - 0.08), y[1], z + along[1]));
            t.cuboid(a.min(b), a.max(b));
        };
        let out = half + WIDE;
        bar(t, [low - WIDE, low], [-out, out]);
        bar(t, [high, high + WIDE], [-out, out]);
        bar(t, [low, high], [-out, -half]);
        bar(t, [low, high], [half, out]);
    });
    let (from, to) = (Vec3::new(side * (HALF - 1.3), HEIGHT - 0.25, z), Vec3::new(side * HALF, 1.75, z));
    t.of("lamp", |t| {
        t.add(format_args!("Translate {} Shape \"sphere\" \"float radius\" 0.05", Point(from + Vec3::Y * 0.1)));
    });
    let warmth = Number(2900.0 + 300.0 * (number % 3) as f32);
    t.add(format_args!(
        "LightSource \"spot\" \"point3 from\" [{}] \"point3 to\" [{}] \"float coneangle\" 34 \"float conedeltaangle\" 14 \"blackbody I\" [{warmth}] \"float scale\" 9",
        Point(from),
        Point(to)
    ));
}

/// An abstract painting: fields of colour that run into each other, brush strokes, the weave of the canvas. Rows of red, green and blue bytes.
fn painting(number: u32, size: usize) -> Vec<u8> {
    let mut noise = FastNoiseLite::with_seed(number as i32);
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(3));
    noise.set_frequency(Some(1.0));
    let mut dice = Dice::new(u64::from(number));
    let palette: Vec<Vec3> = (0..5).map(|_| dice.within(Vec3::splat(0.02), Vec3::new(0.7, 0.6, 0.55))).collect();
    // Fields change slowly: every sixteenth texel knows where its colour is on the palette.
    const COARSE: usize = 16;
    let cells = size / COARSE;
    let field: Vec<f32> = (0..=cells)
        .flat_map(|y| (0..=cells).map(move |x| [x, y].map(|i| 3.0 * i as f32 / cells as f32)))
        .map(|[x, y]| {
            let bend = 0.8 * noise.get_noise_2d(x + 5.2, y + 1.3);
            noise.get_noise_2d(x + bend, 1.7 * y - bend)
        })
        .collect();
    noise.set_fractal_octaves(Some(1));
    let mut bytes = Vec::with_capacity(3 * size * size);
    for y in 0..size {
        let (row, t) = (y / COARSE, (y % COARSE) as f32 / COARSE as f32);
        for x in 0..size {
            let (column, s) = (x / COARSE, (x % COARSE) as f32 / COARSE as f32);
            let at = |dx: usize, dy: usize| field[(row + dy) * (cells + 1) + column + dx];
            let place = at(0, 0).lerp(at(1, 0), s).lerp(at(0, 1).lerp(at(1, 1), s), t);
            // Strokes follow the fields and shift them a little.
            let stroke = noise.get_noise_2d(600.0 * place, 0.02 * (x + y) as f32);
            let place = (2.0 + 2.6 * (place + 0.03 * stroke)).clamp(0.0, 3.999);
            let between = place.fract();
            let edge = between * between * (3.0 - 2.0 * between);
            let colour = palette[place as usize].lerp(palette[place as usize + 1], edge);
            let weave = if (x ^ y) & 2 == 0 { 0.94 } else { 1.0 };
            let colour = colour * (weave * (1.0 + 0.25 * stroke));
            bytes.extend(colour.to_array().map(|c| to_byte(linear_to_srgb(c.clamp(0.0, 1.0)))));
        }
    }
    bytes
}
