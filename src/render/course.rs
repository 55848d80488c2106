//! The course of a render: pass after pass over the image, each a loop over tiles, until it is good enough, out of time, or told to stop. Between two tiles it can
//! be kept, and go on from there another time to the same bits.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::checkpoint::{Keeper, Kept, KeptRef, OpenPass, Rest, RestRef};
use super::pass::{Guides, Pass, step};
use super::progress::Tracking;
use super::splitting::Splitting;
use super::stats::Iteration;
use super::{Budget, Job, Outcome, Progress};
use crate::film::Film;
use crate::integrator::Counters;
use crate::medium::Medium;
use crate::system::clock::cpu_seconds;

/// Samples a pixel at most, where time or error decide.
pub(super) const MAX_SAMPLES: u32 = 1 << 24;

/// An error estimate from fewer samples a pixel than this is not trusted to stop a render.
const MIN_SAMPLES_FOR_ERROR: u32 = 8;

/// An image that is black although something shines is not believed before this many: what is seen of the light may be rare.
const MIN_SAMPLES_OF_BLACK: u32 = 1024;

/// Where tiles that were begun are finished, this stops none of them.
static NEVER: AtomicBool = AtomicBool::new(false);

/// How far a render has come.
pub(super) struct Course {
    film: Film,
    guides: Guides,
    /// Of the passes that are over.
    counters: Counters,
    iterations: Vec<Iteration>,
    /// Samples a pixel of the passes that are over.
    done: u32,
    pass: Option<OpenPass>,
    /// Seconds that it took before this process.
    before: f64,
}

impl Course {
    /// From the start.
    pub fn new(job: &Job) -> Self {
        let film = Film::new(job.film.clone(), job.aovs);
        let guides = job.guides(&film);
        let counters = Counters::default();
        Self { film, guides, counters, iterations: vec![], done: 0, pass: None, before: 0.0 }
    }

    /// From where it was kept; `None` where that does not fit the scene.
    pub fn from(job: &mut Job, kept: Kept) -> Option<Self> {
        let Kept { tiles, rest } = kept;
        let Rest { mixing, splitting, learned, counters, iterations, done, pass, seconds } = rest;
        let mut course = Self { counters, iterations, done, pass, before: seconds, ..Self::new(job) };
        let count = tiles.len();
        let fits = course.film.restore(tiles)
            && course.guides.restore(mixing, splitting)
            && course.pass.as_ref().is_none_or(|pass| pass.ended.len() == count)
            && job.world.light_choice.relearn(learned);
        fits.then_some(course)
    }

    /// Goes on to the end.
    pub fn run(
        mut self,
        job: &mut Job,
        seed: u32,
        budget: Budget,
        interrupt: &AtomicBool,
        progress: &dyn Progress,
        keeper: Option<&Keeper>,
    ) -> Outcome {
        let now = Instant::now();
        let start = now.checked_sub(Duration::try_from_secs_f64(self.before).unwrap_or_default()).unwrap_or(now);
        let limit = match budget {
            Budget::Scene => job.scene_spp,
            Budget::Samples(spp) => spp,
            Budget::Time(_) | Budget::Error(_) => MAX_SAMPLES,
        };
        let pixels = job.film.bounds.area() as u64;
        let may_be_lit = !job.world.lights.is_empty() || job.world.media.iter().any(Medium::is_emissive);
        let is_over = |course: &Self| course.is_over(limit, budget, may_be_lit);
        let tracking = Tracking::new(budget, limit, pixels, start, progress);
        progress.start(tracking.total());
        tracking.tiles_ended(self.samples_so_far());
        let mut due = keeper.map(|keeper| keeper.next(tracking.samples(), pixels));
        while !is_over(&self) {
            if interrupt.load(Ordering::Relaxed) {
                self.keep(job, keeper, start);
                break;
            }
            if self.pass.is_none() {
                let Some(samples) = self.next_pass(limit, budget, start) else { break };
                self.begin_pass(job, samples);
            }
            let held = || match (keeper, due) {
                (Some(keeper), Some(due)) => {
                    interrupt.load(Ordering::Relaxed) || keeper.is_due(due, tracking.samples())
                }
                _ => false,
            };
            let cut = if keeper.is_some() { &NEVER } else { interrupt };
            self.go_on(job, seed, cut, &held, &tracking);
            if !self.is_pass_over() {
                if !held() && !cut.load(Ordering::Relaxed) && !job.world.materials.has_failed() {
                    // A step of the pass is over.
                    continue;
                }
                if job.world.materials.has_failed() {
                    break;
                }
                self.keep(job, keeper, start);
                due = keeper.map(|keeper| keeper.next(tracking.samples(), pixels));
                if interrupt.load(Ordering::Relaxed) {
                    break;
                }
                continue;
            }
            self.end_pass(job, limit);
            tracking.pass_ended(self.film.error_estimate());
        }
        let interrupted = interrupt.load(Ordering::Relaxed) && !is_over(&self);
        if let Some(pass) = self.pass.take() {
            self.note(&pass, [0.0; 2]);
        }
        progress.finish();
        job.timings.first_sample = tracking.first_tile();
        job.timings.render = start.elapsed().as_secs_f64();
        let Self { film, guides, counters, iterations, done, .. } = self;
        Outcome { film, samples_per_pixel: done, counters, iterations, guides, interrupted }
    }

