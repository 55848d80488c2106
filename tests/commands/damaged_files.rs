//! Hundreds of damaged files of every format that a scene may name, through the built program: each is refused with a message that says where, or read
//! after all, within two seconds of one processor and 1 GiB of memory, and nothing is left behind. Seeds are fixed; a table says what became of them.

mod structure;

use std::io::{Cursor, Write};

use self::structure::{Structure, is_text};
use crate::program::faults::{Faults, Orderly, Renders};
use crate::program::{Folder, HEAD};
use lanternfish::film::exr::write_exr;
use lanternfish::film::{ChannelImage, PixelBounds};
use lanternfish::math::sampler::Stream;

/// Damaged files made of each whole one.
const EACH: usize = 32;

/// Copies of `whole`: cut short at even distances, with bits flipped, with numbers replaced by the largest and least there are, and where it is text with
/// words replaced by such as no one means.
fn damaged(whole: &[u8], seed: u64) -> Vec<Vec<u8>> {
    let mut stream = Stream::from_seed(seed);
    let mut below = |n: usize| ((stream.next_f32() * n as f32) as usize).min(n.saturating_sub(1));
    let is_text = is_text(whole);
    let words: Vec<(usize, usize)> = {
        let mut words = Vec::new();
        let mut start = None;
        for (i, byte) in whole.iter().enumerate() {
            match (byte.is_ascii_whitespace(), start) {
                (false, None) => start = Some(i),
                (true, Some(from)) => {
                    words.push((from, i));
                    start = None;
                }
                _ => {}
            }
        }
        words
    };
    (0..EACH)
        .map(|number| {
            let mut copy = whole.to_vec();
            match number % 4 {
                0 => copy.truncate(whole.len() * (number / 4) / (EACH / 4)),
                1 => {
                    for _ in 0..=below(4) {
                        copy[below(whole.len())] ^= 1 << below(8);
                    }
                }
                2 if is_text && !words.is_empty() => {
                    const NONSENSE: [&str; 8] =
                        ["1e999", "-1", "nan", "4294967295", "999999999999999999999", "[", "\"", "0"];
                    let (from, to) = words[below(words.len())];
                    copy.splice(from..to, NONSENSE[below(NONSENSE.len())].bytes());
                }
                _ => {
                    const NUMBERS: [u32; 5] = [u32::MAX, i32::MAX as u32, 1 << 31, 0, 0x7f80_0000];
                    let at = below(whole.len().saturating_sub(4).max(1));
                    let end = (at + 4).min(whole.len());
                    copy[at..end].copy_from_slice(&NUMBERS[below(NUMBERS.len())].to_le_bytes()[..end - at]);
                }
            }
            copy
        })
        .collect()
}

/// Renders a scene that says `text` with each damaged copy of the file `name` in turn, and tells what came of them.
fn survive(format: &'static str, name: &str, whole: &[u8], text: &str, seed: u64) {
    survive_in(format, name, whole, &format!("{HEAD}{text}\n"), seed);
}

/// The same of a whole scene.
fn survive_in(format: &'static str, name: &str, whole: &[u8], scene: &str, seed: u64) {
    let at_random = damaged(whole, seed).into_iter().enumerate();
    let at_random = at_random.map(|(number, copy)| (format!("damaged in way {number}"), copy));
    let copies = at_random.chain(Structure::of(format, whole).damaged(whole));
    survive_copies(format, name, whole, scene, copies);
}

fn survive_copies(
    format: &'static str,
    name: &str,
    whole: &[u8],
    scene: &str,
    copies: impl IntoIterator<Item = (String, Vec<u8>)>,
) {
    let folder = Folder::new("damaged");
    folder.write("scene.pbrt", scene);
    let mut faults = Faults::default();
    // Whole, it is read.
    folder.write(name, whole);
    faults.render(&folder, name, Renders);
    for (what, copy) in copies {
        folder.write(name, &copy);
        faults.render(&folder, &format!("{name}, {what}"), Orderly);
    }
    faults.tell(format);
}

const LIT: &str = "LightSource \"infinite\"";

fn picture(format: image::ImageFormat) -> Vec<u8> {
    let pixels = image::RgbImage::from_fn(16, 16, |x, y| image::Rgb([x as u8 * 16, y as u8 * 8, 128]));
    let mut bytes = Cursor::new(Vec::new());
    pixels.write_to(&mut bytes, format).expect("it can be encoded");
    bytes.into_inner()
}

/// As textures, where what cannot be read is magenta, and as lights, where it is refused.
fn survive_image(format: &'static str, whole: &[u8], seed: u64) {
    let name = &format!("a.{format}");
    let texture = format!(
        "{LIT}\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\""
    );
    survive(format, name, whole, &texture, seed);
    let light = format!("LightSource \"infinite\" \"string filename\" \"{name}\"\nShape \"sphere\"");
    survive(format, name, whole, &light, seed + 1);
}

#[test]
fn damaged_scenes_are_survived() {
    let scene = "MakeNamedMaterial \"m\" \"string type\" \"conductor\" \"float roughness\" 0.2\nNamedMaterial \"m\"\nAttributeBegin\nTranslate 0 1 0\n\
                 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"integer indices\" [0 1 2 2 1 3]\nAttributeEnd\n\
                 LightSource \"point\" \"rgb I\" [1 2 3]\nObjectBegin \"o\" Shape \"sphere\" \"float radius\" 0.3 ObjectEnd ObjectInstance \"o\"\n";
    survive("pbrt", "junk", scene.as_bytes(), "Include \"junk\"", 1);
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gz.write_all(scene.as_bytes()).expect("it can be packed");
    survive("pbrt.gz", "junk", &gz.finish().expect("it can be packed"), "Include \"junk\"", 2);
}

