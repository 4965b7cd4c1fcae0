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
pub(super) fn field(text: &str) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::samples::bench;

    /// The records of a text by RFC 4180.
    fn records(text: &str) -> Vec<Vec<String>> {
        let (mut all, mut record, mut field, mut quoted) = (vec![], vec![], String::new(), false);
        let mut letters = text.chars().peekable();
        while let Some(letter) = letters.next() {
            match letter {
                '"' if quoted && letters.peek() == Some(&'"') => field.extend(letters.next()),
                '"' => quoted = !quoted,
                ',' if !quoted => record.push(std::mem::take(&mut field)),
                '\n' if !quoted => {
                    record.push(std::mem::take(&mut field));
                    all.push(std::mem::take(&mut record));
                }
                _ => field.push(letter),
            }
        }
        assert!(!quoted && field.is_empty() && record.is_empty(), "ends in a record: {text}");
        all
    }

    #[test]
    fn odd_names_come_back_from_the_table() {
        let name = "a, \"b\"\nc";
        let text = csv(&bench(name, &[1.5, 2.5])).expect("a table");
        let all = records(&text);
        assert_eq!(all.len(), 3);
        assert!(all.iter().all(|record| record.len() == all[0].len()), "{text}");
        let of = |record: usize, column: &str| {
            let index = all[0].iter().position(|c| c == column).expect(column);
            all[record][index].as_str()
        };
        assert_eq!([of(1, "case"), of(2, "preset"), of(2, "frame")], [name, "low", "3"]);
        assert_eq!([of(1, "wall_ms"), of(2, "cpu_ms"), of(1, "sky_ms")], ["1.5", "5", "0.375"]);
        assert_eq!([of(1, "blend_ms"), of(1, "tiles")], ["", "4"], "did not run; a counter");
    }

    /// What the format asks of a complete event, and that none begins before the one before it on its line ends.
    #[test]
    fn a_trace_is_lines_of_events_one_after_the_other() {
        let trace = trace(&bench("a \"case\"", &[1.5, 2.5]));
        let events = trace["traceEvents"].as_array().expect("events");
        let number = |event: &Value, field: &str| event[field].as_f64().expect(field);
        let mut ends = std::collections::HashMap::new();
        let mut named = Vec::new();
        for event in events {
            let line = [&event["pid"], &event["tid"]].map(|v| v.as_u64().expect("a number"));
            if event["ph"] == "M" {
                assert!(event["args"]["name"].is_string(), "{event}");
                named.push(line);
                continue;
            }
            assert_eq!((&event["ph"], event["name"].is_string()), (&json!("X"), true), "{event}");
            let (start, length) = (number(event, "ts"), number(event, "dur"));
            let end: &mut f64 = ends.entry(line).or_default();
            assert!(start >= *end && length >= 0.0, "{event} begins before {end}");
            *end = start + length;
            assert!(named.contains(&line), "{event} on a line without a name");
        }
        let frame = events.iter().find(|e| e["name"] == "frame 2").expect("a frame");
        assert_eq!(
            (&frame["dur"], &frame["args"]["counters"]["tiles"]),
            (&json!(1500.0), &json!(4))
        );
        assert_eq!(events.iter().filter(|e| e["name"] == "sky").count(), 2);
        assert!(!events.iter().any(|e| e["name"] == "blend"), "it did not run");
    }
}
