//! The reference beside the frame.

use egui::{Grid, Slider, Ui};

use super::Report;
use crate::window::session::Session;
use crate::window::truth::Beside;

/// Whether it is wanted.
pub(super) fn wanted(ui: &mut Ui, session: &mut Session) {
    let compare = &mut session.compare;
    ui.checkbox(&mut compare.wanted, "the path-traced reference beside the frame");
    let scale = Slider::new(&mut compare.scale, 0.05..=1.0).step_by(0.05);
    ui.add(scale.text("resolution of the comparison"));
}

/// The line between frame and reference, what is right of it, and how far the frame is from it.
pub(super) fn beside(ui: &mut Ui, session: &mut Session, report: &Report) {
    let running = session.clock.running && session.scene.clouds.is_some();
    if running {
        ui.label("time runs: a reference needs a view at rest");
        if ui.button("Pause").clicked() {
            session.clock.running = false;
        }
        return;
    }
    let compare = &mut session.compare;
    ui.add(
        Slider::new(&mut compare.split, 0.0..=1.0).show_value(false).text("frame | right of it:"),
    );
    for (beside, name) in [
        (Beside::Reference, "the path-traced reference"),
        (Beside::Difference, "where the frame is brighter (red), darker (blue)"),
        (Beside::Flip, "how different it looks (FLIP)"),
    ] {
        ui.radio_value(&mut compare.beside, beside, name);
    }
    ui.label(match report.samples {
        0 => "no paths yet: they begin when the view rests".to_owned(),
        1 => "1 path a pixel".to_owned(),
        samples => format!("{samples} paths a pixel"),
    });
    let Some(figures) = &report.figures else { return };
    let percent =
        |share: Option<f64>| share.map_or("-".to_owned(), |s| format!("{:+.2} %", 100.0 * s));
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.4}"));
    Grid::new("figures").show(ui, |ui| {
        for (name, value) in [
            ("bias", percent(figures.bias)),
            ("relMSE", number(figures.rel_mse)),
            ("of noise", number(figures.rel_mse_of_noise)),
            ("PSNR", figures.psnr.map_or("-".to_owned(), |v| format!("{v:.1} dB"))),
            ("FLIP", number(Some(figures.flip))),
        ] {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
