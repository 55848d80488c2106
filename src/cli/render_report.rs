//! What `lanternfish render` says once it has rendered: how it went, what only rendering could tell to be wrong, and the command that renders a sample again.

use std::path::Path;

use bytesize::ByteSize;

use serde::Serialize;

use super::diagnostics::say;
use super::log::{self, Level};
use crate::film::{Film, RejectedSample};
use crate::integrator::Counters;
use crate::integrator::path::MOST_BOUNCES;
use crate::material::mip_map::cache::TileCacheStatistics;
use crate::medium::regions::MAX_OVERLAP;
use crate::render::Outcome;
use crate::render::stats::Statistics;

/// The last line in JSON: what the render came to, in numbers.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Conclusion<'a> {
    output: &'a Path,
    /// By the clock, of all steps; of those before an interruption only the rendering.
    seconds: f64,
    cpu_seconds: f64,
    /// Bytes.
    peak_memory: u64,
    /// How many there were.
    warnings: u64,
    samples_per_pixel: u32,
    error: Option<f64>,
    interrupted: bool,
}

/// Says in JSON how the render went: the last line of one that ends well.
pub(super) fn conclude(output: &Path, statistics: &Statistics, outcome: &Outcome) {
    if log::is_json() {
        let conclusion = Conclusion {
            output,
            seconds: statistics.seconds.total(),
            cpu_seconds: statistics.cpu_seconds,
            peak_memory: statistics.peak_memory,
            warnings: log::warnings(),
            samples_per_pixel: statistics.samples_per_pixel,
            error: statistics.error,
            interrupted: outcome.interrupted,
        };
        log::write_json(Level::Info, &speed(output, statistics), Some(conclusion));
    }
}

/// Says how the render went.
pub(super) fn summarise(output: &Path, statistics: &Statistics, outcome: &Outcome) {
    if !log::is_json() {
        say(speed(output, statistics));
    }
    if let Some(TileCacheStatistics { limit, held, hit_rate, .. }) = statistics.texture_cache {
        let (limit, held) = (ByteSize(limit), ByteSize(held));
        say(format!(
            "textures: at most {held} of tiles in memory, of {limit}; {:.2} % of look-ups found theirs",
            100.0 * hit_rate
        ));
    }
    if outcome.interrupted {
        say("interrupted: the image holds what was done by then");
    }
}

/// How fast it was, how good the image is, and how many warnings there were.
fn speed(output: &Path, statistics: &Statistics) -> String {
    let Counters { closest_rays, shadow_rays, flight_steps, transmittance_steps, .. } = statistics.counters;
    let rays = (closest_rays + shadow_rays) as f64;
    let mut line = format!(
        "{}: {} spp in {:.1} s, {:.2} Mray/s",
        output.display(),
        statistics.samples_per_pixel,
        statistics.seconds.render,
        rays / statistics.seconds.render.max(1e-9) * 1e-6
    );
    if flight_steps + transmittance_steps > 0 {
        let steps = (flight_steps + transmittance_steps) as f64;
        line += &format!(", {:.2} Mstep/s in media", steps / statistics.seconds.render.max(1e-9) * 1e-6);
    }
    if let Some(error) = statistics.error {
        line += &format!(", error {:.2} %", error * 100.0);
    }
    match log::warnings() {
        0 => {}
        1 => line += ", 1 warning",
        warnings => line += &format!(", {warnings} warnings"),
    }
    line
}

/// What only rendering could tell to be wrong.
pub(super) fn after_the_fact(outcome: &Outcome, replay: Option<&str>) -> Vec<String> {
    let mut warnings = vec![];
    warnings.extend(of_rejected(&outcome.film, replay).map(|fault| format!("warning: {fault}")));
    let cut = outcome.counters.cut_paths;
    if cut > 0 {
        let share = 100.0 * cut as f64 / outcome.counters.paths as f64;
        warnings.push(format!(
            "warning: {cut} paths ({share:.2} %) were ended after {MOST_BOUNCES} bounces: the image is too dark by what they would have brought"
        ));
    }
    let overflows = outcome.counters.region_overflows;
    if overflows > 0 {
        warnings.push(format!(
            "warning: the image is wrong: {overflows} times a path met more than {MAX_OVERLAP} media in one place and left one out"
        ));
    }
    warnings
}

/// What a film has to say of samples that were left out, if there are any.
pub(super) fn of_rejected(film: &Film, replay: Option<&str>) -> Option<String> {
    let (count, first) = film.rejected();
    let RejectedSample { pixel: [x, y], sample } = first?;
    let mut text = if count == 1 {
        format!("1 sample was NaN or infinite and left out: pixel {x},{y} sample {sample}")
    } else {
        format!("{count} samples were NaN or infinite and left out, first at pixel {x},{y} sample {sample}")
    };
    if let Some(replay) = replay {
        text += &format!("; this replays it: {replay}");
    }
    Some(text)
}

