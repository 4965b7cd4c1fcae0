//! The report's plots, as SVG.

use std::ops::Range;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;

use crate::bench::record::{Cost, Curve, PictureError, Point, PointKind, Run};
use crate::{Error, Result};

/// The name that browsers know too; the font's measures come with the program.
const FONT: &str = "sans-serif";
const SIZE: (u32, u32) = (960, 540);
/// Height of a run's bar and of what surrounds all bars, pixels.
const BAR: u32 = 26;
const AROUND_BARS: u32 = 130;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn failed(e: impl std::fmt::Display) -> Error {
    Error::Failed(format!("a plot cannot be drawn: {e}"))
}

/// An SVG of what is drawn.
fn drawn(size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<String> {
    static FONTS: Once = Once::new();
    FONTS.call_once(|| {
        // A font that cannot be read is told of by the first text.
        let _ = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    });
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(failed)?;
        draw(&area)?;
        area.present().map_err(failed)?;
    }
    Ok(svg)
}

fn colour(index: usize) -> RGBAColor {
    Palette99::pick(index).to_rgba()
}

/// Colours of kinds of points, in the order of the legend: all of them can be read on white.
const KINDS: [(PointKind, &str, RGBColor); 4] = [
    (PointKind::Preset, "presets", RGBColor(200, 20, 50)),
    (PointKind::Knob, "one number of high changed", RGBColor(20, 130, 50)),
    (PointKind::March, "marching view and sun rays", RGBColor(170, 95, 0)),
    (PointKind::ViewMarch, "marching view rays, our light", RGBColor(20, 90, 190)),
];

/// Marks of a logarithmic axis: 1, 2 and 5 times powers of ten, or of more than three decades the powers
/// alone.
fn marks(range: &Range<f64>) -> Vec<f64> {
    let [low, high] = [range.start, range.end].map(f64::log10);
    let steps: &[f64] = if high - low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
        .filter(|mark| range.contains(mark))
        .collect()
}

/// A mark as people write it.
fn mark(value: &f64) -> String {
    if *value < 1e-3 { format!("{value:e}") } else { format!("{}", (value * 1e6).round() / 1e6) }
}

/// A range that holds all values with some room, for a logarithmic axis.
fn log_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for value in values.filter(|v| *v > 0.0 && v.is_finite()) {
        (low, high) = (low.min(value), high.max(value));
    }
    if low > high { 0.1..1.0 } else { 0.7 * low..1.5 * high }
}

/// Wall time of every frame, a line for each run.
pub fn frame_times(runs: &[Run]) -> Result<String> {
    let times = runs.iter().flat_map(|run| run.frames.iter().map(|f| f.wall_ms));
    let all = runs.iter().flat_map(|run| run.frames.iter().map(|f| f.frame));
    let (first, last) = (all.clone().min().unwrap_or(0), all.max().unwrap_or(1));
    // Room at the right for the names.
    let across = f64::from(first)..f64::from(last) + 0.45 * f64::from((last - first).max(1));
    let whole = |frame: &f64| match frame.fract() == 0.0 {
        true => format!("{frame:.0}"),
        false => String::new(),
    };
    let up = log_range(times);
    let marks = marks(&up);
    drawn(SIZE, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(70)
            .build_cartesian_2d(across, up.log_scale().with_key_points(marks))
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_label_formatter(&whole)
            .y_label_formatter(&mark)
            .x_desc("frame")
            .y_desc("ms")
            .label_style((FONT, 14))
            .draw()
            .map_err(failed)?;
        for (index, run) in runs.iter().enumerate() {
            let line = run.frames.iter().map(|f| (f64::from(f.frame), f.wall_ms));
            let style = colour(index).stroke_width(2);
            chart
                .draw_series(LineSeries::new(line.clone(), style).point_size(2))
                .map_err(failed)?
                .label(format!("{} {}", run.case, run.preset))
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .label_font((FONT, 13))
            .draw()
            .map_err(failed)
    })
}

