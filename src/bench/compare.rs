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
    of_times(&case, old, new, draw)
}

/// Ratios of any two runs under a name.
pub fn of_times(case: &str, old: &Run, new: &Run, draw: Draw) -> Vec<Ratio> {
    let times = |run: &Run, of: &dyn Fn(&Frame) -> Option<f64>| -> Vec<f64> {
        run.frames.iter().filter_map(of).collect()
    };
    let one = |what: &str, of: &dyn Fn(&Frame) -> Option<f64>| {
        ratio(case, what, &times(old, of), &times(new, of), draw)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::samples::bench;

    #[test]
    fn a_bench_is_read_back_and_negative_times_are_refused() {
        let sound = bench("case", &[1.5, 2.5, 3.5]);
        let text = |bench: &Bench| serde_json::to_string(bench).expect("JSON");
        assert_eq!(read(&text(&sound), "old.json").expect("sound"), sound);
        for (spoil, field) in [
            ((|f: &mut Frame| f.cpu_ms = -1.0) as fn(&mut Frame), "runs[0].frames[1]: cpu_ms"),
            (|f| f.passes[0].milliseconds = Some(-1e-9), "runs[0].frames[1]: sky"),
        ] {
            let mut bad = sound.clone();
            spoil(&mut bad.runs[0].frames[1]);
            let message = read(&text(&bad), "old.json").expect_err(field).to_string();
            assert!(message.contains("old.json") && message.contains(field), "{message}");
        }
        // Cut off anywhere it is no bench, and never a panic.
        let whole = text(&sound);
        for end in 0..whole.len() {
            assert!(read(&whole[..end], "cut.json").is_err(), "{end}");
        }
    }

    #[test]
    fn what_both_have_is_compared() {
        let (old, new) = (bench("case", &[1.0, 1.1, 0.9]), bench("case", &[2.0, 2.2, 1.8]));
        let found = ratios(&old, &new);
        let names: Vec<_> = found.iter().map(|r| r.what.as_str()).collect();
        assert_eq!(names, ["wall", "cpu"]);
        assert!(found.iter().all(|r| (r.ratio - 2.0).abs() < 1e-12 && r.is_change()), "{found:?}");
        let last = lines(&found).pop().expect("a last line");
        assert_eq!(last, "ratios=2 slower=2 quicker=0 within_noise=0");
        assert!(ratios(&old, &bench("another", &[1.0])).is_empty());
        assert!(ratios(&old, &bench("case", &[])).is_empty(), "no frames");
        assert_eq!(differences(&old, &new), Vec::<String>::new());
        let mut slower = new.clone();
        slower.machine.driver = "other".to_owned();
        assert_eq!(differences(&old, &slower), ["driver: some, then other"]);
    }
}
