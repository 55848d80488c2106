//! The film's own arithmetic: sums of a million samples and what they vary, from denormal numbers to 1e30, against exact sums of integers.

use super::case::{Case, Stop, Trial};
use crate::film::{Film, FilmSettings, Moments, PixelBounds, PixelFilter, PixelSamples, SampleResult, Sensor};
use crate::math::Rgb;
use crate::math::sampler::Stream;

pub(super) const CASES: &[Case] = &[
    Case {
        name: "film.accumulation",
        checks: "Mean and variance of 2^20 samples, in passes of 1, 1, 2, 4 … and one by one, are those of exact integer sums.",
        seconds: 0.7,
        known: None,
        run: accumulation,
    },
    Case {
        name: "film.offset",
        checks: "A little noise on a large value keeps its variance: nothing cancels.",
        seconds: 0.2,
        known: None,
        run: offset,
    },
    Case {
        name: "film.range",
        checks: "One sample of 1e30 among 2^20 denormal ones gives the mean that it must, and channels that are finite.",
        seconds: 1.7,
        known: None,
        run: range,
    },
    Case {
        name: "film.layers",
        checks: "Layers add up to the image after 2^20 samples.",
        seconds: 0.2,
        known: None,
        run: layers,
    },
];

const COUNT: u32 = 1 << 20;

/// A film of one pixel.
fn film() -> Film {
    let bounds = PixelBounds::full(1, 1);
    let filter = PixelFilter::Box { radius: glam::Vec2::splat(0.5) };
    let sensor = Sensor::default();
    Film::new(FilmSettings { resolution: [1, 1], bounds, filename: None, sensor, filter, gbuffer: None }, true)
}

/// Pseudo-random whole numbers below 2^24, which f32 holds.
fn numbers(seed: u64) -> Vec<u32> {
    let mut stream = Stream::from_seed(seed);
    (0..COUNT).map(|_| (stream.next_f32() * 16_777_216.0) as u32).collect()
}

/// Fills a film in passes of `pass(samples so far)`.
fn fill(values: &[SampleResult], pass: impl Fn(u32) -> u32) -> Film {
    let mut film = film();
    let mut done = 0;
    while done < values.len() {
        let end = (done + pass(done as u32) as usize).min(values.len());
        let mut samples = PixelSamples::new(Sensor::default());
        for (i, value) in values.iter().enumerate().take(end).skip(done) {
            samples.add(i as u32, value);
        }
        film.tiles_mut()[0].merge([0, 0], &samples);
        done = end;
    }
    film
}

/// What its pixel has gathered.
fn level(film: &Film) -> f64 {
    film.tiles()[0].level([0, 0])
}

fn grey(x: f32) -> SampleResult {
    SampleResult { beauty: Rgb::splat(x), ..SampleResult::default() }
}

/// Mean and variance of the mean of whole numbers, rounded once at the end.
fn exact(values: &[u32]) -> (f64, f64) {
    let n = values.len() as u128;
    let sum: u128 = values.iter().map(|&v| u128::from(v)).sum();
    let squares: u128 = values.iter().map(|&v| u128::from(v) * u128::from(v)).sum();
    let n_times_spread = n * squares - sum * sum;
    (sum as f64 / n as f64, n_times_spread as f64 / (n as f64 * n as f64 * (n - 1) as f64))
}

/// Compares a film's level and variance with what they must be; `scale` undoes that of the samples.
fn compare(trial: &mut Trial, what: &str, film: &Film, values: &[u32], scale: f64) {
    trial.accept(what, film);
    let (mean, variance) = exact(values);
    let level = level(film) / scale;
    trial.equal(&format!("mean, {what}"), level, mean, 1e-12 * mean, "the exact sum of integers");
    let channels = film.channels();
    let got = channels.channel("variance.G").map_or(f64::NAN, |v| f64::from(v[0])) / (scale * scale);
    // The channel is an f32.
    trial.equal(&format!("variance of the mean, {what}"), got, variance, 1.2e-7 * variance, "the exact sums, in f32");
}

