//! The panel: what can be changed, and what a frame takes.

use egui::{CollapsingHeader, ComboBox, DragValue, Grid, RichText, Slider, Ui};

use super::input::HELP;
use super::session::{SCALES, Session};
use crate::frame::{FrameStats, Preset};
use crate::scene::limits;

/// What the panel tells.
#[derive(Clone, Debug, Default)]
pub(super) struct Report {
    /// Name of the adapter.
    pub adapter: String,
    /// Whether the processor does the work of a graphics card.
    pub software: bool,
    /// The picture's size, pixels.
    pub size: [u32; 2],
    /// Time from frame to frame, s, smoothed.
    pub frame_time: f64,
    /// The last frame.
    pub stats: FrameStats,
    /// What there is to say: a saved picture, a mistake.
    pub message: String,
}

/// Shows the panel; changes what is touched and nothing else.
pub(super) fn show(ctx: &egui::Context, session: &mut Session, report: &Report) {
    egui::Window::new("Cumuli")
        .default_pos([8.0, 8.0])
        .default_size([280.0, 680.0])
        .vscroll(true)
        .show(ctx, |ui| contents(ui, session, report));
}

fn contents(ui: &mut Ui, session: &mut Session, report: &Report) {
    if !report.message.is_empty() {
        ui.label(RichText::new(&report.message).strong());
    }
    let rate = if report.frame_time > 0.0 { 1.0 / report.frame_time } else { 0.0 };
    ui.label(format!("{rate:.1} frames/s, {} x {}", report.size[0], report.size[1]));
    if report.software {
        ui.label(format!("software driver: {}", report.adapter));
    } else {
        ui.label(&report.adapter);
    }
    section("Sky and clouds", true).show(ui, |ui| scene(ui, session));
    section("Time", true).show(ui, |ui| time(ui, session));
    section("Quality", false).show(ui, |ui| quality(ui, session));
    section("Frame", true).show(ui, |ui| frame(ui, &report.stats));
    section("Keys", false).show(ui, keys);
}

fn section(title: &str, open: bool) -> CollapsingHeader {
    CollapsingHeader::new(title).default_open(open)
}

fn scene(ui: &mut Ui, session: &mut Session) {
    let mut sun = session.sun();
    let elevation = Slider::new(&mut sun.elevation, -10.0..=90.0).suffix("°").text("sun's height");
    ui.add(lenient(elevation));
    let azimuth = Slider::new(&mut sun.azimuth, 0.0..=360.0).suffix("°").text("sun's compass");
    ui.add(lenient(azimuth));
    session.set_sun(sun);
    if let Some(clouds) = &mut session.scene.clouds {
        let range = limits::COVERAGE.least..=limits::COVERAGE.most;
        ui.add(lenient(Slider::new(&mut clouds.coverage, range).text("coverage")));
    }
    let exposure = Slider::new(&mut session.scene.exposure, -8.0..=8.0);
    ui.add(lenient(exposure.suffix(" EV").text("exposure")));
    if ui.button("Reset").on_hover_text("the scene and the view as they were loaded").clicked() {
        session.reset();
    }
}

