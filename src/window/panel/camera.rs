//! The camera, and particles that the scene lists.

use egui::{ComboBox, DragValue, Grid, Ui};

use super::field;
use crate::scene::{ParticleSpec, limits};
use crate::window::session::Session;

/// Every number of the camera.
pub(super) fn camera(ui: &mut Ui, session: &mut Session) {
    let start = *session.fly.start();
    let mut camera = session.fly.camera();
    let mut changed = false;
    Grid::new("camera").num_columns(3).show(ui, |ui| {
        let ahead = camera.target - camera.position;
        let place = &limits::COORDINATE;
        let value = &mut camera.position;
        if field::vector(ui, "position", "the pinhole", place, value, start.position) {
            // Moved, it looks the same way.
            camera.target = camera.position + ahead;
            changed = true;
        }
        let (hint, value) = ("a point in the middle of the picture", &mut camera.target);
        changed |= field::vector(ui, "target", hint, place, value, start.target);
        let (hint, value) = ("a direction that is up in the picture", &mut camera.up);
        changed |= field::vector(ui, "up", hint, &UP, value, start.up);
        let (range, value) = (&limits::FIELD_OF_VIEW, &mut camera.fov_x);
        changed |= field::number(ui, "field of view", "horizontal", range, value, start.fov_x);
        let hint = "diameter of a thin lens, 0 for a pinhole; only the reference has it";
        let (range, value) = (&limits::APERTURE, &mut camera.aperture);
        changed |= field::number(ui, "aperture", hint, range, value, start.aperture);
        let mut focus = camera.focus();
        let hint = "along the view axis, what a lens shows sharp; only for the reference";
        if field::number(ui, "focus", hint, &limits::FOCUS, &mut focus, start.focus()) {
            camera.focus_distance = Some(focus);
            changed = true;
        }
        let hint = "open so long from the picture's time on; only the reference has it";
        let (range, value) = (&limits::SHUTTER, &mut camera.shutter);
        changed |= field::number(ui, "shutter", hint, range, value, start.shutter);
    });
    if changed && is_usable(&camera) {
        session.fly.set(&camera);
    }
    ui.label(format!("speed {:.0} m/s", session.fly.speed));
}

/// Components of a direction; their length does not matter.
const UP: limits::Range = limits::Range { least: -1.0, most: 1.0, unit: "" };

/// Whether it has a direction of view and one that is up.
fn is_usable(camera: &crate::scene::Camera) -> bool {
    let scene = crate::scene::Scene { camera: *camera, ..Default::default() };
    scene.validate().is_ok()
}

/// Listed particles, one at a time.
pub(super) fn particles(ui: &mut Ui, session: &mut Session, shapes: &[String]) {
    let list = &mut session.scene.particles;
    ui.horizontal(|ui| {
        if ui.button("Add").on_hover_text("a particle before the camera").clicked() {
            let camera = session.fly.camera();
            list.push(ParticleSpec {
                centre: camera.position + NEW_DISTANCE * camera.basis().forward,
                ..NEW
            });
            session.chosen_particle = list.len() - 1;
        }
        let one = !list.is_empty();
        if ui.add_enabled(one, egui::Button::new("Remove")).clicked() {
            list.remove(session.chosen_particle.min(list.len() - 1));
        }
        ui.label(format!("{} listed", list.len()));
    });
    let Some(last) = list.len().checked_sub(1) else { return };
    session.chosen_particle = session.chosen_particle.min(last);
    ui.add(DragValue::new(&mut session.chosen_particle).range(0..=last).prefix("particle "));
    let particle = &mut list[session.chosen_particle];
    let new = ParticleSpec { centre: particle.centre, ..NEW };
    let start = session.start.particles.get(session.chosen_particle).unwrap_or(&new);
    Grid::new("particle").num_columns(3).show(ui, |ui| {
        field::vector(ui, "centre", "", &limits::COORDINATE, &mut particle.centre, start.centre);
        field::number(ui, "radius", "", &limits::RADIUS, &mut particle.radius, start.radius);
        let (range, value) = (&limits::EXTINCTION, &mut particle.extinction);
        field::number(ui, "extinction", "at density 1", range, value, start.extinction);
        ui.label("shape");
        ComboBox::from_id_salt("shape").selected_text(&particle.shape).show_ui(ui, |ui| {
            for name in shapes {
                ui.selectable_value(&mut particle.shape, name.clone(), name);
            }
        });
        let changed = particle.shape != start.shape;
        field::back(ui, &start.shape, changed, || particle.shape.clone_from(&start.shape));
        ui.end_row();
        turn(ui, particle, start);
    });
}

/// The shape's turn, as a rotation vector.
fn turn(ui: &mut Ui, particle: &mut ParticleSpec, start: &ParticleSpec) {
    let degrees = |turn: glam::DQuat| turn.to_scaled_axis() * 1f64.to_degrees();
    let (mut axis, before) = (degrees(particle.orientation), degrees(start.orientation));
    let hint = "of the shape: an axis whose length is the angle";
    if field::vector(ui, "turn", hint, &TURN, &mut axis, before) {
        particle.orientation = if axis == before {
            start.orientation
        } else {
            glam::DQuat::from_scaled_axis(axis * 1f64.to_radians()).normalize()
        };
    }
}

/// More than half a turn about an axis is less about the opposite one.
const TURN: limits::Range = limits::Range { least: -180.0, most: 180.0, unit: "°" };

/// A particle that is added, and how far before the camera, m.
const NEW: ParticleSpec = ParticleSpec {
    centre: glam::DVec3::ZERO,
    radius: 100.0,
    extinction: 0.05,
    shape: String::new(),
    orientation: glam::DQuat::IDENTITY,
};
const NEW_DISTANCE: f64 = 500.0;
