//! The tables of a scene.

use super::curve::{Curve, Run};
use super::ratio::{Ratio, short};
use super::report::SceneReport;
use super::table::Table;

const MEBIBYTE: f64 = (1u64 << 20) as f64;

/// What the methods cost and give, how they stand to the first, and how fast their errors fall.
pub fn summary(scene: &SceneReport) -> Vec<Table> {
    vec![errors(scene), costs(scene), ratios(scene), slopes(scene)]
}

/// How the reference was made and what it is worth, and what else is to be known.
pub fn notes(scene: &SceneReport) -> Vec<String> {
    let reference = &scene.reference;
    let own = reference.own_rmse.map_or("unknown".to_owned(), |own| {
        let share = if reference.mean > 0.0 {
            format!(" ({:.2} % of its mean)", 100.0 * own / reference.mean)
        } else {
            String::new()
        };
        short(own) + &share
    });
    let spp = if reference.spp > 0 { format!(", {} samples a pixel", reference.spp) } else { String::new() };
    let mut notes = vec![
        format!("file: {}", scene.file.display()),
        format!("reference: {}{spp}; mean {}, own RMSE {own}", reference.how, short(reference.mean)),
    ];
    notes.extend(scene.notes.iter().cloned());
    notes
}

/// After the name of a method whose least error is not above the reference's own.
fn mark(curve: &Curve) -> &'static str {
    if curve.last().is_above_reference { "" } else { " ○" }
}

fn errors(scene: &SceneReport) -> Table {
    let [width, height] = scene.pixels;
    let title = format!("{}: {} lights, {width} × {height} pixels: errors with most samples", scene.name, scene.lights);
    let mut table =
        Table::new(title, &["method", "spp", "RMSE", "of gathered light", "relative MSE", "HDR-FLIP", "TTUV"]);
    table.notes = notes(scene);
    table.notes.push(
        "TTUV: RMSE² × processor minutes of the whole process. The reference's own error is taken off RMSE, relative MSE and TTUV. Gathered light: without what \
         is seen of lights and fires themselves, whose edges are a matter of antialiasing"
            .to_owned(),
    );
    for curve in &scene.curves {
        let point = curve.last();
        let bands = [point.rmse, point.gathered_rmse, point.relative_mse, point.flip, point.ttuv];
        let names = [curve.method.name.clone() + mark(curve), point.spp.to_string()];
        table.rows.push(names.into_iter().chain(bands.iter().map(Ratio::show)).collect());
    }
    table
}

fn costs(scene: &SceneReport) -> Table {
    let header = ["method", "spp", "CPU s", "wall s", "load s", "build s", "render s", "MiB"];
    let mut table = Table::new(format!("{}: what they took", scene.name), &header);
    table.notes.push(
        "CPU and wall: of the whole process. Load, build and render: by the clock, means over the runs".to_owned(),
    );
    for curve in &scene.curves {
        let point = curve.last();
        let mean = |of: fn(&Run) -> f64| short(point.mean(of));
        table.rows.push(vec![
            curve.method.name.clone(),
            point.spp.to_string(),
            point.cpu_seconds.show(),
            point.wall_seconds.show(),
            mean(|run| run.cost.load_seconds),
            mean(|run| run.cost.build_seconds),
            mean(|run| run.cost.render_seconds),
            mean(|run| run.cost.peak_memory / MEBIBYTE),
        ]);
    }
    table
}

fn ratios(scene: &SceneReport) -> Table {
    let header = ["method", "TTUV", "TTUV, best 99.9 %", "TTUV, gathered", "RMSE", "RMSE, gathered", "CPU s", "wall s"];
    let Some(first) = scene.curves.first() else { return Table::new(scene.name.clone(), &header) };
    let name = &first.method.name;
    let mut table = Table::new(format!("{}: how many times the figure of {name}", scene.name), &header);
    table.notes.push(format!(
        "with most samples; 95 % confidence intervals, paired by seed, in parentheses. Above 1, {name} is better. Best 99.9 %: without the \
         pixels that are worst over all methods, the same for each; where that differs, a few bright pixels decide. Gathered: without what is seen of \
         lights and fires themselves"
    ));
    for curve in &scene.curves {
        let of = |of: fn(&Run) -> f64| curve.ratio(first, of).show();
        let cells = [
            of(Run::ttuv),
            curve.trimmed_ratio(first).show(),
            of(Run::gathered_ttuv),
            of(|run| run.errors.rmse),
            of(|run| run.errors.gathered_rmse),
            of(|run| run.cost.cpu_seconds),
            of(|run| run.cost.wall_seconds),
        ];
        table.rows.push(std::iter::once(curve.method.name.clone() + mark(curve)).chain(cells).collect());
    }
    table
}

fn slopes(scene: &SceneReport) -> Table {
    let header = [
        "method",
        "slope over time",
        "over samples",
        "points",
        "verdict",
        "mean against the reference's",
        "of gathered light",
    ];
    let mut table = Table::new(format!("{}: how fast the error falls", scene.name), &header);
    table.notes.push(
        "slope of log RMSE over log time of sampling (without building, and learning between passes), −0.5 for an unbiased method, with its 95 % confidence interval over the runs; points from 4 spp on. \
         (!) marks means that differ by more than their interval, which one in twenty does by chance"
            .to_owned(),
    );
    for curve in &scene.curves {
        let slope = &curve.slope;
        let number = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.3}"));
        let interval = slope.interval.map_or(String::new(), |[low, high]| format!(" ({low:.3} to {high:.3})"));
        table.rows.push(vec![
            curve.method.name.clone(),
            number(slope.value) + &interval,
            number(slope.over_samples),
            slope.spp.iter().map(u32::to_string).collect::<Vec<_>>().join(" "),
            slope.verdict.clone(),
            curve.bias.show(),
            curve.gathered_bias.show(),
        ]);
    }
    table
}

/// Every point of every curve.
pub fn points(scene: &SceneReport) -> Table {
    let header = ["method", "spp", "RMSE", "relative MSE", "HDR-FLIP", "TTUV", "CPU s", "wall s", ""];
    let mut table = Table::new(format!("{}: all points", scene.name), &header);
    table.notes.push("geometric means over the runs, 95 % confidence intervals in parentheses".to_owned());
    for curve in &scene.curves {
        for point in &curve.points {
            let bands: [Ratio; 6] =
                [point.rmse, point.relative_mse, point.flip, point.ttuv, point.cpu_seconds, point.wall_seconds];
            let mut row = vec![curve.method.name.clone(), point.spp.to_string()];
            row.extend(bands.iter().map(Ratio::show));
            row.push(if point.is_above_reference { "" } else { "not above the reference's error" }.to_owned());
            table.rows.push(row);
        }
    }
    table
}

/// What each method is on the command line.
pub fn methods(curves: &[Curve]) -> Table {
    let mut table = Table::of_words("methods", &["method", "arguments of lanternfish render"]);
    for Curve { method, .. } in curves {
        let arguments = if method.arguments.is_empty() { "none: the defaults".to_owned() } else { method.show() };
        table.rows.push(vec![method.name.clone(), arguments]);
    }
    table
}
