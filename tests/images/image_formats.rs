//! Images as textures, from every kind of file that is read: the values that a scene gets are those that the file means, whatever it stores them as. They are read
//! off the layer `albedo` of a plate that fills the image, a texel a pixel. Nothing is random but where in a texel a sample falls.

use std::io::Write;
use std::path::Path;

use exr::prelude::*;
use image::codecs::{
    bmp::BmpEncoder, hdr::HdrEncoder, jpeg::JpegEncoder, png::PngEncoder, qoi::QoiEncoder, tga::TgaEncoder,
};
use image::{ExtendedColorType, ImageEncoder};

use lanternfish::render::TextureLevels;

use crate::common::{Options, render_text};

/// Texels of the test image: two rows of three, from the top.
const WIDTH: usize = 3;
const HEIGHT: usize = 2;
const COUNT: usize = WIDTH * HEIGHT;

/// The albedo of a plate with the texture that `parameters` state, pixel by pixel from the top.
fn albedo(kind: &str, parameters: &str) -> Vec<[f32; 3]> {
    // A plate from (0, 0) to (3, 2) texels, seen so that a pixel is a texel; a float texture weighs white against black.
    let material = match kind {
        "float" => {
            "MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"texture reflectance\" \"c\" NamedMaterial \"m\""
                .to_owned()
        }
        _ => "Material \"diffuse\" \"texture reflectance\" \"t\"".to_owned(),
    };
    let weighed = if kind == "float" {
        "Texture \"c\" \"spectrum\" \"scale\" \"rgb tex\" [1 1 1] \"texture scale\" \"t\""
    } else {
        ""
    };
    let text = format!(
        "LookAt 0 0 -1  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [0 1 0 1]\n\
         Film \"rgb\" \"integer xresolution\" {WIDTH} \"integer yresolution\" {HEIGHT}\n\
         PixelFilter \"box\" \"float xradius\" 0.1 \"float yradius\" 0.1\nWorldBegin\nLightSource \"infinite\"\n\
         Texture \"t\" \"{kind}\" \"imagemap\" \"string filter\" \"point\" {parameters}\n{weighed}\n{material}\n\
         Shape \"bilinearmesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 0]\n"
    );
    let texture_levels = TextureLevels::Finest;
    let options = Options { spp: 1, max_depth: Some(1), texture_levels, ..Options::default() };
    let outcome = render_text(&text, &options);
    let image = outcome.film.channels();
    let channels = ["albedo.R", "albedo.G", "albedo.B"].map(|name| image.channel(name).expect("albedo").to_vec());
    (0..COUNT).map(|i| [0, 1, 2].map(|c| channels[c][i])).collect()
}

#[track_caller]
fn assert_albedo(what: &str, kind: &str, parameters: &str, expected: &[[f32; 3]], tolerance: f32) {
    let found = albedo(kind, parameters);
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let off = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f32::max);
        assert!(off <= tolerance, "{what}: texel {i} is {found:?}, expected {expected:?}");
    }
}

/// A colour for each texel, all different, as bytes.
fn bytes() -> Vec<[u8; 3]> {
    (0..COUNT as u8).map(|i| [20 + 30 * i, 250 - 40 * i, 100 + 9 * i]).collect()
}

fn linear(stored: f32) -> f32 {
    if stored <= 0.04045 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) }
}

/// The colours of bytes after `decode`.
fn decoded(decode: impl Fn(f32) -> f32) -> Vec<[f32; 3]> {
    bytes().iter().map(|rgb| rgb.map(|c| decode(f32::from(c) / 255.0))).collect()
}

fn named(path: &Path, more: &str) -> String {
    format!("\"string filename\" \"{}\" {more}", path.display())
}

