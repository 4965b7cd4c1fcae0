//! Run time against error, with names beside the points.

use std::ops::Range;

use plotters::prelude::*;

use super::super::labels::{Rect, placed};
use super::{
    AXIS_TEXT, Area, FONT, LEGEND_TEXT, MARGIN, SIZE, drawn, failed, log_range, mark, marks,
};
use crate::Result;
use crate::bench::record::{Cost, Curve, PictureError, Point, PointKind};

/// Size of text at points; as of the other sizes.
const POINT_TEXT: u32 = 14;
/// What of the picture the legend of a curve takes, pixels.
const LEGEND_STRIP: u32 = 34;

/// Colours of kinds of points, in the order of the legend: all of them can be read on white.
const KINDS: [(PointKind, &str, RGBColor); 4] = [
    (PointKind::Preset, "presets", RGBColor(200, 20, 50)),
    (PointKind::Knob, "one number of high changed", RGBColor(20, 130, 50)),
    (PointKind::March, "view and sun rays marched", RGBColor(170, 95, 0)),
    (PointKind::ViewMarch, "view rays marched, our light", RGBColor(20, 90, 190)),
];

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
    // Room for names beside the outermost points.
    let across = 0.8 * across.start..1.3 * across.end;
    let up = log_range(places().map(|(_, (_, error))| error));
    let [across_marks, up_marks] = [&across, &up].map(marks);
    drawn(SIZE, |whole| {
        let (strip, area) = whole.split_vertically(LEGEND_STRIP);
        let mut chart = ChartBuilder::on(&area)
            .margin(MARGIN)
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
            .label_style((FONT, AXIS_TEXT))
            .draw()
            .map_err(failed)?;
        let mut front: Vec<(f64, f64)> =
            places().filter(|(p, _)| on_front(p)).map(|(_, at)| at).collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        let wide = BLACK.mix(0.25).stroke_width(6);
        chart.draw_series(LineSeries::new(front, wide)).map_err(failed)?;
        let mut names = Vec::new();
        let mut kinds = vec![("Pareto front", wide)];
        for (kind, name, style) in KINDS {
            let mut of_kind: Vec<_> =
                places().filter(|(p, (ms, e))| p.kind == kind && seen(*ms) && seen(*e)).collect();
            if of_kind.is_empty() {
                continue;
            }
            kinds.push((name, style.stroke_width(2)));
            if kind != PointKind::Knob {
                of_kind.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
                let line = of_kind.iter().map(|(_, at)| *at);
                chart.draw_series(LineSeries::new(line, style.mix(0.5))).map_err(failed)?;
            }
            let dots = of_kind.iter().map(|(_, at)| Circle::new(*at, 4, style.filled()));
            chart.draw_series(dots).map_err(failed)?;
            let at = |at: &(f64, f64)| chart.plotting_area().map_coordinate(at);
            names.extend(of_kind.iter().map(|(p, place)| (at(place), short(p), style)));
        }
        named(whole, &chart.plotting_area().get_pixel_range(), &names)?;
        kinds_legend(&strip, &kinds)
    })
}

/// A point's name beside others of its kind: the legend tells the rest.
fn short(point: &Point) -> String {
    let kind = match point.kind {
        PointKind::Preset => "",
        PointKind::Knob => "high ",
        PointKind::March => "march-",
        PointKind::ViewMarch => "view-march-",
    };
    point.name.strip_prefix(kind).unwrap_or(&point.name).to_owned()
}

/// Writes names beside their points, or where there is room, with a line.
fn named(
    area: &Area<'_>,
    (across, down): &(Range<i32>, Range<i32>),
    names: &[((i32, i32), String, RGBColor)],
) -> Result<()> {
    let mut points = Vec::new();
    for ((x, y), name, colour) in names {
        let (width, height) =
            area.estimate_text_size(name, &point_style(colour)).map_err(failed)?;
        points.push(([*x, *y], [width as i32, height as i32]));
    }
    let frame = Rect([across.start, down.start, across.end, down.end]);
    for (((x, y), name, colour), place) in names.iter().zip(placed(&points, frame)) {
        if let Some([end_x, end_y]) = place.line {
            let line = PathElement::new([(*x, *y), (end_x, end_y)], colour.mix(0.4));
            area.draw(&line).map_err(failed)?;
        }
        let [left, top] = place.at;
        let text = Text::new(name.clone(), (left, top), point_style(colour));
        area.draw(&text).map_err(failed)?;
    }
    Ok(())
}

fn point_style(colour: &RGBColor) -> TextStyle<'static> {
    let mut style = TextStyle::from((FONT, POINT_TEXT).into_font());
    style.color = colour.to_backend_color();
    style
}

/// Kinds of points in a row, from left to right.
fn kinds_legend(area: &Area<'_>, kinds: &[(&str, ShapeStyle)]) -> Result<()> {
    let style = TextStyle::from((FONT, LEGEND_TEXT).into_font());
    let (mut x, y) = (80 + MARGIN as i32, MARGIN as i32);
    for (name, line) in kinds {
        let path = PathElement::new([(x, y + 7), (x + 18, y + 7)], *line);
        area.draw(&path).map_err(failed)?;
        area.draw(&Text::new((*name).to_owned(), (x + 24, y), style.clone())).map_err(failed)?;
        let (width, _) = area.estimate_text_size(name, &style).map_err(failed)?;
        x += width as i32 + 40;
    }
    Ok(())
}
