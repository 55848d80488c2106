//! What was asked for, checked.

use std::path::PathBuf;

use super::BenchError;
use super::goals::Goal;
use super::lean::When;
use super::method::Method;
use super::suite;

/// What the command line says, as it says it.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// A suite in place of them.
    pub suite: Option<suite::Suite>,
    /// Lists of methods.
    pub methods: Vec<String>,
    /// Seconds that the longest render may take.
    pub time: Option<f64>,
    /// Samples a pixel of each point.
    pub spp: Option<Vec<u32>>,
    /// Independent renders of each point.
    pub runs: Option<u32>,
    /// The user's own reference.
    pub reference: Option<PathBuf>,
    /// What makes the reference.
    pub reference_method: Option<String>,
    /// Its samples a pixel.
    pub reference_spp: Option<u32>,
    /// Width and height in place of the scene's.
    pub resolution: Option<[u32; 2]>,
    /// Threads of each render.
    pub threads: Option<u32>,
    /// When it is measured what leaving out saves.
    pub lean: Option<When>,
    /// The folder of the results.
    pub out: PathBuf,
    /// The whole command, for the report.
    pub command: String,
}

/// The points of a curve.
#[derive(Clone, Debug, PartialEq)]
pub enum Levels {
    /// These samples a pixel, rising.
    Samples(Vec<u32>),
    /// 1, 2, 4 … until the next is expected to take more seconds than this.
    Time(f64),
}

/// What a scene is made from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// The user's file.
    File(PathBuf),
    /// One of the gallery's, with this many lights.
    Gallery(&'static str, u32),
}

/// A scene to measure.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name in the report; no two are alike.
    pub name: String,
    /// Where it comes from.
    pub origin: Origin,
    /// What is compared; all others are compared with the first.
    pub methods: Vec<Method>,
    /// What makes the reference, unless it is chosen.
    pub reference: Option<Method>,
    /// How many lights × pixels × samples exhaustive methods may ask.
    pub most_questions: Option<f64>,
    /// What was set out to be reached.
    pub goals: Vec<Goal>,
}

/// What is to be done.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The scenes.
    pub entries: Vec<Entry>,
    /// The points of each curve.
    pub levels: Levels,
    /// Independent renders of each point; their seeds are 1, 2 ….
    pub runs: u32,
    /// The user's own reference.
    pub reference: Option<PathBuf>,
    /// Samples a pixel of the reference, where they were said.
    pub reference_spp: Option<u32>,
    /// Width and height in place of the scenes'.
    pub resolution: Option<[u32; 2]>,
    /// Threads of each render.
    pub threads: Option<u32>,
    /// What is measured of what leaving out saves.
    pub lean: Lean,
    /// The folder of the results.
    pub out: PathBuf,
    /// The whole command.
    pub command: String,
}

/// What is said of renders with and without what a scene leaves out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lean {
    /// When there are any.
    pub when: When,
    /// Rounds, if they were said.
    pub runs: Option<u32>,
    /// Samples a pixel, if they were said.
    pub spp: Option<u32>,
    /// Width and height, if they were said.
    pub resolution: Option<[u32; 2]>,
}

/// What is compared where nothing is said.
const METHODS: &str = "auto,uniform,power,tree";
/// Runs where nothing is said: with 5, the 95 % interval is 2.8 standard errors to either side.
const RUNS: u32 = 5;