/// Median times of the passes of every run, end to end.
pub fn passes(runs: &[Run]) -> Result<String> {
    let names: Vec<&str> =
        runs.first().map_or_else(Vec::new, |r| r.passes.iter().map(|p| p.name.as_str()).collect());
    let time = |run: &Run, name: &str| {
        run.passes.iter().find(|p| p.name == name).and_then(|p| p.ms).map_or(0.0, |ms| ms.median)
    };
    let total = |run: &Run| names.iter().map(|name| time(run, name)).sum::<f64>();
    let longest = runs.iter().map(total).fold(1e-3, f64::max);
    let count = runs.len() as f64;
    let size = (SIZE.0, BAR * runs.len() as u32 + AROUND_BARS);
    drawn(size, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(190)
            .build_cartesian_2d(0.0..1.35 * longest, count..0.0)
            .map_err(failed)?;
        let label = |y: &f64| match runs.get((*y - 0.5).round() as usize) {
            Some(run) if (y.fract() - 0.5).abs() < 0.01 => format!("{} {}", run.case, run.preset),
            _ => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(4 * runs.len() + 1)
            .y_label_formatter(&label)
            .light_line_style(TRANSPARENT)
            .x_desc("ms")
            .label_style((FONT, 14))
            .draw()
            .map_err(failed)?;
        for (index, name) in names.iter().enumerate() {
            let bars = runs.iter().enumerate().map(|(row, run)| {
                let before: f64 = names[..index].iter().map(|name| time(run, name)).sum();
                let corner = |x: f64, y: f64| (x, row as f64 + y);
                let ends = [corner(before, 0.15), corner(before + time(run, name), 0.85)];
                Rectangle::new(ends, colour(index).filled())
            });
            let square = colour(index).filled();
            chart
                .draw_series(bars)
                .map_err(failed)?
                .label(*name)
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], square));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .label_font((FONT, 13))
            .draw()
            .map_err(failed)
    })
}

/// Run time against error, with the front.
pub fn curve(
    curve: &Curve,
    error: fn(&Point) -> Option<PictureError>,
    on_front: fn(&Point) -> bool,
) -> Result<String> {
    let place = |p: &Point| error(p).map(|e| (p.ms(curve.cost), e.without_noise()));
    let places = || curve.points.iter().filter_map(|p| place(p).map(|at| (p, at)));
    let seen = |v: f64| v > 0.0 && v.is_finite();
    let across = log_range(places().map(|(_, (ms, _))| ms));
    // Names stand to the right of their points.
    let across = across.start..2.0 * across.end;
    let up = log_range(places().map(|(_, (_, error))| error));
    let [across_marks, up_marks] = [&across, &up].map(marks);
    drawn(SIZE, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(80)
            .build_cartesian_2d(
                across.log_scale().with_key_points(across_marks),
                up.log_scale().with_key_points(up_marks),
            )
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc(match curve.cost {
                Cost::Wall => "ms a frame",
                Cost::Processor => "processor ms a frame",
            })
            .y_desc("relMSE")
            .x_label_formatter(&mark)
            .y_label_formatter(&mark)
            .label_style((FONT, 14))
            .draw()
            .map_err(failed)?;
        let mut front: Vec<(f64, f64)> =
            places().filter(|(p, _)| on_front(p)).map(|(_, at)| at).collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart
            .draw_series(LineSeries::new(front, BLACK.mix(0.35).stroke_width(6)))
            .map_err(failed)?
            .label("Pareto front")
            .legend(|(x, y)| {
                PathElement::new([(x, y), (x + 16, y)], BLACK.mix(0.35).stroke_width(6))
            });
        for (kind, name, style) in KINDS {
            let mut of_kind: Vec<_> =
                places().filter(|(p, (ms, e))| p.kind == kind && seen(*ms) && seen(*e)).collect();
            if of_kind.is_empty() {
                continue;
            }
            if kind != PointKind::Knob {
                of_kind.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
                let line = of_kind.iter().map(|(_, at)| *at);
                chart.draw_series(LineSeries::new(line, style.mix(0.5))).map_err(failed)?;
            }
            let dots = of_kind.iter().map(|(_, at)| Circle::new(*at, 4, style.filled()));
            chart
                .draw_series(dots)
                .map_err(failed)?
                .label(name)
                .legend(move |(x, y)| Circle::new((x + 8, y), 4, style.filled()));
            let names = of_kind.iter().map(|(p, at)| {
                EmptyElement::at(*at)
                    + Text::new(p.name.clone(), (7, -6), (FONT, 12).into_font().color(&style))
            });
            chart.draw_series(names).map_err(failed)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .label_font((FONT, 13))
            .draw()
            .map_err(failed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_marks_that_people_read() {
        let written = |range: Range<f64>| marks(&range).iter().map(mark).collect::<Vec<_>>();
        assert_eq!(written(150.0..6000.0), ["200", "500", "1000", "2000", "5000"]);
        assert_eq!(written(0.02..0.3), ["0.02", "0.05", "0.1", "0.2"]);
        assert_eq!(written(2e-4..2e-3), ["2e-4", "5e-4", "0.001"]);
        assert_eq!(written(0.05..2000.0), ["0.1", "1", "10", "100", "1000"]);
    }
}
