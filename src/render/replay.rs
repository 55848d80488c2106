//! One sample of a render again, with all that happens along its path.
//!
//! A sample's random numbers follow from its address, but what earlier passes taught has a say in what it does with them. So where anything is
//! learned, the passes before its own are rendered again, and in its own pass, where camera rays of a tile share what is known along them, the rays of its tile
//! that come before it. What comes out is the sample of the render to the last bit, whatever the number of threads.

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::DVec3;

use super::pass::{self, Pass, TileGuides};
use super::progress::Tracking;
use super::{Budget, Job, Progress};
use crate::film::{Film, FilmTile, RejectedSample, SampleResult};
use crate::integrator::Scratch;
use crate::integrator::record::{Event, PathRecord, VertexKind};
use crate::math::Rgb;

/// Why a sample cannot be replayed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    /// The pixel is not rendered.
    #[error("there is no pixel {0},{1} in the part of the image that is rendered")]
    Pixel(u32, u32),
    /// The render ends before that sample.
    #[error("there is no sample {sample}: the render takes {} of a pixel, which count from {}", taken.end - taken.start, taken.start)]
    Sample {
        /// Its number.
        sample: u32,
        /// Those that there are.
        taken: Range<u32>,
    },
    /// The replay was stopped.
    #[error("interrupted before the sample was reached")]
    Interrupted,
}

/// What came of a sample.
#[derive(Clone, Debug)]
pub struct Replay {
    /// Which it was.
    pub sample: RejectedSample,
    /// The first sample of the render.
    pub first: u32,
    /// The samples a pixel of the passes before its own.
    pub passes: Vec<u32>,
    /// What it brought, before the sensor.
    pub result: SampleResult,
    /// How that came about.
    pub record: PathRecord,
    /// What to add to positions to have them in the scene's space.
    origin: DVec3,
}

impl Job {
    /// Renders the sample again. `passes` are the samples a pixel of the render's passes; where they are not told they are 1, 1, 2, 4, 8 …
    /// `limit` is how many samples a pixel the render takes in all, where that is known.
    ///
    /// # Errors
    /// A pixel or sample that the render does not have; an interrupt.
    pub fn replay(
        &mut self,
        seed: u32,
        sample: RejectedSample,
        passes: &[u32],
        limit: Option<u32>,
        interrupt: &AtomicBool,
        progress: &dyn Progress,
    ) -> Result<Replay, ReplayError> {
        let [x, y] = sample.pixel;
        if !self.film.bounds.contains(sample.pixel) {
            return Err(ReplayError::Pixel(x, y));
        }
        let first = self.first_sample;
        let taken = first..limit.map_or(u32::MAX, |limit| first.saturating_add(limit));
        if !taken.contains(&sample.sample) {
            return Err(ReplayError::Sample { sample: sample.sample, taken });
        }
        let (passes, own) = passes_up_to(sample.sample - first, passes);
        let done: u32 = passes.iter().sum();
        let end = first.saturating_add(done).saturating_add(own).min(taken.end);
        let is_taught = self.in_scatter.is_some() || self.splits_views || self.world.light_choice.learns();
        let total = if is_taught { done } else { 0 };

        let area = self.film.bounds.area() as u64;
        let tracking = Tracking::new(Budget::Samples(total), total.max(1), area, Instant::now(), progress);
        progress.start(tracking.total());
        let mut film = Film::new(self.film.clone(), false);
        let mut guides = self.guides(&film);
        let mut at = 0;
        for &pass in passes.iter().filter(|_| is_taught) {
            let learns = self.begin_pass(&mut guides, at);
            let samples = first + at..first + at + pass;
            let mut step = pass::step(&samples, samples.start);
            let mut context =
                Pass { job: self, seed, samples, step: 0..0, interrupt, held: &|| false, tracking: &tracking, learns };
            while !step.is_empty() {
                context.step = step.clone();
                let mut ended = vec![false; film.tiles().len()];
                context.run(&mut film, &mut guides, &mut ended);
                step = pass::step(&context.samples, step.end);
            }
            if interrupt.load(Ordering::Relaxed) {
                progress.finish();
                return Err(ReplayError::Interrupted);
            }
            self.learn(&mut guides, pass);
            at += pass;
        }
        progress.finish();

        let learns = self.begin_pass(&mut guides, done);
        let samples = first + done..end;
        // Steps begin anew: what came before this one has no say in it.
        let mut step = pass::step(&samples, samples.start);
        while !step.contains(&sample.sample) && !step.is_empty() {
            step = pass::step(&samples, step.end);
        }
        let context = Pass { job: self, seed, samples, step, interrupt, held: &|| false, tracking: &tracking, learns };
        let tiles = film.tiles().iter().zip(guides.tiles_mut());
        let (result, record) = tiles
            .into_iter()
            .find(|(tile, _)| tile.bounds().contains(sample.pixel))
            .map(|(tile, guides)| context.replay(tile, guides, sample))
            .ok_or(ReplayError::Pixel(x, y))?;
        Ok(Replay { sample, first, passes, result, record, origin: self.origin })
    }
}

