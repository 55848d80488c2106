//! The renderer against converged images by pbrt-v4 (CPU, `volpath`), scene by scene, where this machine has them.
//!
//! Everything but the colours of `r09` is grey, so an RGB renderer must agree with a spectral one in expectation; pixels are compared by the
//! mean of their channels. Both images know the variance of their pixels, so the test asks whether noise explains the differences, at the
//! false-alarm rate of [`FALSE_ALARM_RATE`] for each question, and besides whether the differences are small.
//!
//! Noise is taken as normal. Block means of heavy-tailed estimates (light found by chance) are not quite, so the worst block
//! has a looser limit than their mean and their sum of squares.

use std::io::Read;
use std::path::Path;
use std::time::Instant;

use crate::common::{Options, critical_z, render_file, shared};
use lanternfish::film::ChannelImage;
use lanternfish::film::exr::read_exr_layers;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The rate at which a question fails although nothing but noise differs, were noise normal.
const FALSE_ALARM_RATE: f64 = 1e-6;

/// A block agrees if it is within the tolerance or off by no more than this many standard errors.
const EXPLAINED: f64 = 3.0;

/// Width and height of the blocks whose means are compared, in pixels.
const BLOCK: usize = 8;

/// Blocks darker than this share of the image's mean are held to the tolerance at that brightness: what rarely receives light at all is noise.
const DARK: f64 = 0.1;

/// Blocks darker than this share of the image's mean saw a handful of paths, too few to know their own variance: no z-test.
const RARE: f64 = 1e-3;

/// The mean over channels and its variance, pixel by pixel.
struct Grey {
    width: usize,
    pixels: Vec<(f64, f64)>,
}

impl Grey {
    fn new(image: &ChannelImage) -> Self {
        let (colour, variance) = (image.rgb("").expect("the beauty"), image.rgb("variance").expect("variances"));
        let mean = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>() / 3.0;
        let pixel = |i: usize| {
            // The channels of a pixel share their paths; full correlation can only overstate the noise.
            let deviation = mean(&|c| f64::from(variance[c][i]).max(0.0).sqrt());
            (mean(&|c| f64::from(colour[c][i])), deviation * deviation)
        };
        Self { width: image.bounds.width() as usize, pixels: (0..image.bounds.area()).map(pixel).collect() }
    }

    fn over(&self, pixels: impl Iterator<Item = usize>) -> (f64, f64) {
        let (mut count, mut sum, mut variance) = (0.0, 0.0, 0.0);
        for (value, noise) in pixels.map(|i| self.pixels[i]) {
            count += 1.0;
            sum += value;
            variance += noise;
        }
        (sum / count, variance / (count * count))
    }

    fn mean(&self) -> (f64, f64) {
        self.over(0..self.pixels.len())
    }

    /// Means of blocks and their variances, row by row. The images here are whole numbers of blocks wide and high.
    fn blocks(&self) -> Vec<(f64, f64)> {
        let (width, height) = (self.width, self.pixels.len() / self.width);
        let corners = (0..height).step_by(BLOCK).flat_map(|y| (0..width).step_by(BLOCK).map(move |x| (x, y)));
        let inside =
            |(x, y)| (y..y + BLOCK).flat_map(move |row| (x..x + BLOCK).map(move |column| row * width + column));
        corners.map(|corner| self.over(inside(corner))).collect()
    }
}

/// What two images have in common.
struct Agreement {
    ratio: f64,
    mean_z: f64,
    within: f64,
    sum_z: f64,
    sum_z_squared: f64,
    worst_z: f64,
    blocks: usize,
}

impl Agreement {
    fn of(a: &Grey, b: &Grey, block_tolerance: f64) -> Self {
        assert_eq!((a.width, a.pixels.len()), (b.width, b.pixels.len()), "the images differ in size");
        let z = |(a, noise_a): (f64, f64), (b, noise_b): (f64, f64)| {
            if a == b { 0.0 } else { (a - b) / (noise_a + noise_b).sqrt() }
        };
        let pairs: Vec<_> = a.blocks().into_iter().zip(b.blocks()).collect();
        let mean = b.mean().0;
        let is_lit = |((a, _), (b, _)): &&((f64, f64), (f64, f64))| a.max(*b) > RARE * mean;
        let scores = || pairs.iter().filter(is_lit).map(|(a, b)| z(*a, *b));
        let agrees = |(a, b): &&((f64, f64), (f64, f64))| {
            (a.0 - b.0).abs() <= block_tolerance * b.0.max(DARK * mean) || z(*a, *b).abs() <= EXPLAINED
        };
        let within = pairs.iter().filter(agrees).count();
        Self {
            ratio: a.mean().0 / b.mean().0,
            mean_z: z(a.mean(), b.mean()),
            within: within as f64 / pairs.len() as f64,
            sum_z: scores().sum(),
            sum_z_squared: scores().map(|z| z * z).sum(),
            worst_z: scores().fold(0.0, |worst: f64, z| if z.abs() > worst.abs() { z } else { worst }),
            blocks: scores().count(),
        }
    }

