//! What whole-program tests share: scenes from text, rendered in-process, and the statistics to judge them by.
//!
//! Every statistical assertion names the probability with which it would fail although nothing is wrong. Seeds are fixed, so a test that
//! passes keeps passing; the rate says how much faith a failure after a change deserves.

#![allow(dead_code, unused_imports)] // each test binary uses its part

pub mod blocks;
pub mod media;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use lanternfish::cache_points::CacheSettings;
use lanternfish::film::{Film, FilmOverrides};
use lanternfish::geometry::Backend;
use lanternfish::material::mip_map::memory::TextureSettings;
use lanternfish::render::{
    Budget, Job, LightSelection, Outcome, RenderError, RenderSettings, Silent, TextureLevels, ViewRays, VolumeLights,
    VolumeSampling, load,
};
use lanternfish::scene::{Sources, Warnings};
pub use lanternfish::stability::reference::integrate;
pub use lanternfish::stability::scene::{CUBE, Shot, boundary};
use statrs::distribution::{ContinuousCDF, Normal};

/// How to render a test's scene.
#[derive(Clone)]
pub struct Options {
    pub spp: u32,
    pub seed: u32,
    pub backend: Backend,
    pub lights: LightSelection,
    /// How readily the light tree splits; `None` for its default.
    pub splitting: Option<f32>,
    /// How cache points are made and used.
    pub cache: CacheSettings,
    /// From how many candidates light samples are resampled; `None` for the default.
    pub light_candidates: Option<u32>,
    /// Whether media are lights.
    pub volume_lights: VolumeLights,
    /// How scattering points are sampled along camera rays.
    pub volume_sampling: VolumeSampling,
    /// Whether camera rays are split to find what shines straight into the camera.
    pub view_rays: ViewRays,
    /// How much memory images on surfaces may take.
    pub textures: TextureSettings,
    /// At which level of detail they are looked up.
    pub texture_levels: TextureLevels,
    /// Bounces in place of the scene's.
    pub max_depth: Option<u32>,
    pub threads: usize,
    /// Resolution and crop in place of the scene's.
    pub film: FilmOverrides,
}

/// Candidates for cache points of [`Options::default`]. The number that suits larger images takes seconds to turn into points, many times what a
/// test's image takes; the image is the same with fewer, only noisier. They come from pilot paths alone; tests that are about cache points or
/// about noise ask for [`CacheSettings::default`].
const FEW_CANDIDATES: u32 = 2000;

impl Default for Options {
    fn default() -> Self {
        Self {
            spp: 64,
            seed: 1,
            backend: Backend::DEFAULT,
            lights: LightSelection::Auto,
            splitting: None,
            cache: CacheSettings { candidates: Some(FEW_CANDIDATES), ..CacheSettings::default() },
            light_candidates: None,
            volume_lights: VolumeLights::Auto,
            volume_sampling: VolumeSampling::Auto,
            view_rays: ViewRays::Auto,
            textures: TextureSettings::default(),
            texture_levels: TextureLevels::Auto,
            max_depth: None,
            threads: 2,
            film: FilmOverrides::default(),
        }
    }
}

/// Renders a scene file.
pub fn render_file(path: &Path, options: &Options) -> Result<(Outcome, Warnings), String> {
    let mut warnings = Warnings::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().map_err(|e| e.to_string())?;
    let outcome = pool.install(|| Ok(render_job(&mut prepare_file(path, options, &mut warnings)?, options)));
    outcome.map(|outcome| (outcome, warnings)).map_err(|error: RenderError| error.to_string())
}

/// Loads a scene file and makes it ready to render.
pub fn prepare_file(path: &Path, options: &Options, warnings: &mut Warnings) -> Result<Job, RenderError> {
    #[cfg(feature = "openvdb")]
    openvdb::set_worker(env!("CARGO_BIN_EXE_lanternfish-vdb"));
    let (scene, timings) = load(path, &mut Sources::default(), warnings)?;
    let settings = RenderSettings {
        backend: Some(options.backend),
        lights: options.lights,
        splitting: options.splitting,
        cache: options.cache,
        light_candidates: options.light_candidates,
        volume_lights: options.volume_lights,
        volume_sampling: options.volume_sampling,
        view_rays: options.view_rays,
        budget: Budget::Samples(options.spp),
        textures: options.textures.clone(),
        texture_levels: options.texture_levels,
        max_depth: options.max_depth,
        film: options.film,
        ..RenderSettings::default()
    };
    Job::prepare(&scene, &settings, timings, warnings)
}

/// The same for a scene given as text. Warnings are of no interest.
pub fn prepare_text(text: &str, options: &Options) -> Job {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    prepare_file(&path, options, &mut Warnings::default()).expect("the scene can be prepared")
}

/// Renders a scene that is ready. What cache points learned stays with it.
pub fn render_job(job: &mut Job, options: &Options) -> Outcome {
    job.render(options.seed, Budget::Samples(options.spp), &AtomicBool::new(false), &Silent)
}

/// Renders a scene given as text; files that it names are looked up in the system's folder for temporary files.
pub fn render_text(text: &str, options: &Options) -> Outcome {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, text).expect("the scene can be written");
    render_file(&path, options).expect("the scene renders").0
}

