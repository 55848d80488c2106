//! What tells one render from another: a checkpoint serves only the render that it is of.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::material::mip_map::memory::TextureSettings;
use crate::render::{Budget, RenderSettings};
use crate::scene::Sources;

/// Names of what matters, and what each is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity(Vec<(String, String)>);

impl Identity {
    /// That of a render of which nothing else is to be told.
    pub fn named(name: &str) -> Self {
        Self(vec![("the name".to_owned(), name.to_owned())])
    }

    /// That of a render of the scene read from `sources`, which names the other `files`, with these settings and this seed.
    pub fn new(
        sources: &Sources,
        files: &[PathBuf],
        settings: &RenderSettings,
        budget: Budget,
        seed: u32,
        backend: &str,
    ) -> Self {
        let mut list = vec![];
        let mut add = |name: &str, value: String| list.push((name.to_owned(), value));
        add("the version of lanternfish", env!("CARGO_PKG_VERSION").to_owned());
        add("what traces rays", backend.to_owned());
        add("the seed", seed.to_string());
        // What changes no bit of the image: where it goes, who watches, on how many threads and in how much memory.
        let settings = RenderSettings {
            output: None,
            png: None,
            stats: None,
            debug_cache_points: None,
            quiet: false,
            strict: false,
            threads: None,
            seed: None,
            budget,
            textures: TextureSettings::default(),
            ..settings.clone()
        };
        add("the options", format!("{settings:?}"));
        for path in sources.paths() {
            add(&format!("the scene file {}", path.display()), state(path));
        }
        for path in files {
            add(&format!("the file {}", path.display()), state(path));
        }
        Self(list)
    }

    /// The same render, of which this is to be told as well.
    #[must_use]
    pub fn and(mut self, name: &str, value: impl ToString) -> Self {
        self.0.push((name.to_owned(), value.to_string()));
        self
    }

    /// What differs, in words; `None` where nothing does.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let find = |list: &[(String, String)], name: &str| list.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone());
        let names = self.0.iter().chain(&other.0).map(|(name, _)| name);
        let differs = |name: &&String| find(&self.0, name) != find(&other.0, name);
        names.into_iter().find(differs).cloned()
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
