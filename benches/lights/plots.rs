//! The page's pictures.

use plotters::prelude::*;

use super::compare::{Run, SceneResult, Way};

const SIZE: (u32, u32) = (720, 320);

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// TTUV of each way with its confidence interval, on a logarithmic scale, and the blocked share of shadow rays over iterations.
pub fn of(result: &SceneResult) -> Vec<String> {
    lanternfish::bench::plots::font();
    let mut pictures = [String::new(), String::new()];
    let [first, second] = &mut pictures;
    for drawn in [ttuv(result, first), blocked(result, second)] {
        if let Err(error) = drawn {
            eprintln!("no plot of {}: {error}", result.scene);
        }
    }
    pictures.into()
}

fn ttuv(result: &SceneResult, svg: &mut String) -> Drawn {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let bars: Vec<(f64, f64, f64)> = result
        .ways
        .iter()
        .map(|way| {
            let estimate = way.estimate(Run::ttuv);
            let half = if estimate.half_width.is_finite() { estimate.half_width } else { 0.0 };
            (estimate.mean, (estimate.mean - half).max(0.2 * estimate.mean), estimate.mean + half)
        })
        .collect();
    let least = bars.iter().map(|bar| bar.1).fold(f64::INFINITY, f64::min) / 1.5;
    let most = bars.iter().map(|bar| bar.2).fold(0.0, f64::max) * 1.5;
    let count = bars.len();
    if !(least > 0.0 && most.is_finite()) {
        return Err("nothing is known of an error".into());
    }
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{}: TTUV, lower is better", result.scene), ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(140)
        .build_cartesian_2d((least..most).log_scale(), (0..count - 1).into_segmented())?;
    // From the top down.
    let name = |position: &SegmentValue<usize>| match position {
        SegmentValue::CenterOf(index) => result.ways[count - 1 - index].variant.name.to_owned(),
        _ => String::new(),
    };
    let number = |value: &f64| lanternfish::bench::ratio::short(*value);
    chart
        .configure_mesh()
        .disable_y_mesh()
        .y_labels(count + 1)
        .y_label_formatter(&name)
        .x_label_formatter(&number)
        .draw()?;
    for (index, &(mean, low, high)) in bars.iter().rev().enumerate() {
        let sides = [(least, SegmentValue::Exact(index)), (mean, SegmentValue::Exact(index + 1))];
        let mut bar = Rectangle::new(sides, Palette99::pick(0).mix(0.6).filled());
        bar.set_margin(3, 3, 0, 0);
        chart.draw_series([bar])?;
        let middle = SegmentValue::CenterOf(index);
        chart.draw_series([PathElement::new([(low, middle.clone()), (high, middle)], BLACK.stroke_width(2))])?;
    }
    drop(chart);
    Ok(root.present()?)
}

fn blocked(result: &SceneResult, svg: &mut String) -> Drawn {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let shares = |way: &Way| way.runs.first().map_or(vec![], |run| run.cost.blocked.clone());
    let iterations = result.ways.iter().map(|way| shares(way).len()).max().unwrap_or(1).max(2);
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{}: share of shadow rays blocked, by iteration", result.scene), ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(50)
        // Room for the names at the right.
        .build_cartesian_2d(1.0..1.3 * iterations as f64, 0.0..1.0)?;
    chart
        .configure_mesh()
        .x_labels(iterations)
        .x_label_formatter(&|i| format!("{i:.0}"))
        .y_label_formatter(&|share| format!("{share:.1}"))
        .draw()?;
    for (index, way) in result.ways.iter().enumerate() {
        let style = Palette99::pick(index).stroke_width(2);
        let points = shares(way).into_iter().enumerate().map(|(i, share)| (i as f64 + 1.0, share));
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(way.variant.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
    }
    chart.configure_series_labels().label_font(("sans-serif", 10)).position(SeriesLabelPosition::MiddleRight).draw()?;
    Ok(root.present()?)
}
