//! Files that are valid, or nearly, and small, and come to monstrous things: each renders within two seconds of one processor and 1 GiB of memory, or is
//! refused with a message. Volumes are in `monstrous_volumes`.

use std::fmt::Write as _;
use std::io::Write;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use crate::program::faults::*;
use crate::program::{Folder, HEAD};

/// What stands in the scene after the usual head, files beside it, and what must come of it.
type Monster<'a> = (&'a str, String, &'a [(&'a str, Vec<u8>)], Fate);

fn render(name: &str, monsters: &[Monster<'_>]) {
    render_within(name, monsters, 2);
}

fn render_within(name: &str, monsters: &[Monster<'_>], seconds: u32) {
    let folder = Folder::new(name);
    let mut faults = Faults::default();
    for (what, text, files, fate) in monsters {
        for (name, content) in *files {
            folder.write(name, content);
        }
        folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
        faults.render_within(&folder, what, *fate, seconds);
        println!("{what:<44} {}", faults.tally());
    }
}

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(text).and_then(|()| encoder.finish()).expect("it is packed")
}

#[test]
fn nesting_and_repetition() {
    let included = |line: &str, lines: usize| vec![("a", line.repeat(lines).into_bytes())];
    let includes = |count: usize| "Include \"a\"\n".repeat(count);
    // Each file includes the next one twice.
    let doubling: Vec<(String, Vec<u8>)> = (0..40)
        .map(|i| (format!("d{i}"), format!("Include \"d{0}\"\nInclude \"d{0}\"\n", i + 1).into_bytes()))
        .collect();
    let mut doubling: Vec<(&str, Vec<u8>)> = doubling.iter().map(|(n, c)| (n.as_str(), c.clone())).collect();
    doubling.push(("d40", b"Shape \"sphere\"\n".to_vec()));
    render(
        "nesting",
        &[
            ("a million attribute blocks", "AttributeBegin ".repeat(1_000_000), &[], Limit("blocks within")),
            (
                "a million brackets",
                format!("Shape \"sphere\" \"float radius\" {}", "[".repeat(1_000_000)),
                &[],
                Refused(""),
            ),
            ("includes that double", "Include \"d0\"".into(), &doubling, Limit("")),
            ("a million blocks", includes(1000), &included("AttributeBegin AttributeEnd\n", 1000), Orderly),
            ("a million lamps", includes(1000), &included("LightSource \"point\"\n", 1000), Orderly),
        ],
    );
}

/// What hundreds of thousands of shapes cost is what they are worth; that they fit into memory is what matters.
#[test]
fn a_great_many_shapes() {
    let triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";
    let object = format!("ObjectBegin \"o\" {triangle} ObjectEnd\n");
    let included = |line: &str| vec![("a", line.repeat(1000).into_bytes())];
    let includes = |thousands: usize| "Include \"a\"\n".repeat(thousands);
    render_within(
        "million",
        &[
            ("500,000 triangles, a shape each", includes(500), &included(triangle), Orderly),
            ("200,000 spheres", includes(200), &included("Shape \"sphere\"\n"), Orderly),
            ("200,000 materials", includes(200), &included("Material \"diffuse\" Shape \"sphere\"\n"), Orderly),
            ("200,000 instances", format!("{object}{}", includes(200)), &included("ObjectInstance \"o\"\n"), Orderly),
        ],
        20,
    );
}

#[test]
fn objects_within_objects() {
    let mut deep = String::from("ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd\n");
    for i in 1..100_000 {
        let _ = writeln!(deep, "ObjectBegin \"o{i}\" ObjectInstance \"o{}\" ObjectEnd", i - 1);
    }
    let mut wide = String::from("ObjectBegin \"o0\" Shape \"sphere\" ObjectEnd\n");
    for i in 1..60 {
        let line = format!("ObjectInstance \"o{}\" ", i - 1).repeat(3);
        let _ = writeln!(wide, "ObjectBegin \"o{i}\" {line} ObjectEnd");
    }
    render(
        "objects",
        &[
            ("objects 100,000 deep", format!("{deep}ObjectInstance \"o99999\""), &[], Limit("within each other")),
            ("objects that come to 3^59", format!("{wide}ObjectInstance \"o59\""), &[], Limit("parts")),
            ("objects that come to 3^9, twice", format!("{wide}{}", "ObjectInstance \"o9\" ".repeat(2)), &[], Orderly),
        ],
    );
}

#[test]
fn meshes() {
    let same = |count: usize, index: u32| format!("{index} ").repeat(3 * count);
    let mesh = |indices: &str| {
        format!("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [{indices}]")
    };
    let light = |shape: String| format!("AreaLightSource \"diffuse\"\n{shape}");
    let face = "3 0 0 0\n".repeat(300_000);
    let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 300000\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n";
    let ply = format!("{header}{face}").into_bytes();
    let subdivided = |levels: u32| {
        format!(
            "Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \"integer levels\" {levels}"
        )
    };
    render(
        "meshes",
        &[
            ("300,000 triangles without area", mesh(&same(300_000, 1)), &[], Orderly),
            ("300,000 triangles without area that shine", light(mesh(&same(300_000, 1))), &[], Orderly),
            ("300,000 times one triangle", mesh(&"0 1 2 ".repeat(300_000)), &[], Orderly),
            ("300,000 times one triangle that shines", light(mesh(&"0 1 2 ".repeat(300_000))), &[], Orderly),
            (
                "a packed mesh of one point",
                "Shape \"plymesh\" \"string filename\" \"m.ply\"".into(),
                &[("m.ply", gzip(&ply))],
                Orderly,
            ),
            ("a surface of 262,144 triangles", subdivided(9), &[], Orderly),
            ("a surface of more triangles than are allowed", subdivided(13), &[], Refused("levels")),
        ],
    );
}

/// A PNG of the given size and kind of colour whose rows are all 0: deflate makes a thousandth of them.
fn png(width: u32, height: u32, bits: u8, colour: u8, rows: u32) -> Vec<u8> {
    let crc_of = |kind: &[u8], data: &[u8]| {
        let mut crc = flate2::Crc::new();
        crc.update(kind);
        crc.update(data);
        crc.sum()
    };
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        file.extend((data.len() as u32).to_be_bytes());
        file.extend(kind);
        file.extend(data);
        file.extend(crc_of(kind, data).to_be_bytes());
    };
    let channels = if colour == 2 { 3 } else { 1 };
    chunk(b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, colour, 0, 0, 0]].concat());
    let row = vec![0; 1 + (width as usize * channels * usize::from(bits)).div_ceil(8)];
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    (0..rows).for_each(|_| encoder.write_all(&row).expect("it is packed"));
    chunk(b"IDAT", &encoder.finish().expect("it is packed"));
    chunk(b"IEND", &[]);
    file
}

