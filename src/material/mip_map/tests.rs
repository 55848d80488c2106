//! Images from files: in memory and tile by tile they are the same to the last bit, and what cannot be read is told.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::memory::{TextureMemory, TextureSettings};
use super::*;
use crate::film::stored_image::read_header;
use crate::scene::{FileId, SceneErrorKind, Warnings};

const SPAN: Span = Span { file: FileId(0), line: 3, column: 1, length: 1 };

fn memory(limit: u64, folder: Option<PathBuf>, strict: bool) -> Arc<TextureMemory> {
    Arc::new(TextureMemory::new(TextureSettings { limit, folder }, strict))
}

fn open(path: &Path, encoding: Encoding, memory: &Arc<TextureMemory>) -> MipMap {
    let header = read_header(path).expect("a header");
    MipMap::new(path.to_owned(), encoding, SPAN, "nothing is used instead", &header, memory)
}

/// Images of all kinds of values and channels, larger than a tile and of odd sizes.
fn images(folder: &Path) -> Vec<PathBuf> {
    let (width, height) = (150, 67);
    let byte = |x: u32, y: u32, c: u32| ((x * 7 + y * 13 + c * 101) % 256) as u8;
    let save = |name: &str, image: image::DynamicImage| {
        let path = folder.join(name);
        image.save(&path).expect("the image can be written");
        path
    };
    let grey = image::GrayImage::from_fn(width, height, |x, y| image::Luma([byte(x, y, 0)]));
    let rgb = image::RgbImage::from_fn(width, height, |x, y| image::Rgb([0, 1, 2].map(|c| byte(x, y, c))));
    let rgba = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba([0, 1, 2, 3].map(|c| byte(x, y, c))));
    let opaque = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba([byte(x, y, 0), byte(x, y, 1), 9, 255]));
    let deep: image::ImageBuffer<image::Rgb<u16>, Vec<u16>> =
        image::ImageBuffer::from_fn(width, height, |x, y| image::Rgb([x as u16 * 400, y as u16 * 900, 77]));
    let grey_alpha = image::GrayAlphaImage::from_fn(width, height, |x, y| image::LumaA([0, 1].map(|c| byte(x, y, c))));
    let wide = |x: u32, y: u32, c: u32| u16::from(byte(x, y, c)) * 113 + y as u16;
    let deep_grey: image::ImageBuffer<image::LumaA<u16>, Vec<u16>> =
        image::ImageBuffer::from_fn(width, height, |x, y| image::LumaA([wide(x, y, 0), wide(x, y, 1)]));
    let deep_opaque: image::ImageBuffer<image::Rgba<u16>, Vec<u16>> =
        image::ImageBuffer::from_fn(width, height, |x, y| image::Rgba([wide(x, y, 0), 0, 9, u16::MAX]));
    // Black and white are halves without loss.
    let coarse: image::ImageBuffer<image::Rgb<u16>, Vec<u16>> = image::ImageBuffer::from_fn(width, height, |x, y| {
        image::Rgb([0, 1, 2].map(|c| 0xffff * ((x + y + c) as u16 % 2)))
    });
    let hdr = image::Rgb32FImage::from_fn(width, height, |x, y| image::Rgb([x as f32 * 0.3, y as f32, 0.125]));
    vec![
        save("grey.png", grey.into()),
        save("rgb.png", rgb.into()),
        save("rgba.png", rgba.into()),
        save("opaque.png", opaque.into()),
        save("deep.png", deep.into()),
        save("light.hdr", hdr.into()),
        save("grey-alpha.png", grey_alpha.into()),
        save("deep-grey.png", deep_grey.into()),
        save("deep-opaque.png", deep_opaque.into()),
        save("coarse.png", coarse.into()),
    ]
}

/// All texels of all levels.
fn all(map: &MipMap) -> Vec<[f32; 4]> {
    let view = map.view().expect("it can be read");
    let mut texels = vec![];
    for (number, level) in view.levels().iter().enumerate() {
        for y in 0..level.height {
            texels.extend((0..level.width).map(|x| view.texel(number, x, y)));
        }
    }
    texels
}

#[test]
fn tiles_hold_what_memory_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = folder.path().join("tiles");
    std::fs::create_dir(&kept).expect("a folder");
    for path in images(folder.path()) {
        for encoding in [Encoding::Auto, Encoding::Linear, Encoding::Gamma(1.8)] {
            let ample = memory(1 << 30, None, true);
            let resident = open(&path, encoding, &ample);
            ample.settle([&resident].into_iter(), &mut Warnings::default());
            assert!(resident.resident() > 0 && resident.resident() as u64 <= resident.whole());
            let expected = all(&resident);
            // Without a folder; with one that is empty; with what is there from the time before.
            for folder in [None, Some(kept.clone()), Some(kept.clone())] {
                let short = memory(9000, folder, true);
                let tiles = open(&path, encoding, &short);
                short.settle([&tiles].into_iter(), &mut Warnings::default());
                assert_eq!(all(&tiles), expected, "{path:?} {encoding:?}");
                assert_eq!((tiles.resident(), short.has_failed()), (0, false));
                assert!(short.statistics().expect("there is a cache").reads > 0);
            }
        }
    }
    let count = std::fs::read_dir(&kept).expect("a folder").count();
    assert_eq!(count, 30, "each image in each encoding has a file");
}

