//! Writes the files that fuzzing begins with, small ones of every kind, to `fuzz/corpus`:
//!
//! ```text
//! cargo run --manifest-path fuzz/Cargo.toml --example seeds
//! ```

use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    Vec2, WritableImage, f16,
};
use image::codecs::hdr::HdrEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use lanternfish_openvdb::wire::{Kind, send_grid};
use lanternfish_openvdb::{GridClass, GridHeader, GridMap, GridValues, Tile, VdbGrid};

fn put(target: &str, name: &str, content: impl AsRef<[u8]>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    fs::create_dir_all(&folder).and_then(|()| fs::write(folder.join(name), content)).expect("it is written");
}

fn packed(text: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(text).and_then(|()| encoder.finish()).expect("it is packed")
}

const SCENE: &str = r#"LookAt 0 0 -5  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 8 "integer yresolution" 6
Sampler "zsobol" "integer pixelsamples" 2
Option "bool disablewavelengthjitter" true
ColorSpace "aces2065-1"
WorldBegin
Attribute "shape" "float radius" 2 "string lights" ["a" "b"]
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_s" [.1 .2 .3] "float g" 0.3
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [0.8 0.1 0.1]
Texture "t" "spectrum" "scale" "rgb tex" [0.5 0.5 0.5] "float scale" 2
AttributeBegin AreaLightSource "diffuse" "blackbody L" 3000 Shape "sphere" AttributeEnd
CoordinateSystem "here" Rotate 30 0 1 0 Scale 1 2 3 ActiveTransform EndTime Translate 1 0 0
ActiveTransform All CoordSysTransform "here"
LightSource "spot" "point3 from" [0 3 -3] "spectrum I" "s"
ObjectBegin "o" NamedMaterial "red" Shape "disk" ObjectEnd ObjectInstance "o"
MediumInterface "fog" "" Material "mix" "string materials" ["red" "red"]
Shape "trianglemesh" "point3 P" [-5 -1 -5 5 -1 -5 5 -1 5] "integer indices" [0 1 2]
"#;

fn scenes() {
    put("pbrt", "scene", format!("{SCENE}\0\0\x00400 1 700 2\n"));
    put(
        "pbrt",
        "included",
        "Film \"rgb\"\nInclude \"a\" Import \"b\"\0WorldBegin Include \"b\"\0# more\nShape \"sphere\"",
    );
    put("pbrt", "circle", "Include \"a\"\0Include \"b\"\0Include \"a\"");
    put(
        "pbrt",
        "spectra",
        "WorldBegin LightSource \"distant\" \"spectrum L\" [\"s\" \"stdillum-D65\"]\0\0\x00400 1\n500,2 # x\n",
    );
    put(
        "pbrt",
        "strings",
        "Option \"string msereferenceimage\" \"a\\n\\\"b\\\\\"\nTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]\nWorldBegin",
    );
    put("pbrt", "packed.gz", packed(b"WorldBegin\nShape \"sphere\" \"float radius\" [ 2.5e0 ]\n"));
}

fn meshes() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    put("ply", "ascii", header("ascii") + "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n1 1 0 1 1\n3 0 1 2\n4 0 1 3 2\n");
    for (name, is_big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = header(name).into_bytes();
        let float = |v: f32| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
        for [x, y] in [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            bytes.extend([float(x), float(y)].concat());
            bytes.extend([0; 8]);
            bytes.extend([float(x), float(y)].concat());
        }
        for face in [&[0i32, 1, 2][..], &[0, 1, 3, 2]] {
            bytes.push(face.len() as u8);
            face.iter().for_each(|i| bytes.extend(if is_big { i.to_be_bytes() } else { i.to_le_bytes() }));
        }
        put("ply", name, bytes);
    }
    let odd = "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement other 1\r\nproperty list uint float q\r\nproperty char r\r\nelement vertex 1\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n2 1 2 3\r\n1 2 3\r\n";
    put("ply", "odd", odd);
}

