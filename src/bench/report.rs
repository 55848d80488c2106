//! All that is reported, as it is written to JSON.

use std::path::PathBuf;

use serde::Serialize;

use super::bar::Bar;
use super::crops::Crops;
use super::curve::Curve;
use super::goals::Goal;
use super::lean::{self, LeanReport};
use super::reference::About;
use super::settings::{Levels, Settings};
use super::subject::Subject;
use super::{machine, tables};

/// What was measured, on what, and how.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The command.
    pub command: String,
    /// Version of this program.
    pub version: &'static str,
    /// Processor and threads.
    pub machine: String,
    /// Processes that wanted to run when it began, where the system tells.
    pub load: Option<f64>,
    /// Independent renders of each point.
    pub runs: u32,
    /// Samples a pixel of the points; none where time decides.
    pub spp: Vec<u32>,
    /// Seconds of the longest render, where they decide.
    pub time: Option<f64>,
    /// The scenes that are done.
    pub scenes: Vec<SceneReport>,
    /// What was set out to be reached.
    pub bars: Vec<Bar>,
    /// What leaving out saves in each scene, where that was asked for.
    pub lean: Vec<LeanReport>,
    /// Pictures of each scene.
    #[serde(skip)]
    pub crops: Vec<Crops>,
}

/// What was measured in a scene.
#[derive(Debug, Serialize)]
pub struct SceneReport {
    /// Its name.
    pub name: String,
    /// Its file.
    pub file: PathBuf,
    /// Lights.
    pub lights: usize,
    /// Width and height of what was rendered.
    pub pixels: [u32; 2],
    /// What traced its rays, with its version.
    pub backend: String,
    /// What the images are judged by.
    pub reference: About,
    /// Each method; the others are compared with the first.
    pub curves: Vec<Curve>,
    /// What to know besides.
    pub notes: Vec<String>,
    #[serde(skip)]
    goals: Vec<Goal>,
}

impl SceneReport {
    /// Of these curves.
    pub fn new(
        subject: &Subject,
        reference: About,
        backend: String,
        curves: Vec<Curve>,
        mut notes: Vec<String>,
    ) -> Self {
        let hidden: usize =
            curves.iter().map(|curve| curve.points.iter().filter(|point| !point.is_above_reference).count()).sum();
        if hidden > 0 {
            notes.push(format!(
                "{hidden} points are not above the reference's own error: they are hollow (○), or not in the plots, and slopes leave them out: what tables say of them is right on average at best. \
                 A better reference has more samples (--reference-spp) or another method (--reference-method)"
            ));
        }
        Self {
            name: subject.entry.name.clone(),
            file: subject.file.clone(),
            lights: subject.lights,
            pixels: [subject.bounds.width(), subject.bounds.height()],
            backend,
            reference,
            curves,
            notes,
            goals: subject.entry.goals.clone(),
        }
    }

    /// The curve of a method.
    pub fn curve(&self, method: &str) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.method.name == method)
    }
}

impl Report {
    /// Without scenes.
    pub fn new(settings: &Settings) -> Self {
        let (spp, time) = match &settings.levels {
            Levels::Samples(list) => (list.clone(), None),
            Levels::Time(seconds) => (vec![], Some(*seconds)),
        };
        Self {
            command: settings.command.clone(),
            version: env!("CARGO_PKG_VERSION"),
            machine: machine::machine(),
            load: machine::load(),
            runs: settings.runs,
            spp,
            time,
            scenes: vec![],
            bars: vec![],
            lean: vec![],
            crops: vec![],
        }
    }

    /// A scene is done.
    pub fn add(&mut self, scene: SceneReport, crops: Crops) {
        self.bars.extend(scene.goals.iter().filter_map(|goal| goal.judge(&scene)));
        self.scenes.push(scene);
        self.crops.push(crops);
    }

    /// What traced rays: `, embree 4.3.0`.
    fn backends(&self) -> String {
        let mut names: Vec<&str> = self.scenes.iter().map(|scene| scene.backend.as_str()).collect();
        names.dedup();
        names.iter().map(|name| format!(", {name}")).collect()
    }

    /// Command, version, machine: a line each.
    pub fn about(&self) -> Vec<String> {
        let load = self.load.map_or(String::new(), |load| format!("; {load} processes wanted to run when it began"));
        let points = match self.time {
            Some(seconds) => format!("1, 2, 4 … samples a pixel, up to {seconds} s a render"),
            None => format!("samples a pixel: {}", self.spp.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")),
        };
        let mut about = vec![
            self.command.clone(),
            format!("lanternfish {} ({}){}", self.version, env!("LANTERNFISH_TARGET"), self.backends()),
            format!("machine: {}{load}", self.machine),
        ];
        if !self.scenes.is_empty() {
            about.push(format!("{points}; {} independent runs of each, seeds 1 to {}", self.runs, self.runs));
        }
        about
    }

    /// What to print when all is done.
    pub fn text(&self) -> String {
        let mut text = self.about().join("\n") + "\n";
        for scene in &self.scenes {
            tables::summary(scene).iter().for_each(|table| text += &table.text());
        }
        if !self.bars.is_empty() {
            text += &super::bar::table(&self.bars).text();
        }
        self.lean.iter().for_each(|report| text += &lean::tables::costs(report).text());
        text
    }
}
