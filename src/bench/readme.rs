//! Tables in a README, each between two marks: of presets, of light among overlapping particles.

use super::clumps::table::markdown;
use super::record::{Bench, Curve, PictureError, Point, PointKind};
use crate::{Error, Result};

/// Around the table of presets.
const PRESETS: [&str; 2] = ["<!-- presets: made by cumuli bench -->", "<!-- /presets -->"];
/// Around that of clumps.
const CLUMPS: [&str; 2] = ["<!-- clumps: made by cumuli bench --clumps -->", "<!-- /clumps -->"];

/// What stands in a text before the table and after it; `place` names it in errors.
pub fn around<'a>(text: &'a str, place: &str, is_of_clumps: bool) -> Result<[&'a str; 2]> {
    let [begin_mark, end_mark] = if is_of_clumps { CLUMPS } else { PRESETS };
    let missing = |mark: &str| Error::input(place, format!("expected the line `{mark}`"));
    let begin = text.find(begin_mark).ok_or_else(|| missing(begin_mark))? + begin_mark.len();
    let end = begin + text[begin..].find(end_mark).ok_or_else(|| missing(end_mark))?;
    Ok([&text[..begin], &text[end..]])
}

/// The text with the table that the bench has made anew between its marks.
pub fn refreshed(text: &str, place: &str, bench: &Bench) -> Result<String> {
    let [before, after] = around(text, place, bench.clumps.is_some())?;
    let table = match &bench.clumps {
        Some(clumps) => markdown(bench, clumps),
        None => table(bench),
    };
    Ok(format!("{before}\n\n{table}\n{after}"))
}

fn table(bench: &Bench) -> String {
    let [width, height] = bench.settings.error_size;
    let machine = &bench.machine;
    let mut lines = vec![
        format!(
            "At {width}x{height} on {} threads of {}, {} ({}), commit {}:",
            machine.threads, machine.cpu, machine.adapter, machine.driver, machine.commit
        ),
        String::new(),
        "| scene | preset | ms a frame | processor ms | bias | relMSE | of noise | FLIP | relMSE \
         against exact | march / ours | view march / ours |"
            .to_owned(),
        "|---|---|---|---|---|---|---|---|---|---|---|".to_owned(),
    ];
    for curve in &bench.curves {
        let presets = curve.points.iter().filter(|p| p.kind == PointKind::Preset);
        lines.extend(presets.map(|point| row(curve, point)));
    }
    lines.push(String::new());
    lines.join("\n")
}

fn row(curve: &Curve, point: &Point) -> String {
    let number = |e: Option<PictureError>, of: &dyn Fn(PictureError) -> String| {
        e.map_or_else(|| "-".to_owned(), of)
    };
    let faster = |kind, of| {
        let ratio = curve.speed_up(&point.name, kind, of);
        ratio.map_or_else(|| "-".to_owned(), |v| format!("{v:.1}"))
    };
    let cells = [
        curve.scene.clone(),
        point.name.clone(),
        format!("{:.0}", point.wall_ms.median),
        format!("{:.0}", point.cpu_ms.median),
        number(point.model, &|e| format!("{:+.1} %", 100.0 * e.bias)),
        number(point.model, &|e| format!("{:.3}", e.rel_mse)),
        number(point.model, &|e| format!("{:.3}", e.rel_mse_of_noise)),
        number(point.model, &|e| format!("{:.3}", e.flip)),
        number(point.algorithm, &|e| format!("{:.5}", e.rel_mse)),
        faster(PointKind::March, |p| p.model),
        faster(PointKind::ViewMarch, |p| p.algorithm),
    ];
    format!("| {} |", cells.join(" | "))
}
