use tempfile::TempDir;

use super::*;
use crate::film::exr::write_exr;
use crate::math::sampler::Stream;

fn image(width: u32, height: u32, colour: impl Fn(usize) -> [f32; 3], variance: Option<f32>) -> ChannelImage {
    let bounds = PixelBounds::full(width, height);
    let mut channels = Vec::new();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        channels.push((name.to_owned(), (0..bounds.area()).map(|i| colour(i)[c]).collect()));
        if let Some(variance) = variance {
            channels.push((format!("variance.{name}"), vec![variance; bounds.area()]));
        }
    }
    ChannelImage { bounds, display: bounds, channels, attributes: vec![] }
}

fn compare_images(a: &ChannelImage, b: &ChannelImage) -> Result<Comparison, CompareError> {
    let dir = TempDir::new().expect("a temporary folder");
    let paths = [dir.path().join("a.exr"), dir.path().join("b.exr")];
    write_exr(&paths[0], a.clone()).expect("written");
    write_exr(&paths[1], b.clone()).expect("written");
    compare(&paths[0], &paths[1])
}

#[test]
fn numbers_match_those_by_hand() {
    // Two pixels; differences 1, 0, 0 and 0, 0, −2.
    let a = image(2, 1, |i| [[2.0, 1.0, 1.0], [3.0, 1.0, 0.0]][i], Some(0.04));
    let b = image(2, 1, |i| [[1.0, 1.0, 1.0], [3.0, 1.0, 2.0]][i], Some(0.05));
    let c = compare_images(&a, &b).expect("comparable");
    let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-6 * (1.0 + y.abs()), "{x} is not {y}");
    near(c.mean_a, 8.0 / 6.0);
    near(c.mean_b, 9.0 / 6.0);
    near(c.rmse, (5.0f64 / 6.0).sqrt());
    near(c.relative_rmse, (5.0f64 / 17.0).sqrt());
    let epsilon = 0.01 * 1.5 * 1.5;
    near(c.relative_mse, (1.0 / (1.0 + epsilon) + 4.0 / (4.0 + epsilon)) / 6.0);
    near(c.bias.value, -1.0 / 6.0);
    near(c.bias.relative.expect("light"), -1.0 / 9.0);
    // Each pixel's variance is 0.09, that of the mean of two 0.045.
    let half = 1.959_964 * 0.045f64.sqrt();
    let [low, high] = c.bias.interval.expect("variances");
    near(low, -1.0 / 6.0 - half);
    near(high, -1.0 / 6.0 + half);
    near(c.bias_per_channel[2].value, -1.0);
    near(c.bias_per_channel[2].interval.expect("variances")[1], -1.0 + half);
    assert_eq!((c.blocks.count, c.blocks.within_tolerance, c.blocks.within_noise), (1, 0.0, Some(1.0)));
    near(c.blocks.worst[0].z.expect("noise"), -1.0 / 6.0 / 0.045f64.sqrt());
    assert_eq!(c.variance_from, ["A", "B"]);
    assert!(c.flip > 0.0);
}

#[test]
fn an_image_equals_itself() {
    let a = image(20, 11, |i| [i as f32, 0.0, 1.0], None);
    let c = compare_images(&a, &a).expect("comparable");
    assert_eq!((c.rmse, c.relative_mse, c.bias.value, c.flip), (0.0, 0.0, 0.0, 0.0));
    assert_eq!((c.blocks.count, c.blocks.within_tolerance, c.blocks.within_noise), (6, 1.0, None));
    assert!(c.bias.interval.is_none());
    let black = image(4, 4, |_| [0.0; 3], None);
    let c = compare_images(&black, &black).expect("comparable");
    assert_eq!((c.relative_rmse, c.relative_mse, c.bias.relative), (0.0, 0.0, None));
}