impl Settings {
    /// Checks what was asked for.
    ///
    /// # Errors
    /// [`BenchError::Usage`] with what is wrong.
    pub fn check(request: Request) -> Result<Self, BenchError> {
        let usage = |text: String| Err(BenchError::Usage(text));
        let Request { scenes, suite, methods, time, spp, runs, reference, reference_method, .. } = request;
        let own = match methods.as_slice() {
            [] => None,
            lists => Some(Method::parse_list(lists).map_err(BenchError::Usage)?),
        };
        let judge = reference_method.map(|text| Method::parse(&text)).transpose().map_err(BenchError::Usage)?;
        let mut entries = match suite {
            Some(suite) => suite.entries(),
            None => {
                let methods = match &own {
                    Some(methods) => methods.clone(),
                    None => Method::parse_list(&[METHODS.to_owned()]).map_err(BenchError::Usage)?,
                };
                entries(&scenes, &methods)
            }
        };
        for entry in &mut entries {
            if let Some(methods) = &own {
                entry.methods = methods.clone();
            }
            entry.reference = judge.clone().or(entry.reference.take());
        }
        if entries.is_empty() {
            return usage("nothing to measure: name scenes, or a suite".to_owned());
        }
        if reference.is_some() && entries.len() > 1 {
            return usage("--reference is the image of one scene, and there are several".to_owned());
        }
        let lean = Lean {
            when: request.lean.unwrap_or(match suite {
                None | Some(suite::Suite::Small | suite::Suite::Slopes) => When::Off,
                Some(_) => When::Also,
            }),
            runs,
            spp: spp.as_ref().and_then(|list| list.last().copied()),
            resolution: request.resolution,
        };
        let levels = match (time, spp) {
            (Some(time), _) => Levels::Time(time),
            (None, Some(spp)) => {
                if spp.is_empty() || spp[0] == 0 || !spp.windows(2).all(|pair| pair[0] < pair[1]) {
                    return usage("--spp: numbers above 0, each larger than the one before".to_owned());
                }
                Levels::Samples(spp)
            }
            (None, None) => Levels::Samples(suite.map_or((0..=6).map(|i| 1 << i).collect(), suite::Suite::levels)),
        };
        let runs = runs.unwrap_or(suite.map_or(RUNS, suite::Suite::runs));
        if runs == 0 {
            return usage("--runs: at least 1, and at least 2 to know how sure it is".to_owned());
        }
        Ok(Self {
            entries,
            levels,
            runs,
            reference,
            reference_spp: request.reference_spp,
            resolution: request.resolution.or(suite.map(suite::Suite::resolution)),
            threads: request.threads,
            lean,
            out: request.out,
            command: request.command,
        })
    }

    /// Every method that is used anywhere.
    pub fn methods(&self) -> impl Iterator<Item = &Method> {
        self.entries.iter().flat_map(|entry| entry.methods.iter().chain(&entry.reference))
    }

    /// The seeds of the renders; those of references are elsewhere.
    pub fn seeds(&self) -> impl Iterator<Item = u32> {
        1..=self.runs
    }
}

/// The user's scenes, named by their files.
fn entries(scenes: &[PathBuf], methods: &[Method]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = vec![];
    for path in scenes {
        let file = path.file_name().map_or("scene".into(), |name| name.to_string_lossy());
        let stem = file.strip_suffix(".gz").unwrap_or(&file);
        let stem = stem.strip_suffix(".pbrt").unwrap_or(stem);
        let free = |name: &String| !entries.iter().any(|other| other.name == *name);
        let numbered = (2..).map(|i| format!("{stem}-{i}"));
        let name = std::iter::once(stem.to_owned()).chain(numbered).find(free).unwrap_or_default();
        entries.push(Entry {
            name,
            origin: Origin::File(path.clone()),
            methods: methods.to_vec(),
            reference: None,
            most_questions: None,
            goals: vec![],
        });
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(change: impl FnOnce(&mut Request)) -> Result<Settings, String> {
        let mut request = Request { scenes: vec!["a/room.pbrt.gz".into(), "b/room.pbrt".into()], ..Request::default() };
        change(&mut request);
        Settings::check(request).map_err(|error| error.to_string())
    }

    #[test]
    fn defaults_are_filled_in() {
        let settings = check(|_| ()).expect("two scenes are enough");
        let names: Vec<&str> = settings.entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["room", "room-2"]);
        assert_eq!(settings.levels, Levels::Samples(vec![1, 2, 4, 8, 16, 32, 64]));
        assert_eq!((settings.runs, settings.entries[1].methods.len()), (5, 4));
        let suite = check(|request| request.suite = Some(suite::Suite::All)).expect("a suite");
        assert_eq!((suite.runs, suite.resolution), (3, Some([160, 90])));
        assert!(suite.entries.len() > 10);
        let small = check(|request| request.suite = Some(suite::Suite::Small)).expect("a suite");
        assert_eq!((small.runs, small.levels, small.lean.when), (6, Levels::Samples(vec![4, 16]), When::Off));
        assert_eq!([settings.lean.when, suite.lean.when], [When::Off, When::Also]);
    }

    #[test]
    fn nonsense_is_refused_in_words() {
        let refused = |change: fn(&mut Request)| check(change).expect_err("nonsense");
        assert!(refused(|request| request.scenes.clear()).contains("nothing to measure"));
        assert!(refused(|request| request.runs = Some(0)).contains("--runs"));
        for list in [vec![0], vec![2, 1], vec![4, 4], vec![]] {
            assert!(check(|request| request.spp = Some(list)).expect_err("nonsense").contains("--spp"));
        }
        assert!(refused(|request| request.methods = vec!["best".into()]).contains("\"best\""));
        assert!(refused(|request| request.reference = Some("r.exr".into())).contains("one scene"));
    }
}
