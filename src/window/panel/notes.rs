//! What is told beside the panel: mistakes, keys, what a view shows, what was done.

use egui::{Align2, Color32, Context, Grid, Id, RichText, Window};

use super::{MARGIN, Report, beside};
use crate::window::gamepad;
use crate::window::input::HELP;
use crate::window::session::Session;

/// How long a message stays, s: for a command to be read.
const SHOWN: f64 = 8.0;
/// Width of the keys, points: of the longest row.
const KEYS_WIDTH: f32 = 440.0;
/// Widest message, points.
const WIDTH: f32 = 360.0;

/// What is wrong with files that changed on disk, until it is mended.
pub(super) fn mistakes(ctx: &Context, report: &Report) {
    let mistakes: Vec<_> = [&report.mistake, &report.map_mistake].into_iter().flatten().collect();
    if mistakes.is_empty() {
        return;
    }
    Window::new("Mistake in the file")
        .anchor(Align2::CENTER_BOTTOM, [0.0, -MARGIN])
        .collapsible(false)
        .resizable(false)
        .show(ctx, |ui| {
            for mistake in mistakes {
                ui.colored_label(Color32::LIGHT_RED, mistake);
            }
            ui.weak("the last good one goes on; save the file again when it is mended");
        });
}

/// The keys.
pub(super) fn keys(ctx: &Context) {
    let corner = (Align2::RIGHT_BOTTOM, [-MARGIN, -MARGIN]);
    let height = (ctx.content_rect().height() - 2.0 * MARGIN).max(MARGIN);
    let window = Window::new("Keys").anchor(corner.0, corner.1).resizable(false);
    window.vscroll(true).default_size([KEYS_WIDTH, height]).show(ctx, |ui| {
        Grid::new("keys").show(ui, |ui| {
            for (key, meaning) in HELP.iter().chain(gamepad::HELP) {
                ui.label(RichText::new(*key).strong());
                ui.label(*meaning);
                ui.end_row();
            }
        });
    });
}

/// What the colours of a view of the insides mean, and the comparison with the reference.
pub(super) fn beside_the_picture(ctx: &Context, session: &mut Session, report: &Report) {
    if report.legend.is_none() && !session.compare.wanted {
        return;
    }
    Window::new("Beside the picture")
        .anchor(Align2::RIGHT_TOP, [-MARGIN, MARGIN])
        .title_bar(false)
        .resizable(false)
        .show(ctx, |ui| {
            if let Some(legend) = &report.legend {
                ui.label(legend);
            }
            if session.compare.wanted {
                beside::beside(ui, session, report);
            }
        });
}

/// What is under way, and a message for a while after it was told. Not in the panel, whose rows stay
/// where they are.
pub(super) fn news(ctx: &Context, report: &Report) {
    let now = ctx.input(|input| input.time);
    let id = Id::unique("message");
    let number = report.message.number;
    let last = ctx.data(|data| data.get_temp::<(u64, f64)>(id)).unwrap_or_default();
    let since = if last.0 == number { last.1 } else { now };
    ctx.data_mut(|data| data.insert_temp(id, (number, since)));
    let left = SHOWN - (now - since);
    let message = Some(&report.message.text).filter(|text| !text.is_empty() && left > 0.0);
    // Before the first picture the stage has a place of its own.
    let stage = report.stage.as_ref().filter(|_| report.has_picture);
    if message.is_none() && stage.is_none() && report.reading.is_none() {
        return;
    }
    Window::new("News")
        .anchor(Align2::RIGHT_BOTTOM, [-MARGIN, -MARGIN])
        .title_bar(false)
        .resizable(false)
        .show(ctx, |ui| {
            ui.set_max_width(WIDTH);
            if let Some(stage) = stage {
                ui.label(format!("{stage} …"));
            }
            if let Some(file) = &report.reading {
                ui.label(format!("reading {file} …"));
            }
            if let Some(message) = message {
                ui.label(RichText::new(message).strong());
                ctx.request_repaint_after_secs(left as f32);
            }
        });
}
