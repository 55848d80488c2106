//! What is to be rendered on a farm, checked, and how it divides into tasks.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A render of a still or of a sequence of frames, shared out over tasks. Names are absolute, so that they mean the same on every machine that
/// sees the same files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FarmJob {
    /// The program that renders and merges.
    pub program: String,
    /// The scene; `####` stands for the number of the frame where there are frames.
    pub scene: String,
    /// The image; the same.
    pub output: String,
    /// The folder for scripts, logs and parts. No `#` stands in it where there are frames.
    pub folder: String,
    /// The folder that names in `options` are relative to.
    pub working_folder: String,
    /// Into how many parts the samples of each pixel are divided, at least 1.
    pub parts: u32,
    /// The frames, the last one included; `None` for a still.
    pub frames: Option<RangeInclusive<i32>>,
    /// How many frames a task renders one after the other, at least 1.
    pub frames_per_task: u32,
    /// Let the first samples of each frame teach its parts; see [`FarmJob::has_lesson`].
    pub teaches: bool,
    /// Keep the parts when they are merged.
    pub keep_parts: bool,
    /// Options of `lanternfish render`, for every task.
    pub options: Vec<String>,
    /// The PNG that merges write too, named as the image is: see [`FarmJob::hand_over_png`].
    pub png: Option<String>,
}

/// Why a job cannot be handed to a farm.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum FarmError {
    /// A name that scripts and templates cannot hold.
    #[error("{0:?} cannot be rendered on a farm: names must be UTF-8 without line breaks and other control characters")]
    Name(PathBuf),
    /// A word that scripts cannot hold.
    #[error("{0:?} cannot be handed to a farm: there are line breaks or other control characters in it")]
    Word(String),
    /// The number of a frame in the name of the folder that all frames share.
    #[error("{0}: all frames share this folder, so no # may stand in its name; name another with --folder")]
    Numbered(String),
    /// Slurm takes a backslash in the name of a log for an order to leave it as it is.
    #[error("{0}: Slurm cannot write logs to a folder with a backslash in its name; name another with --folder")]
    Backslash(String),
    /// Something that is no option of `sbatch`.
    #[error("--sbatch {0}: expected an option of sbatch such as --partition=night")]
    Sbatch(String),
    /// An option of the render that would have several tasks write one file.
    #[error("{0} cannot be used here: {1}")]
    Option(&'static str, &'static str),
    /// More than a parameter of a job template may hold.
    #[error("{0} takes {1} characters, and Open Job Description allows 1024 for a parameter")]
    Long(&'static str, usize),
}

/// Options that write files beyond the image, or something else than an image. `merge` does not write them.
const OF_WHOLE_RENDERS: [&str; 5] = ["--png", "--stats", "--debug-cache-points", "--save-cache", "--replay"];

const EVERY_FRAME: &str = "every frame would write the same file; put #### in its name";

impl FarmJob {
    /// Checks what the types do not say.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), FarmError> {
        if self.frames.is_some() && self.folder.contains('#') {
            return Err(FarmError::Numbered(self.folder.clone()));
        }
        if let Some(word) = self.options.iter().find(|word| word.chars().any(char::is_control)) {
            return Err(FarmError::Word(word.clone()));
        }
        for name in OF_WHOLE_RENDERS.into_iter().filter(|name| self.has_option(name)) {
            if self.parts > 1 {
                return Err(FarmError::Option(name, "every part of a frame would write the same file"));
            }
            if self.frames.is_some() && self.value_of(name).is_some_and(|file| !file.contains('#')) {
                return Err(FarmError::Option(name, EVERY_FRAME));
            }
        }
        if self.frames.is_some() && self.png.as_ref().is_some_and(|file| !file.contains('#')) {
            return Err(FarmError::Option("--png", EVERY_FRAME));
        }
        Ok(())
    }

    /// Where a frame has parts, a PNG that the options ask for is not theirs but that of the merged image: hands it over to the merges.
    ///
    /// # Errors
    /// A name that scripts cannot hold.
    pub fn hand_over_png(&mut self) -> Result<(), FarmError> {
        const PNG: &str = "--png";
        if self.parts == 1 || !self.has_option(PNG) {
            return Ok(());
        }
        let file = match self.value_of(PNG) {
            Some(file) => self.absolute(Path::new(file))?,
            None => plain_name(&Path::new(&self.output).with_extension("png"))?,
        };
        let with_value = self.options.iter().any(|word| word == PNG) && self.value_of(PNG).is_some();
        let at = self.options.iter().position(|word| is_option(word, PNG)).unwrap_or(0);
        self.options.drain(at..=at + usize::from(with_value));
        self.png = Some(file);
        Ok(())
    }

    /// A name that is relative to the folder that options are.
    fn absolute(&self, path: &Path) -> Result<String, FarmError> {
        plain_name(&Path::new(&self.working_folder).join(path))
    }

    /// The value that the options give to `name`.
    fn value_of(&self, name: &str) -> Option<&str> {
        let mut words = self.options.iter().skip_while(|word| !is_option(word, name));
        match words.next()?.split_once('=') {
            Some((_, value)) => Some(value),
            None => words.next().map(String::as_str).filter(|word| !word.starts_with('-')),
        }
    }

    /// Whether the first samples of each frame are a task of their own that the parts wait for, and learn from: where there are parts, samples enough as far as the options say, and
    /// no other teacher is named.
    pub fn has_lesson(&self) -> bool {
        let samples = self.value_of("--spp").and_then(|value| value.parse::<u32>().ok());
        let are_enough = samples.is_none_or(|samples| samples > self.parts);
        self.teaches && self.parts > 1 && are_enough && !self.has_option("--load-cache")
    }

    /// Whether the options say something of `name`.
    pub fn has_option(&self, name: &str) -> bool {
        self.options.iter().any(|word| is_option(word, name))
    }

    /// How many tasks it takes for one part of all frames.
    pub fn chunks(&self) -> u64 {
        let frames =
            self.frames.as_ref().map_or(1, |frames| (i64::from(*frames.end()) - i64::from(*frames.start()) + 1) as u64);
        frames.div_ceil(u64::from(self.frames_per_task))
    }

    /// How many tasks render.
    pub fn tasks(&self) -> u64 {
        self.chunks() * u64::from(self.parts)
    }

    /// What people call it: the image's name without ending and frame.
    pub fn label(&self) -> String {
        label(Path::new(&self.output))
    }

    /// The image's file name without its ending: what the names of parts begin with.
    pub fn stem(&self) -> String {
        Path::new(&self.output).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
    }
}

/// Whether a word of a command line is the option `name`, with or without its value.
fn is_option(word: &str, name: &str) -> bool {
    word.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('='))
}

fn label(output: &Path) -> String {
    let stem = output.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().replace('#', ""));
    match stem.trim_end_matches(['.', '_', '-', ' ']) {
        "" => "render".to_owned(),
        label => label.to_owned(),
    }
}

/// The folder for what the farm needs, beside the image.
pub fn default_folder(output: &Path) -> PathBuf {
    output.with_file_name(label(output) + ".farm")
}

/// A path as scripts and templates can hold it: absolute, with symbolic links left as they are.
///
/// # Errors
/// Where it is not UTF-8 or has control characters in it.
pub fn plain_name(path: &Path) -> Result<String, FarmError> {
    let wrong = || FarmError::Name(path.to_owned());
    let path = std::path::absolute(path).map_err(|_| wrong())?;
    let name = path.to_str().ok_or_else(wrong)?;
    if name.chars().any(char::is_control) { Err(wrong()) } else { Ok(name.to_owned()) }
}
