//! The panel: what can be changed, and what a frame takes.

mod camera;
mod clouds;
mod field;
mod files;
pub(super) mod frame;
mod insides;
mod path;
mod sky;
mod tables;
mod time;
mod weather;

use std::path::PathBuf;
use std::sync::Arc;

use egui::{Align2, CollapsingHeader, Color32, Context, Grid, RichText, Ui, Window};

use self::frame::History;
use super::input::HELP;
use super::session::Session;
use super::studio::Inside;
use super::truth::Figures;
use crate::frame::FrameStats;
use crate::tables::TableSet;

/// Between the panel and the window's edge, points.
const MARGIN: f32 = 8.0;

/// What the panel tells.
#[derive(Clone, Debug, Default)]
pub(super) struct Report {
    /// Name of the adapter.
    pub adapter: String,
    /// Whether the processor does the work of a graphics card.
    pub software: bool,
    /// Whether there has been a picture.
    pub has_picture: bool,
    /// From the program's start to that, s.
    pub first_picture: f64,
    /// The picture's size, pixels.
    pub size: [u32; 2],
    /// From picture to picture, s, smoothed.
    pub interval: f64,
    /// What the last picture took from its order on, s.
    pub seconds: f64,
    /// The last picture.
    pub stats: FrameStats,
    /// Those before.
    pub history: History,
    /// What the pictures wait for.
    pub stage: Option<String>,
    /// Shaders compiled.
    pub compiled: u32,
    /// What there is to say: a saved picture.
    pub message: String,
    /// What is wrong with the scene's file, until it is mended.
    pub mistake: Option<String>,
    /// What is wrong with the weather map's file, until it is mended.
    pub map_mistake: Option<String>,
    /// Weather maps to choose from.
    pub maps: Vec<PathBuf>,
    /// The scene's file.
    pub file: Option<PathBuf>,
    /// Scenes to choose from.
    pub scenes: Vec<PathBuf>,
    /// Which view of the insides is shown.
    pub inside: Option<Inside>,
    /// What the colours of a view of the insides mean.
    pub legend: Option<String>,
    /// Samples a pixel of the reference.
    pub samples: u32,
    /// How far the frame is from it.
    pub figures: Option<Figures>,
    /// The tables.
    pub tables: Option<Arc<TableSet>>,
    /// Camera paths to choose from.
    pub paths: Vec<PathBuf>,
    /// Shapes that the tables hold.
    pub shapes: Vec<String>,
}

/// Shows the panel; changes what is touched and nothing else.
pub(super) fn show(ctx: &Context, session: &mut Session, report: &Report) {
    let mistakes: Vec<_> = [&report.mistake, &report.map_mistake].into_iter().flatten().collect();
    if !mistakes.is_empty() {
        Window::new("Mistake in the file")
            .anchor(Align2::CENTER_BOTTOM, [0.0, -8.0])
            .collapsible(false)
            .resizable(false)
            .show(ctx, |ui| {
                for mistake in mistakes {
                    ui.colored_label(Color32::LIGHT_RED, mistake);
                }
                ui.weak("the last good one goes on; save the file again when it is mended");
            });
    }
    if let Some(stage) = report.stage.as_ref().filter(|_| !report.has_picture) {
        Window::new("Starting")
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .title_bar(false)
            .resizable(false)
            .show(ctx, |ui| waiting(ui, stage, report));
    }
    if session.help {
        Window::new("Keys").anchor(Align2::RIGHT_TOP, [-8.0, 8.0]).resizable(false).show(ctx, keys);
    }
    if let Some(legend) = &report.legend {
        Window::new("Legend")
            .anchor(Align2::CENTER_TOP, [0.0, 8.0])
            .title_bar(false)
            .resizable(false)
            .show(ctx, |ui| ui.label(legend));
    }
    if session.panel {
        let height = (ctx.content_rect().height() - 2.0 * MARGIN).max(MARGIN);
        Window::new("Cumuli")
            .default_pos([MARGIN; 2])
            .default_size([300.0, height])
            .vscroll(true)
            .show(ctx, |ui| contents(ui, session, report));
    }
}

fn waiting(ui: &mut Ui, stage: &str, report: &Report) {
    // Nothing that turns: it would be painted all the time, by the processor that compiles.
    ui.label(stage);
    ui.label(format!("{} shaders ready", report.compiled));
}

fn contents(ui: &mut Ui, session: &mut Session, report: &Report) {
    if let Some(stage) = &report.stage {
        ui.label(format!("{stage} …"));
    }
    if !report.message.is_empty() {
        ui.label(RichText::new(&report.message).strong());
    }
    let rate = if report.interval > 0.0 { 1.0 / report.interval } else { 0.0 };
    ui.label(format!("{rate:.1} pictures/s, {} x {}", report.size[0], report.size[1]));
    if report.software {
        ui.colored_label(Color32::YELLOW, format!("software driver: {}", report.adapter));
    } else {
        ui.label(&report.adapter);
    }
    ui.checkbox(&mut session.unfold, "all sections");
    let all = session.unfold;
    let section = |title, open| section(title, open).open(all.then_some(true));
    section("Scene", true).show(ui, |ui| files::files(ui, session, report));
    section("Sun", true).show(ui, |ui| sky::sun(ui, session));
    section("Sky and ground", false).show(ui, |ui| {
        sky::sky(ui, &mut session.scene, &session.start);
    });
    section("Clouds", true).show(ui, |ui| clouds::clouds(ui, session, report));
    section("Medium", false).show(ui, |ui| clouds::medium(ui, session));
    section("Listed particles", false).show(ui, |ui| {
        camera::particles(ui, session, &report.shapes);
    });
    section("Camera", false).show(ui, |ui| camera::camera(ui, session));
    section("Time", true).show(ui, |ui| time::time(ui, session));
    section("Camera path", false).show(ui, |ui| path::path(ui, session, report));
    section("Quality", false).show(ui, |ui| time::quality(ui, session, report));
    section("Frame", true).show(ui, |ui| frame::frame(ui, report));
    section("Insides", false).show(ui, |ui| insides::insides(ui, session, report));
    section("Reference", false).show(ui, |ui| insides::reference(ui, session, report));
    section("Tables", false).show(ui, |ui| tables::tables(ui, report));
    section("Keys", false).show(ui, keys);
}

fn section(title: &str, open: bool) -> CollapsingHeader {
    CollapsingHeader::new(title).default_open(open)
}

fn keys(ui: &mut Ui) {
    Grid::new("keys").show(ui, |ui| {
        for (key, meaning) in HELP {
            ui.label(RichText::new(key).strong());
            ui.label(meaning);
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests;
