//! Tests of accumulation, filters, settings and files.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::exr::{read_exr_layers, write_exr};
use super::image::{Encoding, Image, linear_to_srgb, read_image, read_image_bytes, srgb_to_linear, write_png};
use super::png_rows::PngRows;
use super::stored_image::{Values, read_header, read_stored};
use super::*;
use crate::math::Rgb;
use crate::math::sampler::Stream;
use crate::scene::{Entity, FileId, Param, ParamSet, ParamValue, SceneErrorKind, Span, Warnings};

pub(crate) const NOWHERE: Span = Span { file: FileId(0), line: 1, column: 1, length: 0 };

pub(crate) fn entity(kind: &str, params: Vec<(&str, &str, ParamValue)>) -> Entity {
    let params = params.into_iter().map(|(n, t, v)| Param::new(n, t, v, NOWHERE)).collect();
    Entity { kind: kind.into(), params: ParamSet::new(kind, NOWHERE, params) }
}

pub(crate) fn scene(camera: Entity, film: Entity, filter: Entity) -> crate::scene::SceneDescription {
    let fixed = crate::math::transform::Animated::fixed(glam::DMat4::IDENTITY);
    crate::scene::SceneDescription {
        base: PathBuf::new(),
        camera,
        camera_transform: fixed,
        camera_medium: String::new(),
        film,
        film_color_space: "srgb",
        filter,
        sampler: entity("", vec![]),
        integrator: entity("", vec![]),
        options: ParamSet::new("Option", NOWHERE, vec![]),
        transform_times: [0.0, 1.0],
        shapes: vec![],
        objects: vec![],
        instances: vec![],
        lights: vec![],
        area_lights: vec![],
        materials: vec![],
        media: vec![],
        textures: vec![],
        systems: vec![],
    }
}

pub(crate) fn film_settings(film: Vec<(&str, &str, ParamValue)>, overrides: &FilmOverrides) -> FilmSettings {
    let scene = scene(entity("perspective", vec![]), entity("rgb", film), entity("box", vec![]));
    FilmSettings::build(&scene, overrides, &mut Warnings::default()).expect("valid settings")
}

fn size(width: i32, height: i32) -> Vec<(&'static str, &'static str, ParamValue)> {
    vec![
        ("xresolution", "integer", ParamValue::Integer(vec![width])),
        ("yresolution", "integer", ParamValue::Integer(vec![height])),
    ]
}

fn filters() -> Vec<PixelFilter> {
    vec![
        PixelFilter::Box { radius: Vec2::new(0.5, 1.5) },
        PixelFilter::Triangle { radius: Vec2::new(2.0, 0.75) },
        PixelFilter::gaussian(Vec2::new(1.5, 2.0), 0.5),
        PixelFilter::gaussian(Vec2::new(1.0, 1.0), 1e9),
        PixelFilter::gaussian(Vec2::new(100.0, 3.0), 0.2),
    ]
}

/// Mass and second moment along one axis by the midpoint rule.
fn marginal(filter: &PixelFilter, axis: usize, from: f64, to: f64) -> (f64, f64) {
    let n = 20_000;
    let (mut mass, mut second) = (0.0, 0.0);
    for i in 0..n {
        let x = from + (to - from) * (f64::from(i) + 0.5) / f64::from(n);
        let at = if axis == 0 { Vec2::new(x as f32, 0.0) } else { Vec2::new(0.0, x as f32) };
        let value = f64::from(filter.evaluate(at)) * (to - from) / f64::from(n);
        mass += value;
        second += value * x * x;
    }
    (mass, second)
}

