//! Searchlights of 1° in haze 1000 units wide: no beam has gaps, and an animation of them does not flicker more than noise explains.
//!
//! Eight seeds stand for eight frames: each learns its cache points anew. Every beam's axis is cut into stretches of pixels, as long as it
//! takes for the noise of a stretch's mean in a frame, by the frames' own estimates, to be so small that a gap would be seen. Of beams that
//! hardly leave the town's roofs there is no stretch.
//!
//! Each of the three assertions about chance fails with probability 1e-4 although all is well. The bound on gaps holds whatever the light's
//! distribution, given its variance; those on flicker take a stretch's mean, of some 40 samples that meet the beam, for normal.
//!
//! Beams without cache points of their own (`CacheSettings::beams`) are not wrong, only noisier, in each frame as much as its estimates say
//! (χ² 148 of 189 degrees): they fail for want of stretches that are free enough of noise, 27 on 12 beams in place of 39 on 14.

use std::collections::HashSet;

use crate::common::{Options, prepare_file, render_job};
use glam::{Quat, Vec2, Vec3};
use lanternfish::cache_points::CacheSettings;
use lanternfish::film::FilmOverrides;
use lanternfish::render::LightSelection;
use lanternfish::scene::Warnings;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const RATE: f64 = 1e-4;
const FRAMES: u32 = 8;
const SPP: u32 = 1500;
const SIZE: [u32; 2] = [64, 36];
/// The part of the image from above that is rendered: the sky.
const SKY: f32 = 0.6;
/// The noise of a stretch beside its mean: what noise is allowed, 5.5 times that, is less than all the light.
const NOISE: f64 = 0.16;
/// The haze ends here; near a lamp light is without bounds.
const HAZE: [Vec3; 2] = [Vec3::new(-500.0, -4.0, -500.0), Vec3::new(500.0, 420.0, 500.0)];
const NEAR: f32 = 40.0;

/// What is seen of green in one frame, and the estimated variance of each pixel.
struct Frame {
    light: Vec<f64>,
    variance: Vec<f64>,
    surfaces: Vec<f64>,
}

/// The numbers of a line.
fn numbers(line: &str) -> Vec<f32> {
    line.split_whitespace().filter_map(|word| word.trim_matches(['[', ']']).parse().ok()).collect()
}

/// Pixels along each beam's axis, one by one from its lamp on; none belongs to two beams.
fn axes(text: &str) -> Vec<Vec<usize>> {
    let start = |name: &str| text.lines().find(|line| line.starts_with(name)).map(numbers).expect("it is there");
    let (look, fov) = (start("LookAt"), start("Camera")[0]);
    let (eye, target) = (Vec3::from_slice(&look), Vec3::from_slice(&look[3..]));
    let forward = (target - eye).normalize();
    let right = Vec3::Y.cross(forward).normalize();
    let up = forward.cross(right);
    let [width, height] = SIZE.map(|n| n as f32);
    let scale = 0.5 * height / (0.5 * fov.to_radians()).tan();
    let project = |p: Vec3| {
        let q = p - eye;
        let seen = Vec2::new(q.dot(right), -q.dot(up)) * (scale / q.dot(forward)) + 0.5 * Vec2::new(width, height);
        (q.dot(forward) > 5.0).then_some(seen)
    };
    let lines: Vec<&str> = text.lines().collect();
    let lamps: Vec<(Vec3, Vec3)> = lines
        .windows(2)
        .filter(|pair| pair[1] == "ObjectInstance \"housing\"")
        .map(|pair| {
            let n = numbers(pair[0]);
            let turn = Quat::from_axis_angle(Vec3::from_slice(&n[4..]).normalize(), n[3].to_radians());
            (Vec3::from_slice(&n), turn * Vec3::Y)
        })
        .collect();
    assert_eq!(lamps.len(), 24);
    let glare: Vec<Vec2> = lamps.iter().filter_map(|&(lamp, _)| project(lamp)).collect();
    let mut taken = HashSet::new();
    let along = |&(lamp, axis): &(Vec3, Vec3)| {
        let places = (0..2400).map(|step| lamp + (NEAR + 0.5 * step as f32) * axis);
        let inside = places.take_while(|p| p.cmpge(HAZE[0]).all() && p.cmple(HAZE[1]).all());
        let seen = inside.filter_map(project).filter(|s| {
            s.cmpge(Vec2::ZERO).all()
                && s.x < width
                && s.y < (SKY * height).floor()
                && glare.iter().all(|g| g.distance(*s) > 2.5)
        });
        let pixels = seen.map(|s| s.y as usize * SIZE[0] as usize + s.x as usize);
        pixels.filter(|pixel| taken.insert(*pixel)).collect()
    };
    lamps.iter().map(along).collect()
}