fn pictures() {
    let picture = RgbImage::from_fn(9, 5, |x, y| Rgb([x as u8 * 16, y as u8 * 8, 128]));
    let all = DynamicImage::ImageRgb8(picture);
    let kinds = [
        ("rgb", all.clone()),
        ("grey", DynamicImage::ImageLuma8(all.to_luma8())),
        ("grey-alpha", DynamicImage::ImageLumaA8(all.to_luma_alpha8())),
        ("rgba", DynamicImage::ImageRgba8(all.to_rgba8())),
        ("rgb16", DynamicImage::ImageRgb16(all.to_rgb16())),
    ];
    for (name, picture) in kinds {
        for (ending, format) in [
            ("png", ImageFormat::Png),
            ("tga", ImageFormat::Tga),
            ("bmp", ImageFormat::Bmp),
            ("qoi", ImageFormat::Qoi),
            ("gif", ImageFormat::Gif),
            ("pnm", ImageFormat::Pnm),
        ] {
            let mut bytes = Cursor::new(Vec::new());
            if picture.write_to(&mut bytes, format).is_ok() {
                put("image", &format!("{name}.{ending}"), bytes.into_inner());
            }
        }
    }
    for (name, picture) in [("rgb.jpg", all.clone()), ("grey.jpg", DynamicImage::ImageLuma8(all.to_luma8()))] {
        let mut bytes = Vec::new();
        picture.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, 60)).expect("it can be encoded");
        put("image", name, bytes);
    }
    for (name, text) in [("bits.pbm", "P1 # c\n3 2\n1 0 1\n010\n"), ("words.ppm", "P3 2 1 1023\n0 512 1023 1 2 3\n")] {
        put("image", name, text);
    }
    let packed = b"P7\nWIDTH 2\nHEIGHT 1\nDEPTH 2\nMAXVAL 255\nTUPLTYPE GRAYSCALE_ALPHA\nENDHDR\n\x01\x80\xff\x00";
    put("image", "grey-alpha.pam", packed);
    let mut hdr = Vec::new();
    let radiance: Vec<Rgb<f32>> = (0..16 * 3).map(|i| Rgb([i as f32, 0.5, 100.0])).collect();
    HdrEncoder::new(&mut hdr).encode(&radiance, 16, 3).expect("it can be encoded");
    put("image", "rgb.hdr", hdr);
    for (name, head, count) in [("rgb.pfm", "PF\n4 3\n-1.0\n", 36), ("grey.pfm", "Pf\n4 3\n2.0\n", 12)] {
        let mut bytes = head.as_bytes().to_vec();
        (0..count).for_each(|i| bytes.extend((i as f32).to_le_bytes()));
        put("image", name, bytes);
    }
}

fn layers() {
    let (width, height) = (7, 5);
    let value = |i: usize| (i * i % 11) as f32 * 0.25;
    let floats = FlatSamples::F32((0..width * height).map(value).collect());
    let halves = FlatSamples::F16((0..width * height).map(|i| f16::from_f32(value(i))).collect());
    let whole = FlatSamples::U32((0..width * height).map(|i| i as u32).collect());
    let all = [
        ("none", Compression::Uncompressed),
        ("rle", Compression::RLE),
        ("zip1", Compression::ZIP1),
        ("zip16", Compression::ZIP16),
        ("piz", Compression::PIZ),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("b44a", Compression::B44A),
    ];
    for (name, compression) in all {
        for (kind, blocks) in [("lines", Blocks::ScanLines), ("tiles", Blocks::Tiles(Vec2(4, 4)))] {
            let list = [("R", &floats), ("G", &halves), ("B", &halves), ("id", &whole)]
                .into_iter()
                .map(|(name, samples)| AnyChannel::new(name, samples.clone()));
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let channels = AnyChannels::sort(list.collect());
            let layer = Layer::new((width, height), LayerAttributes::named("layer"), encoding, channels);
            let mut bytes = Cursor::new(Vec::new());
            if Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).is_ok() {
                put("exr", &format!("{name}-{kind}.exr"), bytes.into_inner());
            }
        }
    }
}

