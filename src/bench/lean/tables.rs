//! What was found, as tables and as lines of CSV.

use serde::Serialize;

use super::{LeanReport, Row};
use crate::bench::estimate::Estimate;
use crate::bench::ratio::{Ratio, short};
use crate::bench::run::Cost;
use crate::bench::table::Table;

const MEBIBYTE: f64 = (1u64 << 20) as f64;

/// What leaving out saves.
pub fn costs(report: &LeanReport) -> Table {
    let [width, height] = report.pixels;
    let title = format!("{}: what it leaves out, and what that saves", report.scene);
    let header =
        ["left out", "ready, ms", "with it", "a sample, µs", "with it", "MiB", "with it", "rounds", "image", "verdict"];
    let mut table = Table::new(title, &header);
    table.notes.push(format!(
        "processor time and largest resident memory of the scene as it is, and what they are with each system, which something tiny out of sight needs; {width} × {height} \
         pixels, {} samples each; 95 % confidence intervals, paired",
        report.spp
    ));
    table.notes.push(
        "ready: all but rendering, with the reader of .vdb files, whose memory is not counted. Image: whether it is the same to the last bit. In use: it does something wherever it can"
            .to_owned(),
    );
    table.notes.extend(report.notes.iter().cloned());
    table.rows.extend(report.rows.iter().map(|row| {
        vec![
            row.system.to_owned(),
            short(1e3 * row.start_seconds.without.mean),
            more(&row.start_seconds.more, 1e3),
            short(row.sample_microseconds.without.mean),
            percent(&row.sample_ratio),
            short(row.peak_memory.without.mean / MEBIBYTE),
            more(&row.peak_memory.more, 1.0 / MEBIBYTE),
            row.rounds.len().to_string(),
            if row.is_same_image { "same" } else { "other noise" }.to_owned(),
            row.verdict.show().to_owned(),
        ]
    }));
    table
}

/// Why each is left out, and what makes the scene need it.
pub fn reasons(report: &LeanReport) -> Table {
    let mut table = Table::of_words(
        format!("{}: why, and with what it is measured", report.scene),
        &["left out", "because", "with it: the same scene and"],
    );
    table.rows.extend(report.rows.iter().map(|row| vec![row.system.to_owned(), row.reason.clone(), how(row)]));
    table
}

fn how(row: &Row) -> String {
    if row.arguments.is_empty() || row.text.is_empty() {
        return row.how.to_owned();
    }
    format!("{} and two lamps too faint to be seen", row.how)
}

/// `+31 ± 4`.
fn more(estimate: &Estimate, scale: f64) -> String {
    let mean = signed(scale * estimate.mean);
    if estimate.half_width.is_finite() { format!("{mean} ± {:.1}", scale * estimate.half_width) } else { mean }
}

/// `+12.1 % (+10.9 to +13.3)`.
fn percent(ratio: &Ratio) -> String {
    let more = |times: f64| 100.0 * (times - 1.0);
    match (ratio.value.is_finite(), ratio.high.is_finite()) {
        (false, _) => "unknown".to_owned(),
        (true, false) => format!("{} %", signed(more(ratio.value))),
        (true, true) => {
            let [value, low, high] = [ratio.value, ratio.low, ratio.high].map(|times| signed(more(times)));
            format!("{value} % ({low} to {high})")
        }
    }
}

/// With a sign, unless it is 0 when rounded.
fn signed(value: f64) -> String {
    let digits = format!("{:.1}", value.abs());
    let sign = if digits == "0.0" {
        ""
    } else if value < 0.0 {
        "−"
    } else {
        "+"
    };
    sign.to_owned() + &digits
}

/// A render; the names are the header's.
#[derive(Serialize)]
struct Line<'a> {
    scene: &'a str,
    system: &'a str,
    verdict: &'a str,
    round: usize,
    with: bool,
    width: u32,
    height: u32,
    spp: u32,
    cpu_seconds_with_helpers: f64,
    cpu_seconds: f64,
    cpu_seconds_rendering: f64,
    peak_memory: f64,
}

/// All renders of all scenes as CSV; those of a scene as it is are there with each system that they were compared with.
///
/// # Errors
/// What the crate `csv` says.
pub fn csv(reports: &[LeanReport]) -> Result<Vec<u8>, String> {
    let mut writer = csv::Writer::from_writer(vec![]);
    for report in reports {
        for row in &report.rows {
            for (round, costs) in row.rounds.iter().enumerate() {
                for (cost, with) in costs.iter().zip([false, true]) {
                    let line = line(report, row, round + 1, with, cost);
                    writer.serialize(line).map_err(|error| error.to_string())?;
                }
            }
        }
    }
    writer.into_inner().map_err(|error| error.to_string())
}

fn line<'a>(report: &'a LeanReport, row: &'a Row, round: usize, with: bool, cost: &Cost) -> Line<'a> {
    Line {
        scene: &report.scene,
        system: row.system,
        verdict: row.verdict.show(),
        round,
        with,
        width: report.pixels[0],
        height: report.pixels[1],
        spp: report.spp,
        cpu_seconds_with_helpers: cost.cpu_seconds_with_helpers,
        cpu_seconds: cost.cpu_seconds,
        cpu_seconds_rendering: cost.cpu_seconds_rendering,
        peak_memory: cost.peak_memory,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_have_signs() {
        let estimate = |mean, half_width| Estimate { mean, half_width };
        assert_eq!(more(&estimate(0.0312, 0.004), 1e3), "+31.2 ± 4.0");
        assert_eq!(more(&estimate(-0.001, f64::INFINITY), 1e3), "−1.0");
        assert_eq!(percent(&Ratio { value: 1.121, low: 1.109, high: 1.133 }), "+12.1 % (+10.9 to +13.3)");
        assert_eq!(percent(&Ratio { value: 0.99, low: 0.0, high: f64::INFINITY }), "−1.0 %");
        assert_eq!(signed(-0.04), "0.0");
        assert_eq!(percent(&Ratio { value: f64::NAN, low: 0.0, high: 0.0 }), "unknown");
    }
}