/// A stretch's means, one of each frame, and their variance as the frames estimate it.
struct Stretch {
    means: Vec<f64>,
    variance: f64,
}

impl Stretch {
    fn of(pixels: &[usize], frames: &[Frame]) -> Self {
        let count = pixels.len() as f64;
        let sum = |of: &[f64]| pixels.iter().map(|&pixel| of[pixel]).sum::<f64>();
        let means = frames.iter().map(|frame| sum(&frame.light) / count).collect();
        let variances = frames.iter().map(|frame| sum(&frame.variance) / (count * count));
        Self { means, variance: variances.sum::<f64>() / frames.len() as f64 }
    }

    fn mean(&self) -> f64 {
        self.means.iter().sum::<f64>() / self.means.len() as f64
    }
}

fn frames(path: &std::path::Path, cache: CacheSettings) -> Vec<Frame> {
    let film = FilmOverrides { resolution: Some(SIZE), crop: Some([0.0, 1.0, 0.0, SKY]) };
    let render = |seed| {
        let options = Options {
            spp: SPP,
            seed,
            film,
            cache,
            lights: LightSelection::CachePoints,
            // So that there is little noise in other ways.
            light_candidates: Some(4),
            ..Options::default()
        };
        let mut job = prepare_file(path, &options, &mut Warnings::default()).expect("it can be prepared");
        let image = render_job(&mut job, &options).film.channels();
        let channel = |name| -> Vec<f64> {
            image.channel(name).expect("every layer is there").iter().map(|v| f64::from(*v)).collect()
        };
        Frame { light: channel("G"), variance: channel("variance.G"), surfaces: channel("direct.G") }
    };
    (1..=FRAMES).map(render).collect()
}

#[test]
fn beams_have_no_gaps_and_flicker_no_more_than_noise() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = lanternfish::gallery::find("beams").expect("there is such a scene");
    let path = scene.write(folder.path(), Some(24)).expect("it can be written");
    let text = std::fs::read_to_string(&path).expect("it was written");
    let frames = frames(&path, CacheSettings::default());
    let (mut stretches, mut inside, mut all, mut seen) = (vec![], 0, 0, 0);
    for axis in axes(&text) {
        let sky: Vec<usize> =
            axis.into_iter().filter(|&p| frames.iter().all(|frame| frame.surfaces[p] == 0.0)).collect();
        all += sky.len();
        let (mut from, before) = (0, stretches.len());
        for to in 1..=sky.len() {
            let stretch = Stretch::of(&sky[from..to], &frames);
            if to - from >= 3 && stretch.variance.sqrt() < NOISE * stretch.mean() {
                inside += to - from;
                from = to;
                stretches.push(stretch);
            }
        }
        seen += usize::from(stretches.len() > before);
    }
    println!("{} stretches on {seen} beams, with {inside} of {all} pixels", stretches.len());
    assert!(stretches.len() >= 33 && seen >= 13, "too noisy to see a gap in the beams");

    // The light of samples is not negative, so that a mean falls short of what it should be by t with probability exp(−t² / 2v) at most, v
    // being its variance (Maurer 2003, "A bound on the deviation probability for sums of non-negative random variables"). To v it adds the
    // squares of the samples' means, which are less than a hundredth of it.
    let comparisons = (stretches.len() * frames.len()) as f64;
    let allowed = (2.0 * (comparisons / RATE).ln()).sqrt();
    let short = |s: &Stretch| (s.mean() - s.means.iter().copied().fold(f64::INFINITY, f64::min)) / s.variance.sqrt();
    let worst = stretches.iter().map(short).fold(0.0, f64::max);
    println!("the darkest lies {worst:.2} standard errors below its mean, of {allowed:.2} allowed");

    // Between frames: the squares of all deviations, and of each frame's, as χ².
    let share = (FRAMES - 1) as f64 / f64::from(FRAMES);
    let squares = |frame: usize| -> f64 {
        stretches.iter().map(|s| (s.means[frame] - s.mean()).powi(2) / (share * s.variance)).sum()
    };
    let of_frames: Vec<f64> = (0..frames.len()).map(squares).collect();
    let bound = |freedom: f64, rate: f64| ChiSquared::new(freedom).expect("above 0").inverse_cdf(1.0 - rate);
    let count = stretches.len() as f64;
    let total = share * of_frames.iter().sum::<f64>();
    let freedom = count * f64::from(FRAMES - 1);
    println!(
        "χ² {total:.0} of {freedom} degrees, {:.0} allowed; of frames {of_frames:.0?} of {count}, {:.0} allowed",
        bound(freedom, RATE),
        bound(count, RATE / f64::from(FRAMES))
    );

    assert!(worst < allowed);
    assert!(total < bound(freedom, RATE));
    assert!(of_frames.iter().all(|&chi2| chi2 < bound(count, RATE / f64::from(FRAMES))));
}
