//! Sets of the gallery's scenes, with what is compared in each and what was set out to be reached there.

use super::bar::Bound::{self, AtLeast, AtMost};
use super::goals::{Goal, Quantity};
use super::method::Method;
use super::settings::{Entry, Origin};

/// Exhaustive methods take no more samples than this allows, in lights × pixels × samples: minutes.
const MOST_QUESTIONS: f64 = 3e9;

/// A set of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Suite {
    /// Ways of choosing lights: the comparison of Li et al. 2024.
    Paper,
    /// Ways of sampling scattering points.
    Volumes,
    /// Both.
    All,
    /// A minute's look at both, in two scenes without .vdb files: what continuous integration watches.
    Small,
    /// Whether the errors of all methods that are unbiased fall as t^-1/2. Samples are independent there, since stratified ones are better than that; camera rays are not
    /// split, since where they are is learned all the time; and errors are looked at from 16 samples a pixel on, in images large enough that lights are learned by then.
    Slopes,
}

/// Ways of choosing lights.
const LIGHTS: [&str; 6] = ["cache-points", "uniform", "power", "tree", "optimal", "no-visibility"];
/// Ways of sampling scattering points.
const SCATTERING: [&str; 5] = ["auto", "null", "in-scatter", "both", "equi-angular"];

/// Scenes for the former, and their numbers of lights.
const PAPER: [(&str, u32); 6] =
    [("pier", 200_000), ("foliage", 3_000), ("house", 4_406), ("rooms", 2_000), ("beams", 24), ("lamp", 1)];
/// Scenes for the latter.
const VOLUMES: [(&str, u32); 6] =
    [("torch", 1), ("godrays", 2), ("fire", 1), ("cloud", 2), ("explosion", 3), ("beams", 24)];

/// Where slopes are measured. There are few lights, so that each method's error is one of many small parts and not of a few large ones.
const SLOPES: [((&str, u32), &[&str]); 2] = [(("rooms", 300), &LIGHTS), (("godrays", 2), &SCATTERING)];

/// What the small suite compares in each of its scenes.
const SMALL: [((&str, u32), &[&str]); 2] =
    [(("rooms", 300), &["cache-points", "uniform", "tree"]), (("godrays", 2), &["auto", "null"])];

impl Suite {
    /// The scenes of it.
    pub fn entries(self) -> Vec<Entry> {
        let paper = || PAPER.iter().map(|&scene| entry("lights", scene, &LIGHTS));
        let volumes = || VOLUMES.iter().map(|&scene| entry("volumes", scene, &SCATTERING));
        match self {
            Self::Paper => paper().collect(),
            Self::Volumes => volumes().collect(),
            Self::All => paper().chain(volumes()).collect(),
            Self::Small => SMALL.iter().map(|&(scene, methods)| entry("small", scene, methods)).collect(),
            Self::Slopes => SLOPES.iter().map(|&(scene, methods)| entry("slopes", scene, methods)).collect(),
        }
    }

    /// Width and height of the images.
    pub const fn resolution(self) -> [u32; 2] {
        if matches!(self, Self::Small) { [48, 27] } else { [160, 90] }
    }

    /// Independent renders of each point: with 3, the 95 % interval is 4.3 standard errors to either side, with 4 it is 3.2, with 6 it is 2.6.
    pub const fn runs(self) -> u32 {
        match self {
            Self::Small => 6,
            Self::Slopes => 4,
            Self::Paper | Self::Volumes | Self::All => 3,
        }
    }

    /// Samples a pixel of the points.
    pub fn levels(self) -> Vec<u32> {
        match self {
            Self::Small => vec![4, 16],
            Self::Slopes => vec![16, 32, 64, 128],
            Self::Paper => vec![2, 8, 32],
            Self::Volumes | Self::All => vec![1, 2, 4, 8, 16, 32],
        }
    }
}

