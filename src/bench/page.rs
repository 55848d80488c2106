//! All of it on one page that needs nothing else: plots as SVG, pictures as data in the text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::crops::Crops;
use super::lean::LeanReport;
use super::report::{Report, SceneReport};
use super::table::escape;
use super::{bar, lean, plots, tables};

const STYLE: &str = "\
:root{color-scheme:light dark;--line:#d4d4d4;--soft:#666;--back:#fff;--text:#1a1a1a}\
@media(prefers-color-scheme:dark){:root{--line:#444;--soft:#aaa;--back:#161616;--text:#e6e6e6}svg{filter:invert(1) hue-rotate(180deg)}}\
body{font:15px/1.45 system-ui,sans-serif;margin:0 auto;padding:1.5em;max-width:1360px;background:var(--back);color:var(--text)}\
h1{font-size:1.6em}h2{margin-top:2.5em;border-top:2px solid var(--line);padding-top:1em}h3{margin:1.8em 0 .4em}\
p{margin:.3em 0;color:var(--soft);max-width:110ch}code{white-space:pre-wrap;overflow-wrap:anywhere}\
.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.92em;margin:.5em 0}\
td,th{padding:3px 12px;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}\
td:first-child,th:first-child{text-align:left;padding-left:0}.words td,.words th{text-align:left}th{font-weight:600}\
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,480px),1fr));gap:1em}.plots svg{width:100%;height:auto}\
.crops{display:flex;flex-wrap:wrap;gap:.8em}figure{margin:0}figcaption{font-size:.85em;color:var(--soft)}\
figure img{width:192px;image-rendering:pixelated;display:block;margin-bottom:3px}summary{cursor:pointer;margin-top:1em}";

/// The page.
pub fn html(report: &Report) -> String {
    let about = report.about();
    let lines: String = about[1..].iter().map(|line| format!("<p>{}</p>\n", escape(line))).collect();
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>Error against run time</title>\n<style>{STYLE}</style>\n<h1>Error against run time</h1>\n\
         <p><code>{}</code></p>\n{lines}{}",
        escape(&about[0]),
        HOW_TO_READ
    );
    if !report.bars.is_empty() {
        text += &bar::table(&report.bars).html();
    }
    for (scene, crops) in report.scenes.iter().zip(&report.crops) {
        text += &of_scene(scene, crops);
    }
    text += &of_lean(&report.lean);
    text + "</html>\n"
}

/// What leaving out saves, with the texts that were added to scenes.
fn of_lean(reports: &[LeanReport]) -> String {
    if reports.is_empty() {
        return String::new();
    }
    let mut text = "<h2>What is left out</h2>\n".to_owned();
    for report in reports {
        text += &lean::tables::costs(report).html();
        text += &lean::tables::reasons(report).html();
        let files: String = report
            .rows
            .iter()
            .filter(|row| !row.text.is_empty())
            .map(|row| format!("<h3>{}</h3>\n<p><code>{}</code></p>\n", escape(row.system), escape(&row.text)))
            .collect();
        text += &format!(
            "<details><summary>The files, beside the scene's while it was measured, and the command</summary>\n<p><code>{}</code></p>\n{files}</details>\n",
            escape(&report.command)
        );
    }
    text
}

const HOW_TO_READ: &str = "<details><summary>How to read this</summary>\n\
    <p>Every point is several renders, each a process of its own with a seed of its own; their order takes turns, so that other work on the machine \
    hits all methods alike. Lines are geometric means over the runs, bands their 95 % confidence intervals (Student's t on the logarithms): \
    few runs, wide bands.</p>\n\
    <p>Errors are those of the beauty (R, G, B) over the whole image, against the reference. The reference is noisy itself; its own mean square error is measured and \
    taken off RMSE, relative MSE and TTUV, which leaves them right on average. What is not above the reference's own error is not claimed: such points \
    are hollow on its line or left out. Nothing is taken off HDR-FLIP.</p>\n\
    <p>The error of an unbiased method falls as t^-1/2 once there is nothing more to learn. Every other slope is named. The last columns of that table compare the images' \
    means with the reference's: a bias that noise hides from the slope shows there.</p>\n</details>\n";

fn of_scene(scene: &SceneReport, crops: &Crops) -> String {
    let mut text = format!("<h2>{}</h2>\n", escape(&scene.name));
    text += &tables::summary(scene).iter().map(super::table::Table::html).collect::<String>();
    text += "<h3>Errors over time</h3>\n<div class=\"plots\">\n";
    for plot in plots::of(scene) {
        match plot.svg() {
            Ok(svg) => text += &svg,
            Err(error) => text += &format!("<p>no plot {}: {}</p>", plot.name, escape(&error)),
        }
    }
    text += "</div>\n";
    text += &of_crops(crops);
    text += &format!(
        "<details><summary>All points, and what each method is on the command line</summary>\n{}{}{}</details>\n",
        tables::points(scene).html(),
        tables::methods(&scene.curves).html(),
        commands(scene)
    );
    text
}

fn of_crops(crops: &Crops) -> String {
    let image = |png: &[u8], what: &str| {
        format!("<img alt=\"{}\" src=\"data:image/png;base64,{}\">", escape(what), STANDARD.encode(png))
    };
    let figure = |pictures: String, name: &str| {
        format!("<figure>{pictures}<figcaption>{}</figcaption></figure>\n", escape(name))
    };
    let mut text = String::new();
    for part in &crops.parts {
        text += &format!(
            "<h3>{}</h3>\n<p>{} samples a pixel, seed 1; below each its HDR-FLIP error, black for none, yellow for 1</p>\n<div class=\"crops\">\n",
            escape(&part.name),
            crops.spp
        );
        text += &figure(image(&part.reference, "reference"), "reference");
        for (name, beauty, error) in &part.methods {
            text += &figure(image(beauty, name) + &image(error, &format!("error of {name}")), name);
        }
        text += "</div>\n";
    }
    text
}

/// The commands that make the reference again, and one of each method's images.
fn commands(scene: &SceneReport) -> String {
    let runs = scene.curves.iter().filter_map(|curve| curve.last().runs.first()).map(|run| &run.command);
    let lines: Vec<String> = scene.reference.commands.iter().chain(runs).map(|command| escape(command)).collect();
    format!("<h3>Commands of the reference and of one render each</h3>\n<p><code>{}</code></p>\n", lines.join("\n"))
}