    /// Samples over all pixels, those that were rejected included.
    fn samples_so_far(&self) -> u64 {
        let area = |done: u32| u64::from(done) * self.film.settings().bounds.area() as u64;
        let open = self.pass.as_ref().map_or(0, |pass| {
            let [first, end] = &pass.samples;
            let tiles = self.film.tiles().iter().zip(&pass.ended).filter(|(_, ended)| **ended);
            let now = step(&(*first..*end), pass.step).len() as u64;
            let ended: u64 = tiles.map(|(tile, _)| tile.bounds().area() as u64 * now).sum();
            area(pass.step - first) + ended
        });
        area(self.done) + open
    }

    /// Whether nothing is left to do.
    fn is_over(&self, limit: u32, budget: Budget, may_be_lit: bool) -> bool {
        if self.pass.is_some() {
            return false;
        }
        let Budget::Error(target) = budget else { return self.done >= limit };
        let is_good = || {
            let enough = if may_be_lit && self.film.is_black() { MIN_SAMPLES_OF_BLACK } else { MIN_SAMPLES_FOR_ERROR };
            self.done >= enough && self.film.error_estimate().is_some_and(|error| error <= target)
        };
        self.done >= limit || self.done >= MIN_SAMPLES_FOR_ERROR && is_good()
    }

    /// Samples a pixel of the next pass: 1, 1, 2, 4, 8 …, so that the image's sample count doubles; `None` where there is no time for one more.
    fn next_pass(&self, limit: u32, budget: Budget, start: Instant) -> Option<u32> {
        let mut samples = self.done.max(1).min(limit - self.done);
        if let (Budget::Time(budget), true) = (budget, self.done > 0) {
            let spent = start.elapsed().as_secs_f64();
            let affordable = (budget.as_secs_f64() - spent) / (spent / f64::from(self.done));
            if affordable < 1.0 {
                return None;
            }
            samples = samples.min(affordable as u32);
        }
        Some(samples)
    }

    fn begin_pass(&mut self, job: &mut Job, samples: u32) {
        let learns = job.begin_pass(&mut self.guides, self.done);
        let view_rays = self.guides.splitting.as_ref().map_or(0.0, Splitting::mean);
        let first = job.first_sample + self.done;
        self.pass = Some(OpenPass {
            samples: [first, first + samples],
            step: first,
            learns,
            ended: vec![false; self.film.tiles().len()],
            counters: Counters::default(),
            points: self.guides.mixing.summary(),
            view_rays,
        });
    }

    /// Renders tiles of the open pass that are not done, until it is `held`, or `cut` even within a pixel.
    fn go_on(
        &mut self,
        job: &Job,
        seed: u32,
        cut: &AtomicBool,
        held: &(dyn Fn() -> bool + Sync),
        tracking: &Tracking<'_>,
    ) {
        let Some(OpenPass { samples: [first, end], step: at, learns, ended, counters, .. }) = &mut self.pass else {
            return;
        };
        let samples = *first..*end;
        let now = step(&samples, *at);
        let context = Pass { job, seed, samples, step: now.clone(), interrupt: cut, held, tracking, learns: *learns };
        *counters += context.run(&mut self.film, &mut self.guides, ended);
        if now.end < *end && ended.iter().all(|&ended| ended) {
            *at = now.end;
            ended.fill(false);
        }
    }

    fn is_pass_over(&self) -> bool {
        self.pass.as_ref().is_some_and(|pass| {
            let is_last = step(&(pass.samples[0]..pass.samples[1]), pass.step).end == pass.samples[1];
            is_last && pass.ended.iter().all(|&ended| ended)
        })
    }

    /// All tiles of the pass are done: takes over what it taught, if another one follows.
    fn end_pass(&mut self, job: &mut Job, limit: u32) {
        let Some(pass) = self.pass.take() else { return };
        let [first, end] = pass.samples;
        self.done = end - job.first_sample;
        let (start, cpu) = (Instant::now(), cpu_seconds());
        if self.done < limit || job.teaches {
            job.learn(&mut self.guides, end - first);
        }
        self.note(&pass, [start.elapsed().as_secs_f64(), cpu_seconds() - cpu]);
    }

    /// Takes down what was done in a pass, and the seconds by the clock and of processors that learning from it took.
    fn note(&mut self, pass: &OpenPass, learning: [f64; 2]) {
        let [first, end] = pass.samples;
        self.counters += pass.counters;
        let mut iteration = Iteration::new(end - first, &pass.counters);
        [iteration.in_scatter_regions, iteration.in_scatter_points] = pass.points;
        iteration.view_rays = pass.view_rays;
        [iteration.learning, iteration.learning_cpu] = learning;
        self.iterations.push(iteration);
    }

    fn keep(&self, job: &Job, keeper: Option<&Keeper>, start: Instant) {
        let Some(keeper) = keeper else { return };
        let rest = RestRef {
            mixing: &self.guides.mixing,
            splitting: &self.guides.splitting,
            learned: job.world.light_choice.learned(),
            counters: self.counters,
            iterations: &self.iterations,
            done: self.done,
            pass: self.pass.as_ref(),
            seconds: start.elapsed().as_secs_f64(),
        };
        keeper.keep(&KeptRef { tiles: self.film.tiles(), rest });
    }
}