/// A PNG of indices into a palette, which the encoder at hand does not write.
fn palette_png() -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |name: &[u8; 4], data: &[u8]| {
        png.extend((data.len() as u32).to_be_bytes());
        let mut crc = flate2::Crc::new();
        crc.update(name);
        crc.update(data);
        png.extend(name);
        png.extend(data);
        png.extend(crc.sum().to_be_bytes());
    };
    let mut header = [WIDTH as u32, HEIGHT as u32].map(u32::to_be_bytes).concat();
    header.extend([8, 3, 0, 0, 0]);
    chunk(b"IHDR", &header);
    // The colours backwards, and indices that count backwards.
    let palette: Vec<u8> = bytes().into_iter().rev().flatten().collect();
    chunk(b"PLTE", &palette);
    let rows: Vec<u8> = (0..HEIGHT)
        .flat_map(|y| std::iter::once(0).chain((0..WIDTH).map(move |x| (COUNT - 1 - y * WIDTH - x) as u8)))
        .collect();
    let mut packed = flate2::write::ZlibEncoder::new(vec![], flate2::Compression::default());
    packed.write_all(&rows).expect("memory");
    chunk(b"IDAT", &packed.finish().expect("memory"));
    chunk(b"IEND", &[]);
    png
}

#[test]
fn images_of_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let flat: Vec<u8> = bytes().concat();
    let size = (WIDTH as u32, HEIGHT as u32);
    let write = |name: &str, content: Vec<u8>| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("it can be written");
        path
    };
    let png = |data: &[u8], colour| {
        let mut out = vec![];
        PngEncoder::new(&mut out).write_image(data, size.0, size.1, colour).expect("a PNG");
        out
    };
    let srgb = decoded(linear);
    let rgb8 = write("rgb8.png", png(&flat, ExtendedColorType::Rgb8));
    assert_albedo("PNG", "spectrum", &named(&rgb8, ""), &srgb, 1e-6);
    // Encodings, whatever the file.
    assert_albedo("sRGB", "spectrum", &named(&rgb8, "\"string encoding\" \"sRGB\""), &srgb, 1e-6);
    assert_albedo("linear", "spectrum", &named(&rgb8, "\"string encoding\" \"linear\""), &decoded(|v| v), 1e-6);
    assert_albedo(
        "gamma",
        "spectrum",
        &named(&rgb8, "\"string encoding\" \"gamma 2.2\""),
        &decoded(|v| v.powf(2.2)),
        1e-6,
    );
    // Scaled, then inverted.
    let with = |more: &str| named(&rgb8, &format!("\"string encoding\" \"linear\" {more}"));
    assert_albedo("scale", "spectrum", &with("\"float scale\" 0.5"), &decoded(|v| 0.5 * v), 1e-6);
    assert_albedo("invert", "spectrum", &with("\"bool invert\" true"), &decoded(|v| 1.0 - v), 1e-6);
    let both = with("\"bool invert\" true \"float scale\" 1.5");
    assert_albedo("both", "spectrum", &both, &decoded(|v| (1.0 - 1.5 * v).max(0.0)), 1e-6);

    let wide: Vec<u8> = flat.iter().flat_map(|&b| (u16::from(b) * 257).to_ne_bytes()).collect();
    assert_albedo(
        "16 bits",
        "spectrum",
        &named(&write("16.png", png(&wide, ExtendedColorType::Rgb16)), ""),
        &srgb,
        2e-5,
    );
    assert_albedo("palette", "spectrum", &named(&write("palette.png", palette_png()), ""), &srgb, 1e-6);
    let greys: Vec<u8> = bytes().iter().map(|rgb| rgb[0]).collect();
    let grey = |decode: fn(f32) -> f32| -> Vec<[f32; 3]> {
        greys.iter().map(|&g| [decode(f32::from(g) / 255.0); 3]).collect()
    };
    assert_albedo(
        "grey",
        "spectrum",
        &named(&write("l8.png", png(&greys, ExtendedColorType::L8)), ""),
        &grey(linear),
        1e-6,
    );
    let wide: Vec<u8> = greys.iter().flat_map(|&b| (u16::from(b) * 257).to_ne_bytes()).collect();
    assert_albedo(
        "16-bit grey",
        "spectrum",
        &named(&write("l16.png", png(&wide, ExtendedColorType::L16)), ""),
        &grey(linear),
        2e-5,
    );

    // With alpha: colours leave it out; a float is the grey, or of colours the alpha, unless that is 1 all over; alpha is never decoded.
    let alphas: Vec<u8> = (0..COUNT as u8).map(|i| 40 * i).collect();
    let alpha: Vec<[f32; 3]> = alphas.iter().map(|&a| [f32::from(a) / 255.0; 3]).collect();
    let la: Vec<u8> = greys.iter().zip(&alphas).flat_map(|(&g, &a)| [g, a]).collect();
    let la = write("la8.png", png(&la, ExtendedColorType::La8));
    assert_albedo("grey with alpha", "spectrum", &named(&la, ""), &grey(linear), 1e-6);
    assert_albedo("grey beside alpha", "float", &named(&la, ""), &grey(linear), 1e-6);
    let rgba: Vec<u8> = bytes().iter().zip(&alphas).flat_map(|(rgb, &a)| [rgb[0], rgb[1], rgb[2], a]).collect();
    let rgba8 = write("rgba8.png", png(&rgba, ExtendedColorType::Rgba8));
    assert_albedo("RGBA", "spectrum", &named(&rgba8, ""), &srgb, 1e-6);
    assert_albedo("alpha", "float", &named(&rgba8, ""), &alpha, 1e-6);
    let opaque: Vec<u8> = bytes().iter().flat_map(|rgb| [rgb[0], rgb[1], rgb[2], 255]).collect();
    let opaque = write("opaque.png", png(&opaque, ExtendedColorType::Rgba8));
    let means: Vec<[f32; 3]> = srgb.iter().map(|rgb| [rgb.iter().sum::<f32>() / 3.0; 3]).collect();
    assert_albedo("opaque", "float", &named(&opaque, ""), &means, 1e-6);

    let mut tga = vec![];
    TgaEncoder::new(&mut tga).write_image(&flat, size.0, size.1, ExtendedColorType::Rgb8).expect("a TGA");
    assert_albedo("TGA", "spectrum", &named(&write("i.tga", tga.clone()), ""), &srgb, 1e-6);
    assert_albedo("TGA in capitals", "spectrum", &named(&write("I.TGA", tga), ""), &srgb, 1e-6);
    let mut bmp = vec![];
    BmpEncoder::new(&mut bmp).write_image(&flat, size.0, size.1, ExtendedColorType::Rgb8).expect("a BMP");
    assert_albedo("BMP", "spectrum", &named(&write("i.bmp", bmp), ""), &srgb, 1e-6);
    let mut qoi = vec![];
    QoiEncoder::new(&mut qoi).write_image(&flat, size.0, size.1, ExtendedColorType::Rgb8).expect("a QOI");
    assert_albedo("QOI", "spectrum", &named(&write("i.qoi", qoi), ""), &srgb, 1e-6);
    // JPEG keeps smooth images: one colour, which it rounds.
    let one: Vec<u8> = [200u8, 100, 50].repeat(COUNT);
    let mut jpeg = vec![];
    JpegEncoder::new_with_quality(&mut jpeg, 100)
        .write_image(&one, size.0, size.1, ExtendedColorType::Rgb8)
        .expect("a JPEG");
    let expected = vec![[200u8, 100, 50].map(|c| linear(f32::from(c) / 255.0)); COUNT];
    assert_albedo("JPEG", "spectrum", &named(&write("i.jpg", jpeg), ""), &expected, 0.01);
}

