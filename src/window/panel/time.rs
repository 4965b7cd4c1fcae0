//! Time and quality.

use egui::{ComboBox, DragValue, Slider, Ui};

use super::Report;
use super::sky::lenient;
use crate::frame::Preset;
use crate::scene::limits;
use crate::window::clock::PACES;
use crate::window::scale::{RATES, SCALES};
use crate::window::session::Session;

/// What the time's slider spans, s.
const SCRUB: f64 = 3600.0;

/// Pause, scrub, speed.
pub(super) fn time(ui: &mut Ui, session: &mut Session) {
    let clock = &mut session.clock;
    ui.horizontal(|ui| {
        let label = if clock.running { "Pause" } else { "Run" };
        if ui.button(label).clicked() {
            clock.running = !clock.running;
        }
        let range = limits::TIME.least..=limits::TIME.most;
        let time = DragValue::new(&mut clock.time).range(range).speed(1.0).suffix(" s");
        ui.add(time.clamp_existing_to_range(false));
    });
    ui.add(lenient(Slider::new(&mut clock.time, 0.0..=SCRUB).suffix(" s").text("time")));
    let pace = Slider::new(&mut clock.pace, PACES).logarithmic(true).suffix(" ×");
    ui.add(lenient(pace.text("pace")));
}

/// The preset.
pub(super) fn preset(ui: &mut Ui, session: &mut Session) {
    let settings = &mut session.settings;
    ComboBox::from_label("preset").selected_text(settings.preset.name()).show_ui(ui, |ui| {
        for preset in Preset::ALL {
            ui.selectable_value(&mut settings.preset, preset, preset.name());
        }
    });
}

/// Resolution.
pub(super) fn quality(ui: &mut Ui, session: &mut Session, report: &Report) {
    if report.software {
        ui.label(
            "A software driver does the work of a graphics card: small pictures, few a second.",
        );
    }
    let resolution = &mut session.resolution;
    ui.checkbox(&mut resolution.automatic, "resolution adapts");
    if resolution.automatic {
        let rate = Slider::new(&mut resolution.rate, RATES).logarithmic(true);
        ui.add(lenient(rate.max_decimals(0).suffix("/s").text("pictures to hold")));
        ui.label(format!("resolution {:.0} %", 100.0 * resolution.scale));
    } else {
        let scale = Slider::new(&mut resolution.scale, SCALES);
        ui.add(lenient(scale.step_by(0.05).text("resolution")));
    }
    ui.checkbox(&mut session.sharp, "sharp when nothing moves");
    ui.checkbox(&mut session.settings.time_passes, "time of each pass");
}
