//! Renders that are stopped again and again, and go on from what was kept, end with the bits of one that was not.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::Duration;

use lanternfish::film::ChannelImage;
use lanternfish::integrator::Counters;
use lanternfish::render::checkpoint::{Interval, Keeper, read};
use lanternfish::render::identity::Identity;
use lanternfish::render::{Budget, Job, LightSelection, Outcome, Progress, ProgressState, Silent, VolumeSampling};
use lanternfish::scene::Warnings;

use super::determinism::{crowd, picture, same_bits, scene};
use crate::common::{Options, Shot, View, prepare_file};

/// Sets a flag after so many tiles.
struct After<'a> {
    tiles: AtomicI64,
    flag: &'a AtomicBool,
}

impl Progress for After<'_> {
    fn start(&self, _: Option<u64>) {}
    fn update(&self, _: &ProgressState) {
        if self.tiles.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.flag.store(true, Ordering::Relaxed);
        }
    }
    fn finish(&self) {}
}

/// One process of many: begins from the checkpoint, if there is one, and is stopped after `tiles` tiles.
fn one_of_many(path: &Path, scene: &Path, options: &Options, tiles: i64) -> Outcome {
    let mut job = prepare(scene, options);
    let (stop, asked) = (AtomicBool::new(false), AtomicBool::new(false));
    let identity = Identity::named("this");
    let from = read(path, &identity).expect("it is whole");
    // Some checkpoints are made on the way, the last one when it is stopped.
    let keeper = Keeper::new(path.to_owned(), identity, Interval::Samples(3), &asked);
    let listener = After { tiles: AtomicI64::new(tiles), flag: &stop };
    let budget = Budget::Samples(options.spp);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().expect("threads");
    let outcome = pool.install(|| job.render_kept(options.seed, budget, &stop, &listener, &keeper, from));
    keeper.settle().expect("it can be written");
    outcome.expect("it is of this scene")
}

fn prepare(scene: &Path, options: &Options) -> Job {
    prepare_file(scene, options, &mut Warnings::default()).expect("the scene can be prepared")
}

fn whole(outcome: &Outcome) -> (ChannelImage, Counters, u32, usize) {
    let Outcome { film, counters, samples_per_pixel, iterations, .. } = outcome;
    (film.channels(), *counters, *samples_per_pixel, iterations.len())
}

/// Stops a render of `text` after various numbers of tiles, until it is through.
fn goes_on(what: &str, text: &str, options: &Options) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.pbrt");
    std::fs::write(&file, text).expect("the scene can be written");
    let uninterrupted =
        prepare(&file, options).render(options.seed, Budget::Samples(options.spp), &AtomicBool::new(false), &Silent);
    let (expected, counters, spp, iterations) = whole(&uninterrupted);
    for steps in [[1, 2, 3], [7, 11, 4], [13, 1, 9]] {
        let path = folder.path().join(format!("{}.checkpoint", steps[0]));
        let mut stops = 0;
        let outcome = loop {
            // On one thread and on several in turn.
            let options = Options { threads: 1 + stops % 3, ..options.clone() };
            let outcome = one_of_many(&path, &file, &options, steps[stops % 3]);
            if !outcome.interrupted {
                break outcome;
            }
            stops += 1;
            assert!(stops < 500, "{what}: it never ends");
        };
        println!("{what}: {stops} stops");
        assert!(stops > 2, "{what}: stopped {stops} times");
        let (image, ..) = whole(&outcome);
        same_bits(what, &image, &expected);
        assert_eq!(whole(&outcome).1, counters, "{what}");
        assert_eq!((whole(&outcome).2, whole(&outcome).3), (spp, iterations), "{what}");
    }
}

#[test]
fn renders_go_on_to_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let world = format!("{}{}", crowd(), scene(&picture(folder.path())));
    let shot = Shot { from: [0.0, 0.6, -4.5], to: [0.0, 0.1, 0.0], fov: 45.0, size: 40, depth: 4 };
    let text = shot.scene(&world);
    let base = Options { spp: 16, ..Options::default() };
    let points = Options { lights: LightSelection::CachePoints, ..base.clone() };
    goes_on("as it comes", &text, &base);
    goes_on("cache points", &text, &points);
    let beside = Options { lights: LightSelection::Optimal, volume_sampling: VolumeSampling::Both, ..base.clone() };
    goes_on("cache points beside", &text, &beside);
    // What a film may hold besides, and a filter with negative lobes.
    let sinc =
        text.replace("WorldBegin", "PixelFilter \"sinc\" WorldBegin").replace("Film \"rgb\"", "Film \"gbuffer\"");
    assert_ne!(sinc, text);
    goes_on("a film of everything", &sinc, &base);
}

#[test]
fn what_is_damaged_or_of_another_render_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = Shot { size: 20, ..Shot::default() }.scene("LightSource \"infinite\" \"rgb L\" [1 1 1]");
    let file = folder.path().join("scene.pbrt");
    std::fs::write(&file, text).expect("the scene can be written");
    let path = folder.path().join("kept");
    let options = Options { spp: 4, ..Options::default() };
    assert!(one_of_many(&path, &file, &options, 1).interrupted);
    let good = std::fs::read(&path).expect("it was kept");
    let mine = Identity::named("this");
    assert!(read(&path, &mine).is_ok_and(|kept| kept.is_some()));
    let error = read(&path, &Identity::named("that")).err().expect("it is another").to_string();
    assert!(error.contains("another render"), "{error}");
    assert!(read(&folder.path().join("none"), &mine).is_ok_and(|kept| kept.is_none()));
    for length in (0..good.len()).step_by(good.len() / 100 + 1) {
        std::fs::write(&path, &good[..length]).expect("written");
        assert!(read(&path, &mine).is_err(), "{length}");
    }
    for place in (0..good.len()).step_by(good.len() / 300 + 1).chain(0..40) {
        let mut bad = good.clone();
        bad[place] ^= 1 << (place % 8);
        std::fs::write(&path, bad).expect("written");
        assert!(read(&path, &mine).is_err(), "{place}");
    }
    // Of an image of another size.
    std::fs::write(&path, &good).expect("written");
    let text = Shot { size: 40, ..Shot::default() }.scene("LightSource \"infinite\" \"rgb L\" [1 1 1]");
    std::fs::write(&file, text).expect("the scene can be written");
    let asked = AtomicBool::new(false);
    let keeper = Keeper::new(path.clone(), mine.clone(), Interval::Time(Duration::from_secs(60)), &asked);
    let from = read(&path, &mine).expect("it is whole");
    let stop = AtomicBool::new(false);
    let outcome = prepare(&file, &options).render_kept(options.seed, Budget::Samples(4), &stop, &Silent, &keeper, from);
    assert!(outcome.is_err());
}
