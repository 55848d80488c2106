//! What the command line asks for.

use super::common::{argument, flag, text_argument};

/// The scenes and the numbers of lights that they get unless told otherwise: few, so that all takes minutes.
const SCENES: [(&str, u64); 6] =
    [("pier", 200_000), ("foliage", 3_000), ("house", 4_406), ("rooms", 2_000), ("beams", 24), ("lamp", 1)];

/// The scenes for comparing ways of sampling scattering points, with the numbers of lights that they have.
const SCATTERING: [(&str, u64); 6] =
    [("beams", 24), ("godrays", 2), ("torch", 1), ("fire", 1), ("cloud", 2), ("explosion", 3)];

/// More lights than this are too many to ask each at every sample.
const MANY: u64 = 100_000;

pub struct Settings {
    /// Scenes and their numbers of lights.
    pub scenes: Vec<(String, u64)>,
    pub size: String,
    pub spp: u32,
    /// Samples a pixel of [`super::variants::OPTIMAL`], where they were asked for.
    optimal_spp: Option<u32>,
    /// Samples a pixel of both halves of a reference.
    pub reference_spp: u32,
    pub first_seed: u64,
    pub seeds: u64,
    /// Of what is timed without an image to judge.
    pub repetitions: u64,
    /// Columns that are left out.
    pub without: Vec<String>,
    pub columns: bool,
    pub ablations: bool,
    /// Whether ways of sampling scattering points are compared instead of ways of selecting lights.
    pub sampling: bool,
    /// Numbers of lights of the scene whose time per sample is compared.
    pub many: Option<[u64; 2]>,
}

impl Settings {
    pub fn from_command_line() -> Self {
        let list = |name: &str| -> Vec<String> {
            text_argument(name).map_or(vec![], |text| text.split(',').map(str::to_owned).collect())
        };
        let sampling = flag("sampling");
        let all = if sampling { SCATTERING } else { SCENES };
        let mut scenes: Vec<(String, u64)> = all.map(|(name, lights)| (name.to_owned(), lights)).to_vec();
        for pair in list("lights-of") {
            let wanted = pair.split_once('=').and_then(|(name, n)| Some((name, n.parse().ok()?)));
            match wanted.and_then(|(name, n)| Some((scenes.iter_mut().find(|(other, _)| other == name)?, n))) {
                Some((scene, lights)) => scene.1 = lights,
                None => refuse(&format!("--lights-of {pair}: SCENE=NUMBER, of the scenes {}", names(all))),
            }
        }
        let only = list("scenes");
        let is_known = |name: &&String| *name == "none" || scenes.iter().any(|(other, _)| other == *name);
        if let Some(unknown) = only.iter().find(|name| !is_known(name)) {
            refuse(&format!("--scenes {unknown}: some of {}, or none", names(all)));
        }
        scenes.retain(|(name, _)| only.is_empty() || only.contains(name));
        let spp = argument("spp", 16).max(1) as u32;
        Self {
            scenes,
            size: text_argument("size").unwrap_or_else(|| "160x90".to_owned()),
            spp,
            optimal_spp: text_argument("optimal-spp")
                .map(|_| argument("optimal-spp", spp.into()).clamp(1, spp.into()) as u32),
            reference_spp: argument("reference-spp", 16 * u64::from(spp)).max(2) as u32,
            first_seed: argument("first-seed", 1),
            seeds: argument("seeds", 3).max(1),
            repetitions: argument("repetitions", 7).max(1),
            without: list("without"),
            columns: !flag("no-columns"),
            ablations: !flag("no-ablations"),
            sampling,
            many: flag("many").then(|| [argument("few-lights", 5_000), argument("many-lights", 5_000_000)]),
        }
    }

    /// Samples a pixel of [`super::variants::OPTIMAL`] under so many lights: fewer than `spp` where it takes too long.
    pub fn optimal_spp(&self, lights: u64) -> u32 {
        let usual = if lights > MANY { (self.spp / 4).max(1) } else { self.spp };
        self.optimal_spp.unwrap_or(usual)
    }

    /// The seeds of the renders; those of references are elsewhere.
    pub fn seeds(&self) -> impl Iterator<Item = u64> {
        self.first_seed..self.first_seed + self.seeds
    }
}

fn names(scenes: [(&str, u64); 6]) -> String {
    scenes.map(|(name, _)| name).join(", ")
}

fn refuse(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(2);
}