#[test]
fn filter_moments_match_numeric_integration() {
    // An equidistant u integrates the inverse distribution by the midpoint rule, without noise.
    for (index, filter) in filters().iter().enumerate().filter(|(i, _)| *i != 3) {
        for axis in 0..2 {
            let radius = f64::from(filter.radius()[axis]).min(6.0);
            let (mass, second) = marginal(filter, axis, -radius, radius);
            let n = 1 << 18;
            let (mut mean, mut square) = (0.0, 0.0);
            for i in 0..n {
                let u = (i as f32 + 0.5) / n as f32;
                let x = f64::from(filter.sample([u, u], || 0.5).offset[axis]);
                mean += x / f64::from(n);
                square += x * x / f64::from(n);
            }
            assert!(mean.abs() < 1e-5, "filter {index} axis {axis}: mean {mean}");
            let expected = second / mass;
            assert!((square / expected - 1.0).abs() < 2e-4, "filter {index} axis {axis}: {square} for {expected}");
        }
    }
}

#[test]
fn a_very_wide_gaussian_is_a_parabola() {
    // exp(−x²/2σ²) − exp(−r²/2σ²) → (r² − x²)/2σ²: second moment r²/5.
    let filter = &filters()[3];
    let n = 1 << 16;
    let square: f64 = (0..n)
        .map(|i| f64::from(filter.sample([(i as f32 + 0.5) / n as f32, 0.5], || 0.5).offset.x).powi(2))
        .sum::<f64>()
        / n as f64;
    assert!((square - 0.2).abs() < 1e-4, "{square}");
}

/// χ² of independent samples against the filter, 24 × 24 cells. False-alarm rate 1e-4 per filter; the seed is fixed.
#[test]
fn filter_samples_follow_the_filter() {
    const CELLS: usize = 24;
    for (index, filter) in filters().iter().enumerate().take(3) {
        let radius = filter.radius();
        let n = 400_000;
        let mut observed = vec![0u32; CELLS * CELLS];
        let mut stream = Stream::from_seed(index as u64);
        for _ in 0..n {
            let p = filter.sample([stream.next_f32(), stream.next_f32()], || 0.5).offset;
            assert!(p.abs().cmple(radius).all(), "{p} outside of {radius}");
            let cell = ((p / radius * 0.5 + 0.5) * CELLS as f32)
                .floor()
                .as_ivec2()
                .clamp(glam::IVec2::ZERO, glam::IVec2::splat(CELLS as i32 - 1));
            observed[cell.y as usize * CELLS + cell.x as usize] += 1;
        }
        let shares = |axis: usize| -> Vec<f64> {
            let r = f64::from(radius[axis]);
            let edge = |i: usize| -r + 2.0 * r * i as f64 / CELLS as f64;
            let masses: Vec<f64> = (0..CELLS).map(|i| marginal(filter, axis, edge(i), edge(i + 1)).0).collect();
            let total: f64 = masses.iter().sum();
            masses.iter().map(|m| m / total).collect()
        };
        let (across, down) = (shares(0), shares(1));
        let (mut chi2, mut cells, mut rest) = (0.0, 0usize, (0.0, 0.0));
        for (i, &count) in observed.iter().enumerate() {
            let expected = across[i % CELLS] * down[i / CELLS] * f64::from(n);
            if expected < 5.0 {
                rest = (rest.0 + f64::from(count), rest.1 + expected);
            } else {
                chi2 += (f64::from(count) - expected).powi(2) / expected;
                cells += 1;
            }
        }
        if rest.1 > 5.0 {
            chi2 += (rest.0 - rest.1).powi(2) / rest.1;
            cells += 1;
        }
        let p = ChiSquared::new((cells - 1) as f64).expect("more than one cell").sf(chi2);
        assert!(p > 1e-4, "filter {index}: chi2 {chi2} over {cells} cells, p = {p}");
    }
}

fn sample(value: f32) -> SampleResult {
    SampleResult { beauty: Rgb::splat(value), depth: f32::INFINITY, ..SampleResult::default() }
}

