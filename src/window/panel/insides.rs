//! Views of the insides.

use egui::Ui;

use super::Report;
use crate::window::session::Session;
use crate::window::studio::Inside;

/// Which view is shown in place of the picture.
pub(super) fn insides(ui: &mut Ui, session: &mut Session, report: &Report) {
    ui.radio_value(&mut session.inside, None, "the picture");
    for (inside, name) in Inside::ALL {
        ui.radio_value(&mut session.inside, Some(inside), name);
    }
    if let Some(legend) = &report.legend {
        ui.weak(legend);
    }
}
