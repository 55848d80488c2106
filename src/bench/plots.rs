//! Plots, drawn alike as SVG for the page and as PNG: errors over time with their bands, and where the time went.

use std::sync::Once;

use plotters::coord::types::RangedCoordf64;
use plotters::coord::{CoordTranslate, Shift};
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::curve::Point;
use super::ratio::{Ratio, short};
use super::report::SceneReport;

/// Width and height in pixels.
pub const SIZE: (u32, u32) = (640, 400);
/// Colours that are told apart with any colour vision (Okabe and Ito 2008), then others.
const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 94, 50),
    RGBColor(150, 60, 200),
    RGBColor(90, 90, 90),
    RGBColor(170, 170, 0),
];
const FONT: &str = "sans-serif";

/// A plot of a scene.
pub struct Plot<'a> {
    /// For file names: `rmse-cpu`.
    pub name: &'static str,
    scene: &'a SceneReport,
    kind: Kind,
}

enum Kind {
    /// A number over time, both on logarithmic scales.
    Curves { title: &'static str, y: fn(&Point) -> Ratio, x: fn(&Point) -> Ratio, over: &'static str, has_floor: bool },
    /// Seconds of each part of a render.
    Times,
}

const CPU: &str = "processor seconds of the whole process";
const WALL: &str = "seconds by the clock";

/// The plots of a scene, two and two beside each other.
pub fn of(scene: &SceneReport) -> Vec<Plot<'_>> {
    type Quantity = fn(&Point) -> Ratio;
    let cpu: Quantity = |point| point.cpu_seconds;
    let wall: Quantity = |point| point.wall_seconds;
    let quantities: [(&'static str, &'static str, &'static str, Quantity, bool); 5] = [
        ("rmse-cpu", "rmse-wall", "RMSE", |point| point.rmse, true),
        ("gathered-cpu", "gathered-wall", "RMSE of gathered light", |point| point.gathered_rmse, false),
        ("relative-mse-cpu", "relative-mse-wall", "relative MSE", |point| point.relative_mse, false),
        ("flip-cpu", "flip-wall", "HDR-FLIP", |point| point.flip, false),
        ("ttuv-cpu", "ttuv-wall", "TTUV", |point| point.ttuv, false),
    ];
    let mut plots = vec![];
    // Images may not tell gathered light apart.
    let tells = scene.curves.iter().flat_map(|curve| &curve.points).any(|point| point.gathered_rmse.value > 0.0);
    for (by_cpu, by_wall, title, y, has_floor) in quantities.into_iter().filter(|q| tells || q.0 != "gathered-cpu") {
        for (name, x, over) in [(by_cpu, cpu, CPU), (by_wall, wall, WALL)] {
            // Minutes of TTUV are those of the axis.
            let y = if name == "ttuv-wall" { |point: &Point| point.ttuv_by_the_clock } else { y };
            plots.push(Plot { name, scene, kind: Kind::Curves { title, y, x, over, has_floor } });
        }
    }
    plots.push(Plot { name: "time", scene, kind: Kind::Times });
    plots
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

impl Plot<'_> {
    /// As SVG; without the declaration of its name space, which is not needed inside HTML.
    ///
    /// # Errors
    /// In words.
    pub fn svg(&self) -> Result<String, String> {
        font();
        let mut svg = String::new();
        self.draw(SVGBackend::with_string(&mut svg, SIZE).into_drawing_area()).map_err(|error| error.to_string())?;
        let (width, height) = SIZE;
        let sized = format!("width=\"{width}\" height=\"{height}\" ");
        Ok(svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "").replacen(&sized, "", 1))
    }

    /// As PNG.
    ///
    /// # Errors
    /// In words.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        font();
        let (width, height) = SIZE;
        let mut pixels = vec![255; 3 * width as usize * height as usize];
        self.draw(BitMapBackend::with_buffer(&mut pixels, SIZE).into_drawing_area())
            .map_err(|error| error.to_string())?;
        crate::film::image::encode_png(width, height, &pixels)
    }

    fn draw<B: DrawingBackend>(&self, root: DrawingArea<B, Shift>) -> Drawn
    where
        B::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        match &self.kind {
            Kind::Curves { title, y, x, over, has_floor } => {
                let floor = self.scene.reference.own_rmse.filter(|own| *has_floor && *own > 0.0);
                curves(self.scene, &root, title, *y, *x, over, floor)?;
            }
            Kind::Times => times(self.scene, &root)?,
        }
        Ok(root.present()?)
    }
}

