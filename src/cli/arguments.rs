//! The command line's grammar, and raw flags made into checked settings.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args, Parser, Subcommand};

use super::checkpoint_arguments::CheckpointArguments;
use super::farm_arguments::FarmArguments;
use super::limit_arguments::LimitArguments;
use super::merge_command::MergeArguments;
use super::share_arguments::ShareArguments;
use super::texture_arguments::TextureArguments;
use crate::bench::suite::Suite;
use crate::bench::{Request, When};
use crate::cache_points::gather::Gathering;
use crate::cache_points::learn::VisibilityRule;
use crate::cache_points::{CacheSettings, DEFAULT_ENTRIES};
use crate::film::{FilmOverrides, RejectedSample};
use crate::geometry::Backend;
use crate::render::{
    Budget, LightSelection, PngOutput, RenderSettings, SamplerKind, ViewRays, VolumeLights, VolumeSampling,
};

/// Renders scenes with very many lights and OpenVDB volumes.
#[derive(Debug, Parser)]
#[command(name = "lanternfish", version, arg_required_else_help = true, after_help = super::EXIT_CODES_HELP)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
#[allow(clippy::large_enum_variant)] // there is one of it in a process
pub enum Command {
    /// Render a pbrt-v4 scene to OpenEXR.
    Render(RenderArguments),
    /// Say what is in a scene, a .vdb, a .nvdb or an .exr file; for a scene also what a render of it would build.
    Info(InfoArguments),
    /// Join images of one frame that have different samples of it.
    Merge(MergeArguments),
    /// Compare two OpenEXR images of the same size and crop.
    Compare(CompareArguments),
    /// Measure error against run time: methods against each other, on scenes of yours or of the project.
    Bench(BenchArguments),
    /// Render scenes, or all in a folder, with a few samples, and say of each whether it works, how long it took and what it warned of.
    Try(TryArguments),
    /// Hand a render to the scheduler of a farm, in parts and frames.
    Farm(FarmArguments),
    /// Write one of the project's own scenes to a folder.
    Scene(SceneArguments),
    /// Check that extreme scenes come out right, case by case.
    Stability(StabilityArguments),
}