/// Netpbm's formats: packed and in words, of bits, bytes and 16-bit integers, with a comment and with alpha.
#[test]
fn images_of_netpbm() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("it can be written");
        path
    };
    let flat: Vec<u8> = bytes().concat();
    let words = |values: &[u8], factor: u32| {
        values.iter().map(|&v| (u32::from(v) * factor).to_string()).collect::<Vec<_>>().join(" ")
    };
    let srgb = decoded(linear);
    let packed = [b"P6\n# from afar\n3 2\n255\n", flat.as_slice()].concat();
    assert_albedo("P6", "spectrum", &named(&write("p6.ppm", &packed), ""), &srgb, 1e-6);
    let text = format!("P3 3 2 255\n{}\n", words(&flat, 1));
    assert_albedo("P3", "spectrum", &named(&write("p3.ppm", text.as_bytes()), ""), &srgb, 1e-6);
    let text = format!("P3 3 2 65535\n{}\n", words(&flat, 257));
    assert_albedo("P3 of 16 bits", "spectrum", &named(&write("wide.ppm", text.as_bytes()), ""), &srgb, 2e-5);
    let greys: Vec<u8> = bytes().iter().map(|rgb| rgb[0]).collect();
    let grey: Vec<[f32; 3]> = greys.iter().map(|&v| [linear(f32::from(v) / 255.0); 3]).collect();
    let packed = [b"P5 3 2 255\n", greys.as_slice()].concat();
    assert_albedo("P5", "spectrum", &named(&write("p5.pgm", &packed), ""), &grey, 1e-6);
    // A bit that is set is black; rows begin at whole bytes.
    let bits = [0.0, 1.0, 0.0, 1.0, 1.0, 0.0].map(|v| [v; 3]);
    assert_albedo("P4", "spectrum", &named(&write("p4.pbm", b"P4 3 2\n\xa0\x20"), ""), &bits, 1e-6);
    let rgba: Vec<u8> = bytes().iter().zip(0u8..).flat_map(|(rgb, i)| [rgb[0], rgb[1], rgb[2], 40 * i]).collect();
    let header = b"P7\nWIDTH 3\nHEIGHT 2\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n";
    let alpha: Vec<[f32; 3]> = (0..COUNT).map(|i| [40.0 * i as f32 / 255.0; 3]).collect();
    let pam = write("p7.pam", &[header, rgba.as_slice()].concat());
    assert_albedo("P7", "spectrum", &named(&pam, ""), &srgb, 1e-6);
    assert_albedo("P7's alpha", "float", &named(&pam, ""), &alpha, 1e-6);
}

