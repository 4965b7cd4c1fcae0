//! The cloud field and its medium.

use egui::{CollapsingHeader, Grid, Ui};

use super::{Report, field, weather};
use crate::medium::Phase;
use crate::scene::{CloudField, WeatherMap, limits};
use crate::window::session::Session;

/// The field: every number of it.
pub(super) fn clouds(ui: &mut Ui, session: &mut Session, report: &Report) {
    let start = session.start.clouds.clone();
    let mut there = session.scene.clouds.is_some();
    ui.checkbox(&mut there, "a field of clouds around the camera");
    if there != session.scene.clouds.is_some() {
        session.scene.clouds = there.then(|| start.clone().unwrap_or_default());
    }
    let Some(clouds) = &mut session.scene.clouds else { return };
    let start = start.unwrap_or_default();
    let before = clouds.clone();
    Grid::new("clouds").num_columns(3).show(ui, |ui| {
        numbers(ui, clouds, &start);
        cells(ui, clouds, &start);
    });
    let wishes = &mut session.wishes;
    CollapsingHeader::new("weather map")
        .open(session.unfold.then_some(true))
        .show(ui, |ui| weather::weather(ui, clouds, &start, report, wishes));
    CollapsingHeader::new("shapes")
        .open(session.unfold.then_some(true))
        .show(ui, |ui| names(ui, clouds, &report.shapes));
    // Each number is in its range, but they may not go together.
    let less_than_a_cell = |map: &WeatherMap, cell: f64| map.extent.min_element() < cell;
    let cell = clouds.cell_size;
    if clouds.slots() > limits::MOST_SLOTS
        || clouds.weather.as_ref().is_some_and(|map| less_than_a_cell(map, cell))
    {
        *clouds = before;
    }
}

fn numbers(ui: &mut Ui, clouds: &mut CloudField, start: &CloudField) {
    let all = 0..=u32::MAX;
    let hint = "another seed is another sky";
    field::whole(ui, "seed", hint, (all, 1), &mut clouds.seed, start.seed);
    macro_rules! numbers {
        ($($field:ident, $range:ident, $name:literal, $hint:literal;)*) => {$(
            field::number(ui, $name, $hint, &limits::$range, &mut clouds.$field, start.$field);
        )*};
    }
    numbers! {
        coverage, COVERAGE, "coverage", "share of the sky that is covered; with a weather map, where it is white";
        base, CLOUD_BASE, "base", "altitude of the flat bases";
        thickness, CLOUD_THICKNESS, "thickness", "height of the tallest cloud";
        extinction, EXTINCTION, "extinction", "at density 1";
        feature_size, FEATURE_SIZE, "feature size", "distance between groups of clouds";
        particle_size, PARTICLE_SIZE, "particle size", "radius of a full-grown particle";
        evolution_time, EVOLUTION_TIME, "evolution", "time in which a cloud grows and vanishes";
    }
    let hint = "velocity of the whole field: x, y, z";
    field::vector(ui, "wind", hint, &limits::WIND, &mut clouds.wind, start.wind);
}

fn cells(ui: &mut Ui, clouds: &mut CloudField, start: &CloudField) {
    let hint = "side of a cell of the innermost ring; each ring's are twice as wide";
    let (range, value) = (&limits::CELL_SIZE, &mut clouds.cell_size);
    field::number(ui, "cell size", hint, range, value, start.cell_size);
    macro_rules! wholes {
        ($($field:ident, $range:ident, $step:literal, $name:literal, $hint:literal;)*) => {$(
            let range = (limits::$range, $step);
            field::whole(ui, $name, $hint, range, &mut clouds.$field, start.$field);
        )*};
    }
    wholes! {
        cells, CELLS, 2, "cells", "a side of a ring, an even number";
        rings, RINGS, 1, "rings", "number of rings";
        layers, LAYERS, 1, "layers", "particles above each other in a cell";
    }
}

/// Which shapes the particles take; none chosen means all.
fn names(ui: &mut Ui, clouds: &mut CloudField, shapes: &[String]) {
    ui.weak("none chosen: all that have noise");
    for name in shapes {
        let mut chosen = clouds.shapes.contains(name);
        let full = clouds.shapes.len() >= limits::MOST_FIELD_SHAPES && !chosen;
        if ui.add_enabled(!full, egui::Checkbox::new(&mut chosen, name.as_str())).changed() {
            clouds.shapes.retain(|other| other != name);
            if chosen {
                clouds.shapes.push(name.clone());
            }
        }
    }
}

/// What the particles are filled with. It is taken over by a button, as tables may have to be
/// computed for it.
pub(super) fn medium(ui: &mut Ui, session: &mut Session) {
    let start = session.start.medium;
    let medium = &mut session.medium;
    Grid::new("medium").num_columns(3).show(ui, |ui| {
        ui.label("phase function").on_hover_text("water droplets, or Henyey-Greenstein");
        ui.horizontal(|ui| {
            let is_mie = matches!(medium.phase, Phase::Mie { .. });
            if ui.selectable_label(is_mie, "droplets").clicked() && !is_mie {
                medium.phase = crate::scene::Medium::default().phase;
            }
            if ui.selectable_label(!is_mie, "HG").clicked() && is_mie {
                medium.phase = Phase::Hg { g: 0.85 };
            }
        });
        field::back(ui, &start.phase.to_string(), medium.phase != start.phase, || {
            medium.phase = start.phase;
        });
        ui.end_row();
        match &mut medium.phase {
            Phase::Mie { diameter_um } => {
                let before =
                    if let Phase::Mie { diameter_um } = start.phase { diameter_um } else { 20.0 };
                let hint = "of a droplet";
                field::number(ui, "diameter", hint, &DIAMETER, diameter_um, before);
            }
            Phase::Hg { g } => {
                let before = if let Phase::Hg { g } = start.phase { g } else { 0.85 };
                field::number(ui, "g", "mean cosine of scattering", &MEAN_COSINE, g, before);
            }
        }
        let hint = "share of the extinguished light that is scattered on";
        field::number(ui, "albedo", hint, &limits::ALBEDO, &mut medium.albedo, start.albedo);
    });
    let changed = *medium != session.scene.medium;
    let take = egui::Button::new("Take over");
    let hint = "computes tables for it where there are none, which takes up to a minute";
    if ui.add_enabled(changed, take).on_hover_text(hint).clicked() {
        session.scene.medium = session.medium;
    }
}

/// As the phase functions allow; `Phase::check` has the last word.
const DIAMETER: limits::Range = limits::Range { least: 5.0, most: 50.0, unit: "um" };
const MEAN_COSINE: limits::Range = limits::Range { least: -0.999, most: 0.999, unit: "" };
