//! What is wrong with a field, and where: turned into one sentence with file, line and field.

use crate::error::Error;
use crate::scene::limits::Range;

/// The result of a check.
pub(super) type Checked = Result<(), Fault>;

/// A field that cannot be used.
#[derive(Debug)]
pub(super) struct Fault {
    field: String,
    message: String,
}

impl Fault {
    /// What was expected and what was found.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The path of the field: "particles[3].radius".
    pub fn field(&self) -> &str {
        &self.field
    }

    /// The error for a file or a thing called `place`.
    pub fn in_place(self, place: &str) -> Error {
        if self.field.is_empty() {
            Error::input(place, self.message)
        } else {
            Error::input(format!("{place}: {}", self.field), self.message)
        }
    }

    /// The error for a line of a file, counted from 1; 0 where the line is not known.
    pub fn in_line(self, place: &str, line: usize) -> Error {
        if line == 0 { self.in_place(place) } else { self.in_place(&format!("{place}:{line}")) }
    }
}

/// The path to a field while it is checked; costs nothing until something is wrong.
#[derive(Clone, Copy)]
pub(super) enum At<'a> {
    Root,
    Key(&'a At<'a>, &'static str),
    Index(&'a At<'a>, usize),
}

impl<'a> At<'a> {
    pub fn key(&'a self, key: &'static str) -> At<'a> {
        At::Key(self, key)
    }

    pub fn index(&'a self, index: usize) -> At<'a> {
        At::Index(self, index)
    }

    pub fn fault(&self, message: impl Into<String>) -> Fault {
        Fault { field: self.text(), message: message.into() }
    }

    /// Checks one number; NaN is in no range.
    pub fn number(&self, value: f64, range: &Range) -> Checked {
        if value >= range.least && value <= range.most {
            return Ok(());
        }
        let unit = if range.unit.is_empty() { String::new() } else { format!(" {}", range.unit) };
        let expected = if range.most == f64::MAX {
            "a finite number".to_owned()
        } else {
            format!("a number from {} to {}{unit}", short(range.least), short(range.most))
        };
        Err(self.fault(format!("expected {expected}, found {}", short(value))))
    }

    /// Checks each of several numbers, named by index.
    pub fn numbers(&self, values: &[f64], range: &Range) -> Checked {
        values.iter().enumerate().try_for_each(|(i, value)| self.index(i).number(*value, range))
    }

    /// Checks a whole number.
    pub fn whole(&self, value: u32, range: &std::ops::RangeInclusive<u32>) -> Checked {
        if range.contains(&value) {
            return Ok(());
        }
        let (least, most) = (range.start(), range.end());
        Err(self.fault(format!("expected a whole number from {least} to {most}, found {value}")))
    }

    fn text(&self) -> String {
        match self {
            At::Root => String::new(),
            At::Key(At::Root, key) => (*key).to_owned(),
            At::Key(parent, key) => format!("{}.{key}", parent.text()),
            At::Index(parent, index) => format!("{}[{index}]", parent.text()),
        }
    }
}

/// A number as a person would write it: "20000", "1e11".
fn short(value: f64) -> String {
    let text = if value.abs() >= 1e7 { format!("{value:e}") } else { format!("{value:?}") };
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// The path in serde's terms, without the marks for what has no name.
pub(super) fn path_text(path: &serde_path_to_error::Path) -> String {
    // An unknown field is part of its path, whatever it is called.
    let text = tidy(&path.to_string(), LONGEST_MESSAGE);
    if text == "." || text == "?" { String::new() } else { text.trim_end_matches(".?").to_owned() }
}

/// Longest part of somebody else's text that is repeated in a message.
const LONGEST_MESSAGE: usize = 300;

/// A fault from a message of serde: it may hold anything that stood in the file, so it is
/// shortened and freed of control characters, and a misspelt name gets a suggestion.
pub(super) fn from_serde(field: &str, message: &str) -> Fault {
    // A missing field is named as the field it should be.
    if let Some(name) = message.strip_prefix("missing field `").and_then(|m| m.strip_suffix('`')) {
        let field = if field.is_empty() { name.to_owned() } else { format!("{field}.{name}") };
        return Fault { field, message: "is missing".to_owned() };
    }
    let suggestion = suggestion(message);
    let message = message
        .replace("expected f64", "expected a number")
        .replace("expected u32", "expected a whole number from 0 to 4294967295")
        .replace("EOF while parsing", "the file ends within")
        .replace("expected value", "expected a value; NaN and infinity are none")
        .replace("number out of range", "expected a number of at most 1.8e308")
        .replace("floating-point number overflowed", "expected a number of at most 1.8e308");
    Fault { field: tidy(field, 100), message: tidy(&message, LONGEST_MESSAGE) + &suggestion }
}

/// ", did you mean `x`?" where an unknown name is close to a known one.
fn suggestion(message: &str) -> String {
    // The form of serde's messages: unknown field `a`, expected one of `b`, `c`.
    const MARKS: [&str; 2] = ["unknown field `", "unknown variant `"];
    if !MARKS.iter().any(|mark| message.starts_with(mark)) || message.len() > 2000 {
        return String::new();
    }
    let mut names = message.split('`').skip(1).step_by(2);
    let Some(found) = names.next() else { return String::new() };
    // Below this similarity, words merely share some letters.
    const SIMILAR: f64 = 0.8;
    names
        .map(|name| (strsim::jaro_winkler(found, name), name))
        .filter(|(similarity, _)| *similarity >= SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| format!("; did you mean `{name}`?"))
        .unwrap_or_default()
}

/// One line of at most `longest` characters, nothing unprintable in it.
pub(super) fn tidy(text: &str, longest: usize) -> String {
    let mut out = String::new();
    for (count, c) in text.trim().chars().enumerate() {
        if count == longest {
            out.push('…');
            break;
        }
        match c {
            '\n' => out.push_str("; "),
            c if c.is_control() => out.extend(c.escape_default()),
            c => out.push(c),
        }
    }
    out
}