/// What files of floats hold: values that bytes cannot.
fn floats() -> Vec<[f32; 3]> {
    (0..COUNT).map(|i| [0.125 + 0.0625 * i as f32, 0.5 - 0.03125 * i as f32, 0.75]).collect()
}

#[test]
fn images_of_floats() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let values = floats();
    let pixel = |p: Vec2<usize>| values[p.y() * WIDTH + p.x()];
    let size = Vec2(WIDTH, HEIGHT);
    for (name, encoding) in [
        (
            "scan lines",
            Encoding { blocks: Blocks::ScanLines, line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS },
        ),
        ("tiles", Encoding { blocks: Blocks::Tiles(Vec2(2, 2)), ..Encoding::FAST_LOSSLESS }),
        (
            "packed",
            Encoding { compression: Compression::PIZ, line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS },
        ),
        ("plain", Encoding::UNCOMPRESSED),
    ] {
        let path = at("i.exr");
        let half = SpecificChannels::rgb(|p: Vec2<usize>| {
            let [r, g, b] = pixel(p).map(f16::from_f32);
            (r, g, b)
        });
        Image::from_encoded_channels(size, encoding, half).write().to_file(&path).expect("an EXR");
        assert_albedo(&format!("half, {name}"), "spectrum", &named(&path, ""), &values, 1e-6);
        let float = SpecificChannels::rgb(|p: Vec2<usize>| {
            let [r, g, b] = pixel(p);
            (r, g, b)
        });
        Image::from_encoded_channels(size, encoding, float).write().to_file(&path).expect("an EXR");
        assert_albedo(&format!("float, {name}"), "spectrum", &named(&path, ""), &values, 1e-6);
    }
    // Luminance alone, and with alpha beside the colours.
    let greys: Vec<[f32; 3]> = values.iter().map(|v| [v[0]; 3]).collect();
    let y = SpecificChannels::build().with_channel::<f32>("Y").with_pixel_fn(|p: Vec2<usize>| (pixel(p)[0],));
    Image::from_channels(size, y).write().to_file(at("y.exr")).expect("an EXR");
    assert_albedo("Y", "spectrum", &named(&at("y.exr"), ""), &greys, 1e-6);
    assert_albedo("Y", "float", &named(&at("y.exr"), ""), &greys, 1e-6);
    let rgba = SpecificChannels::rgba(|p: Vec2<usize>| (pixel(p)[0], pixel(p)[1], pixel(p)[2], 0.25f32));
    Image::from_channels(size, rgba).write().to_file(at("rgba.exr")).expect("an EXR");
    assert_albedo("RGBA", "spectrum", &named(&at("rgba.exr"), ""), &values, 1e-6);
    assert_albedo("A", "float", &named(&at("rgba.exr"), ""), &[[0.25; 3]; COUNT], 1e-6);
    // What floats are said to be, they are.
    let squared: Vec<[f32; 3]> = values.iter().map(|v| v.map(|c| c * c)).collect();
    assert_albedo("gamma", "spectrum", &named(&at("rgba.exr"), "\"string encoding\" \"gamma 2\""), &squared, 1e-6);

    let hdr: Vec<image::Rgb<f32>> = values.iter().map(|v| image::Rgb(*v)).collect();
    let file = std::fs::File::create(at("i.hdr")).expect("a file");
    HdrEncoder::new(file).encode(&hdr, WIDTH, HEIGHT).expect("an HDR");
    // Eight bits of mantissa, shared.
    assert_albedo("HDR", "spectrum", &named(&at("i.hdr"), ""), &values, 4e-3);

    for (name, scale) in [("little.pfm", "-1.0"), ("big.pfm", "1.0")] {
        // Rows go up.
        let mut pfm = format!("PF\n{WIDTH} {HEIGHT}\n{scale}\n").into_bytes();
        for v in values.chunks(WIDTH).rev().flatten().flatten() {
            pfm.extend(if scale == "1.0" { v.to_be_bytes() } else { v.to_le_bytes() });
        }
        std::fs::write(at(name), pfm).expect("it can be written");
        assert_albedo(name, "spectrum", &named(&at(name), ""), &values, 1e-6);
    }
}