#[test]
fn passes_of_any_size_give_the_same_moments() {
    let mut stream = Stream::from_seed(5);
    let values: Vec<f32> = (0..4096).map(|_| 1000.0 + stream.next_f32()).collect();
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / 4096.0;
    let squares = values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>();
    for pass in [1usize, 3, 64, 4096] {
        let mut film = Film::new(film_settings(size(1, 1), &FilmOverrides::default()), true);
        for chunk in values.chunks(pass) {
            let mut samples = PixelSamples::new(Sensor::default());
            chunk.iter().for_each(|&v| samples.add(0, &sample(v)));
            film.tiles_mut()[0].merge([0, 0], &samples);
        }
        let moments = film.tiles[0].beauty[0];
        assert_eq!(moments.count, 4096);
        assert!((moments.mean.x / mean - 1.0).abs() < 1e-14);
        assert!((moments.squares.x / squares - 1.0).abs() < 1e-9, "pass size {pass}");
        let variance = moments.variance_of_mean().y;
        assert!((variance / (squares / 4095.0 / 4096.0) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_million_samples_lose_nothing() {
    // 2^20 samples of 1 and 1 + 2^-20 in turn, in passes of one: sums of f32 would lose the small part.
    let small = 1.0 + 1.0 / 1_048_576.0;
    let mut total = Moments::default();
    for i in 0..1u32 << 20 {
        let mut samples = PixelSamples::new(Sensor::default());
        samples.add(i, &sample(if i % 2 == 0 { 1.0 } else { small }));
        total.merge(&samples.beauty);
    }
    let expected = 0.5 * (1.0 + f64::from(small));
    assert!((total.mean.x - expected).abs() < 1e-13, "{}", total.mean.x - expected);
    let spread = (f64::from(small) - 1.0) / 2.0;
    let variance = total.squares.x / f64::from(1u32 << 20);
    assert!((variance / (spread * spread) - 1.0).abs() < 1e-6, "{variance}");
}

#[test]
fn samples_that_are_not_finite_are_counted_and_left_out() {
    let mut film = Film::new(film_settings(size(40, 20), &FilmOverrides::default()), true);
    let mut samples = PixelSamples::new(Sensor::default());
    samples.add(7, &sample(2.0));
    samples.add(8, &sample(f32::NAN));
    samples.add(9, &SampleResult { volume: Rgb::new(0.0, f32::INFINITY, 0.0), ..sample(1.0) });
    film.tiles_mut().last_mut().expect("tiles").merge([39, 19], &samples);
    assert_eq!(film.rejected(), (2, Some(RejectedSample { pixel: [39, 19], sample: 8 })));
    assert_eq!(film.sample_count(), 1);
    let picture = film.beauty();
    assert_eq!(picture.pixels[(19 * 40 + 39) * 3], 2.0);
    assert!(film.channels().channels.iter().all(|(_, values)| values.iter().all(|v| v.is_finite())));
}

#[test]
fn the_error_estimate_is_noise_over_signal() {
    let mut film = Film::new(film_settings(size(2, 1), &FilmOverrides::default()), false);
    assert_eq!(film.error_estimate(), None);
    for (x, values) in [(0, [1.0, 3.0]), (1, [4.0, 4.0])] {
        let mut samples = PixelSamples::new(Sensor::default());
        values.iter().for_each(|&v| samples.add(0, &sample(v)));
        film.tiles_mut()[0].merge([x, 0], &samples);
    }
    // Variances of the mean 1 and 0 (per channel), means 2 and 4.
    let expected = (1.0f64 / (4.0 + 16.0)).sqrt();
    assert!((film.error_estimate().expect("light") - expected).abs() < 1e-12);
}

#[test]
fn pixels_take_the_memory_that_is_documented() {
    assert_eq!((size_of::<Moments>(), size_of::<AovSums>()), (56, 160));
    assert_eq!((size_of::<super::signed::SignedSums>(), size_of::<super::gbuffer::SurfaceSums>()), (144, 112));
}

#[test]
fn tiles_cover_the_crop_once() {
    let overrides = FilmOverrides { crop: Some([0.1, 0.9, 0.3, 0.95]), ..FilmOverrides::default() };
    let mut film = Film::new(film_settings(size(101, 67), &overrides), false);
    let bounds = film.settings().bounds;
    let mut seen = vec![0; bounds.area()];
    for tile in film.tiles_mut() {
        tile.bounds().pixels().for_each(|p| seen[bounds.index(p)] += 1);
    }
    assert!(seen.iter().all(|&n| n == 1));
}

#[test]
fn settings_round_crops_as_pbrt_does() {
    let window = |v: Vec<f32>| {
        let mut film = size(10, 8);
        film.push(("cropwindow", "float", ParamValue::Float(v)));
        film_settings(film, &FilmOverrides::default()).bounds
    };
    assert_eq!(window(vec![0.25, 0.5, 0.0, 1.0]), PixelBounds { x0: 3, x1: 5, y0: 0, y1: 8 });
    let mut film = size(10, 8);
    film.push(("pixelbounds", "integer", ParamValue::Integer(vec![2, 6, 1, 20])));
    let overrides = FilmOverrides { resolution: Some([20, 16]), crop: None };
    assert_eq!(
        film_settings(film.clone(), &FilmOverrides::default()).bounds,
        PixelBounds { x0: 2, x1: 6, y0: 1, y1: 8 }
    );
    assert_eq!(film_settings(film, &overrides).bounds, PixelBounds { x0: 4, x1: 12, y0: 2, y1: 16 });
}

#[test]
fn settings_refuse_what_makes_no_sense() {
    let build = |camera: Entity, film: Entity| {
        FilmSettings::build(
            &scene(camera, film, entity("", vec![])),
            &FilmOverrides::default(),
            &mut Warnings::default(),
        )
    };
    let one = |name: &'static str, v: i32| entity("rgb", vec![(name, "integer", ParamValue::Integer(vec![v]))]);
    assert!(build(entity("", vec![]), one("xresolution", 0)).is_err());
    assert!(build(entity("", vec![]), entity("hologram", vec![])).is_err());
    let huge = build(entity("", vec![]), entity("rgb", size(100_000, 100_000))).expect_err("too large");
    assert!(matches!(huge.kind, SceneErrorKind::Limit(_)));
    let shut = entity("perspective", vec![("shutterclose", "float", ParamValue::Float(vec![0.0]))]);
    assert!(build(shut, entity("rgb", vec![])).is_err());
}

#[test]
fn the_sensor_scales_and_limits_as_pbrt_does() {
    let film = vec![
        ("iso", "float", ParamValue::Float(vec![200.0])),
        ("maxcomponentvalue", "float", ParamValue::Float(vec![5.0])),
    ];
    let camera = entity("perspective", vec![("shutterclose", "float", ParamValue::Float(vec![0.5]))]);
    let scene = scene(camera, entity("rgb", film), entity("", vec![]));
    let settings = FilmSettings::build(&scene, &FilmOverrides::default(), &mut Warnings::default()).expect("valid");
    assert_eq!(settings.sensor, Sensor { imaging_ratio: 1.0, max_component: 5.0, balance: None });
    let bright = SampleResult { beauty: Rgb::new(10.0, 4.0, 0.0), direct: Rgb::new(10.0, 4.0, 0.0), ..sample(0.0) };
    let exposed = settings.sensor.expose(&bright, 1.0);
    assert_eq!((exposed.beauty, exposed.direct), (Rgb::new(5.0, 2.0, 0.0), Rgb::new(5.0, 2.0, 0.0)));
    assert!(
        Film::new(settings, false).channels().attribute("lanternfish.biased").is_some_and(|note| note.contains('5'))
    );
    let unbiased = Film::new(film_settings(size(1, 1), &FilmOverrides::default()), false);
    assert_eq!(unbiased.channels().attribute("lanternfish.biased"), None);
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn exr_files_come_back_with_their_crop_and_attributes() {
    let dir = folder();
    let path = dir.path().join("a.exr");
    let overrides = FilmOverrides { crop: Some([0.25, 0.75, 0.5, 1.0]), ..FilmOverrides::default() };
    let mut film = Film::new(film_settings(size(40, 30), &overrides), true);
    for tile in film.tiles_mut() {
        for pixel in tile.bounds().pixels() {
            for (i, v) in [1.0f32, 2.0, 6.0].into_iter().enumerate() {
                let mut samples = PixelSamples::new(Sensor::default());
                let beauty = Rgb::new(v, pixel[0] as f32, pixel[1] as f32);
                samples.add(
                    i as u32,
                    &SampleResult {
                        beauty,
                        normal: Vec3::Z,
                        depth: if i == 0 { 4.0 } else { f32::INFINITY },
                        ..sample(0.0)
                    },
                );
                tile.merge(pixel, &samples);
            }
        }
    }
    let mut image = film.channels();
    image.attributes = vec![("command".into(), "render ünïcode.pbrt".into()), ("seed".into(), "7".into())];
    write_exr(&path, image.clone()).expect("written");
    let back = read_exr_layers(&path).expect("read");
    assert_eq!(back.bounds, PixelBounds { x0: 10, x1: 30, y0: 15, y1: 30 });
    assert_eq!(back.display, PixelBounds::full(40, 30));
    assert_eq!(back.attribute("command"), Some("render ünïcode.pbrt"));
    assert_eq!(back.channels.len(), image.channels.len());
    for (name, values) in &image.channels {
        assert_eq!(back.channel(name), Some(values.as_slice()), "{name}");
    }
    let corner = back.bounds.index([29, 15]);
    assert_eq!(back.channel("R").map(|v| v[corner]), Some(3.0));
    assert_eq!(back.rgb("").map(|[_, g, b]| (g[corner], b[corner])), Some((29.0, 15.0)));
    // Values 1, 2, 6: s² = 7, s²/n = 7/3.
    assert_eq!(back.channel("variance.R").map(|v| v[corner]), Some((7.0f64 / 3.0) as f32));
    assert_eq!(back.channel("depth.Z").map(|v| v[corner]), Some(4.0));
    assert_eq!(back.channel("samples").map(|v| v[corner]), Some(3.0));
    assert_eq!(back.channel("normal.Z").map(|v| v[corner]), Some(1.0));
}

#[test]
fn reference_images_are_readable() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/refs/r01_area.exr");
    if path.exists() {
        let image = read_exr_layers(&path).expect("readable");
        assert_eq!(image.bounds, PixelBounds::full(96, 72));
        assert!(image.rgb("").is_some() && image.rgb("variance").is_some());
    }
}

fn gradient(channels: usize) -> Image {
    let pixels = (0..16 * 4 * channels).map(|i| i as f32 / (16 * 4 * channels) as f32).collect();
    Image { width: 16, height: 4, channels, pixels }
}

#[test]
fn png_round_trips_within_half_a_step() {
    let dir = folder();
    for channels in [1, 3, 4] {
        let path = dir.path().join(format!("{channels}.png"));
        let image = gradient(channels);
        write_png(&path, &image, 0.0).expect("written");
        let stored = read_image(&path, Encoding::Linear).expect("read");
        assert_eq!((stored.width, stored.height, stored.channels), (16, 4, channels));
        for (i, (&byte, &linear)) in stored.pixels.iter().zip(&image.pixels).enumerate() {
            let expected = if channels == 4 && i % 4 == 3 { linear } else { linear_to_srgb(linear) };
            assert!((byte - expected).abs() <= 0.5 / 255.0 + 1e-6);
        }
        let decoded = read_image(&path, Encoding::Auto).expect("read");
        assert!(decoded.pixels.iter().zip(&image.pixels).all(|(a, b)| (a - b).abs() < 0.006));
    }
    // One stop doubles; values above 1 clip, NaN is black.
    let path = dir.path().join("exposed.png");
    let image = Image { width: 3, height: 1, channels: 1, pixels: vec![0.25, 3.0, f32::NAN] };
    write_png(&path, &image, 1.0).expect("written");
    let back = read_image(&path, Encoding::Linear).expect("read").pixels;
    assert!((back[0] - linear_to_srgb(0.5)).abs() < 0.5 / 255.0 + 1e-6);
    assert_eq!(back[1..], [1.0, 0.0]);
    assert_eq!(std::fs::read_dir(dir.path()).expect("folder").count(), 4, "no temporary files stay behind");
}

#[test]
fn srgb_is_its_own_inverse_and_meets_known_values() {
    assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
    for i in 0..=1000 {
        let v = i as f32 / 1000.0;
        assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-5);
    }
    assert!((Encoding::Gamma(2.0).to_linear(0.5) - 0.25).abs() < 1e-7);
}

/// One small file of each kind, written by hand or by the crate `image`.
fn samples_of_each_format(dir: &Path) -> Vec<PathBuf> {
    let write = |name: &str, bytes: &[u8]| {
        let path = dir.join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let encode = |format: ::image::ImageFormat| {
        let picture = ::image::RgbImage::from_fn(16, 8, |x, y| ::image::Rgb([x as u8 * 16, y as u8 * 32, 128]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("encoded");
        bytes.into_inner()
    };
    let mut hdr = std::io::Cursor::new(Vec::new());
    let radiance: Vec<::image::Rgb<f32>> = (0..16 * 8).map(|i| ::image::Rgb([i as f32, 0.5, 100.0])).collect();
    ::image::codecs::hdr::HdrEncoder::new(&mut hdr).encode(&radiance, 16, 8).expect("encoded");
    let mut pfm = b"PF\n16 8\n-1.0\n".to_vec();
    (0..16 * 8 * 3).for_each(|i| pfm.extend((i as f32).to_le_bytes()));
    let exr = dir.join("f.exr");
    let plane = |scale: f32| (0..128).map(|i| i as f32 * scale).collect::<Vec<f32>>();
    let bounds = PixelBounds::full(16, 8);
    let channels = vec![("R".into(), plane(1.0)), ("G".into(), plane(2.0)), ("B".into(), plane(-3.0))];
    write_exr(&exr, ChannelImage { bounds, display: bounds, channels, attributes: vec![] }).expect("written");
    vec![
        write("a.png", &encode(::image::ImageFormat::Png)),
        write("b.jpg", &encode(::image::ImageFormat::Jpeg)),
        write("c.tga", &encode(::image::ImageFormat::Tga)),
        write("c.bmp", &encode(::image::ImageFormat::Bmp)),
        write("c.qoi", &encode(::image::ImageFormat::Qoi)),
        write("c.gif", &encode(::image::ImageFormat::Gif)),
        write("c.ppm", &encode(::image::ImageFormat::Pnm)),
        write("d.hdr", &hdr.into_inner()),
        write("e.pfm", &pfm),
        exr,
    ]
}

#[test]
fn every_format_is_read() {
    let dir = folder();
    for path in samples_of_each_format(dir.path()) {
        let image = read_image(&path, Encoding::Auto).expect("readable");
        // A GIF may have holes.
        let channels = if path.extension().is_some_and(|e| e == "gif") { 4 } else { 3 };
        assert_eq!((image.width, image.height, image.channels), (16, 8, channels), "{}", path.display());
        let at = |x: usize, y: usize| &image.pixels[(y * 16 + x) * channels..][..3];
        match path.extension().and_then(|e| e.to_str()) {
            Some("png" | "tga" | "bmp" | "qoi" | "gif" | "ppm") => {
                let expected = [160u8, 64, 128].map(|b| srgb_to_linear(f32::from(b) / 255.0));
                assert!(at(10, 2).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6));
            }
            Some("hdr") => assert!((at(10, 2)[0] - 42.0).abs() < 0.5),
            // Rows from the bottom: the file's first pixel is at the lower left.
            Some("pfm") => assert_eq!((at(0, 7), at(0, 0)[0]), (&[0.0, 1.0, 2.0][..], 7.0 * 48.0)),
            Some("exr") => assert_eq!(at(3, 1), [19.0, 38.0, -57.0]),
            _ => {}
        }
    }
}

#[test]
fn truncated_and_damaged_files_are_refused_without_panic() {
    let dir = folder();
    let mut stream = Stream::from_seed(11);
    // More than enough to meet every header field; set the variable to search longer.
    let damages: usize = std::env::var("LANTERNFISH_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(300);
    for path in samples_of_each_format(dir.path()) {
        let bytes = std::fs::read(&path).expect("there");
        for length in 0..bytes.len() - 1 {
            let result = read_image_bytes(&path, bytes[..length].to_vec(), Encoding::Auto);
            // A PNG that lacks its last chunk or a TGA that lacks its footer is still a whole picture.
            assert!(result.is_err() || length + 26 >= bytes.len(), "{} cut to {length}", path.display());
        }
        for _ in 0..damages {
            let mut damaged = bytes.clone();
            for _ in 0..3 {
                let at = (stream.next_f32() * bytes.len() as f32) as usize;
                damaged[at] = (stream.next_f32() * 256.0) as u8;
            }
            let _ = read_image_bytes(&path, damaged, Encoding::Auto);
        }
    }
}

#[test]
fn rows_of_damaged_files_are_those_of_the_whole() {
    let dir = folder();
    let path = dir.path().join("a.png");
    let image = ::image::RgbaImage::from_fn(16, 8, |x, y| ::image::Rgba([x as u8 * 16, y as u8 * 32, 128, x as u8]));
    image.save(&path).expect("written");
    let bytes = std::fs::read(&path).expect("there");
    let mut stream = Stream::from_seed(12);
    let mut compared = 0;
    for damages in 0..400 {
        let mut damaged = bytes.clone();
        for _ in 0..damages % 4 {
            let at = (stream.next_f32() * bytes.len() as f32) as usize;
            damaged[at] = (stream.next_f32() * 256.0) as u8;
        }
        if damages % 5 == 4 {
            damaged.truncate((stream.next_f32() * bytes.len() as f32) as usize);
        }
        std::fs::write(&path, &damaged).expect("written");
        let Some(mut rows) = PngRows::open(&path, [16, 8]) else { continue };
        let rows: Result<Vec<_>, _> = (0..8).map(|_| rows.next_row()).collect();
        let whole = read_stored(&path);
        assert!(rows.is_ok() || whole.is_err(), "{whole:?}");
        if let (Ok(rows), Ok(whole)) = (rows, whole) {
            compared += 1;
            let Values::Bytes(whole) = whole.values else { panic!("they are bytes") };
            for (row, whole) in rows.iter().zip(whole.chunks_exact(64)) {
                assert_eq!(row.values, Values::Bytes(whole.into()));
            }
        }
    }
    assert!(compared >= 80, "{compared}");
    assert!(PngRows::open(&dir.path().join("none.png"), [16, 8]).is_none());
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    let dir = folder();
    let path = dir.path().join("huge.pfm");
    std::fs::write(&path, b"PF\n2000000000 2000000000\n-1.0\n1234").expect("written");
    assert!(read_image(&path, Encoding::Auto).is_err());
    assert!(read_image(&dir.path().join("missing.png"), Encoding::Auto).is_err());
}

#[test]
fn what_blows_up_is_refused() {
    for (values, bytes, is_fine) in
        [(1 << 26, 1, true), ((1 << 26) + 1, 1 << 10, false), (1 << 27, 1 << 19, true), (1 << 28, 1 << 19, false)]
    {
        assert_eq!(super::stored_image::check_expansion(values, bytes).is_ok(), is_fine, "{values} {bytes}");
    }
}

#[test]
fn moments_of_nothing_are_neutral() {
    let mut moments = Moments::default();
    moments.merge(&Moments::default());
    assert_eq!(moments.variance_of_mean(), DVec3::ZERO);
    let mut one = Moments::default();
    one.add(DVec3::ONE);
    moments.merge(&one);
    assert_eq!(moments, one);
}

#[test]
fn a_single_channel_is_grey_whatever_it_is_called() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("one.exr");
    let bounds = PixelBounds::full(2, 1);
    for (name, values) in [("R", vec![0.25, 0.5]), ("Y", vec![0.25, 0.5]), ("height", vec![0.25, 0.5])] {
        let channels = vec![(name.to_owned(), values)];
        write_exr(&path, ChannelImage { bounds, display: bounds, channels, attributes: vec![] }).expect("written");
        let stored = read_stored(&path).expect("it is read");
        assert!(stored.channels == 1 && read_header(&path).expect("it is read").is_grey, "{name}");
    }
}
