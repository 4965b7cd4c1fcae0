//! A bench for tests.

use super::record::{Bench, Frame, Machine, Run, SCHEMA, Settings, Spread};
use crate::frame::{Counters, PassTime};

/// One run of preset low whose frames took so long, ms; sky was made in each, the blend in none.
pub fn bench(case: &str, wall: &[f64]) -> Bench {
    let frames = (2..).zip(wall).map(|(frame, ms)| Frame {
        frame,
        time: 0.1 * f64::from(frame),
        wall_ms: *ms,
        cpu_ms: 2.0 * ms,
        passes: vec![pass("sky", Some(0.25 * ms)), pass("blend", None)],
        counters: Counters { tiles: 4, ..Counters::default() },
    });
    let none = Spread { median: 0.0, p95: 0.0, p99: 0.0, min: 0.0, max: 0.0, spread: 0.0 };
    let of = |values: &[f64]| Spread::of(values).unwrap_or(none);
    let run = Run {
        case: case.to_owned(),
        preset: "low".to_owned(),
        start_ms: 1.0,
        first_ms: 2.0,
        frames: frames.collect(),
        wall_ms: of(wall),
        cpu_ms: of(&wall.iter().map(|ms| 2.0 * ms).collect::<Vec<_>>()),
        passes: Vec::new(),
    };
    let word = || "some".to_owned();
    let machine = Machine {
        cpu: word(),
        threads: 2,
        system: word(),
        adapter: word(),
        kind: word(),
        backend: word(),
        driver: word(),
        version: word(),
        commit: word(),
        build: word(),
    };
    let (size, frames) = ([16, 16], wall.len() as u32);
    let settings = Settings {
        size,
        error_size: size,
        warmup: 2,
        frames,
        fps: 10.0,
        tables: word(),
        set: Vec::new(),
    };
    let (runs, curves) = (vec![run], Vec::new());
    Bench {
        schema: SCHEMA,
        machine,
        settings,
        runs,
        curves,
        motion: Vec::new(),
        against: Vec::new(),
        popping: Vec::new(),
        clumps: None,
    }
}

fn pass(name: &str, milliseconds: Option<f64>) -> PassTime {
    let reason = "for a test".to_owned();
    PassTime { name: name.to_owned(), ran: milliseconds.is_some(), reason, milliseconds }
}