/// Beyond the edge: the image again, black, or the nearest texel.
#[test]
fn what_lies_beyond_the_edge() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("i.pfm");
    let values = floats();
    let mut pfm = format!("PF\n{WIDTH} {HEIGHT}\n-1.0\n").into_bytes();
    values.chunks(WIDTH).rev().flatten().flatten().for_each(|v| pfm.extend(v.to_le_bytes()));
    std::fs::write(&path, pfm).expect("it can be written");
    // Two texels to the right and one up.
    let moved = "\"float udelta\" 0.6666667 \"float vdelta\" 0.5";
    for (wrap, beyond) in [("repeat", None), ("clamp", Some(false)), ("black", Some(true))] {
        let expected: Vec<[f32; 3]> = (0..COUNT)
            .map(|i| {
                let (x, y) = ((i % WIDTH) as i32 + 2, (i / WIDTH) as i32 - 1);
                let inside = x < WIDTH as i32 && y >= 0;
                let at = |x: i32, y: i32| values[y as usize * WIDTH + x as usize];
                match beyond {
                    None => at(x.rem_euclid(WIDTH as i32), y.rem_euclid(HEIGHT as i32)),
                    Some(true) if !inside => [0.0; 3],
                    Some(_) => at(x.clamp(0, WIDTH as i32 - 1), y.clamp(0, HEIGHT as i32 - 1)),
                }
            })
            .collect();
        let parameters = named(&path, &format!("\"string wrap\" \"{wrap}\" {moved}"));
        assert_albedo(wrap, "spectrum", &parameters, &expected, 1e-6);
    }
}