/// Values of a file beyond the slider's range stay as they are until they are touched.
fn lenient(slider: Slider<'_>) -> Slider<'_> {
    slider.clamping(egui::SliderClamping::Edits)
}

fn time(ui: &mut Ui, session: &mut Session) {
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
    let pace = Slider::new(&mut clock.pace, 0.1..=1000.0).logarithmic(true).suffix(" ×");
    ui.add(lenient(pace.text("pace")));
}

fn quality(ui: &mut Ui, session: &mut Session) {
    let settings = &mut session.settings;
    ComboBox::from_label("preset").selected_text(settings.preset.name()).show_ui(ui, |ui| {
        for preset in Preset::ALL {
            ui.selectable_value(&mut settings.preset, preset, preset.name());
        }
    });
    ui.add(lenient(Slider::new(&mut session.scale, SCALES).step_by(0.05).text("resolution")));
    ui.checkbox(&mut settings.time_passes, "time of each pass");
}

fn frame(ui: &mut Ui, stats: &FrameStats) {
    Grid::new("passes").striped(true).show(ui, |ui| {
        for pass in &stats.passes {
            ui.label(&pass.name);
            ui.label(match pass.milliseconds {
                Some(ms) => format!("{ms:.2} ms"),
                None if pass.ran => "ran".to_owned(),
                None => "skipped".to_owned(),
            });
            ui.label(&pass.reason);
            ui.end_row();
        }
    });
    let counters = &stats.counters;
    let mib = counters.bytes_resident as f64 / f64::from(1 << 20);
    ui.label(format!(
        "{} particles, {} in view; {} list entries; {mib:.0} MiB",
        counters.particles_generated,
        counters.particles_visible,
        counters.screen_list_entries + counters.light_list_entries,
    ));
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
mod tests {
    use super::*;
    use crate::frame::{Counters, PassTime};
    use crate::scene::{CloudField, Scene};

    fn report() -> Report {
        let pass = |name: &str, ran, milliseconds| PassTime {
            name: name.to_owned(),
            milliseconds,
            ran,
            reason: "a reason".to_owned(),
        };
        Report {
            adapter: "an adapter".to_owned(),
            software: true,
            size: [640, 360],
            frame_time: 0.1,
            stats: FrameStats {
                unfinished: false,
                passes: vec![pass("sky", false, None), pass("blend", true, Some(1.25))],
                counters: Counters { particles_generated: 4321, ..Counters::default() },
            },
            message: "a message".to_owned(),
        }
    }

    /// Shows the panel a few times, as its layout takes more than one frame to settle, with the
    /// events of the last one; returns all text that is painted.
    fn shown(session: &mut Session, events: Vec<Vec<egui::Event>>) -> String {
        let ctx = egui::Context::default();
        let mut text = String::new();
        for events in [vec![Vec::new(); 3], events].concat() {
            let size = egui::vec2(1280.0, 2000.0);
            let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size));
            let input = egui::RawInput { screen_rect, events, ..Default::default() };
            let output = ctx.run_ui(input, |ui| show(ui.ctx(), session, &report()));
            text.clear();
            for clipped in &output.shapes {
                if let egui::Shape::Text(shape) = &clipped.shape {
                    text.push_str(shape.galley.text());
                    text.push('\n');
                }
            }
            output.drop_without_applying_deltas();
        }
        text
    }

    fn session() -> Session {
        let clouds = Some(CloudField { coverage: 0.333_333, ..CloudField::default() });
        let mut session = Session::new(Scene { clouds, ..Scene::default() }, 1234.567);
        // Values that sliders would round or pull into their range.
        session.scene.exposure = 20.5;
        session.clock.pace = 0.012_345;
        session.scale = 0.123_45;
        session
    }

    #[test]
    fn showing_it_changes_nothing() {
        let mut shown_session = session();
        let text = shown(&mut shown_session, Vec::new());
        assert_eq!(shown_session.seen(), session().seen());
        assert_eq!(shown_session.clock, session().clock);
        assert_eq!(shown_session.settings, session().settings);
        assert_eq!(shown_session.scale, session().scale);
        for part in [
            "a message",
            "software driver: an adapter",
            "10.0 frames/s, 640 x 360",
            "blend",
            "1.25 ms",
            "skipped",
            "a reason",
            "4321 particles",
        ] {
            assert!(text.contains(part), "{text} lacks {part}");
        }
    }

    #[test]
    fn without_a_field_there_is_no_coverage() {
        let mut session = session();
        assert!(shown(&mut session, Vec::new()).contains("coverage"));
        session.scene.clouds = None;
        assert!(!shown(&mut session, Vec::new()).contains("coverage"));
    }
}