/// Text is measured, and in PNG drawn, with a font that the program has with it. Must be called before anything is drawn.
pub fn font() {
    static ONCE: Once = Once::new();
    // It can only fail for what is no font.
    ONCE.call_once(|| drop(register_font(FONT, FontStyle::Normal, dejavu::sans::regular())));
}

fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// What is drawn of a curve: x, y and its band; and what is not above the reference's own error.
struct Line {
    claimed: Vec<(f64, f64, [f64; 2])>,
    below: Vec<f64>,
}

fn curves<B: DrawingBackend>(
    scene: &SceneReport,
    root: &DrawingArea<B, Shift>,
    title: &str,
    y: fn(&Point) -> Ratio,
    x: fn(&Point) -> Ratio,
    over: &str,
    floor: Option<f64>,
) -> Drawn
where
    B::ErrorType: 'static,
{
    let line = |points: &[Point]| {
        let (claimed, below): (Vec<&Point>, Vec<&Point>) = points.iter().partition(|point| point.is_above_reference);
        let band = |point: &&Point| (x(point).value, y(point).value, [y(point).low, y(point).high]);
        Line {
            claimed: claimed.iter().map(band).filter(|(x, y, _)| *x > 0.0 && y.is_finite() && *y > 0.0).collect(),
            below: below.iter().map(|point| x(point).value).filter(|x| *x > 0.0).collect(),
        }
    };
    let lines: Vec<Line> = scene.curves.iter().map(|curve| line(&curve.points)).collect();
    let all = || lines.iter().flat_map(|line| &line.claimed);
    let xs = || all().map(|point| point.0).chain(lines.iter().flat_map(|line| line.below.iter().copied()));
    let ys = || all().map(|point| point.1).chain(floor);
    let (x0, x1) = range(xs());
    let (y0, y1) = range(ys());
    if [x0, x1, y0, y1].iter().any(|end| !(end.is_finite() && *end > 0.0)) {
        root.titled(&format!("{}: {title}: nothing is known of it", scene.name), (FONT, 16))?;
        return Ok(());
    }
    // Room for the names.
    let x1 = x1 * (x1 / x0).powf(0.3);
    let mut chart = ChartBuilder::on(root)
        .caption(format!("{}: {title}, lower is better", scene.name), (FONT, 16))
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(64)
        .build_cartesian_2d(
            (x0..x1).log_scale().with_key_points(ticks(x0, x1)),
            (y0..y1).log_scale().with_key_points(ticks(y0, y1)),
        )?;
    let number = |value: &f64| short(*value);
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc(over)
        .y_desc(title)
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .label_style((FONT, 12))
        .draw()?;
    let within = |y: f64| y.clamp(y0, y1);
    for (index, line) in lines.iter().enumerate() {
        let upper = line.claimed.iter().map(|&(x, _, [_, high])| (x, within(high)));
        let lower = line.claimed.iter().rev().map(|&(x, _, [low, _])| (x, within(low)));
        if line.claimed.len() > 1 && line.claimed.iter().all(|(_, _, [_, high])| high.is_finite()) {
            chart.draw_series([Polygon::new(upper.chain(lower).collect::<Vec<_>>(), colour(index).mix(0.12))])?;
        }
    }
    if let Some(floor) = floor {
        let style = BLACK.mix(0.6).stroke_width(1);
        chart.draw_series(DashedLineSeries::new([(x0, floor), (x1, floor)], 6, 4, style))?;
        let style = (FONT, 11).into_font().color(&BLACK.mix(0.7)).pos(Pos::new(HPos::Left, VPos::Bottom));
        let at = (x0 * (x1 / x0).powf(0.02), floor * (y1 / y0).powf(0.01));
        chart.draw_series([Text::new("the reference's own error", at, style)])?;
    }
    if title == "RMSE" {
        // As fast as the error of an unbiased method falls, through the middle of the plot.
        let middle = ((x0 * x1).sqrt(), (y0 * y1).sqrt());
        let at = |x: f64| middle.1 * (x / middle.0).powf(-0.5);
        let ends = [x0, x1].map(|x| (x, at(x))).map(|(x, y)| {
            let y = within(y);
            (x.clamp(middle.0 * (middle.1 / y1).powi(2), middle.0 * (middle.1 / y0).powi(2)), y)
        });
        chart
            .draw_series(DashedLineSeries::new(ends, 2, 4, BLACK.mix(0.45).stroke_width(1)))?
            .label("t^-1/2")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK.mix(0.45)));
    }
    for (index, (line, curve)) in lines.iter().zip(&scene.curves).enumerate() {
        let style = colour(index).stroke_width(2);
        chart
            .draw_series(LineSeries::new(line.claimed.iter().map(|&(x, y, _)| (x, y)), style))?
            .label(&curve.method.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        chart.draw_series(line.claimed.iter().map(|&(x, y, _)| Circle::new((x, y), 3, colour(index).filled())))?;
        if let Some(floor) = floor {
            chart.draw_series(line.below.iter().map(|&x| Circle::new((x, floor), 4, colour(index).stroke_width(1))))?;
        }
    }
    legend(&mut chart)
}

