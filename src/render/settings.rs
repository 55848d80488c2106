//! What a render was asked to do, checked: the command line's flags and whatever other front end there is end up here.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::share::Share;
use crate::cache_points::CacheSettings;
use crate::film::FilmOverrides;
use crate::geometry::Backend;
use crate::geometry::differentials::SampleShare;
use crate::material::mip_map::memory::TextureSettings;
use crate::math::sampler::mix;
use crate::scene::Warnings;

/// When to stop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Budget {
    /// After the samples per pixel that the scene's sampler states.
    #[default]
    Scene,
    /// After this many samples per pixel; at least 1.
    Samples(u32),
    /// After this much rendering time.
    Time(Duration),
    /// When [`crate::film::Film::error_estimate`] is at most this; above 0.
    Error(f64),
}

/// How a light is chosen at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSelection {
    /// Whatever suits the number of lights.
    #[default]
    Auto,
    /// All alike.
    Uniform,
    /// By power.
    Power,
    /// By the unoccluded contribution of every light at the vertex: slow and the best there is without visibility.
    Optimal,
    /// By what the nearest of many points in space knows of the lights, visibility learned while rendering.
    CachePoints,
    /// By a hierarchy over the lights: each choice in the time of a few dozen lights, however many there are.
    Tree,
}

/// Whether media that emit are chosen as lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum VolumeLights {
    /// All that are given by grids.
    #[default]
    Auto,
    /// None: what they emit is found by rays that happen to meet it.
    Off,
}

/// How scattering points are sampled along camera rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeSampling {
    /// By null tracking, and by in-scatter sampling as well in those regions of the image where that pays.
    #[default]
    Auto,
    /// By null tracking alone.
    Null,
    /// By in-scatter sampling wherever cache points expect light to be scattered.
    InScatter,
    /// By both everywhere, weighed by multiple importance sampling.
    Both,
    /// By both everywhere, and paths go on from the points that in-scatter sampling finds as well.
    Paths,
    /// By null tracking and by equi-angular sampling everywhere: the lights are known, what hides them is not. For comparison.
    EquiAngular,
}

/// How often what shines straight into the camera is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ViewRays {
    /// By more camera rays than paths where they disagree about it: at the edges of lamps, small ones above all.
    #[default]
    Auto,
    /// By the paths' own camera rays alone.
    Off,
}

/// How the samples of a pixel relate to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SamplerKind {
    /// As the scene says: independent for pbrt's sampler of that name, else Owen-scrambled Sobol' points.
    #[default]
    Scene,
    /// Each is where the others are not: Owen-scrambled Sobol' points.
    Sobol,
    /// By chance. Noisier; the variance that is estimated from the samples is that of the image, and errors fall as n^-1/2 to the letter.
    Independent,
}

/// At which level of detail images on surfaces are looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureLevels {
    /// At that whose texels are about as large as what the ray covers (ray differentials).
    #[default]
    Auto,
    /// At the finest, whatever the ray covers: the samples of a pixel do all the filtering.
    Finest,
}

/// Where a PNG goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PngOutput {
    /// Beside the EXR file, with its name.
    Beside,
    /// To this file.
    File(PathBuf),
}

/// Everything that a render can be told besides its scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderSettings {
    /// The EXR file; `None` for what the scene says.
    pub output: Option<PathBuf>,
    /// The PNG file, if any.
    pub png: Option<PngOutput>,
    /// When to stop.
    pub budget: Budget,
    /// Which of the frame's samples to take; of a budget in samples, or of what the scene says.
    pub share: Share,
    /// Seed of all random numbers; `None` for what the scene's sampler says.
    pub seed: Option<u32>,
    /// Number of threads; `None` for one per processor.
    pub threads: Option<usize>,
    /// The frame's number in its sequence.
    pub frame: Option<i32>,
    /// Where what was learned goes, for other renders.
    pub save_cache: Option<PathBuf>,
    /// What another render has learned.
    pub load_cache: Option<PathBuf>,
    /// Whether that is all that is known of lights and of scattering points: nothing more is learned.
    pub freeze_cache: bool,
    /// How a light is chosen.
    pub lights: LightSelection,
    /// Whether media that emit are chosen as lights.
    pub volume_lights: VolumeLights,
    /// How scattering points are sampled along camera rays.
    pub volume_sampling: VolumeSampling,
    /// How often what shines straight into the camera is asked for.
    pub view_rays: ViewRays,
    /// How the samples of a pixel relate to each other.
    pub sampler: SamplerKind,
    /// The PNG file that shows the cache points that the camera sees, over the image; all of them go to a PLY file of the same name.
    pub debug_cache_points: Option<PathBuf>,
    /// How cache points are made and used.
    pub cache: CacheSettings,
    /// How readily [`LightSelection::Tree`] draws several lights at a vertex, 0 (never) to 1 (all); `None` for its default.
    pub splitting: Option<f32>,
    /// From how many candidates the light sample of a vertex is resampled, at least 1 (no resampling); `None` for what suits the selector.
    pub light_candidates: Option<u32>,
    /// Which library traces rays; `None` for Embree where it is built in.
    pub backend: Option<Backend>,
    /// Bounces; `None` for what the scene says.
    pub max_depth: Option<u32>,
    /// How much memory images on surfaces may take, and where their tiles are kept.
    pub textures: TextureSettings,
    /// Whether textures are looked up as finely as rays are thin.
    pub texture_levels: TextureLevels,
    /// Resolution and crop in place of the scene's.
    pub film: FilmOverrides,
    /// Whether only the plan is wanted: cache points are not built then.
    pub plan_only: bool,
    /// Where statistics go as JSON.
    pub stats: Option<PathBuf>,
    /// Whether doubtful input is an error rather than a warning.
    pub strict: bool,
    /// Whether only errors are printed.
    pub quiet: bool,
}

