//! The camera path.

use egui::{Button, ComboBox, DragValue, Slider, Ui};

use super::Report;
use crate::scene::limits;
use crate::window::session::Session;
use crate::window::wishes::Wish;

/// Most that two views which are added one by one lie apart, s.
const LONGEST_STEP: f64 = 600.0;

/// Recording, views one by one, flying along, saving.
pub(super) fn path(ui: &mut Ui, session: &mut Session, report: &Report) {
    let (camera, now) = (session.fly.camera(), session.clock.time);
    let path = &mut session.path;
    ui.horizontal(|ui| {
        let label = if path.is_recording() { "Stop" } else { "Record" };
        if ui.button(label).on_hover_text("R; takes the place of the path there is").clicked() {
            path.record(&camera, now);
        }
        let label = if path.is_replaying() { "Stop" } else { "Fly along" };
        let there = path.len() > 0;
        if ui.add_enabled(there, Button::new(label)).on_hover_text("P").clicked() {
            path.replay();
        }
        if ui.add_enabled(there, Button::new("Save")).clicked() {
            session.wishes.push(Wish::SavePath);
        }
    });
    ui.horizontal(|ui| {
        if ui.button("Add view").on_hover_text("K").clicked() {
            path.add(&camera, now);
        }
        let range = limits::LEAST_KEY_STEP..=LONGEST_STEP;
        ui.add(DragValue::new(&mut path.step).range(range).speed(0.1).suffix(" s later"));
        if ui.add_enabled(path.len() > 0, Button::new("Take back")).clicked() {
            path.remove_last();
        }
        if ui.add_enabled(path.len() > 0, Button::new("Clear")).clicked() {
            path.clear();
        }
    });
    ComboBox::from_label("a file").selected_text("choose").show_ui(ui, |ui| {
        for path in &report.found.paths {
            if ui.selectable_label(false, path.display().to_string()).clicked() {
                session.wishes.push(Wish::Open(path.clone()));
            }
        }
    });
    let path = &mut session.path;
    ui.label(format!("{} keys, {:.1} s", path.len(), path.end()));
    let (mut time, end) = (path.time, path.end());
    if end > 0.0 {
        ui.add(Slider::new(&mut time, 0.0..=end).suffix(" s").text("place on the path"));
    }
    if time != path.time {
        path.time = time;
        if let Some(view) = path.view(&camera) {
            session.fly.set(&view);
        }
    }
}