fn accumulation(trial: &mut Trial) -> Result<(), Stop> {
    let values = numbers(1);
    let samples: Vec<SampleResult> = values.iter().map(|&v| grey(v as f32)).collect();
    compare(trial, "doubling passes", &fill(&samples, |done| done.max(1)), &values, 1.0);
    compare(trial, "passes of one sample", &fill(&samples, |_| 1), &values, 1.0);
    compare(trial, "one pass", &fill(&samples, |_| COUNT), &values, 1.0);
    let scale = 2f32.powi(-40);
    let small: Vec<SampleResult> = values.iter().map(|&v| grey(v as f32 * scale)).collect();
    compare(trial, "2^-40 times as large", &fill(&small, |done| done.max(1)), &values, f64::from(scale));
    Ok(())
}

fn offset(trial: &mut Trial) -> Result<(), Stop> {
    // 2^23 and up to 7 more: a spread of a millionth of the value.
    let values: Vec<u32> = numbers(2).iter().map(|v| (1 << 23) + v % 8).collect();
    let samples: Vec<SampleResult> = values.iter().map(|&v| grey(v as f32)).collect();
    for (what, film) in
        [("doubling passes", fill(&samples, |done| done.max(1))), ("passes of one sample", fill(&samples, |_| 1))]
    {
        compare(trial, what, &film, &values, 1.0);
    }
    // Welford's update alone, without passes.
    let mut moments = Moments::default();
    values.iter().for_each(|&v| moments.add(glam::DVec3::splat(f64::from(v))));
    let (mean, variance) = exact(&values);
    trial.equal("mean, running update", moments.mean.x, mean, 1e-12 * mean, "the exact sum of integers");
    let got = moments.variance_of_mean().x;
    trial.equal("variance, running update", got, variance, 1e-7 * variance, "the exact sums of integers");
    Ok(())
}

fn range(trial: &mut Trial) -> Result<(), Stop> {
    let tiny = 1e-42f32;
    let large = 1e30f32;
    for (what, at) in [("first", 0), ("last", COUNT as usize - 1), ("in the middle", 12_345)] {
        let samples: Vec<SampleResult> =
            (0..COUNT as usize).map(|i| grey(if i == at { large } else { tiny })).collect();
        let film = fill(&samples, |done| done.max(1));
        trial.accept(what, &film);
        let n = f64::from(COUNT);
        let mean = f64::from(large) / n + f64::from(tiny) * (n - 1.0) / n;
        trial.equal(&format!("mean, the large one {what}"), level(&film), mean, 1e-12 * mean, "the sum over the count");
    }
    let even: Vec<SampleResult> = (0..COUNT).map(|_| grey(tiny)).collect();
    let film = fill(&even, |done| done.max(1));
    trial.equal("mean of denormal numbers", level(&film), f64::from(tiny), 1e-54, "all are the same");
    let bright: Vec<SampleResult> = (0..1024).map(|i| grey(if i % 2 == 0 { f32::MAX } else { 0.0 })).collect();
    let film = fill(&bright, |done| done.max(1));
    trial.accept("half of the largest f32", &film);
    let half = f64::from(f32::MAX) / 2.0;
    trial.equal("mean of the largest f32 and nothing", level(&film), half, 1e-12 * half, "half of it");
    Ok(())
}

fn layers(trial: &mut Trial) -> Result<(), Stop> {
    let [a, b, c, d] = [3, 4, 5, 6].map(numbers);
    let scale = 2f32.powi(-24);
    let samples: Vec<SampleResult> = (0..COUNT as usize)
        .map(|i| {
            let [direct, indirect, emission, volume] =
                [a[i], b[i], c[i], d[i]].map(|v| Rgb::splat((v >> 4) as f32 * 16.0 * scale));
            SampleResult {
                beauty: direct + indirect + emission + volume,
                direct,
                indirect,
                emission,
                volume,
                ..SampleResult::default()
            }
        })
        .collect();
    let film = fill(&samples, |done| done.max(1));
    trial.accept("layers", &film);
    let channels = film.channels();
    let of = |name: &str| channels.channel(name).map_or(f64::NAN, |v| f64::from(v[0]));
    let sum: f64 = ["direct.R", "indirect.R", "emission.R", "volume.R"].map(of).iter().sum();
    trial.equal("the sum of the layers", sum, of("R"), 2e-7 * of("R"), "the image, in f32");
    let expected = a.iter().map(|v| u64::from(v >> 4) * 16).sum::<u64>() as f64 / f64::from(COUNT) * f64::from(scale);
    trial.equal("the layer `direct`", of("direct.R"), expected, 6e-8 * expected, "the exact sum of integers, in f32");
    Ok(())
}