/// The command that replays a sample of the render that `arguments` (the program's name included) asked for. `passes` are told where
/// they do not follow from the samples a pixel.
pub(super) fn replay_command(
    mut arguments: impl Iterator<Item = String>,
    RejectedSample { pixel: [x, y], sample }: RejectedSample,
    passes: impl Iterator<Item = u32>,
    frame: Option<i32>,
) -> String {
    // The program and the word `render`. Before all other arguments there is no place where an option would be taken for something else.
    let mut words: Vec<String> = arguments.by_ref().take(2).collect();
    if let Some(frame) = frame {
        words.push(format!("--frames={frame}"));
    }
    words.extend(["--replay".to_owned(), format!("{x},{y},{sample}")]);
    let passes: Vec<String> = passes.map(|pass| pass.to_string()).collect();
    if !passes.is_empty() {
        words.extend(["--passes".to_owned(), passes.join(",")]);
    }
    // What names other frames, and what is written by whole renders only.
    let mut rest = vec![];
    while let Some(argument) = arguments.next() {
        match ["--frames", "--save-cache"].iter().find_map(|name| argument.strip_prefix(name)) {
            Some("") => drop(arguments.next()),
            Some(value) if value.starts_with('=') => {}
            _ => rest.push(argument),
        }
    }
    in_words(words.into_iter().chain(rest))
}

/// An argument as text, whatever it is.
pub(super) fn lossy(argument: std::ffi::OsString) -> String {
    argument.to_string_lossy().into_owned()
}

/// Arguments as one would type them into a shell.
fn in_words(arguments: impl Iterator<Item = String>) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%^".contains(c);
    let quote = |argument: String| {
        let needs = argument.is_empty() || !argument.chars().all(is_plain);
        if needs { format!("'{}'", argument.replace('\'', "'\\''")) } else { argument }
    };
    arguments.map(quote).collect::<Vec<_>>().join(" ")
}

/// The command line, for headers and statistics.
pub fn command_line() -> String {
    in_words(std::env::args_os().map(lossy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::tests::film_settings;
    use crate::film::{FilmOverrides, PixelSamples, SampleResult, Sensor};
    use crate::math::Rgb;

    /// A sample that is not finite, in whichever of its values, is counted, located, and told with the command that replays it.
    #[test]
    fn samples_left_out_are_told_with_the_command_that_replays_them() {
        let overrides = FilmOverrides { resolution: Some([40, 20]), crop: None };
        let mut film = Film::new(film_settings(vec![], &overrides), true);
        assert_eq!(of_rejected(&film, None), None);
        let mut samples = PixelSamples::new(Sensor::default());
        samples.add(8, &SampleResult::default());
        samples.add(9, &SampleResult { albedo: Rgb::splat(f32::NAN), ..SampleResult::default() });
        film.tiles_mut()[2].merge([35, 7], &samples);
        let (count, first) = film.rejected();
        let first = first.expect("one was left out");
        assert_eq!((count, first.pixel, first.sample), (1, [35, 7], 9));
        let words = ["lanternfish", "render", "my scene.pbrt", "--seed", "7", "--png"].map(str::to_owned);
        let command = replay_command(words.clone().into_iter(), first, [].into_iter(), None);
        assert_eq!(command, "lanternfish render --replay 35,7,9 'my scene.pbrt' --seed 7 --png");
        let text = of_rejected(&film, Some(&command)).expect("told");
        assert!(text.starts_with("1 sample was NaN or infinite and left out: pixel 35,7 sample 9"), "{text}");
        assert!(text.ends_with(&command), "{text}");
        let timed = replay_command(words.into_iter(), first, [1, 1, 2, 4, 3].into_iter(), None);
        assert!(timed.contains(" --replay 35,7,9 --passes 1,1,2,4,3 'my"), "{timed}");
        let words = ["lanternfish", "render", "s.####.pbrt", "--frames", "1..9", "--save-cache", "x", "--png"];
        let words = words.map(str::to_owned);
        let of_sequence = replay_command(words.into_iter(), first, [].into_iter(), Some(3));
        assert_eq!(of_sequence, "lanternfish render --frames=3 --replay 35,7,9 's.####.pbrt' --png");
        // Another tile has one that comes earlier.
        let mut samples = PixelSamples::new(Sensor::default());
        samples.add(3, &SampleResult { beauty: Rgb::splat(f32::INFINITY), ..SampleResult::default() });
        film.tiles_mut()[5].merge([33, 17], &samples);
        let text = of_rejected(&film, None).expect("told");
        assert_eq!(text, "2 samples were NaN or infinite and left out, first at pixel 33,17 sample 3");
    }

    #[test]
    fn quoted_words_reach_the_program_as_they_were() {
        let words = ["a b", "it's", "", "$HOME", "*.pbrt", "plain-1.0,x=y", "a;b", "µ"].map(str::to_owned);
        let line = format!("for i in {}; do printf '%s|' \"$i\"; done", in_words(words.clone().into_iter()));
        let out = std::process::Command::new("sh").args(["-c", &line]).output().expect("a shell");
        assert_eq!(String::from_utf8(out.stdout).expect("text"), words.join("|") + "|");
    }
}