impl RenderSettings {
    /// The EXR file to write: the one asked for, else the one that the scene names (its ending made `.exr`), else the scene
    /// file's name with `.exr`. The latter two are looked up from the current folder.
    pub fn output_path(&self, scene: &Path, named: Option<&str>) -> PathBuf {
        if let Some(path) = &self.output {
            return path.clone();
        }
        let name = named.filter(|name| !name.is_empty()).map(PathBuf::from).unwrap_or_else(|| {
            let mut name = PathBuf::from(scene.file_name().unwrap_or("image".as_ref()));
            if name.extension().is_some_and(|e| e == "gz") {
                name.set_extension("");
            }
            name
        });
        name.with_extension("exr")
    }

    /// The seed of all random numbers where the scene asks for `scene_seed`: each frame of a sequence has one of its own, so that its noise is too.
    pub fn seed(&self, scene_seed: u32) -> u32 {
        let seed = self.seed.unwrap_or(scene_seed);
        self.frame.map_or(seed, |frame| mix(u64::from(seed) << 32 | u64::from(frame as u32)) as u32)
    }

    /// What part of a pixel each of its samples stands for where textures are looked up; `None` where they are looked up at their finest.
    pub fn texture_share(&self, scene_spp: u32) -> Option<SampleShare> {
        let samples = match self.budget {
            Budget::Scene => scene_spp,
            Budget::Samples(samples) => samples,
            // As many as it takes: more than make a difference.
            Budget::Time(_) | Budget::Error(_) => u32::MAX,
        };
        (self.texture_levels == TextureLevels::Auto).then(|| SampleShare::of(samples))
    }

    /// The PNG file to write beside `output`, if one was asked for.
    pub fn png_path(&self, output: &Path) -> Option<PathBuf> {
        self.png.as_ref().map(|png| match png {
            PngOutput::Beside => output.with_extension("png"),
            PngOutput::File(path) => path.clone(),
        })
    }

    /// Warns of options that another selector of lights would need. Whoever states a default loses nothing, and is not warned.
    pub fn warn_ignored(&self, warnings: &mut Warnings) {
        let mut ignored = |option: &str, selector: &str| {
            warnings.add(None, format!("{option} is ignored: only --lights {selector} uses it"));
        };
        if self.splitting.is_some() && self.lights != LightSelection::Tree {
            ignored("--splitting", "tree");
        }
        // `auto` builds cache points where there are many lights; in-scatter sampling has them beside any selector.
        let draws =
            matches!(self.volume_sampling, VolumeSampling::InScatter | VolumeSampling::Both | VolumeSampling::Paths);
        if !draws && !matches!(self.lights, LightSelection::Auto | LightSelection::CachePoints) {
            let CacheSettings {
                gathering,
                visibility,
                refine,
                rehearse,
                normals,
                alike,
                near_clusters,
                beams,
                candidates,
                entries,
            } = self.cache;
            let default = CacheSettings::default();
            for (option, differs) in [
                ("--cache-visibility", visibility != default.visibility),
                ("--cache-gathering", gathering != default.gathering),
                ("--cache-no-refining", refine != default.refine),
                ("--cache-no-rehearsal", rehearse != default.rehearse),
                ("--cache-no-normals", normals != default.normals),
                ("--cache-no-alike", alike != default.alike),
                ("--cache-no-near-clusters", near_clusters != default.near_clusters),
                ("--cache-no-beams", beams != default.beams),
                ("--cache-entries", entries != default.entries),
                ("--cache-candidates", candidates != default.candidates),
            ] {
                if differs {
                    ignored(option, "cache-points");
                }
            }
        }
    }
}
