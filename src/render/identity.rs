//! What tells one render from another. A checkpoint serves only the render that it is of; parts of a frame are joined only if they are of one frame; what was learned
//! serves only the scene that it was learned in.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Budget, RenderSettings, Share};
use crate::film::FilmOverrides;
use crate::geometry::Backend;
use crate::material::mip_map::memory::TextureSettings;
use crate::scene::Sources;

/// Names of what matters, and what each is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity(Vec<(String, String)>);

/// The name of what the options are.
const OPTIONS: &str = "the options";

impl Identity {
    /// That of a render of which nothing else is to be told.
    pub fn named(name: &str) -> Self {
        Self(vec![("the name".to_owned(), name.to_owned())])
    }

    /// That of a render of the scene read from `sources`, which is made of these `files`, where `scene_seed` is the scene's. Another render of the same identity has the same bits.
    pub fn of_render(sources: &Sources, files: &[PathBuf], settings: &RenderSettings, scene_seed: u32) -> Self {
        let mut list = vec![program(settings)];
        list.push(("the seed".to_owned(), settings.seed(scene_seed).to_string()));
        list.push((OPTIONS.to_owned(), format!("{:?}", what_shows(settings))));
        let files = sources.paths().map(|path| ("scene file", path)).chain(files.iter().map(|f| ("file", f.as_path())));
        list.extend(files.map(|(kind, path)| (format!("the {kind} {}", path.display()), state(path))));
        Self(list)
    }

    /// That of the frame that the render takes samples of: it does not tell which samples, nor of which seed, and where files are and how old they are does not matter.
    pub fn of_frame(sources: &Sources, files: &[PathBuf], settings: &RenderSettings) -> Self {
        let frame = settings.frame.map_or("none".to_owned(), |frame| frame.to_string());
        Self([Self::of_scene(sources, files, settings).0, vec![("the frame's number".to_owned(), frame)]].concat())
    }

    /// That of the scene and of all options that what is learned depends on: not the resolution.
    pub fn of_lesson(sources: &Sources, files: &[PathBuf], settings: &RenderSettings) -> Self {
        let settings = RenderSettings { film: FilmOverrides::default(), ..settings.clone() };
        Self::of_scene(sources, files, &settings)
    }

    fn of_scene(sources: &Sources, files: &[PathBuf], settings: &RenderSettings) -> Self {
        let settings = RenderSettings {
            share: Share::Whole,
            budget: Budget::Scene,
            frame: None,
            seed: None,
            load_cache: None,
            freeze_cache: false,
            ..what_shows(settings)
        };
        let mut text = crc32fast::Hasher::new();
        sources.texts().for_each(|content| text.update(content.as_bytes()));
        let mut others = crc32fast::Hasher::new();
        for path in files.iter().filter(|path| sources.paths().all(|source| source != path.as_path())) {
            let name = path.file_name().unwrap_or_default().as_encoded_bytes();
            others.update(name);
            others.update(&path.metadata().map_or(0, |metadata| metadata.len()).to_le_bytes());
        }
        Self(vec![
            program(&settings),
            (OPTIONS.to_owned(), format!("{settings:?}")),
            ("the text of the scene".to_owned(), format!("{:08x}", text.finalize())),
            ("one of the files that the scene names".to_owned(), format!("{:08x}", others.finalize())),
        ])
    }

    /// The same render, of which this is to be told as well.
    #[must_use]
    pub fn and(mut self, name: &str, value: impl ToString) -> Self {
        self.0.push((name.to_owned(), value.to_string()));
        self
    }

