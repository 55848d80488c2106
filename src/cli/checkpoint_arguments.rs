//! What the command line says of checkpoints.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use crate::render::checkpoint::Interval;

/// Options of `lanternfish render`.
#[derive(Args, Debug)]
pub struct CheckpointArguments {
    /// How often all that a render has come to is kept in OUT.exr.checkpoint: after so many samples a pixel (100i), so much time (300s, 15m), or never (off).
    #[arg(long, value_name = "INTERVAL", default_value = "15m", value_parser = interval, help_heading = "Checkpoints")]
    pub checkpoint: Keeping,
    /// Go on from OUT.exr.checkpoint, to the very image that the render would have had without a break.
    #[arg(long, help_heading = "Checkpoints")]
    pub resume: bool,
    /// The same where there is such a file; where there is none, or one of another render, render from the start.
    #[arg(long, conflicts_with = "resume", help_heading = "Checkpoints")]
    pub recover: bool,
    /// After so much time (45m) stop as if interrupted: write the image so far and a checkpoint.
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration, help_heading = "Checkpoints")]
    pub exit_at: Option<Duration>,
}

/// Whether and how often a render is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keeping(pub Option<Interval>);

/// Where the checkpoint of the render to `output` is.
pub fn beside(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}

fn interval(text: &str) -> Result<Keeping, String> {
    let samples = || text.strip_suffix('i')?.parse().ok().filter(|&n: &u32| n > 0).map(Interval::Samples);
    let time = || humantime::parse_duration(text).ok().filter(|time| !time.is_zero()).map(Interval::Time);
    match text {
        "off" => Ok(Keeping(None)),
        _ => samples().or_else(time).map(|interval| Keeping(Some(interval))).ok_or_else(|| {
            "expected a number of samples a pixel such as 100i, a time such as 300s or 15m, or off".to_owned()
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_samples_or_times() {
        assert_eq!(interval("100i"), Ok(Keeping(Some(Interval::Samples(100)))));
        assert_eq!(interval("300s"), Ok(Keeping(Some(Interval::Time(Duration::from_secs(300))))));
        assert_eq!(interval("1h 5m"), Ok(Keeping(Some(Interval::Time(Duration::from_secs(3900))))));
        assert_eq!(interval("off"), Ok(Keeping(None)));
        for wrong in ["", "0i", "i", "-3i", "1.5i", "0s", "5", "often", "99999999999i"] {
            assert!(interval(wrong).is_err(), "{wrong}");
        }
        assert_eq!(beside(Path::new("a/b.exr")), Path::new("a/b.exr.checkpoint"));
    }
}