/// `lanternfish render`.
#[derive(Args, Debug)]
#[command(group = ArgGroup::new("budget"))]
pub struct RenderArguments {
    /// The scene: pbrt-v4 text, may be gzipped.
    pub scene: PathBuf,
    /// The OpenEXR file to write [default: what the scene's Film says, else the scene's name].
    #[arg(short, long, value_name = "OUT.exr")]
    pub output: Option<PathBuf>,
    /// Also write a PNG: to FILE, or beside the OpenEXR file. Without FILE, give it after SCENE.
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    pub png: Option<Option<PathBuf>>,
    /// Samples per pixel [default: what the scene's Sampler says].
    #[arg(long, group = "budget", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=0x7fff_ffff))]
    pub spp: Option<u32>,
    /// Render for about this long; at least one sample a pixel is taken, however long it takes.
    #[arg(long, group = "budget", value_name = "SECONDS", value_parser = above_zero)]
    pub time: Option<f64>,
    /// Render until the relative error of the image is estimated to be at most this, e.g. 0.01.
    #[arg(long, group = "budget", value_name = "E", value_parser = above_zero)]
    pub error: Option<f64>,
    /// Seed of the random numbers: another seed, another noise [default: what the scene's Sampler says, else 0].
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// Threads [default: one for each processor that the process may use, by its affinity and the quotas of its control groups]. The image does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// How a light is chosen.
    #[arg(long, value_enum, default_value_t = LightSelection::Auto)]
    pub lights: LightSelection,
    /// How readily `--lights tree` draws several lights at a vertex: from 0 (never) to 1 (all, 64 at most) [default: 0.7].
    #[arg(long, value_name = "S", value_parser = fraction)]
    pub splitting: Option<f32>,
    /// From how many candidates, weighed with the BSDF, the light sample of a vertex is resampled; 1 for none.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    pub light_candidates: Option<u32>,
    /// Whether media that emit, given by grids, are chosen as lights.
    #[arg(long, value_enum, default_value_t = VolumeLights::Auto)]
    pub volume_lights: VolumeLights,
    /// How scattering points are sampled along camera rays through media.
    #[arg(long, value_enum, default_value_t = VolumeSampling::Auto)]
    pub volume_sampling: VolumeSampling,
    /// Whether a sample looks for what shines straight into the camera by more rays than its path's where that pays.
    #[arg(long, value_enum, default_value_t = ViewRays::Auto)]
    pub view_rays: ViewRays,
    /// How the samples of a pixel relate to each other.
    #[arg(long, value_enum, default_value_t = SamplerKind::Scene)]
    pub sampler: SamplerKind,
    /// Whether and how cache points learn which lights are hidden.
    #[arg(long, value_enum, default_value_t = VisibilityRule::Clusters, help_heading = "Cache points")]
    pub cache_visibility: VisibilityRule,
    /// How the lights of cache points are gathered.
    #[arg(long, value_enum, default_value_t = Gathering::Hierarchy, help_heading = "Cache points")]
    pub cache_gathering: Gathering,
    /// Keep the lists of cache points as they were gathered: do not make them anew from what was learned.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_refining: bool,
    /// Let cache points begin without knowing what is hidden: trace no pilot paths that try lights before the first pass.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_rehearsal: bool,
    /// Ignore surface normals when cache points are merged and looked up.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_normals: bool,
    /// Go down to each light of a cluster by its importance, also where those are far away, close together and alike.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_alike: bool,
    /// Evaluate only single lights at a vertex where they are near, and clusters of lights nowhere.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_near_clusters: bool,
    /// Give narrow beams no cache points of their own.
    #[arg(long, help_heading = "Cache points")]
    pub cache_no_beams: bool,
    /// Lights and clusters that a cache point keeps at most.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_ENTRIES, value_parser = clap::value_parser!(u32).range(4..=256), help_heading = "Cache points")]
    pub cache_entries: u32,
    /// Candidates for cache points at most [default: a number that suits the image, up to 1.1 million].
    #[arg(long, value_name = "N", help_heading = "Cache points")]
    pub cache_candidates: Option<u32>,
    /// Write a picture of the cache points that no surface hides from the camera, over the image and coloured by radius, and all of
    /// them to a PLY file of the same name.
    #[arg(long, value_name = "FILE.png", help_heading = "Cache points")]
    pub debug_cache_points: Option<PathBuf>,
    /// What images on surfaces may take.
    #[command(flatten)]
    pub textures: TextureArguments,
    /// How it is kept.
    #[command(flatten)]
    pub checkpoints: CheckpointArguments,
    /// Which frames, and what part of each.
    #[command(flatten)]
    pub share: ShareArguments,
    /// What it may take, and how it is told.
    #[command(flatten)]
    pub limits: LimitArguments,
    /// Which library traces rays [default: embree where built in].
    #[arg(long, value_enum)]
    pub backend: Option<Backend>,
    /// Bounces: 1 is direct light only [default: what the scene's Integrator says].
    #[arg(long, value_name = "N")]
    pub max_depth: Option<u32>,
    /// Width and height in pixels in place of the scene's.
    #[arg(long, value_name = "WxH", value_parser = resolution)]
    pub resolution: Option<[u32; 2]>,
    /// The part of the image to render, as fractions of its width and height.
    #[arg(long, value_name = "X0,X1,Y0,Y1", value_parser = crop)]
    pub crop: Option<[f32; 4]>,
    /// Render this one sample of a render with these options again and print what happens along its path; no image is written. Samples
    /// count from 0.
    #[arg(long, value_name = "X,Y,SAMPLE", value_parser = replayed)]
    pub replay: Option<RejectedSample>,
    /// Samples a pixel of each pass of the render that the replayed sample is of [default: 1,1,2,4,8,…]. A render that is given a time is
    /// divided by how long its passes take.
    #[arg(long, value_name = "N,N,…", value_delimiter = ',', requires = "replay", value_parser = clap::value_parser!(u32).range(1..))]
    pub passes: Vec<u32>,
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Refuse damaged data, such as voxels that are not finite, images that cannot be read or lists of the wrong length, instead of replacing it with a warning.
    #[arg(long)]
    pub strict: bool,
    /// Print errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// `lanternfish info`.
#[derive(Args, Debug)]
pub struct InfoArguments {
    /// A scene, a .vdb, a .nvdb or an .exr file.
    pub file: PathBuf,
    /// Of a scene: look for everything that is unused, missing or suspicious as well, and end with 3 if anything is.
    #[arg(long)]
    pub strict: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `lanternfish compare`.
#[derive(Args, Debug)]
pub struct CompareArguments {
    /// The image to judge.
    pub a: PathBuf,
    /// The image to judge it by.
    pub b: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// Write a picture of A, B and |A − B| side by side.
    #[arg(long, value_name = "FILE")]
    pub png: Option<PathBuf>,
}

/// `lanternfish bench`.
#[derive(Args, Debug)]
#[command(after_help = super::bench_command::list(), group = ArgGroup::new("subject").required(true).multiple(false), group = ArgGroup::new("points"))]
pub struct BenchArguments {
    /// The scenes.
    #[arg(group = "subject", value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// One of the project's own sets of scenes, with what was set out to be reached in each.
    #[arg(long, value_enum, group = "subject")]
    pub suite: Option<Suite>,
    /// What is compared, with commas between; the others are compared with the first. May be given several times [default:
    /// auto,uniform,power,tree].
    #[arg(long, value_name = "A,B,NAME=ARGS", allow_hyphen_values = true)]
    pub methods: Vec<String>,
    /// Render with 1, 2, 4 … samples a pixel until the next would take longer than this.
    #[arg(long, group = "points", value_name = "SECONDS", value_parser = above_zero)]
    pub time: Option<f64>,
    /// Samples per pixel of the points of each curve [default: 1,2,4,…,64; suites have their own].
    #[arg(long, group = "points", value_name = "N,N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=0x7fff_ffff))]
    pub spp: Option<Vec<u32>>,
    /// Independent renders of each point [default: 5; suites have their own].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: Option<u32>,
    /// An image of yours to judge by, in place of one that is rendered; its layers `variance.*`, if it has them, tell its own error.
    #[arg(long, value_name = "R.exr", conflicts_with_all = ["reference_spp", "reference_method"])]
    pub reference: Option<PathBuf>,
    /// Samples per pixel of the reference that is rendered [default: 16 times the most of the points; in a suite 8 times].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=0x7fff_ffff))]
    pub reference_spp: Option<u32>,
    /// What renders the reference [default: every light asked at every vertex, where that is affordable, else the tree; null tracking].
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub reference_method: Option<String>,
    /// Width and height in pixels in place of the scene's [default in a suite: 160x90; in those of small images 48x27].
    #[arg(long, value_name = "WxH", value_parser = resolution)]
    pub resolution: Option<[u32; 2]>,
    /// Threads of each render [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Also measure what it saves to leave out what each scene does not need, or that alone: seconds and memory with and without each system that
    /// it leaves out. `--runs`, the last of `--spp` and `--resolution` hold for it too [default: off; in the suites paper, volumes and all also].
    #[arg(long, value_enum, value_name = "off|also|only", num_args = 0..=1, require_equals = true, default_missing_value = "also")]
    pub lean: Option<When>,
    /// The folder for page, numbers, plots and references; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// `lanternfish try`.
#[derive(Args, Debug)]
pub struct TryArguments {
    /// Scenes, and folders to look for scenes in (files .pbrt and .pbrt.gz; those that have no WorldBegin are parts of others).
    #[arg(required = true, value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=0x7fff_ffff))]
    pub spp: u32,
    /// Width and height in place of the scenes' own.
    #[arg(long, value_name = "WxH", value_parser = resolution)]
    pub resolution: Option<[u32; 2]>,
    /// A folder for the images, their PNGs and what each render said; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Time for a scene: one that is not done by then is ended.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, value_parser = above_zero)]
    pub time_limit: f64,
    /// Take missing files, bad voxels and the like as errors.
    #[arg(long)]
    pub strict: bool,
    /// Print JSON when all are done.
    #[arg(long)]
    pub json: bool,
}

/// `lanternfish scene`.
#[derive(Args, Debug)]
#[command(after_help = super::scene_command::list())]
pub struct SceneArguments {
    /// The scene's name: one of those listed below.
    pub name: String,
    /// The folder to write it to; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How many lights it shall have [default and range: see below].
    #[arg(long, value_name = "N")]
    pub lights: Option<u32>,
    /// A .vdb file to show in place of the scene's volume; it is copied to the folder and fitted to the volume's place.
    #[arg(long, value_name = "FILE.vdb")]
    pub vdb: Option<PathBuf>,
}

/// `lanternfish stability`.
#[derive(Args, Debug)]
pub struct StabilityArguments {
    /// Run this case, or all of this group (the part before the dot); may be given several times [default: all].
    #[arg(long, value_name = "NAME")]
    pub case: Vec<String>,
    /// List the cases and what each checks, and run nothing.
    #[arg(long)]
    pub list: bool,
    /// The folder for stability.html, .json and .csv, and for the scenes of cases that fail; made if it is not there.
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// Threads [default: one per processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Time for a case: one that is not done by then fails [default: 120].
    #[arg(long, value_name = "SECONDS", value_parser = above_zero)]
    pub time_limit: Option<f64>,
}

impl BenchArguments {
    /// What the flags ask for, unchecked; `command` is the whole command line.
    pub fn request(&self, command: String) -> Request {
        Request {
            scenes: self.scenes.clone(),
            suite: self.suite,
            methods: self.methods.clone(),
            time: self.time,
            spp: self.spp.clone(),
            runs: self.runs,
            reference: self.reference.clone(),
            reference_method: self.reference_method.clone(),
            reference_spp: self.reference_spp,
            resolution: self.resolution,
            threads: self.threads,
            lean: self.lean,
            out: self.out.clone(),
            command,
        }
    }
}

impl RenderArguments {
    /// The settings that the flags ask for. The grammar has checked each flag and that at most one budget is given.
    pub fn settings(&self) -> RenderSettings {
        let budget = match (self.spp, self.time, self.error) {
            (Some(spp), ..) => Budget::Samples(spp),
            (_, Some(seconds), _) => Budget::Time(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)),
            (_, _, Some(error)) => Budget::Error(error),
            _ => Budget::Scene,
        };
        let png = self.png.as_ref().map(|file| file.clone().map_or(PngOutput::Beside, PngOutput::File));
        RenderSettings {
            output: self.output.clone(),
            png,
            budget,
            share: self.share.share(),
            seed: self.seed,
            frame: None,
            save_cache: self.share.save_cache.clone(),
            load_cache: self.share.load_cache.clone(),
            freeze_cache: self.share.freeze_cache,
            threads: self.threads.map(|n| n as usize),
            lights: self.lights,
            splitting: self.splitting,
            light_candidates: self.light_candidates,
            volume_lights: self.volume_lights,
            volume_sampling: self.volume_sampling,
            view_rays: self.view_rays,
            sampler: self.sampler,
            debug_cache_points: self.debug_cache_points.clone(),
            cache: CacheSettings {
                gathering: self.cache_gathering,
                visibility: self.cache_visibility,
                refine: !self.cache_no_refining,
                rehearse: !self.cache_no_rehearsal,
                normals: !self.cache_no_normals,
                alike: !self.cache_no_alike,
                near_clusters: !self.cache_no_near_clusters,
                beams: !self.cache_no_beams,
                candidates: self.cache_candidates,
                entries: self.cache_entries,
            },
            backend: self.backend,
            max_depth: self.max_depth,
            textures: self.textures.settings(),
            texture_levels: self.textures.texture_levels,
            film: FilmOverrides { resolution: self.resolution, crop: self.crop },
            plan_only: false,
            stats: self.stats.clone(),
            strict: self.strict,
            quiet: self.quiet,
        }
    }
}

fn above_zero(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

fn fraction(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|v: &f32| (0.0..=1.0).contains(v));
    number.ok_or_else(|| "expected a number from 0 to 1".to_owned())
}

fn resolution(text: &str) -> Result<[u32; 2], String> {
    let parse = |part: &str| part.parse().ok().filter(|n| (1..=0x00ff_ffff).contains(n));
    let parts = text.split_once(['x', 'X']).and_then(|(w, h)| Some([parse(w)?, parse(h)?]));
    parts.ok_or_else(|| "expected width x height in pixels, such as 640x360".to_owned())
}

fn replayed(text: &str) -> Result<RejectedSample, String> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, sample]) => Ok(RejectedSample { pixel: [x, y], sample }),
        _ => Err("expected a pixel and the number of its sample: X,Y,SAMPLE".to_owned()),
    }
}

fn crop(text: &str) -> Result<[f32; 4], String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x0, x1, y0, y1]) if 0.0 <= x0 && x0 < x1 && x1 <= 1.0 && 0.0 <= y0 && y0 < y1 && y1 <= 1.0 => {
            Ok([x0, x1, y0, y1])
        }
        _ => Err("expected four fractions X0,X1,Y0,Y1 with 0 ≤ X0 < X1 ≤ 1 and 0 ≤ Y0 < Y1 ≤ 1".to_owned()),
    }
}
