//! `report.html`: everything of a bench on one page that needs no other file.

mod labels;
mod plots;

use std::fmt::Write;

use super::record::{Bench, Cost, Curve, PictureError, Point, PointKind, Spread};
use crate::Result;

/// Names of points have a rim, so that lines do not cross them. In the dark plots are inverted, hues kept. What is
/// wider than the window is scrolled by itself.
const STYLE: &str = ":root{color-scheme:light dark}body{font:15px/1.5 sans-serif;max-width:1000px;\
    margin:2em auto;padding:0 1em;color:#222;background:#fff}.wide{overflow-x:auto}\
    table{border-collapse:collapse;margin:1em 0}td,th{padding:.2em .7em;text-align:right;\
    border-bottom:1px solid #8885}td:first-child,th:first-child{text-align:left;white-space:nowrap}\
    .facts td{text-align:left}svg{display:block;max-width:100%;min-width:700px;height:auto}svg text{font-family:sans-serif;\
    paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-opacity:.7}\
    @media(prefers-color-scheme:dark){body{color:#ddd;background:#111}\
    svg{filter:invert(.93) hue-rotate(180deg)}}";

/// The page.
pub fn html(bench: &Bench) -> Result<String> {
    let mut page = String::new();
    let machine = &bench.machine;
    let [width, height] = bench.settings.size;
    let facts = [
        ("processor", format!("{}, {} threads", machine.cpu, machine.threads)),
        ("adapter", format!("{} ({}, {})", machine.adapter, machine.kind, machine.backend)),
        ("driver", machine.driver.clone()),
        ("system", machine.system.clone()),
        ("cumuli", format!("{} {} ({})", machine.version, machine.commit, machine.build)),
        ("size", format!("{width}x{height}")),
    ];
    let rows = facts.map(|(name, value)| vec![name.to_owned(), value]);
    page.push_str(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
        <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">",
    );
    let _ = write!(page, "<title>Cumuli bench</title><style>{STYLE}</style></head><body>");
    page.push_str("<h1>Cumuli bench</h1>");
    page.push_str(&table(&[], &rows));
    for curve in &bench.curves {
        page.push_str(&curve_section(curve)?);
    }
    if !bench.runs.is_empty() {
        page.push_str("<h2>Frame times</h2>");
        page.push_str(&figure(&plots::frame_times(&bench.runs)?));
        page.push_str(&times_table(bench));
        page.push_str("<h2>Passes</h2>");
        page.push_str(&figure(&plots::passes(&bench.runs)?));
    }
    page.push_str(&motion_section(bench));
    page.push_str(&against_section(bench));
    page.push_str(&popping_section(bench));
    page.push_str("</body></html>\n");
    Ok(page)
}

fn curve_section(curve: &Curve) -> Result<String> {
    let mut text = format!("<h2>Run time against error: {}</h2>", escape(&curve.scene));
    let reference = curve.reference.as_deref().unwrap_or("none");
    let _ = write!(
        text,
        "<p>Path-traced reference: {}. Errors are relMSE over pixels with clouds, without what the \
         reference's own noise makes of it. The line is the Pareto front. Marches are named by their steps. Run time is {}.</p>",
        escape(reference),
        match curve.cost {
            Cost::Wall => "wall time",
            Cost::Processor => "processor time of all threads, as the adapter is a software driver",
        }
    );
    if curve.points.iter().any(|p| p.model.is_some()) {
        text.push_str("<h3>Against the reference: error of the model</h3>");
        text.push_str(&figure(&plots::curve(curve, |p| p.model, |p| p.on_model_front)?));
    }
    if curve.points.iter().any(|p| p.algorithm.is_some()) {
        text.push_str("<h3>Against the exact compositor: error of the algorithm</h3>");
        text.push_str(
            "<p>Marches with sun rays are measured by their own limit of many steps.</p>",
        );
        text.push_str(&figure(&plots::curve(curve, |p| p.algorithm, |p| p.on_algorithm_front)?));
    }
    let error = |e: Option<PictureError>| match e {
        Some(e) => [
            format!("{:+.1} %", 100.0 * e.bias),
            format!("{:.5}", e.rel_mse),
            format!("{:.5}", e.rel_mse_of_noise),
            format!("{:.4}", e.flip),
        ],
        None => std::array::from_fn(|_| "-".to_owned()),
    };
    let row = |p: &Point| {
        let mut row = vec![p.name.clone(), ms(p.wall_ms.median), ms(p.cpu_ms.median)];
        row.extend(error(p.model));
        row.extend(error(p.algorithm));
        row
    };
    let rows: Vec<_> = curve.points.iter().map(row).collect();
    text.push_str(&table(
        &[
            "",
            "wall ms",
            "CPU ms",
            "bias (model)",
            "relMSE",
            "of noise",
            "FLIP",
            "bias (algorithm)",
            "relMSE",
            "of noise",
            "FLIP",
        ],
        &rows,
    ));
    let mut faster = Vec::new();
    for preset in curve.points.iter().filter(|p| p.kind == PointKind::Preset) {
        let ratio = |kind, of| {
            curve.speed_up(&preset.name, kind, of).map_or("-".to_owned(), |v| format!("{v:.2}"))
        };
        faster.push(vec![
            preset.name.clone(),
            ratio(PointKind::March, |p| p.model),
            ratio(PointKind::ViewMarch, |p| p.model),
            ratio(PointKind::March, |p| p.algorithm),
            ratio(PointKind::ViewMarch, |p| p.algorithm),
        ]);
    }
    text.push_str(
        "<p>Times quicker than marching at equal error; -: no step count measured comes that far.</p>",
    );
    text.push_str(&table(
        &["", "march, model", "view march, model", "march, algorithm", "view march, algorithm"],
        &faster,
    ));
    Ok(text)
}

