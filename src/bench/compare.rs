//! One bench against another.

use super::record::{Bench, Frame, Ratio, Run, SCHEMA};
use super::statistics::{Draw, ratio};
use crate::{Error, Result};

/// Reads a bench from JSON text; `place` names it in errors.
pub fn read(text: &str, place: &str) -> Result<Bench> {
    // The version first: other versions may have other fields.
    #[derive(serde::Deserialize)]
    struct Version {
        schema: u32,
    }
    let bad = |e: serde_json::Error| Error::input(place, format!("is no bench of cumuli: {e}"));
    let Version { schema } = serde_json::from_str(text).map_err(bad)?;
    if schema != SCHEMA {
        let message = format!("expected schema {SCHEMA}, found {schema}");
        return Err(Error::input(place, message));
    }
    let bench: Bench = serde_json::from_str(text).map_err(bad)?;
    for (index, run) in bench.runs.iter().enumerate() {
        for (frame, what, ms) in times(run) {
            // NaN and infinity are no JSON.
            if ms < 0.0 {
                let field = format!("runs[{index}].frames[{frame}]: {what}");
                let message = format!("{field}: expected a time of at least 0, found {ms}");
                return Err(Error::input(place, message));
            }
        }
    }
    Ok(bench)
}

/// All times of a run's frames: place of the frame, what took the time, ms.
fn times(run: &Run) -> impl Iterator<Item = (usize, &str, f64)> {
    run.frames.iter().enumerate().flat_map(|(index, frame)| {
        let whole = [("wall_ms", frame.wall_ms), ("cpu_ms", frame.cpu_ms)];
        let passes =
            frame.passes.iter().filter_map(|p| p.milliseconds.map(|ms| (p.name.as_str(), ms)));
        whole.into_iter().chain(passes).map(move |(what, ms)| (index, what, ms))
    })
}

/// Ratios of all runs that both have: wall time, processor time, and each pass.
pub fn ratios(old: &Bench, new: &Bench) -> Vec<Ratio> {
    let find = |run: &Run| new.runs.iter().find(|n| n.case == run.case && n.preset == run.preset);
    let pairs = old.runs.iter().filter_map(|run| Some((run, find(run)?)));
    pairs.flat_map(|(old, new)| of_runs(old, new, Draw::Apart)).collect()
}

/// Ratios of two runs of one case.
pub fn of_runs(old: &Run, new: &Run, draw: Draw) -> Vec<Ratio> {
    let case = match old.preset == new.preset {
        true => format!("{} {}", old.case, old.preset),
        false => format!("{} {} to {}", old.case, old.preset, new.preset),
    };
    let times = |run: &Run, of: &dyn Fn(&Frame) -> Option<f64>| -> Vec<f64> {
        run.frames.iter().filter_map(of).collect()
    };
    let one = |what: &str, of: &dyn Fn(&Frame) -> Option<f64>| {
        ratio(&case, what, &times(old, of), &times(new, of), draw)
    };
    let passes = old.passes.iter().filter_map(|pass| {
        let ms = |frame: &Frame| {
            frame.passes.iter().find(|p| p.name == pass.name && p.ran)?.milliseconds
        };
        one(&pass.name, &ms)
    });
    let whole = [one("wall", &|f| Some(f.wall_ms)), one("cpu", &|f| Some(f.cpu_ms))];
    whole.into_iter().flatten().chain(passes).collect()
}

/// What besides the program differs between two benches, so that their times say little.
pub fn differences(old: &Bench, new: &Bench) -> Vec<String> {
    let (a, b) = (&old.machine, &new.machine);
    let (s, t) = (&old.settings, &new.settings);
    let size = |s: [u32; 2]| format!("{}x{}", s[0], s[1]);
    [
        ("processor", a.cpu.clone(), b.cpu.clone()),
        ("threads", a.threads.to_string(), b.threads.to_string()),
        ("adapter", a.adapter.clone(), b.adapter.clone()),
        ("driver", a.driver.clone(), b.driver.clone()),
        ("build", a.build.clone(), b.build.clone()),
        ("size", size(s.size), size(t.size)),
        ("tables", s.tables.clone(), t.tables.clone()),
        ("set", s.set.join(" "), t.set.join(" ")),
    ]
    .into_iter()
    .filter(|(_, old, new)| old != new)
    .map(|(what, old, new)| format!("{what}: {old}, then {new}"))
    .collect()
}

/// The ratios in lines for people, and a last one for scripts.
pub fn lines(ratios: &[Ratio]) -> Vec<String> {
    let width = ratios.iter().map(|r| r.case.len()).max().unwrap_or(0);
    let verdict = |r: &Ratio| match (r.is_change(), r.ratio > 1.0) {
        (false, _) => "within noise",
        (true, true) => "slower",
        (true, false) => "quicker",
    };
    let mut lines: Vec<_> = ratios
        .iter()
        .map(|r| {
            format!(
                "{:width$}  {:12} {:10.3} ms {:10.3} ms  x{:<7.3} {:.3} to {:.3}  {}",
                r.case,
                r.what,
                r.old_ms,
                r.new_ms,
                r.ratio,
                r.interval[0],
                r.interval[1],
                verdict(r)
            )
        })
        .collect();
    let count = |word: &str| ratios.iter().filter(|r| verdict(r) == word).count();
    lines.push(format!(
        "ratios={} slower={} quicker={} within_noise={}",
        ratios.len(),
        count("slower"),
        count("quicker"),
        count("within noise")
    ));
    lines
}