/// Where a logarithmic axis has numbers: at 1, 2 and 5 times the powers of ten, at the powers alone where those are many.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let decades = (low.log10().floor() as i32)..=(high.log10().floor() as i32);
    let steps: &[f64] = if decades.end() - decades.start() > 3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let all = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
    all.filter(|tick| (low..=high).contains(tick)).collect()
}

/// What an axis shows: all values and a little more.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    (low / 1.25, high * 1.25)
}

/// Where the time of the renders with most samples went, a bar for each method.
fn times<B: DrawingBackend>(scene: &SceneReport, root: &DrawingArea<B, Shift>) -> Drawn
where
    B::ErrorType: 'static,
{
    let parts: Vec<[f64; 4]> = scene
        .curves
        .iter()
        .map(|curve| {
            let point = curve.last();
            let parts = [
                point.mean(|run| run.cost.load_seconds),
                point.mean(|run| run.cost.build_seconds),
                point.mean(|run| run.cost.render_seconds),
            ];
            let rest = point.mean(|run| run.cost.wall_seconds) - parts.iter().sum::<f64>();
            [parts[0], parts[1], parts[2], rest.max(0.0)]
        })
        .collect();
    let most = parts.iter().map(|parts| parts.iter().sum()).fold(0.0, f64::max).max(1e-3);
    let count = parts.len();
    if count == 0 {
        root.titled(&format!("{}: nothing was measured", scene.name), (FONT, 16))?;
        return Ok(());
    }
    let mut chart = ChartBuilder::on(root)
        .caption(format!("{}: where the time went, with most samples", scene.name), (FONT, 16))
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(120)
        .build_cartesian_2d(0.0..1.45 * most, 0.0..count as f64)?;
    chart.configure_mesh().disable_mesh().disable_y_axis().x_desc(WALL).y_labels(0).label_style((FONT, 12)).draw()?;
    for (index, curve) in scene.curves.iter().enumerate() {
        let text = format!("{} ({} spp)", curve.method.name, curve.last().spp);
        label(root, &chart, &text, (count - index) as f64 - 0.5)?;
    }
    for (part, title) in ["load", "build", "render", "start, end, writing"].into_iter().enumerate() {
        let style = colour([5, 1, 0, 8][part]).mix(0.8).filled();
        let bar = |(index, parts): (usize, &[f64; 4])| {
            let from = parts[..part].iter().sum::<f64>();
            let top = (count - index) as f64;
            Rectangle::new([(from, top - 0.2), (from + parts[part], top - 0.8)], style)
        };
        chart
            .draw_series(parts.iter().enumerate().map(bar))?
            .label(title)
            .legend(move |(x, y)| Rectangle::new([(x, y - 4), (x + 12, y + 4)], style));
    }
    legend(&mut chart)
}

/// The names of what is drawn.
fn legend<'a, B: DrawingBackend + 'a, C: CoordTranslate>(chart: &mut ChartContext<'a, B, C>) -> Drawn
where
    B::ErrorType: 'static,
{
    let labels = &mut chart.configure_series_labels();
    labels.label_font((FONT, 12)).background_style(WHITE.mix(0.8)).border_style(BLACK.mix(0.2));
    Ok(labels.position(SeriesLabelPosition::UpperRight).draw()?)
}

type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A name left of the axis, at the height of its bar.
fn label<B: DrawingBackend>(root: &DrawingArea<B, Shift>, chart: &Chart<B>, text: &str, at: f64) -> Drawn
where
    B::ErrorType: 'static,
{
    let (x, y) = chart.backend_coord(&(0.0, at));
    let style = (FONT, 12).into_font().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Center));
    Ok(root.draw(&Text::new(text.to_owned(), (x - 6, y), style))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_a_few_numbers() {
        assert_eq!(ticks(0.15, 3.0), [0.2, 0.5, 1.0, 2.0]);
        let many = ticks(1e-6, 2.0);
        assert!(
            many.len() == 7 && many.iter().all(|tick| (tick.log10() - tick.log10().round()).abs() < 1e-9),
            "{many:?}"
        );
    }
}
