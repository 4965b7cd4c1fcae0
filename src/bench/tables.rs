//! A bench as a table of frames, and as a trace.

use serde_json::{Value, json};

use super::record::{Bench, Frame, Run};
use crate::{Error, Result};

/// Names of the counters, in the order of the columns.
fn counters(frame: &Frame) -> Result<Vec<(String, u64)>> {
    let failed = || Error::Failed("counters are no table of whole numbers".to_owned());
    let Ok(Value::Object(map)) = serde_json::to_value(frame.counters) else { return Err(failed()) };
    map.into_iter().map(|(name, value)| Ok((name, value.as_u64().ok_or_else(failed)?))).collect()
}

/// `bench.csv`: one line for each frame. A pass that did not run has no time.
pub fn csv(bench: &Bench) -> Result<String> {
    let mut text = String::new();
    for run in &bench.runs {
        for frame in &run.frames {
            let counters = counters(frame)?;
            if text.is_empty() {
                let mut header: Vec<String> =
                    ["case", "preset", "frame", "time_s", "wall_ms", "cpu_ms"]
                        .map(str::to_owned)
                        .into();
                header.extend(frame.passes.iter().map(|p| format!("{}_ms", p.name)));
                header.extend(counters.iter().map(|(name, _)| name.clone()));
                text.push_str(&header.join(","));
                text.push('\n');
            }
            let mut line = vec![
                field(&run.case),
                field(&run.preset),
                frame.frame.to_string(),
                frame.time.to_string(),
                frame.wall_ms.to_string(),
                frame.cpu_ms.to_string(),
            ];
            let ms = |ms: Option<f64>| ms.map_or_else(String::new, |ms| ms.to_string());
            line.extend(frame.passes.iter().map(|p| ms(p.milliseconds)));
            line.extend(counters.iter().map(|(_, value)| value.to_string()));
            text.push_str(&line.join(","));
            text.push('\n');
        }
    }
    Ok(text)
}

/// A field by RFC 4180: quoted where it holds what would end it.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// `trace.json` in Chrome's trace event format, for chrome://tracing or Perfetto: a process for each
/// run, its frames on one line and their passes on another, end to end.
pub fn trace(bench: &Bench) -> Value {
    let events = bench.runs.iter().enumerate().flat_map(|(process, run)| events(process, run));
    json!({ "displayTimeUnit": "ms", "traceEvents": events.collect::<Vec<_>>() })
}

fn events(process: usize, run: &Run) -> Vec<Value> {
    let name = format!("{} {}", run.case, run.preset);
    let meta = |what: &str, line: usize, name: &str| json!({ "ph": "M", "name": what, "pid": process, "tid": line, "args": { "name": name } });
    let mut events = vec![
        meta("process_name", 0, &name),
        meta("thread_name", 0, "frames"),
        meta("thread_name", 1, "passes"),
    ];
    // Microseconds are the format's unit.
    let event = |line: usize, name: &str, start: f64, ms: f64, args: Value| {
        json!({
            "ph": "X", "cat": "frame", "name": name, "pid": process, "tid": line,
            "ts": 1e3 * start, "dur": 1e3 * ms, "args": args,
        })
    };
    let mut frame_start = 0.0;
    for frame in &run.frames {
        let args = json!({ "time": frame.time, "counters": frame.counters });
        let label = format!("frame {}", frame.frame);
        events.push(event(0, &label, frame_start, frame.wall_ms, args));
        let mut start = frame_start;
        let ran = frame.passes.iter().filter_map(|p| p.milliseconds.map(|ms| (p, ms)));
        for (pass, ms) in ran {
            events.push(event(1, &pass.name, start, ms, json!({ "reason": pass.reason })));
            start += ms;
        }
        // Passes that are timed one by one may take longer than the frame did.
        frame_start = start.max(frame_start + frame.wall_ms);
    }
    events
}
