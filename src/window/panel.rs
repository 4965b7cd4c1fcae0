//! The panel: what can be changed, and what a frame takes.

mod beside;
mod camera;
mod clouds;
mod field;
mod files;
pub(super) mod frame;
mod insides;
mod notes;
mod path;
mod sky;
mod tables;
mod time;
mod weather;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use egui::{Align2, CollapsingHeader, Color32, Context, Ui, Window};

use self::frame::History;
use self::notes::Corner;
use super::files::Found;
use super::session::Session;
use super::studio::Inside;
use super::truth::Figures;
use crate::frame::FrameStats;
use crate::tables::TableSet;

/// Between the panel and the window's edge, points.
const MARGIN: f32 = 8.0;
/// Width of the panel at first, points: a row of three numbers and the way back.
const WIDTH: f32 = 300.0;

/// What was done or went wrong last.
#[derive(Clone, Debug, Default)]
pub(super) struct Message {
    /// What the user reads.
    pub text: String,
    /// Messages up to this one: the same text twice is two.
    pub number: u64,
}

impl Message {
    /// Tells something new.
    pub fn tell(&mut self, text: String) {
        self.text = text;
        self.number += 1;
    }
}

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
    pub message: Message,
    /// What is wrong with the scene's file, until it is mended.
    pub mistake: Option<String>,
    /// What is wrong with files of weather maps, until they are mended.
    pub map_mistakes: BTreeMap<PathBuf, String>,
    /// What is being read.
    pub reading: Option<String>,
    /// Files to choose from.
    pub found: Found,
    /// The scene's file.
    pub file: Option<PathBuf>,
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
    /// Shapes that the tables hold.
    pub shapes: Vec<String>,
}

/// Shows the panel; changes what is touched and nothing else.
pub(super) fn show(ctx: &Context, session: &mut Session, report: &Report) {
    let mut corner = Corner::default();
    notes::mistakes(ctx, report, &mut corner);
    notes::news(ctx, report, &mut corner);
    let from = notes::beside_the_picture(ctx, session, report);
    if session.help {
        notes::keys(ctx, corner, from);
    }
    if let Some(stage) = report.stage.as_ref().filter(|_| !report.has_picture) {
        Window::new("Starting")
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .title_bar(false)
            .resizable(false)
            .show(ctx, |ui| waiting(ui, stage, report));
    }
    if session.panel {
        let height = (ctx.content_rect().height() - 2.0 * MARGIN).max(MARGIN);
        Window::new("Cumuli")
            .default_pos([MARGIN; 2])
            .default_size([WIDTH, height])
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
    let rate = if session.is_lively() && report.interval > 0.0 {
        format!("{:.1} pictures/s", 1.0 / report.interval)
    } else {
        "at rest".to_owned()
    };
    ui.label(format!("{rate}, {} x {} pixels", report.size[0], report.size[1]));
    if report.software {
        ui.colored_label(Color32::YELLOW, format!("software driver: {}", report.adapter));
    } else {
        ui.label(&report.adapter);
    }
    time::preset(ui, session);
    ui.horizontal(|ui| {
        ui.checkbox(&mut session.unfold, "all sections");
        ui.checkbox(&mut session.help, "keys");
    });
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
    section("Reference", false).show(ui, |ui| beside::wanted(ui, session));
    section("Tables", false).show(ui, |ui| tables::tables(ui, report));
}

fn section(title: &str, open: bool) -> CollapsingHeader {
    CollapsingHeader::new(title).default_open(open)
}

#[cfg(test)]
mod tests;