fn entry(set: &str, (scene, lights): (&'static str, u32), methods: &'static [&'static str]) -> Entry {
    // Null tracking meets thin haze so seldom that a reference by it would be noisier than what it is to judge. Scattering points everywhere
    // are sampled instead, as by none of the methods that are the default; null tracking is among those compared, and its bias is shown.
    let in_haze = set == "volumes" || matches!(scene, "beams" | "godrays");
    // So do ways of choosing that know nothing of what a beam lights.
    let chosen = if scene == "beams" { "cache-points" } else { "optimal" };
    let method = |name: &&str| {
        let mut method = Method::known(name)?;
        if set == "slopes" {
            method.arguments.extend(["--sampler", "independent", "--view-rays", "off"].map(str::to_owned));
        }
        Some(method)
    };
    Entry {
        name: format!("{set}-{scene}"),
        origin: Origin::Gallery(scene, lights),
        methods: methods.iter().filter_map(method).collect(),
        reference: in_haze.then(|| Method {
            name: format!("{chosen}-both"),
            arguments: ["--lights", chosen, "--volume-sampling", "both"].map(str::to_owned).to_vec(),
        }),
        most_questions: Some(MOST_QUESTIONS),
        goals: match set {
            "lights" => goals_of_lights(scene),
            "volumes" => goals_of_volumes(scene),
            "slopes" => methods.iter().map(|of| Goal::Slope { of }).collect(),
            _ => vec![],
        },
    }
}

fn goals_of_lights(scene: &str) -> Vec<Goal> {
    let goal = |of: &'static str, least: f64| Goal::Times {
        of,
        over: "cache-points",
        quantity: Quantity::GatheredTtuv,
        bound: AtLeast(least),
    };
    let error = |of: &'static str, most: f64| Goal::Times {
        of,
        over: "optimal",
        quantity: Quantity::GatheredRmse,
        bound: AtMost(most),
    };
    match scene {
        // Where `optimal` has to do with fewer samples, only TTUV compares.
        "pier" => vec![goal("uniform", 2.0), goal("optimal", 10.0), goal("tree", 1.0)],
        "foliage" => {
            let errors = [error("no-visibility", 1.05), error("cache-points", 1.0)];
            [goal("uniform", 6.5), goal("optimal", 1.3), goal("tree", 1.0)].into_iter().chain(errors).collect()
        }
        "house" => {
            let errors = [error("no-visibility", 1.05), error("cache-points", 0.85)];
            [goal("uniform", 3.5), goal("optimal", 1.4), goal("tree", 2.0)].into_iter().chain(errors).collect()
        }
        "rooms" => vec![goal("tree", 2.0)],
        _ => vec![],
    }
}

fn goals_of_volumes(scene: &str) -> Vec<Goal> {
    match scene {
        "beams" | "godrays" => vec![ttuv("null", "auto", AtLeast(5.0)), ttuv("equi-angular", "auto", AtLeast(1.5))],
        "cloud" => {
            vec![Goal::Times { of: "auto", over: "null", quantity: Quantity::RenderingTime, bound: AtMost(1.03) }]
        }
        _ => vec![],
    }
}

fn ttuv(of: &'static str, over: &'static str, bound: Bound) -> Goal {
    Goal::Times { of, over, quantity: Quantity::Ttuv, bound }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_in_the_gallery_and_every_goal_is_measured() {
        for entry in Suite::All.entries().into_iter().chain(Suite::Small.entries()).chain(Suite::Slopes.entries()) {
            let Origin::Gallery(scene, lights) = entry.origin else { panic!("{} is a file", entry.name) };
            let scene = crate::gallery::find(scene).unwrap_or_else(|| panic!("{scene} is not there"));
            assert!(scene.lights.contains(&lights), "{}", entry.name);
            assert!(entry.methods.len() >= 2);
            for goal in &entry.goals {
                let measured = |name: &str| entry.methods.iter().any(|method| method.name == name);
                assert!(goal.methods().into_iter().all(measured), "{goal:?}");
            }
        }
    }
}