#[test]
fn rows_make_tiles_whatever_their_number() {
    let folder = tempfile::tempdir().expect("a folder");
    for (width, height) in [(1, 1), (3, 200), (200, 3), (64, 64), (129, 131), (255, 257), (256, 512), (65, 128)] {
        let path = folder.path().join(format!("{width}x{height}.png"));
        let image = image::RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
        image.save(&path).expect("the image can be written");
        let [ample, short] = [1 << 30, 1].map(|limit| memory(limit, None, true));
        let [resident, tiles] = [&ample, &short].map(|memory| open(&path, Encoding::Auto, memory));
        for (memory, map) in [(&ample, &resident), (&short, &tiles)] {
            memory.settle([map].into_iter(), &mut Warnings::default());
        }
        assert_eq!(all(&tiles), all(&resident), "{width} × {height}");
    }
}

#[test]
fn images_that_must_be_read_as_a_whole_are_named_where_that_takes_too_much() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = image::RgbImage::from_fn(600, 400, |x, y| image::Rgb([x as u8, y as u8, 7]));
    for (name, limit, named) in
        [("a.png", 9000, false), ("a.jpg", 9000, true), ("a.tga", 9000, true), ("a.jpg", 4_000_000, false)]
    {
        let path = folder.path().join(name);
        image.save(&path).expect("the image can be written");
        let memory = memory(limit, Some(folder.path().join("tiles")), true);
        let [first, second] = [(); 2].map(|()| open(&path, Encoding::Auto, &memory));
        let mut warnings = Warnings::default();
        // The second has others fill the memory.
        let others: Vec<MipMap> = (0..5).map(|_| open(&path, Encoding::Auto, &memory)).collect();
        memory.settle([&first].into_iter().chain(&others), &mut warnings);
        assert_eq!(!warnings.list().is_empty(), named, "{name} {limit}: {warnings:?}");
        if let [warning] = warnings.list() {
            assert!(warning.message.contains(name) && warning.message.contains("--texture-memory"), "{warning:?}");
            assert_eq!(warning.span, Some(SPAN));
            // Once there are tiles, nothing has to be cut.
            assert!(first.view().is_some());
            let mut later = Warnings::default();
            memory.settle([&second].into_iter(), &mut later);
            assert!(later.list().is_empty(), "{later:?}");
        }
    }
}

#[test]
fn kept_tiles_that_are_damaged_or_of_another_image_are_made_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let kept = folder.path().join("tiles");
    std::fs::create_dir(&kept).expect("a folder");
    let path = images(folder.path())[1].clone();
    let read = || {
        let short = memory(9000, Some(kept.clone()), true);
        let map = open(&path, Encoding::Auto, &short);
        short.settle([&map].into_iter(), &mut Warnings::default());
        all(&map)
    };
    let expected = read();
    let file = std::fs::read_dir(&kept).expect("a folder").next().expect("a file").expect("a file").path();
    let good = std::fs::read(&file).expect("a file");
    for length in [0, 4, 11, 12, 60, 4095, 4097, good.len() - 1] {
        std::fs::write(&file, &good[..length]).expect("written");
        assert_eq!(read(), expected, "{length}");
    }
    for (place, byte) in [(0, b'X'), (8, 0xff), (11, 0xff), (14, b'!'), (30, b'"')] {
        let mut bad = good.clone();
        bad[place] = byte;
        std::fs::write(&file, bad).expect("written");
        assert_eq!(read(), expected, "{place}");
        assert_eq!(std::fs::read(&file).expect("a file"), good, "{place}");
    }
    // Another image of the same name has another time or length.
    let white = image::RgbImage::from_pixel(150, 67, image::Rgb([255; 3]));
    white.save(&path).expect("written");
    assert!(read().iter().all(|texel| texel[0] == 1.0));
}

#[test]
fn what_cannot_be_read_or_kept_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = images(folder.path())[1].clone();
    let whole = std::fs::read(&path).expect("a file");
    std::fs::write(&path, &whole[..whole.len() / 2]).expect("written");
    for limit in [1 << 30, 9000] {
        let ample = memory(limit, None, false);
        let map = open(&path, Encoding::Auto, &ample);
        ample.settle([&map].into_iter(), &mut Warnings::default());
        assert!(map.view().is_none());
        let mut warnings = Warnings::default();
        ample.report(&mut warnings).expect("only warnings");
        let [warning] = warnings.list() else { panic!("{warnings:?}") };
        assert!(warning.message.contains("rgb.png") && warning.message.contains("nothing is used"), "{warning:?}");
        assert_eq!((warning.span, ample.has_failed()), (Some(SPAN), false));

        let strict = memory(limit, None, true);
        let map = open(&path, Encoding::Auto, &strict);
        strict.settle([&map].into_iter(), &mut Warnings::default());
        assert!(map.view().is_none() && strict.has_failed());
        let error = strict.report(&mut warnings).expect_err("it is an error");
        assert!(matches!(error.kind, SceneErrorKind::File { .. }), "{error}");
    }
    std::fs::write(&path, &whole).expect("written");
    let nowhere = memory(9000, Some(path.join("tiles")), false);
    let map = open(&path, Encoding::Auto, &nowhere);
    nowhere.settle([&map].into_iter(), &mut Warnings::default());
    assert!(map.view().is_none() && nowhere.has_failed());
    let error = nowhere.report(&mut Warnings::default()).expect_err("it is an error");
    assert!(error.help.as_deref().is_some_and(|help| help.contains("--texture-cache")), "{error:?}");
}
