//! Curves: errors over optical depth, energy over optical radius, radiance over angle.

use cumuli::Result;
use cumuli::medium::Shape;
use cumuli::tables::{ScatteringTable, TableSet};
use plotters::prelude::*;
use rayon::prelude::*;

use super::canvas::{CURVES, Canvas, FONT, failed};
use crate::verify::draws;
use crate::verify::energy::Furnace;
use crate::verify::monte_carlo::traced;

const SIZE: [u32; 2] = [1000, 640];
const CAPTION: u32 = 22;
const LABEL: u32 = 15;

/// A curve with its name.
pub struct Curve {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// Axes of a chart.
pub struct Axes<'a> {
    pub title: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub x_range: [f64; 2],
    pub y_range: [f64; 2],
}

/// Curves over a logarithmic axis; `marks` are horizontal lines with their names.
pub fn curves(axes: &Axes<'_>, curves: &[Curve], marks: &[(f64, &str)]) -> Result<Canvas> {
    let mut canvas = Canvas::new(SIZE);
    {
        let area = canvas.area();
        let [x0, x1] = axes.x_range;
        let [y0, y1] = axes.y_range;
        let mut chart = ChartBuilder::on(&area)
            .margin(16)
            .caption(axes.title, (FONT, CAPTION))
            .x_label_area_size(48)
            .y_label_area_size(76)
            .build_cartesian_2d((x0..x1).log_scale(), y0..y1)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .x_desc(axes.x)
            .y_desc(axes.y)
            .x_label_formatter(&|v| format!("{v}"))
            .label_style((FONT, LABEL))
            .max_light_lines(1)
            .draw()
            .map_err(failed)?;
        for (value, name) in marks {
            let line = [(x0, *value), (x1, *value)];
            let series = LineSeries::new(line, BLACK.mix(0.5));
            chart.draw_series(series).map_err(failed)?;
            // The left of the chart belongs to the names of the curves.
            let place = (x0 * (x1 / x0).powf(0.8), *value);
            let text = Text::new((*name).to_owned(), place, (FONT, LABEL));
            chart.draw_series([text]).map_err(failed)?;
        }
        for (curve, colour) in curves.iter().zip(CURVES.iter().cycle()) {
            let colour = *colour;
            chart
                .draw_series(LineSeries::new(curve.points.iter().copied(), colour.stroke_width(2)))
                .map_err(failed)?
                .label(&curve.name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2))
                });
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::MiddleLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font((FONT, LABEL))
            .draw()
            .map_err(failed)?;
        area.present().map_err(failed)?;
    }
    Ok(canvas)
}

/// Random chords that errors are measured on.
const CHORDS: usize = 10_000;
const SEED: u64 = 0x706c_6f74;
/// Central optical depths of the curves.
const DEPTHS: [f64; 2] = [0.1, 200.0];
const STEPS: usize = 40;

/// Evenly spaced in the logarithm.
fn spaced([least, most]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..=STEPS).map(move |i| least * (most / least).powf(i as f64 / STEPS as f64))
}

/// Errors of transmittance over central optical depth, all shapes: whole chords, or random parts.
pub fn depth_errors(tables: &TableSet, shapes: &[Shape], parts: bool) -> Result<Canvas> {
    use cumuli::tables::optical_depth::measure::{central_matter, test_chords};
    let curve = |shape: &Shape| {
        let index = tables.shape_index(&shape.name()).unwrap_or_default();
        let chords = test_chords(shape, CHORDS, SEED);
        let central = central_matter(shape);
        let found: Vec<[f64; 3]> = chords
            .par_iter()
            .map(|chord| {
                let profile = tables.chord_profile(index, chord.entry, chord.exit);
                let mean = f64::from(profile.mean_density);
                let [from, to] = chord.part.map(|t| f64::from(profile.fraction(t as f32)));
                let length = chord.entry.distance(chord.exit) / central;
                if parts {
                    [length, chord.part_matter, mean * (to - from)]
                } else {
                    [length, chord.mean, mean]
                }
            })
            .collect();
        let rms = |depth: f64| {
            let squares = found.iter().map(|[length, exact, got]| {
                let passed = |matter: &f64| (-depth * length * matter).exp();
                (passed(got) - passed(exact)).powi(2)
            });
            f64::sqrt(squares.sum::<f64>() / found.len() as f64)
        };
        Curve { name: shape.name(), points: spaced(DEPTHS).map(|d| (d, rms(d))).collect() }
    };
    let all: Vec<Curve> = shapes.iter().map(curve).collect();
    let (what, target) =
        if parts { ("random parts of chords", 0.01) } else { ("whole chords", 0.005) };
    let axes = Axes {
        title: &format!("Error of transmittance, root mean square, {what}"),
        x: "mean optical depth through the centre",
        y: "RMS error of transmittance",
        x_range: DEPTHS,
        y_range: [0.0, above(&all, target)],
    };
    curves(&axes, &all, &[(target, "target at depth 10")])
}

/// A little above the highest of the curves and of a mark.
fn above(curves: &[Curve], mark: f64) -> f64 {
    let values = curves.iter().flat_map(|c| c.points.iter().map(|p| p.1));
    1.1 * values.filter(|v| v.is_finite()).fold(mark, f64::max)
}