fn lamps_lenses_and_spectra() {
    let c = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 1 5 2 1 2 0 0 0\n1 1 50\n0 30 60 90 180\n0 90\n100 80 40 10 0\n100 70 30 10 0\n";
    put("ies", "c", c);
    put(
        "ies",
        "b-tilted",
        "IESNA91\nTILT=INCLUDE\n1\n3\n0 45 90\n1 .8 .5\n1 -1 2 3 3 2 1 .1 .1 0 1 1 50\n-90 0 90\n-90 0 90\n1 2 3 4 5 6 7 8 9\n",
    );
    put("ies", "a-beside", "TILT=tilt.txt\n1,1000,1,2,2,3,1,0,0,0,1,1,50\n0 90\n0 45\n1 2\n3 4\n\x001 2\n0 90\n1 .5\n");
    put(
        "ies",
        "ring",
        "IES:LM-63-2019\nTILT=NONE\n1 -1 1 2 5 1 1 0 0 0 1 1 1\n0 180\n0 90 180 270 360\n1 2 3 4 5 6 7 8 9 10\n",
    );
    put("text", "lens", "# a lens\n100 10 1.5 20\n-100 5 1 20\n0 80 0 8\n");
    put("text", "spectrum", "400 1.5\n500,2e0 # green\n\t700 -0\r\n");
}

/// A frame as the target `worker` takes it.
fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    [&[kind], &(payload.len() as u16).to_le_bytes()[..], payload].concat()
}

fn answers() {
    let identity: [f64; 16] = std::array::from_fn(|i| f64::from(u8::from(i % 5 == 0)));
    let header = GridHeader {
        name: "density".into(),
        index: 0,
        type_name: "Tree_float_5_4_3".into(),
        value_type: "float".into(),
        class: GridClass::FogVolume,
        map_name: "AffineMap".into(),
        map: GridMap::Affine(identity),
        background: [0.0; 3],
        active_voxels: 512,
        index_bounds: Some(([0; 3], [7; 3])),
        saved_as_half: false,
        was_level_set: false,
        leaf_count: 1,
        tile_count: 2,
        skipped: None,
        metadata: vec![("creator".into(), "x".into())],
    };
    let tile = |origin, size| Tile { origin, size, value: [0.5, 0.0, 0.0], active: true };
    let affine = VdbGrid {
        header,
        leaf_origins: vec![[-8, 0, 8]],
        values: GridValues::F32(vec![0.25; 512]),
        tiles: vec![tile([128, 0, 0], 128), tile([0, 4096, 0], 4096)],
    };
    let mut frustum = affine.clone();
    frustum.header.map = GridMap::Frustum { min: [0.0; 3], max: [16.0; 3], taper: 0.5, depth: 1.0, second: identity };
    for (name, grid) in [("affine", affine), ("frustum", frustum)] {
        let mut sent = Vec::new();
        send_grid(&mut sent, &grid).expect("there is room");
        let mut short = Vec::new();
        let mut rest = sent.as_slice();
        while let [kind, length @ ..] = rest {
            let length = u64::from_le_bytes(length[..8].try_into().expect("eight bytes")) as usize;
            let payload = &rest[9..9 + length];
            if *kind == Kind::Values as u8 {
                // 512 times the same.
                short.extend([kind - 1 | 0x80, 4, 0, 0, 2]);
                short.extend(&payload[..4]);
            } else {
                short.extend(frame(kind - 1, payload));
            }
            rest = &rest[9 + length + 8..];
        }
        short.extend(frame(Kind::End as u8 - 1, &[]));
        put("worker", name, short);
    }
    put("worker", "refused", frame(Kind::Error as u8 - 1, b"Ddamaged"));
}

fn main() {
    scenes();
    meshes();
    pictures();
    layers();
    lamps_lenses_and_spectra();
    answers();
    // The target's own list of changes; whole files are those of the tests.
    put("nvdb", "changed", b"P\x10\x00\x00\x84\x01\x00\x00\x00");
}