    fn print(&self, what: &str, seconds: f64) {
        println!(
            "{what}: mean ratio {:.4} (z {:+.2}), {:.1} % of blocks within tolerance, mean z² {:.2}, mean z {:+.3}, worst {:+.2}; {seconds:.1} s",
            self.ratio,
            self.mean_z,
            self.within * 100.0,
            self.sum_z_squared / self.blocks as f64,
            self.sum_z / self.blocks as f64,
            self.worst_z
        );
    }

    #[track_caller]
    fn assert_close(&self, what: &str, mean_tolerance: f64) {
        assert!((self.ratio - 1.0).abs() <= mean_tolerance, "{what}: the mean is {:.4} of the reference's", self.ratio);
        assert!(self.within >= 0.95, "{what}: only {:.1} % of the blocks agree", self.within * 100.0);
    }

    #[track_caller]
    fn assert_noise_explains_it(&self, what: &str) {
        let n = self.blocks as f64;
        let limit = critical_z(FALSE_ALARM_RATE);
        assert!(self.mean_z.abs() <= limit, "{what}: the means differ by {:+.2} standard errors", self.mean_z);
        let drift = self.sum_z / n.sqrt();
        assert!(drift.abs() <= limit, "{what}: the blocks differ in one direction, by {drift:+.2} standard errors");
        let p = ChiSquared::new(n).expect("there are blocks").sf(self.sum_z_squared);
        assert!(
            p >= FALSE_ALARM_RATE,
            "{what}: blocks differ by more than noise: mean z² {:.2}, p {p:.1e}",
            self.sum_z_squared / n
        );
        // Every one of the blocks is asked, and their tails are heavier than a normal distribution's.
        let worst = 1.25 * critical_z(FALSE_ALARM_RATE / n);
        assert!(self.worst_z.abs() <= worst, "{what}: a block differs by {:+.2} standard errors", self.worst_z);
    }
}

/// Renders with one thread, so that tests run beside each other.
fn render(what: &str, path: &Path, spp: u32, seed: u32) -> (Grey, f64) {
    let start = Instant::now();
    let options = Options { spp, seed, threads: 1, ..Options::default() };
    let (outcome, warnings) = render_file(path, &options).expect("the scene renders");
    assert_eq!(outcome.film.rejected().0, 0, "{what}: samples were NaN or infinite");
    // The scenes say how pbrt-v4 should choose lights and store pixels.
    let doubts: Vec<_> = warnings.list().iter().filter(|warning| !warning.message.contains("is ignored: ")).collect();
    assert!(doubts.is_empty(), "{what}: {doubts:?}");
    (Grey::new(&outcome.film.channels()), start.elapsed().as_secs_f64())
}

/// The reference's scene and image.
fn reference(name: &str) -> Option<(std::path::PathBuf, Grey)> {
    let found = shared(&format!("refs/{name}.exr"));
    let scene = shared(&format!("refs/{name}.pbrt")).or_else(|| shared(&format!("refs/{name}.pbrt.gz")));
    let (Some(image), Some(scene)) = (found, scene) else {
        println!("{name}: skipped, the reference is not on this machine");
        return None;
    };
    let image = read_exr_layers(&image).expect("the reference can be read");
    Some((scene, Grey::new(&image)))
}

/// A scene of greys: noise must explain every difference.
fn check(name: &str, spp: u32, mean_tolerance: f64, block_tolerance: f64) {
    let Some((scene, expected)) = reference(name) else { return };
    let (image, seconds) = render(name, &scene, spp, 1);
    let agreement = Agreement::of(&image, &expected, block_tolerance);
    agreement.print(&format!("{name}, {spp} spp"), seconds);
    agreement.assert_close(name, mean_tolerance);
    agreement.assert_noise_explains_it(name);
}