/// Light out over light in, and the worst chord of the furnace, over the optical radius.
pub fn energy(table: &ScatteringTable, medium: &str) -> Result<Canvas> {
    let furnace = Furnace::new(table);
    let range = table.optical_radius_range();
    let radii: Vec<f64> = spaced(range).collect();
    let found: Vec<(f64, f64)> = radii.par_iter().map(|r| furnace.balance(*r)).collect();
    let points = |pick: fn(&(f64, f64)) -> f64| {
        radii.iter().zip(&found).map(|(r, both)| (*r, pick(both))).collect()
    };
    let all = [
        Curve { name: "light out over light in".to_owned(), points: points(|b| b.0) },
        Curve { name: "furnace, worst chord".to_owned(), points: points(|b| b.1) },
    ];
    let values = || all.iter().flat_map(|c| c.points.iter().map(|p| p.1));
    let low = values().fold(0.99, f64::min) - 0.002;
    let high = values().fold(1.01, f64::max) + 0.002;
    let axes = Axes {
        title: &format!("Conservation of energy, {medium}"),
        x: "optical radius",
        y: "light out over light in",
        x_range: range,
        y_range: [low, high],
    };
    let marks: &[(f64, &str)] =
        if table.albedo() == 1.0 { &[(0.998, "-0.2 %"), (1.002, "+0.2 %")] } else { &[] };
    curves(&axes, &all, marks)
}

/// Optical radii of the charts of radiance, within the table's range.
const CHART_RADII: [f64; 4] = [0.3, 2.0, 10.0, 50.0];
/// Impact parameter and azimuth of the rays.
const IMPACT: f64 = 0.5;
const AZIMUTH: f64 = 1.0;
/// Angles that are traced.
const TRACED: usize = 16;

/// Radiance over the angle to the sun: table, and traced paths with their standard errors.
pub fn radiance(table: &ScatteringTable, medium: &str, paths: u64) -> Result<Canvas> {
    let phase = table.phase().prepare();
    let [least, most] = table.optical_radius_range();
    let incidence = (1.0f64 - IMPACT * IMPACT).sqrt();
    let mut canvas = Canvas::new([1200, 900]);
    {
        let area = canvas.area();
        let title = format!(
            "Radiance at impact parameter {IMPACT}, {medium}: table (line), traced (dots, 2 s.e.)"
        );
        let area = area.titled(&title, (FONT, CAPTION)).map_err(failed)?;
        for (panel, radius) in area.split_evenly((2, 2)).iter().zip(CHART_RADII) {
            let radius = radius.clamp(least, most);
            let ray = |degrees: f64| cumuli::tables::sample::SampleRay {
                optical_radius: radius,
                ..draws::ray(incidence, degrees.to_radians(), AZIMUTH)
            };
            let line: Vec<(f64, f64)> = (0..=720)
                .map(|i| {
                    let degrees = f64::from(i) * 0.25;
                    let ray = ray(degrees);
                    let [once, more] = table.lookup(ray.entry, ray.dir, ray.sun, radius);
                    let opaque = -(-2.0 * radius * incidence).exp_m1();
                    (degrees, opaque * (phase.eval(ray.dir.dot(ray.sun)) * once + more))
                })
                .collect();
            let dots: Vec<(f64, [f64; 2])> = (0..=TRACED)
                .into_par_iter()
                .map(|i| {
                    let degrees = 180.0 * i as f64 / TRACED as f64;
                    (degrees, traced(table, &ray(degrees), paths, i as u64))
                })
                .collect();
            let lit = || line.iter().map(|p| p.1).filter(|v| *v > 0.0 && v.is_finite());
            let low = 0.7 * lit().fold(f64::INFINITY, f64::min).clamp(1e-9, 1e6);
            let high = 1.4 * lit().fold(low, f64::max).max(10.0 * low);
            let mut chart = ChartBuilder::on(panel)
                .margin(12)
                .caption(format!("optical radius {radius}"), (FONT, 18))
                .x_label_area_size(40)
                .y_label_area_size(70)
                .build_cartesian_2d(0.0..180.0, (low..high).log_scale())
                .map_err(failed)?;
            chart
                .configure_mesh()
                .x_desc("angle between view and sun, degrees")
                .y_desc("radiance per sun irradiance, 1/sr")
                .y_label_formatter(&|v| format!("{v:.0e}"))
                .x_label_formatter(&|v| format!("{v:.0}"))
                .label_style((FONT, 14))
                .max_light_lines(1)
                .draw()
                .map_err(failed)?;
            chart.draw_series(LineSeries::new(line, CURVES[0].stroke_width(2))).map_err(failed)?;
            for (degrees, [value, error]) in dots {
                let bar = [value - 2.0 * error, value + 2.0 * error].map(|v| v.max(low));
                let bar = bar.map(|v| (degrees, v));
                let path = PathElement::new(bar.to_vec(), CURVES[1].stroke_width(1));
                chart.draw_series([path]).map_err(failed)?;
                let dot = Circle::new((degrees, value), 3, CURVES[1].filled());
                chart.draw_series([dot]).map_err(failed)?;
            }
        }
        area.present().map_err(failed)?;
    }
    Ok(canvas)
}