/// The beginning of an OpenEXR file of one part with `channels` channels of half precision, and nothing behind it.
fn exr(width: i32, height: i32, channels: usize) -> Vec<u8> {
    exr_header(width, height, channels, 3)
}

/// An OpenEXR file of one row in three channels, in blocks of 32 rows (B44), the first of which says that it has so many bytes.
fn exr_block(width: i32, bytes: i32) -> Vec<u8> {
    let mut file = exr_header(width, 1, 3, 6);
    let first = file.len() as u64 + 8;
    file.extend(first.to_le_bytes());
    file.extend([0, bytes].iter().flat_map(|x: &i32| x.to_le_bytes()));
    file
}

/// `compression` as the format numbers them.
fn exr_header(width: i32, height: i32, channels: usize, compression: u8) -> Vec<u8> {
    let mut file = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            file.extend(text.bytes());
            file.push(0);
        }
        file.extend((value.len() as i32).to_le_bytes());
        file.extend(value);
    };
    let mut list = vec![];
    for i in 0..channels {
        list.extend(format!("c{i:05}\0").bytes());
        list.extend([1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    list.push(0);
    let window: Vec<u8> = [0, 0, width - 1, height - 1].iter().flat_map(|x: &i32| x.to_le_bytes()).collect();
    attribute("channels", "chlist", &list);
    attribute("compression", "compression", &[compression]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    file.push(0);
    file
}

#[test]
fn pictures() {
    let texture = |name: &str| {
        format!(
            "LightSource \"infinite\"\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\""
        )
    };
    let light = |name: &str| format!("LightSource \"infinite\" \"string filename\" \"{name}\"\nShape \"sphere\"");
    // No compression, true colours, 24 bits a pixel.
    let tga = [&[0, 0, 2][..], &[0; 9], &60_000u16.to_le_bytes(), &60_000u16.to_le_bytes(), &[24, 0]].concat();
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n\x02\x02\xea\x60".to_vec();
    let mut jpg = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(16, 16).write_to(&mut jpg, image::ImageFormat::Jpeg).expect("it can be encoded");
    let mut jpg = jpg.into_inner();
    let frame = jpg.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("it has a frame");
    jpg[frame + 5..frame + 9].copy_from_slice(&[0xff, 0xf0, 0xff, 0xf0]);
    let files: &[(&str, &str, Vec<u8>)] = &[
        ("a PNG of 60,000 × 60,000", "a.png", png(60_000, 60_000, 8, 2, 1)),
        ("a PNG of 60,000 × 60,000, whole, 1 bit", "b.png", png(60_000, 60_000, 1, 0, 60_000)),
        ("a PNG of 16,000 × 16,000, whole, 1 bit", "c.png", png(16_000, 16_000, 1, 0, 16_000)),
        ("a PNG of 16,000 × 16,000, whole, 8 bits", "d.png", png(16_000, 16_000, 8, 0, 16_000)),
        ("an OpenEXR of 60,000 × 60,000", "a.exr", exr(60_000, 60_000, 3)),
        ("an OpenEXR of 16,000 × 16,000", "b.exr", exr(16_000, 16_000, 3)),
        ("an OpenEXR of 1,000 × 1,000, 2000 channels", "c.exr", exr(1000, 1000, 2000)),
        ("an OpenEXR of 5,500,000 × 1, a block of 1 GB", "d.exr", exr_block(5_500_000, 1_050_000_000)),
        ("a PFM of 60,000 × 60,000", "a.pfm", b"PF\n60000 60000\n-1\n".to_vec()),
        ("a TGA of 60,000 × 60,000", "a.tga", tga),
        ("an HDR of 60,000 × 60,000", "a.hdr", hdr),
        ("a JPEG of 65,520 × 65,520", "a.jpg", jpg),
    ];
    let folder = Folder::new("pictures");
    let mut faults = Faults::default();
    for (what, name, content) in files {
        folder.write(name, content);
        // A texture that cannot be read is magenta, a light is refused.
        for text in [texture(name), light(name)] {
            folder.write("scene.pbrt", format!("{HEAD}{text}\n"));
            faults.render(&folder, what, Orderly);
        }
        println!("{what:<44} {} bytes: {}", content.len(), faults.tally());
    }
}

#[test]
fn packed_files() {
    let spaces = gzip(&vec![b' '; 16 << 20]);
    // What is packed may be in many pieces.
    let many = spaces.repeat(40);
    let shapes = gzip("Shape \"sphere\"\n".repeat(60_000_000 / 15).as_bytes());
    let lamps = gzip("LightSource \"point\"\n".repeat(60_000_000 / 20).as_bytes());
    let numbers = gzip(format!("Shape \"trianglemesh\" \"point3 P\" [{}]", "0 ".repeat(30_000_000)).as_bytes());
    let header = b"ply\nformat binary_little_endian 1.0\nelement vertex 5000000\nproperty float x\nproperty float y\nproperty float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = gzip(&[&header[..], &vec![0; 60_000_000]].concat());
    let include = "Include \"junk\"".to_owned();
    render(
        "packed",
        &[
            ("640 MiB of blanks", include.clone(), &[("junk", many.clone())], Limit("unpacks")),
            (
                "640 MiB of blanks as a mesh",
                "Shape \"plymesh\" \"string filename\" \"junk\"".into(),
                &[("junk", many)],
                Limit("unpacks"),
            ),
            ("60 MB of spheres", include.clone(), &[("junk", shapes)], Orderly),
            ("60 MB of lamps", include.clone(), &[("junk", lamps)], Orderly),
            ("60 MB of numbers", include, &[("junk", numbers)], Orderly),
            (
                "5 million times one vertex",
                "Shape \"plymesh\" \"string filename\" \"junk\"".into(),
                &[("junk", ply)],
                Orderly,
            ),
        ],
    );
}
