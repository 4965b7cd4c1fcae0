//! The report's plots, as SVG.

mod curve;

pub use curve::curve;

use std::ops::Range;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;

use crate::bench::record::Run;
use crate::{Error, Result};

/// The name that browsers know too; the font's measures come with the program.
const FONT: &str = "sans-serif";
const SIZE: (u32, u32) = (960, 540);
/// Height of a run's bar and of what surrounds all bars, pixels.
const BAR: u32 = 26;
const AROUND_BARS: u32 = 70;
/// Around charts and legends, pixels.
const MARGIN: u32 = 12;
/// The column of a legend and a row of it, pixels.
const LEGEND_WIDTH: u32 = 190;
const LEGEND_ROW: u32 = 18;
/// Letters of a name that have room beside a chart.
const MOST_LETTERS: usize = 26;
/// Sizes of text at axes and in legends. In the picture they are by a quarter smaller.
const AXIS_TEXT: u32 = 16;
const LEGEND_TEXT: u32 = 15;
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

/// Colours of runs and passes, read on white and, inverted with their hues kept, on black.
const COLOURS: [RGBColor; 12] = [
    RGBColor(60, 110, 180),
    RGBColor(230, 125, 30),
    RGBColor(65, 150, 65),
    RGBColor(205, 60, 65),
    RGBColor(140, 95, 190),
    RGBColor(150, 105, 75),
    RGBColor(225, 110, 180),
    RGBColor(120, 120, 120),
    RGBColor(165, 165, 30),
    RGBColor(35, 165, 185),
    RGBColor(100, 75, 30),
    RGBColor(20, 95, 100),
];

fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// Lines of the same colour have other widths.
fn width(index: usize) -> u32 {
    1 + (1 + index / COLOURS.len()) as u32 % 4
}

/// A name with an end where there is no room for all of it.
fn clipped(name: &str) -> String {
    match name.char_indices().nth(MOST_LETTERS) {
        Some((end, _)) => format!("{}\u{2026}", &name[..end]),
        None => name.to_owned(),
    }
}

fn name_of(run: &Run) -> String {
    format!("{} {}", run.case, run.preset)
}

/// Names in the colours of their numbers, one below the other.
fn legend(area: &Area<'_>, names: &[String]) -> Result<()> {
    let style = (FONT, LEGEND_TEXT).into_font();
    for (index, name) in names.iter().enumerate() {
        let y = (MARGIN + index as u32 * LEGEND_ROW) as i32;
        let square = Rectangle::new([(0, y), (12, y + 12)], colour(index).filled());
        area.draw(&square).map_err(failed)?;
        let text = Text::new(clipped(name), (18, y - 1), style.clone());
        area.draw(&text).map_err(failed)?;
    }
    Ok(())
}

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
    // A single frame stands in the middle.
    let aside = if first == last { 0.5 } else { 0.0 };
    let across = f64::from(first) - aside..f64::from(last) + aside;
    let whole = |frame: &f64| match frame.fract() == 0.0 {
        true => format!("{frame:.0}"),
        false => String::new(),
    };
    let up = log_range(times);
    let marks = marks(&up);
    let names: Vec<_> = runs.iter().map(name_of).collect();
    let size = (SIZE.0, SIZE.1.max(names.len() as u32 * LEGEND_ROW + 2 * MARGIN));
    drawn(size, |area| {
        let (left, right) = area.split_horizontally(SIZE.0 - LEGEND_WIDTH);
        legend(&right, &names)?;
        let mut chart = ChartBuilder::on(&left)
            .margin(MARGIN)
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
            .label_style((FONT, AXIS_TEXT))
            .draw()
            .map_err(failed)?;
        for (index, run) in runs.iter().enumerate() {
            let line = run.frames.iter().map(|f| (f64::from(f.frame), f.wall_ms));
            let style = colour(index).stroke_width(width(index));
            chart.draw_series(LineSeries::new(line, style).point_size(2)).map_err(failed)?;
        }
        Ok(())
    })
}

/// Median times of the passes of every run, end to end.
pub fn passes(runs: &[Run]) -> Result<String> {
    let names: Vec<String> =
        runs.first().map_or_else(Vec::new, |r| r.passes.iter().map(|p| p.name.clone()).collect());
    let time = |run: &Run, name: &str| {
        run.passes.iter().find(|p| p.name == name).and_then(|p| p.ms).map_or(0.0, |ms| ms.median)
    };
    let total = |run: &Run| names.iter().map(|name| time(run, name)).sum::<f64>();
    let longest = runs.iter().map(total).fold(1e-3, f64::max);
    let count = runs.len() as f64;
    let rows = BAR * runs.len() as u32 + AROUND_BARS;
    let size = (SIZE.0, rows.max(names.len() as u32 * LEGEND_ROW + 2 * MARGIN));
    drawn(size, |area| {
        let (left, right) = area.split_horizontally(SIZE.0 - LEGEND_WIDTH);
        legend(&right, &names)?;
        let mut chart = ChartBuilder::on(&left)
            .margin(MARGIN)
            .x_label_area_size(40)
            .y_label_area_size(190)
            .build_cartesian_2d(0.0..1.02 * longest, count..0.0)
            .map_err(failed)?;
        let label = |y: &f64| match runs.get((*y - 0.5).round() as usize) {
            Some(run) if (y.fract() - 0.5).abs() < 0.01 => clipped(&name_of(run)),
            _ => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(4 * runs.len() + 1)
            .y_label_formatter(&label)
            .light_line_style(TRANSPARENT)
            .x_desc("ms")
            .label_style((FONT, AXIS_TEXT))
            .draw()
            .map_err(failed)?;
        for (index, name) in names.iter().enumerate() {
            let bars = runs.iter().enumerate().map(|(row, run)| {
                let before: f64 = names[..index].iter().map(|name| time(run, name)).sum();
                let corner = |x: f64, y: f64| (x, row as f64 + y);
                let ends = [corner(before, 0.15), corner(before + time(run, name), 0.85)];
                Rectangle::new(ends, colour(index).filled())
            });
            chart.draw_series(bars).map_err(failed)?;
        }
        Ok(())
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

    #[test]
    fn long_names_are_clipped_between_letters() {
        assert_eq!(clipped("still_paused low"), "still_paused low");
        let long = "\u{e4}".repeat(40);
        assert_eq!(clipped(&long), format!("{}\u{2026}", "\u{e4}".repeat(MOST_LETTERS)));
    }
}