/// Noise of known variance: z² must average 1 over 1024 blocks. Its standard error is √(2/1024) = 0.044; the bound of 0.2 is
/// 4.5 of them (false-alarm rate 7e-6). A shift of two standard errors of a block must be found.
#[test]
fn block_statistics_tell_noise_from_bias() {
    let mut stream = Stream::from_seed(3);
    let mut noise: Vec<f32> = (0..256 * 256).map(|_| (stream.next_f32() - 0.5) * 12f32.sqrt()).collect();
    let b = image(256, 256, |_| [1.0; 3], None);
    let a = image(256, 256, |i| [1.0 + 0.1 * noise[i]; 3], Some(0.01));
    let same = compare_images(&a, &b).expect("comparable");
    let z2 = same.blocks.mean_z_squared.expect("noise known");
    assert!((z2 - 1.0).abs() < 0.2, "{z2}");
    assert!((same.blocks.within_noise.expect("noise known") - 0.95).abs() < 0.03);
    let [low, high] = same.bias.interval.expect("noise known");
    assert!(low < 0.0 && high > 0.0 && (high - low) < 0.002);
    noise.iter_mut().for_each(|n| *n += 0.25);
    let shifted = image(256, 256, |i| [1.0 + 0.1 * noise[i]; 3], Some(0.01));
    let biased = compare_images(&shifted, &b).expect("comparable");
    assert!(biased.blocks.mean_z_squared.expect("noise known") > 4.0);
    assert!(biased.bias.interval.expect("noise known")[0] > 0.0);
}

#[test]
fn the_worst_block_is_found() {
    let b = image(64, 64, |_| [1.0; 3], Some(1e-4));
    let a = image(64, 64, |i| [if i % 64 / 8 == 3 && i / 64 / 8 == 5 { 1.5 } else { 1.0 }; 3], Some(1e-4));
    let c = compare_images(&a, &b).expect("comparable");
    assert_eq!(c.blocks.worst[0].pixel, [24, 40]);
    assert!((c.blocks.within_tolerance - 63.0 / 64.0).abs() < 1e-12);
    let text = c.to_string();
    assert!(text.contains("at    24, 40") && text.contains("98.4 % of 64"), "{text}");
    let json = serde_json::to_value(&c).expect("serialisable");
    assert_eq!(json["blocks"]["worst"][0]["pixel"][1], 40);
}

#[test]
fn what_does_not_match_is_refused() {
    let a = image(4, 4, |_| [1.0; 3], None);
    assert!(matches!(compare_images(&a, &image(4, 5, |_| [1.0; 3], None)), Err(CompareError::Shape { .. })));
    let mut cropped = a.clone();
    cropped.bounds = PixelBounds { x0: 1, y0: 0, x1: 5, y1: 4 };
    assert!(matches!(compare_images(&a, &cropped), Err(CompareError::Shape { .. })));
    let mut grey = a.clone();
    grey.channels.truncate(1);
    assert!(matches!(compare_images(&grey, &a), Err(CompareError::Colour("A"))));
    let broken = image(4, 4, |i| [if i == 6 { f32::NAN } else { 1.0 }, 1.0, 1.0], None);
    let error = compare_images(&a, &broken).expect_err("NaN");
    assert!(matches!(error, CompareError::NotFinite { which: "B", count: 1, pixel: [2, 1] }), "{error}");
}

#[test]
fn the_difference_picture_shows_all_three() {
    let dir = TempDir::new().expect("a temporary folder");
    let [a, b, png] = ["a.exr", "b.exr", "d.png"].map(|name| dir.path().join(name));
    write_exr(&a, image(5, 3, |_| [0.36; 3], None)).expect("written");
    write_exr(&b, image(5, 3, |_| [0.18; 3], None)).expect("written");
    write_difference(&a, &b, &png).expect("written");
    let picture = crate::film::image::read_image(&png, crate::film::image::Encoding::Auto).expect("read");
    assert_eq!((picture.width, picture.height), (15, 3));
    for (x, expected) in [(0, 0.36), (5, 0.18), (14, 0.18)] {
        assert!((picture.pixels[x * 3] - expected).abs() < 0.005, "column {x}");
    }
    let info = crate::report::info_exr(&a).expect("read");
    assert_eq!((info.channels.len(), info.channels[0].max, info.channels[0].not_finite), (3, 0.36, 0));
    assert!(info.to_string().contains("5 × 3 pixels"));
}