#[test]
fn damaged_meshes_are_survived() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let text = format!("{}0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 2 1 3\n", header("ascii"));
    let shape = format!("{LIT}\nShape \"plymesh\" \"string filename\" \"mesh.ply\"");
    survive("ply", "mesh.ply", text.as_bytes(), &shape, 3);
    let mut binary = header("binary_little_endian").into_bytes();
    for v in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0] {
        binary.extend(v.to_le_bytes());
    }
    for face in [[0i32, 1, 2], [2, 1, 3]] {
        binary.push(3);
        face.iter().for_each(|i| binary.extend(i.to_le_bytes()));
    }
    survive("ply", "mesh.ply", &binary, &shape, 4);
}

#[test]
fn damaged_images_are_survived() {
    survive_image("png", &picture(image::ImageFormat::Png), 10);
    survive_image("jpg", &picture(image::ImageFormat::Jpeg), 20);
    survive_image("tga", &picture(image::ImageFormat::Tga), 30);
    survive_image("bmp", &picture(image::ImageFormat::Bmp), 32);
    survive_image("qoi", &picture(image::ImageFormat::Qoi), 34);
    survive_image("gif", &picture(image::ImageFormat::Gif), 38);
    survive_image("ppm", &picture(image::ImageFormat::Pnm), 36);
    let mut hdr = Cursor::new(Vec::new());
    let radiance: Vec<image::Rgb<f32>> = (0..256).map(|i| image::Rgb([i as f32, 0.5, 100.0])).collect();
    image::codecs::hdr::HdrEncoder::new(&mut hdr).encode(&radiance, 16, 16).expect("it can be encoded");
    survive_image("hdr", &hdr.into_inner(), 40);
    let mut pfm = b"PF\n16 16\n-1.0\n".to_vec();
    (0..256 * 3).for_each(|i| pfm.extend((i as f32).to_le_bytes()));
    survive_image("pfm", &pfm, 50);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    let bounds = PixelBounds::full(16, 16);
    let plane = |scale: f32| (0..256).map(|i| i as f32 * scale).collect::<Vec<f32>>();
    let channels = vec![("R".into(), plane(1.0)), ("G".into(), plane(2.0)), ("B".into(), plane(0.5))];
    write_exr(&path, ChannelImage { bounds, display: bounds, channels, attributes: vec![] }).expect("written");
    survive_image("exr", &std::fs::read(&path).expect("it is there"), 60);
}

#[test]
fn damaged_descriptions_of_lamps_lenses_and_volumes_are_survived() {
    let ies = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 1 5 2 1 2 0 0 0\n1 1 50\n0 30 60 90 180\n0 90\n100 80 40 10 0\n100 70 30 10 0\n";
    survive("ies", "a.ies", ies.as_bytes(), "LightSource \"point\" \"string ies\" \"a.ies\"\nShape \"sphere\"", 70);
    let volume = "LightSource \"infinite\"\nMakeNamedMedium \"m\" \"string type\" \"nanovdb\" \"string filename\" \"a.nvdb\" \"float scale\" 0.01\n\
                  MediumInterface \"m\" \"\" Material \"interface\" Shape \"sphere\" \"float radius\" 20";
    survive("nvdb", "a.nvdb", include_bytes!("../data/nanovdb/density-fp8.nvdb"), volume, 80);
    survive("nvdb", "a.nvdb", include_bytes!("../data/nanovdb/density-blosc.nvdb"), volume, 81);
}

/// A lens stands in the head of a scene, so it has one of its own.
#[test]
fn damaged_lenses_are_survived() {
    let lens = "# a lens\n100 10 1.5 20\n-100 5 1 20\n0 80 0 8\n";
    let scene = "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6 Sampler \"zsobol\" \"integer pixelsamples\" 2\n\
                 Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"float focusdistance\" 5\nWorldBegin LightSource \"infinite\" Shape \"sphere\"";
    survive_in("lens", "lens.dat", lens.as_bytes(), scene, 90);
}

/// Cut between their parts, and with grids, blocks and ends that are where they cannot be. At random they are damaged in `bad_input`.
#[cfg(feature = "openvdb")]
#[test]
fn damaged_sparse_volumes_are_survived() {
    use openvdb::{Compression, Precision, VdbWriter};
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.vdb");
    let mut writer = VdbWriter::new().expect("a writer");
    for name in ["density", "flame"] {
        writer.fog_grid(name, Precision::Single, 0.0, 0.125, [-1.0; 3]).expect("a grid");
        writer.dense([0; 3], [16; 3], 0.0, |x, y, z| (x + y * z) as f32 * 0.01).expect("voxels");
    }
    writer.write(&path, Compression::Blosc).expect("a file");
    let whole = std::fs::read(&path).expect("it is there");
    let text = "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"a.vdb\" \"string emission\" \"flame\"\n\
                Material \"interface\" MediumInterface \"m\" \"\" Shape \"sphere\" \"float radius\" 3\n";
    let structure = Structure::of("vdb", &whole);
    assert_eq!(structure.offsets.len(), 2 * 3 + 3, "each grid has three places, and names have lengths");
    // Texts of 1.4 GB, for which OpenVDB would make room before it looks whether they are there.
    let long = structure.offsets.iter().filter(|offset| offset.bytes == 4);
    let long = long.map(|offset| ("long".to_owned(), offset.with(&whole, 0x5555_5555)));
    let copies = structure.damaged(&whole).into_iter().chain(long);
    survive_copies("vdb", "a.vdb", &whole, &format!("{HEAD}{text}"), copies);
}
