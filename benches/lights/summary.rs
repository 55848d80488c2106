//! The tables of a scene: what each way of selecting lights costs and gives, and how it stands to the defaults.

use lanternfish::bench::ratio::{short, show};
use lanternfish::bench::table::Table;

use super::compare::{Quantity, SceneResult, Way};
use super::settings::Settings;
use super::variants::{OPTIMAL, UNIFORM, Variant, columns, defaults};

const MEBIBYTE: f64 = (1u64 << 20) as f64;

/// Costs and errors of the renders, then ratios; of the columns and of the ablations.
pub fn tables(result: &SceneResult, settings: &Settings) -> Vec<Table> {
    let SceneResult { scene, lights, file, reference, .. } = result;
    let base = defaults(settings.sampling);
    let all = columns(settings.sampling);
    let is_column = |way: &&Way| all.contains(&way.variant);
    let columns: Vec<&Way> = result.ways.iter().filter(is_column).collect();
    let changed: Vec<&Way> =
        result.way(base).into_iter().chain(result.ways.iter().filter(|way| !is_column(way))).collect();

    let mut tables = vec![];
    if settings.columns {
        let title = format!("{scene}, {lights} lights: {} at {} samples a pixel", settings.size, settings.spp);
        let mut costs = costs(title, &columns);
        costs.notes.push(format!("file: {}", file.display()));
        costs.notes.push(format!(
            "reference: {} samples a pixel, mean {}, own RMSE {}, which errors do not count",
            reference.spp,
            short(reference.mean),
            short(reference.rmse)
        ));
        let scaled = columns.iter().filter(|way| way.spp != settings.spp);
        costs.notes.extend(scaled.map(|way| {
            format!("{}: measured at {} samples a pixel, scaled as if independent", way.variant.name, way.spp)
        }));
        tables.push(costs);
        tables.push(ratios(format!("{scene}: how many times the defaults' figure"), &columns, result, base));
    }
    if settings.ablations && !settings.sampling {
        tables.push(costs_of_changes(format!("{scene}: defaults with one thing said"), &changed));
        tables.push(ratios(
            format!("{scene}: one thing said, how many times the defaults' figure"),
            &changed,
            result,
            base,
        ));
    }
    tables
}

fn costs_of_changes(title: String, ways: &[&Way]) -> Table {
    let mut table = costs(title, ways);
    table.notes = ways.iter().map(|way| format!("{}: {}", way.variant.name, way.variant.arguments.join(" "))).collect();
    table
}

fn costs(title: String, ways: &[&Way]) -> Table {
    let quantities: [(&str, Quantity); 10] = [
        ("CPU s", |run| run.cost.cpu_seconds),
        ("wall s", |run| run.cost.wall_seconds),
        ("build s", |run| run.cost.build_seconds),
        ("MiB", |run| run.cost.peak_memory / MEBIBYTE),
        ("RMSE", |run| run.errors.rmse),
        ("RMSE of beauty", |run| run.errors.rmse_of_beauty),
        ("RMSE, best 99.9 %", |run| run.errors.rmse_trimmed),
        ("relative MSE", |run| run.errors.relative_mse),
        ("TTUV", super::compare::Run::ttuv),
        ("relative TTUV", super::compare::Run::relative_ttuv),
    ];
    let names: Vec<&str> = quantities.iter().map(|(name, _)| *name).collect();
    let mut table = Table::new(title, &[&["selection"], names.as_slice(), &["blocked"]].concat());
    for way in ways {
        let mut row = vec![way.variant.name.to_owned()];
        row.extend(quantities.iter().map(|(_, quantity)| show(&way.estimate(*quantity))));
        row.push(blocked(way));
        table.rows.push(row);
    }
    table
}

/// Per cent of shadow rays blocked, in the first and the last iteration.
fn blocked(way: &Way) -> String {
    let of = |pick: fn(&[f64]) -> Option<&f64>| {
        let shares = way.runs.iter().filter_map(|run| pick(&run.cost.blocked));
        100.0 * shares.sum::<f64>() / way.runs.len() as f64
    };
    format!("{:.0} → {:.0} %", of(<[f64]>::first), of(<[f64]>::last))
}

fn ratios(title: String, ways: &[&Way], result: &SceneResult, base: Variant) -> Table {
    let quantities: [(&str, Quantity); 5] = [
        ("TTUV", super::compare::Run::ttuv),
        ("relative TTUV", super::compare::Run::relative_ttuv),
        ("TTUV, best 99.9 %", super::compare::Run::trimmed_ttuv),
        ("RMSE", |run| run.errors.rmse),
        ("CPU s", |run| run.cost.cpu_seconds),
    ];
    let names: Vec<&str> = quantities.iter().map(|(name, _)| *name).collect();
    let extra = ["RMSE over optimal's", "memory over uniform's"];
    let mut table = Table::new(title, &[&["selection"], names.as_slice(), &extra].concat());
    table
        .notes
        .push("95 % confidence intervals, paired by seed, in parentheses; above 1 the defaults are better".to_owned());
    table.notes.push("best 99.9 %: without the worst pixels, the same ones for every selection and seed".to_owned());
    let over = |way: &Way, other: Option<&Way>, quantity: Quantity| {
        other.map_or("–".to_owned(), |other| way.ratio(other, quantity).show())
    };
    for way in ways {
        let mut row = vec![way.variant.name.to_owned()];
        row.extend(quantities.iter().map(|(_, quantity)| over(way, result.way(base), *quantity)));
        row.push(over(way, result.way(OPTIMAL), |run| run.errors.rmse));
        row.push(result.way(UNIFORM).map_or("–".to_owned(), |uniform| {
            format!("{:+.1} %", 100.0 * (way.ratio(uniform, |run| run.cost.peak_memory).value - 1.0))
        }));
        table.rows.push(row);
    }
    table
}
