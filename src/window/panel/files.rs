//! Scenes to choose from, and saving.

use std::path::PathBuf;

use egui::{ComboBox, TextEdit, Ui};

use super::Report;
use crate::window::session::Session;
use crate::window::wishes::Wish;

/// Choosing, saving, resetting.
pub(super) fn files(ui: &mut Ui, session: &mut Session, report: &Report) {
    ui.horizontal(|ui| {
        ui.label("name");
        ui.add(TextEdit::singleline(&mut session.scene.name).desired_width(180.0));
    });
    let shown = report.file.as_ref().map_or("built-in".to_owned(), |f| f.display().to_string());
    ComboBox::from_label("scene").selected_text(shown).width(180.0).show_ui(ui, |ui| {
        for path in &report.found.scenes {
            let is_it = report.file.as_ref() == Some(path);
            if ui.selectable_label(is_it, path.display().to_string()).clicked() {
                session.wishes.push(Wish::Open(path.clone()));
            }
        }
    });
    ui.weak("or drop a scene or a camera path on the window");
    ui.horizontal(|ui| {
        ui.add(TextEdit::singleline(&mut session.save_as).desired_width(180.0));
        let named = !session.save_as.trim().is_empty();
        let hint = "as it is seen now: cumuli render makes the same picture of it";
        if ui.add_enabled(named, egui::Button::new("Save scene")).on_hover_text(hint).clicked() {
            let path = PathBuf::from(session.save_as.trim());
            session.wishes.push(Wish::SaveScene(Some(path)));
        }
    });
    ui.horizontal(|ui| {
        let hint = "the scene and the view as they were loaded";
        if ui.button("Reset").on_hover_text(hint).clicked() {
            session.reset();
        }
        if ui.button("Save picture").on_hover_text("PNG and EXR").clicked() {
            let both = vec![crate::output::Format::Png, crate::output::Format::Exr];
            session.wishes.push(Wish::Screenshot(both));
        }
    });
}
