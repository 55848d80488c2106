//! The page's pictures.

use plotters::prelude::*;

use super::compare::{Run, SceneResult, Way};

const SIZE: (u32, u32) = (720, 320);

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// TTUV of each way with its confidence interval, on a logarithmic scale, and the blocked share of shadow rays over iterations.
pub fn of(result: &SceneResult) -> Vec<String> {
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
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{}: TTUV, lower is better", result.scene), ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(90)
        .y_label_area_size(70)
        .build_cartesian_2d((0..count).into_segmented(), (least..most).log_scale())?;
    let name = |position: &SegmentValue<usize>| match position {
        SegmentValue::CenterOf(index) => result.ways.get(*index).map_or("", |way| way.variant.name).to_owned(),
        _ => String::new(),
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(count)
        .x_label_formatter(&name)
        .x_label_style(("sans-serif", 11).into_font().transform(FontTransform::Rotate90))
        .y_label_formatter(&|value| super::ratio::short(*value))
        .draw()?;
    for (index, &(mean, low, high)) in bars.iter().enumerate() {
        let x = SegmentValue::CenterOf(index);
        let sides = [(SegmentValue::Exact(index), least), (SegmentValue::Exact(index + 1), mean)];
        let mut bar = Rectangle::new(sides, Palette99::pick(0).mix(0.6).filled());
        bar.set_margin(0, 0, 8, 8);
        chart.draw_series([bar])?;
        chart.draw_series([PathElement::new([(x.clone(), low), (x, high)], BLACK.stroke_width(2))])?;
    }
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
        .right_y_label_area_size(150)
        .build_cartesian_2d(1..iterations, 0.0..1.0)?;
    chart.configure_mesh().x_labels(iterations).y_label_formatter(&|share| format!("{share:.1}")).draw()?;
    for (index, way) in result.ways.iter().enumerate() {
        let style = Palette99::pick(index).stroke_width(2);
        let points = shares(way).into_iter().enumerate().map(|(i, share)| (i + 1, share));
        chart
            .draw_series(LineSeries::new(points, style))?
            .label(way.variant.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
    }
    chart.configure_series_labels().label_font(("sans-serif", 10)).position(SeriesLabelPosition::LowerRight).draw()?;
    Ok(root.present()?)
}