fn times_table(bench: &Bench) -> String {
    let cells = |s: &Spread| [s.median, s.p95, s.p99, s.max, s.spread].map(ms);
    let rows: Vec<_> = bench
        .runs
        .iter()
        .map(|run| {
            let mut row = vec![format!("{} {}", run.case, run.preset)];
            row.extend(cells(&run.wall_ms));
            row.extend([ms(run.cpu_ms.median), ms(run.first_ms), ms(run.start_ms)]);
            row
        })
        .collect();
    let head = ["ms", "median", "p95", "p99", "max", "spread", "CPU", "first frame", "renderer"];
    table(&head, &rows)
}

fn motion_section(bench: &Bench) -> String {
    if bench.motion.is_empty() {
        return String::new();
    }
    let percent = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.3} %", 100.0 * v));
    let rows: Vec<_> = bench
        .motion
        .iter()
        .map(|m| {
            vec![
                format!("{} {}, frame {}", m.case, m.preset, m.frame),
                percent(Some(m.alone.bias)),
                format!("{:.6}", m.alone.rel_mse),
                percent(m.flicker),
                percent(m.flicker_of_exact),
                m.flicker_of_reference.map_or("-".to_owned(), |f| {
                    let [low, high] = f.interval.map(|v| format!("{:.3}", 100.0 * v));
                    format!("{:.3} % ({low} to {high})", 100.0 * f.flicker)
                }),
            ]
        })
        .collect();
    let head = [
        "",
        "bias against alone",
        "relMSE against alone",
        "flicker",
        "flicker, exact",
        "flicker, path-traced",
    ];
    format!("<h2>In motion</h2>{}", table(&head, &rows))
}

fn against_section(bench: &Bench) -> String {
    if bench.against.is_empty() {
        return String::new();
    }
    let rows: Vec<_> = bench
        .against
        .iter()
        .map(|r| {
            let interval = format!("{:.3} to {:.3}", r.interval[0], r.interval[1]);
            let ratio = format!("{:.3}", r.ratio);
            vec![format!("{}, {}", r.case, r.what), ms(r.old_ms), ms(r.new_ms), ratio, interval]
        })
        .collect();
    let head = ["", "first ms", "second ms", "ratio", "95 %"];
    format!("<h2>One against another</h2>{}", table(&head, &rows))
}

fn popping_section(bench: &Bench) -> String {
    if bench.popping.is_empty() {
        return String::new();
    }
    let percent = |v: f64| format!("{:.3} %", 100.0 * v);
    let rows: Vec<_> = bench
        .popping
        .iter()
        .map(|p| {
            let name = format!("{} {}, {} pairs of frames", p.case, p.preset, p.frames);
            let [fading, at_once] = [p.fading, p.at_once];
            let all = [fading.rms, fading.most, at_once.rms, at_once.most];
            std::iter::once(name).chain(all.map(percent)).collect()
        })
        .collect();
    let head =
        ["", "rings fade: RMS", "99.9 % of pixels below", "rings end at once: RMS", "99.9 % below"];
    let told =
        "<p>What is left between two frames of a straight flight, along the clouds' motion.</p>";
    format!("<h2>Popping</h2>{told}{}", table(&head, &rows))
}

/// A plot that is scrolled where the window is narrow.
fn figure(svg: &str) -> String {
    format!("<div class=\"wide\">{svg}</div>")
}

fn ms(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { format!("{value:.0}") }
}

fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let class = if head.is_empty() { " class=\"facts\"" } else { "" };
    let mut text = format!("<div class=\"wide\"><table{class}><tr>");
    for cell in head {
        let _ = write!(text, "<th>{}</th>", escape(cell));
    }
    text.push_str("</tr>");
    for row in rows {
        text.push_str("<tr>");
        for cell in row {
            let _ = write!(text, "<td>{}</td>", escape(cell));
        }
        text.push_str("</tr>");
    }
    text.push_str("</table></div>");
    text
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
