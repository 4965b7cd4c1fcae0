//! What a frame took, and why.

use std::collections::VecDeque;

use egui::ecolor::Hsva;
use egui::{Color32, Grid, Label, RichText, Ui};
use egui_plot::{Line, Plot, PlotPoints};

use super::Report;
use crate::frame::{FrameStats, Pass};

/// Width and height of the plot, points.
const PLOT: [f32; 2] = [300.0, 150.0];
/// Width of a pass's reason, points: with name and time as wide as the plot.
const REASON: f32 = 150.0;
/// Pictures that the plot shows.
const SHOWN: usize = 200;

/// Times of the last pictures' passes.
#[derive(Clone, Debug, Default)]
pub(in crate::window) struct History {
    /// Milliseconds of each pass, in the order of [`Pass::ALL`]; 0 where it did not run.
    pictures: VecDeque<[f64; Pass::ALL.len()]>,
    /// Pictures that were forgotten.
    first: usize,
}

impl History {
    /// One more picture.
    pub fn add(&mut self, stats: &FrameStats) {
        let milliseconds = Pass::ALL.map(|pass| {
            let found = stats.passes.iter().find(|p| p.name == pass.name());
            found.and_then(|p| p.milliseconds).unwrap_or(0.0)
        });
        self.pictures.push_back(milliseconds);
        if self.pictures.len() > SHOWN {
            self.pictures.pop_front();
            self.first += 1;
        }
    }

    /// Times of one pass by the number of the picture.
    fn line(&self, pass: usize) -> Vec<[f64; 2]> {
        let numbered = self.pictures.iter().zip(self.first..);
        numbered.map(|(times, number)| [number as f64, times[pass]]).collect()
    }
}

/// Plot, table and counts.
pub(super) fn frame(ui: &mut Ui, report: &Report) {
    plot(ui, &report.history);
    passes(ui, &report.stats);
    counters(ui, report);
}

fn plot(ui: &mut Ui, history: &History) {
    Plot::new("passes over time")
        .height(PLOT[1])
        .width(PLOT[0])
        .include_y(0.0)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .x_axis_label("picture")
        .y_axis_label("ms")
        .show(ui, |plot| {
            for (index, pass) in Pass::ALL.into_iter().enumerate() {
                let points = PlotPoints::from(history.line(index));
                plot.line(Line::new(pass.name(), points).color(colour(index)));
            }
        });
}

/// The colour of a pass, in plot and table. Each is a turn by the golden ratio from the one before, so
/// that neighbours differ.
fn colour(pass: usize) -> Color32 {
    let hue = (pass as f32 * std::f32::consts::GOLDEN_RATIO).fract();
    Hsva::new(hue, 0.6, 0.95, 1.0).into()
}

fn passes(ui: &mut Ui, stats: &FrameStats) {
    Grid::new("passes").striped(true).show(ui, |ui| {
        for pass in &stats.passes {
            let index = Pass::ALL.iter().position(|p| p.name() == pass.name).unwrap_or(0);
            ui.label(RichText::new(&pass.name).color(colour(index)));
            ui.label(match pass.milliseconds {
                Some(ms) => format!("{ms:.2} ms"),
                None if pass.ran => "ran".to_owned(),
                None => "skipped".to_owned(),
            });
            // The panel is no wider for a long reason.
            ui.horizontal(|ui| {
                ui.set_max_width(REASON);
                ui.add(Label::new(&pass.reason).wrap());
            });
            ui.end_row();
        }
    });
}

fn counters(ui: &mut Ui, report: &Report) {
    let counters = &report.stats.counters;
    let mib = counters.bytes_resident as f64 / f64::from(1 << 20);
    let rows = [
        (
            "particles",
            format!("{}, {} in view", counters.particles_generated, counters.particles_visible),
        ),
        (
            "list entries",
            format!(
                "{} on screen, {} from the sun",
                counters.screen_list_entries, counters.light_list_entries
            ),
        ),
        ("tiles", format!("{}, {} of them empty", counters.tiles, counters.tiles_empty)),
        ("table look-ups", counters.table_lookups.to_string()),
        ("light grid", light_grid([counters.grid_steps_made, counters.grid_steps])),
        ("memory", format!("{mib:.0} MiB on the device")),
        ("picture", format!("{:.0} ms from order to screen", 1e3 * report.seconds)),
        ("start", format!("{:.2} s to the first picture", report.first_picture)),
    ];
    Grid::new("counters").show(ui, |ui| {
        for (name, value) in rows {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

/// How far the next solution is.
fn light_grid([done, all]: [u64; 2]) -> String {
    if all == 0 { "as of now".to_owned() } else { format!("{done} of {all} steps of the next") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::PassTime;

    #[test]
    fn the_plot_keeps_the_last_pictures_under_their_numbers() {
        let mut history = History::default();
        for number in 0..SHOWN + 5 {
            let milliseconds = Some(number as f64);
            let pass = |name: &str, milliseconds| PassTime {
                name: name.to_owned(),
                milliseconds,
                ran: true,
                reason: String::new(),
            };
            let passes = vec![pass("blend", milliseconds), pass("sky", None)];
            history.add(&FrameStats { passes, ..FrameStats::default() });
        }
        let index = |pass| Pass::ALL.iter().position(|p| *p == pass).expect("a pass");
        let blend = history.line(index(Pass::Blend));
        assert_eq!(blend.len(), SHOWN);
        assert!(blend.iter().all(|[number, ms]| number == ms), "{blend:?}");
        assert_eq!(blend[0], [5.0, 5.0]);
        assert!(history.line(index(Pass::Sky)).iter().all(|p| p[1] == 0.0));
    }
}