    /// What differs, in words, and how where that says anything; `None` where nothing does.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let find = |list: &[(String, String)], name: &str| list.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone());
        let names = self.0.iter().chain(&other.0).map(|(name, _)| name);
        let values = |name: &String| [find(&self.0, name), find(&other.0, name)];
        let differs = |name: &&String| {
            let [a, b] = values(name);
            a != b
        };
        let name = names.into_iter().find(differs)?;
        let [a, b] = values(name).map(Option::unwrap_or_default);
        let first = || a.split(", ").zip(b.split(", ")).find(|(a, b)| a != b);
        match first().filter(|_| name == OPTIONS) {
            Some((a, b)) => Some(format!("{name} ({a}, {b})")),
            None => Some(name.clone()),
        }
    }

    /// As text for a header.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// From such text.
    pub fn from_text(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }

    /// A number that tells it from others, as good as surely.
    pub fn digest(&self) -> String {
        let text = self.to_text();
        format!("{:08x}-{}", crc32fast::hash(text.as_bytes()), text.len())
    }
}

/// Goes up with each change of what the same scene and options come to: what an older build kept is not gone on from.
const RESULTS: u32 = 3;

/// What renders.
fn program(settings: &RenderSettings) -> (String, String) {
    let backend = settings.backend.unwrap_or(Backend::DEFAULT).label();
    ("the program".to_owned(), format!("lanternfish {}, results {RESULTS}, with {backend}", env!("CARGO_PKG_VERSION")))
}

/// The settings without what changes no bit of the image: where it goes, who watches, on how many threads and in how much memory.
fn what_shows(settings: &RenderSettings) -> RenderSettings {
    RenderSettings {
        output: None,
        png: None,
        stats: None,
        debug_cache_points: None,
        save_cache: None,
        quiet: false,
        strict: false,
        threads: None,
        seed: None,
        textures: TextureSettings::default(),
        ..settings.clone()
    }
}

/// Length and time of a file.
fn state(path: &Path) -> String {
    let state = || {
        let metadata = path.metadata().ok()?;
        let changed = metadata.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
        Some(format!("{} bytes of {}", metadata.len(), changed.as_nanos()))
    };
    state().unwrap_or_else(|| "missing".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(text: &str) -> Sources {
        let mut sources = Sources::default();
        sources.add("no-such-scene.pbrt", text);
        sources
    }

    #[test]
    fn parts_of_a_frame_are_alike_and_others_are_told_apart() {
        let settings = RenderSettings::default();
        let frame = |settings: &RenderSettings| Identity::of_frame(&sources("a"), &[], settings);
        let whole = frame(&settings);
        let part = RenderSettings {
            share: Share::Part { number: 2, of: 3 },
            seed: Some(4),
            threads: Some(1),
            budget: Budget::Samples(7),
            ..settings.clone()
        };
        assert_eq!(whole.difference(&frame(&part)), None);
        assert_eq!(Identity::from_text(&whole.to_text()), Some(whole.clone()));
        let render = |settings: &RenderSettings| Identity::of_render(&sources("a"), &[], settings, 0);
        let told = render(&settings).difference(&render(&part)).expect("another render");
        assert!(told.contains("the seed"), "{told}");
        assert_ne!(render(&settings).digest(), render(&part).digest());
        let told = whole.difference(&frame(&RenderSettings { frame: Some(3), ..settings.clone() }));
        assert_eq!(told.as_deref(), Some("the frame's number"));
        let told = whole.difference(&frame(&RenderSettings { max_depth: Some(3), ..settings.clone() }));
        assert_eq!(told.as_deref(), Some("the options (max_depth: None, max_depth: Some(3))"));
        let told = whole.difference(&Identity::of_frame(&sources("b"), &[], &settings));
        assert_eq!(told.as_deref(), Some("the text of the scene"));
        let smaller = RenderSettings {
            film: FilmOverrides { resolution: Some([4, 4]), crop: None },
            frame: Some(9),
            ..settings.clone()
        };
        assert!(whole.difference(&frame(&smaller)).is_some());
        let lesson = |settings: &RenderSettings| Identity::of_lesson(&sources("a"), &[], settings);
        assert_eq!(lesson(&settings).difference(&lesson(&smaller)), None);
    }
}
