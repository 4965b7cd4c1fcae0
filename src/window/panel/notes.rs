//! What is told beside the panel: mistakes, keys, what a view shows, what was done.

use egui::{Align2, Color32, Context, Grid, Id, InnerResponse, RichText, ScrollArea, Window};

use super::{MARGIN, Report, beside};
use crate::window::gamepad;
use crate::window::input::HELP;
use crate::window::session::Session;

/// How long a message stays, s: for a command to be read.
const SHOWN: f64 = 8.0;
/// What the title and the edges of the keys take of their height, points.
const TITLE: f32 = 50.0;
/// Widest message, points.
const WIDTH: f32 = 360.0;
/// The keys are no lower where there is little room, points: some rows, and the rest by scrolling.
const LEAST_HEIGHT: f32 = 60.0;

/// The lower right corner, where notes stand on each other: none hides another.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corner {
    /// What is taken from below, points.
    taken: f32,
}

impl Corner {
    /// A window on top of those that are there.
    fn window(self, name: &str) -> Window<'_> {
        let place = [-MARGIN, -MARGIN - self.taken];
        let window = Window::new(name).id(Id::unique(name));
        window.anchor(Align2::RIGHT_BOTTOM, place).resizable(false)
    }

    /// The next one stands on this.
    fn take(&mut self, shown: Option<InnerResponse<Option<()>>>) {
        self.taken += shown.map_or(0.0, |shown| shown.response.rect.height() + MARGIN);
    }
}

/// What is wrong with files that changed on disk, until it is mended.
pub(super) fn mistakes(ctx: &Context, report: &Report, corner: &mut Corner) {
    let of_maps = report.map_mistakes.values();
    let mistakes: Vec<_> = report.mistake.iter().chain(of_maps).collect();
    if mistakes.is_empty() {
        return;
    }
    let shown = corner.window("Mistake in the file").collapsible(false).show(ctx, |ui| {
        ui.set_max_width(WIDTH);
        for mistake in mistakes {
            ui.colored_label(Color32::LIGHT_RED, mistake);
        }
        ui.weak("the last good one goes on; save the file again when it is mended");
    });
    corner.take(shown);
}

/// The keys, below what stands `from` points beneath the window's upper edge.
pub(super) fn keys(ctx: &Context, corner: Corner, from: f32) {
    let height = ctx.content_rect().height() - corner.taken - from - 2.0 * MARGIN - TITLE;
    corner.window("Keys").auto_sized().show(ctx, |ui| {
        ScrollArea::vertical().max_height(height.max(LEAST_HEIGHT)).show(ui, |ui| {
            Grid::new("keys").show(ui, |ui| {
                for (key, meaning) in HELP.iter().chain(gamepad::HELP) {
                    ui.label(RichText::new(*key).strong());
                    ui.label(*meaning);
                    ui.end_row();
                }
            });
        });
    });
}

/// What the colours of a view of the insides mean, and the comparison with the reference; its height
/// with the gap above it, points.
pub(super) fn beside_the_picture(ctx: &Context, session: &mut Session, report: &Report) -> f32 {
    if report.legend.is_none() && !session.compare.wanted {
        return 0.0;
    }
    let name = "Beside the picture";
    let shown = Window::new(name)
        .id(Id::unique(name))
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
    shown.map_or(0.0, |shown| shown.response.rect.height() + MARGIN)
}

/// What is under way, and a message for a while after it was told. Not in the panel, whose rows stay
/// where they are.
pub(super) fn news(ctx: &Context, report: &Report, corner: &mut Corner) {
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
    let shown = corner.window("News").title_bar(false).show(ctx, |ui| {
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
    corner.take(shown);
}