/// The samples a pixel of the passes that are over before the pass with the sample of this index begins, and those of that pass.
fn passes_up_to(sample: u32, stated: &[u32]) -> (Vec<u32>, u32) {
    let (mut passes, mut done) = (vec![], 0u32);
    loop {
        let pass = stated.get(passes.len()).copied().unwrap_or(done.max(1));
        match done.checked_add(pass) {
            Some(end) if end <= sample => {
                passes.push(pass);
                done = end;
            }
            _ => return (passes, pass),
        }
    }
}

impl Pass<'_> {
    /// One of the pass's samples, after all rays of the tile that may have a say in it.
    fn replay(
        &self,
        tile: &FilmTile,
        mut guides: TileGuides<'_>,
        RejectedSample { pixel, sample }: RejectedSample,
    ) -> (SampleResult, PathRecord) {
        let mut scratch = Scratch::default();
        let shares = guides.mix.draws();
        if shares {
            self.begin_tile(tile, &mut guides, &mut scratch);
            for before in tile.bounds().pixels().take_while(|before| *before != pixel) {
                self.pixel(tile, before, &mut guides, &mut scratch);
            }
        }
        let mut splitting = self.begin_pixel(tile, pixel, &guides, &mut scratch);
        for before in self.step.start..if shares { sample } else { self.step.start } {
            self.sample(pixel, before, &mut splitting, &mut scratch);
        }
        scratch.record = Some(Box::default());
        let (result, _) = self.sample(pixel, sample, &mut splitting, &mut scratch);
        (result, scratch.record.map(|record| *record).unwrap_or_default())
    }
}

/// Three numbers, in as many digits as they have.
fn colour(c: Rgb) -> String {
    format!("({}, {}, {})", c.0.x, c.0.y, c.0.z)
}

impl fmt::Display for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sample: RejectedSample { pixel: [x, y], sample }, first, passes, result, record, origin } = self;
        let start = first + passes.iter().sum::<u32>();
        writeln!(f, "pixel {x},{y} sample {sample}, of the pass that begins with sample {start}")?;
        let verdict = if result.is_finite() { "" } else { "   <- not finite: left out of the image" };
        writeln!(f, "  value    {}{verdict}", colour(result.beauty))?;
        let SampleResult { emission, direct, indirect, volume, albedo, normal, depth, .. } = result;
        for (name, c) in [("emission", emission), ("direct", direct), ("indirect", indirect), ("volume", volume)] {
            writeln!(f, "  {name:<8} {}", colour(*c))?;
        }
        writeln!(
            f,
            "  albedo   {}, normal ({}, {}, {}), depth {depth}",
            colour(*albedo),
            normal.x,
            normal.y,
            normal.z
        )?;
        writeln!(f, "path:")?;
        for (i, event) in record.events.iter().enumerate() {
            match event {
                Event::Vertex { index, depth, kind, p, throughput, so_far } => {
                    let kind = match kind {
                        VertexKind::Surface => "surface",
                        VertexKind::Medium => "medium",
                    };
                    let [x, y, z] = (p.as_dvec3() + *origin).to_array();
                    write!(
                        f,
                        "  bounce {depth} (ray {index}): {kind} at ({x}, {y}, {z}), throughput {}, so far {}",
                        colour(*throughput),
                        colour(*so_far)
                    )?;
                }
                Event::Light { light, pmf, brought, .. } => {
                    write!(f, "    light {} of probability {pmf} brings {}", light.0, colour(*brought))?;
                }
                Event::Seen { brought } => {
                    write!(f, "  surfaces and environments shine {} straight into the camera", colour(*brought))?;
                }
                Event::End { so_far } => write!(f, "  end, with {} in all", colour(*so_far))?,
            }
            let is_fault = record.first_fault == Some(i);
            writeln!(f, "{}", if is_fault { "   <- the first value that is not finite" } else { "" })?;
        }
        if record.left_out > 0 {
            writeln!(f, "  ({} events more before the end are not shown)", record.left_out)?;
        }
        if record.first_fault.is_none() && !result.is_finite() {
            writeln!(
                f,
                "  no value above is at fault: it is one of those that are not shown (albedo, normal, depth, or a light scattered before the camera)"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_double_unless_they_are_told() {
        let doubling = [
            (0, &[][..], 1),
            (1, &[1], 1),
            (2, &[1, 1], 2),
            (3, &[1, 1], 2),
            (4, &[1, 1, 2], 4),
            (9, &[1, 1, 2, 4], 8),
        ];
        for (sample, before, own) in doubling {
            assert_eq!(passes_up_to(sample, &[]), (before.to_vec(), own), "{sample}");
        }
        assert_eq!(passes_up_to(7, &[1, 1, 2, 3, 5]), (vec![1, 1, 2, 3], 5));
        assert_eq!(passes_up_to(6, &[1, 1, 2, 3, 5]), (vec![1, 1, 2], 3));
        assert_eq!(passes_up_to(u32::MAX, &[]).0.iter().sum::<u32>(), 1 << 31);
    }
}
