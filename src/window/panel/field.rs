//! Rows of the panel: a name, a value with its unit and range, and the way back.

use egui::{Button, DragValue, Response, RichText, Ui};
use glam::DVec3;

use crate::scene::limits::Range;

/// A tenth of a per cent of its range, or of itself, a value changes by for each point the mouse
/// drags it.
const DRAG: f64 = 1e-3;
/// Ranges that span more than this are dragged by shares of the value instead.
const WIDE: f64 = 1e5;

/// A row of a grid with one number; true where it was changed.
pub(super) fn number(
    ui: &mut Ui,
    name: &str,
    hint: &str,
    range: &Range,
    value: &mut f64,
    start: f64,
) -> bool {
    let before = *value;
    let told = told(hint, range);
    ui.label(name).on_hover_text(&told);
    drag(ui, range, value).on_hover_text(&told);
    back(ui, &text(start, range.unit), *value != start, || *value = start);
    ui.end_row();
    *value != before
}

/// A row with three numbers.
pub(super) fn vector(
    ui: &mut Ui,
    name: &str,
    hint: &str,
    range: &Range,
    value: &mut DVec3,
    start: DVec3,
) -> bool {
    let before = *value;
    let told = told(hint, range);
    ui.label(name).on_hover_text(&told);
    ui.horizontal(|ui| {
        for axis in 0..3 {
            drag(ui, range, &mut value[axis]).on_hover_text(&told);
        }
    });
    let told = start.to_array().map(|v| text(v, "")).join(", ");
    back(ui, &told, *value != start, || *value = start);
    ui.end_row();
    *value != before
}

/// A row with a whole number, a multiple of `step`.
pub(super) fn whole(
    ui: &mut Ui,
    name: &str,
    hint: &str,
    (range, step): (std::ops::RangeInclusive<u32>, u32),
    value: &mut u32,
    start: u32,
) -> bool {
    let before = *value;
    let (least, most) = (*range.start(), *range.end());
    let told = format!("{hint}; {least} to {most}");
    ui.label(name).on_hover_text(&told);
    let speed = (f64::from(most - least) * DRAG).clamp(0.05, 1e3);
    let mut chosen = *value;
    let widget = DragValue::new(&mut chosen).range(range).speed(speed);
    ui.add(widget.clamp_existing_to_range(false)).on_hover_text(&told);
    if chosen != *value {
        *value = chosen.next_multiple_of(step).min(most);
    }
    back(ui, &start.to_string(), *value != start, || *value = start);
    ui.end_row();
    *value != before
}

/// The button that leads back to where a value was.
pub(super) fn back(ui: &mut Ui, start: &str, changed: bool, mut reset: impl FnMut()) {
    let button = Button::new(RichText::new("↺").monospace()).frame(false);
    if ui.add_enabled(changed, button).on_hover_text(format!("back to {start}")).clicked() {
        reset();
    }
}

/// What a row is about and in which range, for who points at it.
fn told(hint: &str, range: &Range) -> String {
    let (least, most) = (text(range.least, ""), text(range.most, range.unit));
    if range.most == f64::MAX { hint.to_owned() } else { format!("{hint}; {least} to {most}") }
}

fn drag(ui: &mut Ui, range: &Range, value: &mut f64) -> Response {
    let span = range.most - range.least;
    let speed = if span > WIDE { value.abs().max(1.0) * 10.0 * DRAG } else { span * DRAG };
    let suffix = if range.unit.is_empty() { String::new() } else { format!(" {}", range.unit) };
    // A value from a file beyond what fits in digits stays as it is until it is touched.
    let widget = DragValue::new(value)
        .range(range.least..=range.most)
        .speed(speed)
        .suffix(suffix)
        .max_decimals(9)
        .clamp_existing_to_range(false);
    ui.add(widget)
}

/// A number as a person would write it.
fn text(value: f64, unit: &str) -> String {
    let plain = if value.abs() >= 1e6 { format!("{value:e}") } else { format!("{value}") };
    if unit.is_empty() { plain } else { format!("{plain} {unit}") }
}