#[test]
fn r01_area() {
    check("r01_area", 256, 0.012, 0.05);
}

#[test]
fn r02_delta() {
    check("r02_delta", 256, 0.012, 0.05);
}

#[test]
fn r03_env_glossy() {
    check("r03_env_glossy", 256, 0.012, 0.05);
}

#[test]
fn r04_fog_homogeneous() {
    check("r04_fog_homogeneous", 256, 0.012, 0.05);
}

#[test]
fn r05_grid_many_points() {
    check("r05_grid_many_points", 1024, 0.02, 0.12);
}

#[test]
fn r06_emissive_grid() {
    check("r06_emissive_grid", 1024, 0.02, 0.12);
}

#[test]
fn r07_instances_motion() {
    check("r07_instances_motion", 256, 0.012, 0.05);
}

#[test]
fn r08_mesh_lights() {
    check("r08_mesh_lights", 512, 0.012, 0.05);
}

/// RGB products differ from spectral ones, so here only closeness can be asked for.
#[test]
fn r09_colour() {
    let Some((scene, expected)) = reference("r09_colour") else { return };
    let (image, seconds) = render("r09_colour", &scene, 256, 1);
    let agreement = Agreement::of(&image, &expected, 0.06);
    agreement.print("r09_colour, 256 spp", seconds);
    agreement.assert_close("r09_colour", 0.03);
}

/// A reference whose medium is a .vdb file written out as a uniform grid: both forms must agree with the reference and with
/// each other.
fn check_both_ways(name: &str, spp: u32, medium: &str, mean_tolerance: f64, block_tolerance: f64, vdb: &str) {
    let Some((scene, expected)) = reference(name) else { return };
    let (grid, seconds) = render(name, &scene, spp, 1);
    let agreement = Agreement::of(&grid, &expected, block_tolerance);
    agreement.print(&format!("{name}, uniformgrid, {spp} spp"), seconds);
    agreement.assert_close(name, mean_tolerance);
    agreement.assert_noise_explains_it(name);

    let file = shared(&format!("data/vdb/{vdb}"));
    let Some(file) = file.filter(|_| cfg!(feature = "openvdb")) else {
        println!("{name}: its .vdb file is skipped");
        return;
    };
    let file = file.canonicalize().expect("the file exists");
    let medium = format!(
        "MakeNamedMedium \"m\" \"string type\" \"openvdb\" \"string filename\" \"{}\" {medium}\n",
        file.display()
    );
    let text = with_medium(&scene, &medium);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    // Another seed, so that the two are independent.
    let (sparse, seconds) = render(name, &path, spp, 2);
    let agreement = Agreement::of(&sparse, &expected, block_tolerance);
    agreement.print(&format!("{name}, openvdb, {spp} spp"), seconds);
    agreement.assert_close(name, mean_tolerance);
    agreement.assert_noise_explains_it(name);
    let agreement = Agreement::of(&sparse, &grid, block_tolerance);
    agreement.print(&format!("{name}, openvdb against uniformgrid"), seconds);
    agreement.assert_noise_explains_it(name);
}

/// The scene file's text with another medium in place of its own.
fn with_medium(scene: &Path, medium: &str) -> String {
    let mut text = String::new();
    let file = std::fs::File::open(scene).expect("the scene can be opened");
    flate2::read::GzDecoder::new(file).read_to_string(&mut text).expect("the scene is gzipped text");
    let start = text.find("MakeNamedMedium").expect("the scene has a medium");
    let end = start + text[start..].find("\nMaterial").expect("materials follow") + 1;
    format!("{}{medium}{}", &text[..start], &text[end..])
}

#[test]
fn r10_smoke() {
    let medium = r#""string density" "density" "rgb sigma_a" [.3 .3 .3] "rgb sigma_s" [2.5 2.5 2.5] "float g" .4"#;
    check_both_ways("r10_smoke", 256, medium, 0.012, 0.05, "openusd/smoke_000002.vdb");
}

#[test]
fn r11_fire() {
    let medium = r#""string density" "density" "string emission" "flame" "rgb sigma_a" [2 2 2] "rgb sigma_s" [1.5 1.5 1.5]
        "float g" 0 "rgb Le" [40 40 40]"#;
    check_both_ways("r11_fire", 512, medium, 0.02, 0.12, "blender/fire96_zip_f32_0045.vdb");
}