/// Mean over all pixels and its standard error (from the pixels' own variances), per channel.
pub fn image_mean(film: &Film) -> ([f64; 3], [f64; 3]) {
    let image = film.channels();
    let count = image.channel("R").map_or(1, <[f32]>::len) as f64;
    let mean = ["R", "G", "B"]
        .map(|name| image.channel(name).expect("the beauty").iter().map(|v| f64::from(*v)).sum::<f64>() / count);
    let error = ["variance.R", "variance.G", "variance.B"].map(|name| {
        let sum: f64 = image.channel(name).expect("the variance").iter().map(|v| f64::from(*v)).sum();
        sum.sqrt() / count
    });
    (mean, error)
}

/// The number of standard errors that a two-sided test with this false-alarm rate allows.
pub fn critical_z(false_alarm_rate: f64) -> f64 {
    Normal::standard().inverse_cdf(1.0 - false_alarm_rate / 2.0)
}

/// Fails unless `mean` agrees with `expected` within the sampling error, at the false-alarm rate of 1e-6 for a call, plus
/// `slack` (relative) for the rounding of f32 arithmetic.
#[track_caller]
pub fn assert_mean(what: &str, mean: f64, error: f64, expected: f64, slack: f64) {
    let allowed = critical_z(1e-6) * error + slack * expected.abs();
    assert!(
        (mean - expected).abs() <= allowed,
        "{what}: got {mean:.6} ± {error:.6}, expected {expected:.6} ({:+.2} standard errors)",
        (mean - expected) / error.max(1e-30)
    );
}

/// The project's shared data, where this machine has it.
pub fn shared(path: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(path);
    path.exists().then_some(path)
}

/// What can be written as a scene file around a world, and so rendered and compared.
pub trait View {
    /// The whole scene file.
    fn scene(&self, world: &str) -> String;

    /// Renders it.
    fn render(&self, world: &str, options: &Options) -> Outcome {
        render_text(&self.scene(world), options)
    }

    /// Renders it with `spp` samples a pixel and gives the image's mean with its standard error.
    #[track_caller]
    fn mean(&self, world: &str, spp: u32) -> ([f64; 3], [f64; 3]) {
        let outcome = self.render(world, &Options { spp, ..Options::default() });
        assert_eq!(outcome.film.rejected().0, 0, "samples were NaN or infinite");
        image_mean(&outcome.film)
    }

    /// Renders it and compares the image's mean with `expected` by [`assert_mean`], every channel; the standard error itself must
    /// be below `precision` (relative to what is expected), so that the test can see an error of about five times that.
    #[track_caller]
    fn assert(&self, what: &str, world: &str, spp: u32, expected: [f64; 3], precision: f64) {
        let (mean, error) = self.mean(world, spp);
        for channel in 0..3 {
            let (m, e, x) = (mean[channel], error[channel], expected[channel]);
            println!("{what}[{channel}]: {m:.6} ± {e:.6}, expected {x:.6}");
            assert!(e <= precision * x.abs(), "{what}: the error {e:.6} is too large to say much about {x:.6}");
            assert_mean(what, m, e, x, SLACK);
        }
    }
}

impl View for Shot {
    fn scene(&self, world: &str) -> String {
        self.text(world)
    }
}

/// A shot and what else its file says.
#[derive(Default)]
pub struct Framed<'a> {
    pub shot: Shot,
    /// Directives before the camera, such as `MediumInterface`.
    pub before: &'a str,
    /// More parameters of the camera.
    pub camera: &'a str,
}

impl View for Framed<'_> {
    fn scene(&self, world: &str) -> String {
        self.shot.text_with(self.before, self.camera, world)
    }
}

/// Relative rounding error that the mean of an image in f32 may have.
pub const SLACK: f64 = 2e-5;

/// The relative RMSE of two renders' beauty.
pub fn difference(a: &Film, b: &Film) -> f64 {
    let (a, b) = (a.beauty(), b.beauty());
    let squares: f64 = a.pixels.iter().zip(&b.pixels).map(|(x, y)| f64::from(x - y).powi(2)).sum();
    let norm: f64 = a.pixels.iter().map(|x| f64::from(*x).powi(2)).sum();
    (squares / norm).sqrt()
}

/// A floor below it, seen from above.
pub const FLOOR: &str =
    "AttributeBegin Translate 0 -1.2 0 Rotate 90 1 0 0 Material \"diffuse\" \"rgb reflectance\" [0.7 0.6 0.5]
     Shape \"disk\" \"float radius\" 6 AttributeEnd\n";

/// A medium of type `uniformgrid` over the box from −1 to 1 whose 4³ densities are a shuffle of 0 to 1.
pub fn shuffled_grid(name: &str, parameters: &str) -> String {
    let values: Vec<String> = (0..64).map(|i| format!("{:.3}", f64::from(i * 37 % 64) / 63.0)).collect();
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"uniformgrid\" \"integer nx\" 4 \"integer ny\" 4 \"integer nz\" 4
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1] \"float density\" [{}] {parameters}\n",
        values.join(" ")
    )
}

/// The medium `g`: `n`³ voxels of density in the cube from −1 to 1, and what else is said of it.
pub fn grid_medium(n: u32, values: &str, more: &str) -> String {
    format!(
        "MakeNamedMedium \"g\" \"string type\" \"uniformgrid\" \"integer nx\" {n} \"integer ny\" {n} \"integer nz\" {n}
         \"point3 p0\" [-1 -1 -1] \"point3 p1\" [1 1 1] \"float density\" [{values}] {more}\n"
    )
}

/// What a medium says that emits white `radiance`, its density times `scale`.
pub fn glow(scale: f64, radiance: f64) -> String {
    format!("\"float scale\" {scale} \"rgb Le\" [{radiance} {radiance} {radiance}]")
}
