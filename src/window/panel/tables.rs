//! Pictures of the tables: what one particle's look-ups answer.

use std::sync::Arc;

use egui::{Color32, ColorImage, Grid, Id, TextureHandle, TextureOptions, Ui};
use glam::DVec3;

use super::Report;
use crate::tables::TableSet;

/// Side of a picture, pixels.
const SIDE: usize = 96;
/// Pictures beside each other: as many as the panel is wide for at first.
const COLUMNS: usize = 3;
/// Optical depth at density 1 through the middle of the shapes that are shown.
const DEPTH: f64 = 5.0;
/// Optical radii of the lit spheres.
const OPTICAL_RADII: [f64; 3] = [0.3, 3.0, 30.0];

/// Pictures that were made already, with the tables they are of.
#[derive(Clone)]
struct Made {
    tables: Arc<TableSet>,
    pictures: Vec<(String, TextureHandle)>,
}

/// A picture of each table.
pub(super) fn tables(ui: &mut Ui, report: &Report) {
    let Some(tables) = &report.tables else { return };
    let id = Id::unique("pictures of tables");
    let there = ui.data(|data| data.get_temp::<Made>(id));
    let made = there.filter(|made| Arc::ptr_eq(&made.tables, tables)).unwrap_or_else(|| {
        let load = |(name, image): (String, ColorImage)| {
            let texture = ui.ctx().load_texture(&name, image, TextureOptions::LINEAR);
            (name, texture)
        };
        let pictures = all(tables).into_iter().map(load).collect();
        let made = Made { tables: tables.clone(), pictures };
        ui.data_mut(|data| data.insert_temp(id, made.clone()));
        made
    });
    ui.weak(
        "transmittance of each shape by its table at optical depth 5; spheres lit from the left, by \
         medium and optical radius, order 2 and more",
    );
    Grid::new("tables").show(ui, |ui| {
        for row in made.pictures.chunks(COLUMNS) {
            for (name, texture) in row {
                ui.vertical(|ui| {
                    ui.image(texture);
                    ui.label(name);
                });
            }
            ui.end_row();
        }
    });
}

fn all(tables: &TableSet) -> Vec<(String, ColorImage)> {
    let shapes = tables.shape_names().zip(0..).filter(|(_, shape)| *shape > 0);
    let shapes = shapes.map(|(name, shape)| (name.to_owned(), transmittance(tables, shape)));
    let spheres = tables.scattering().iter().flat_map(|table| {
        OPTICAL_RADII.map(|radius| {
            let name = format!("{}, {radius}", table.phase());
            (
                name,
                picture(|place| {
                    let entry = front(place);
                    let chord = 2.0 * entry.z;
                    let source = table.lookup(entry, DVec3::NEG_Z, DVec3::NEG_X, radius)[1];
                    // As much as a white surface of the sun's irradiance sends is white.
                    source * -(-radius * chord).exp_m1() * std::f64::consts::PI
                }),
            )
        })
    });
    shapes.chain(spheres).collect()
}

/// Parallel rays through a shape, along its z axis.
fn transmittance(tables: &TableSet, shape: u32) -> ColorImage {
    picture(|place| {
        let entry = front(place);
        let exit = DVec3::new(entry.x, entry.y, -entry.z);
        let mean = f64::from(tables.chord_step(shape, entry, exit).mean_density);
        (-mean * entry.z * DEPTH).exp()
    })
}

/// Where a ray against the z axis enters the unit sphere.
fn front([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// A grey picture of what a function of the place on the unit disc is, clear outside of it.
fn picture(value: impl Fn([f64; 2]) -> f64) -> ColorImage {
    let pixels = (0..SIDE * SIDE).map(|index| {
        let at = |i: usize| 2.0 * (i as f64 + 0.5) / SIDE as f64 - 1.0;
        let place = [at(index % SIDE), -at(index / SIDE)];
        if place[0].hypot(place[1]) >= 1.0 {
            return Color32::TRANSPARENT;
        }
        let shown = crate::frame::cpu::tonemap::srgb(value(place).clamp(0.0, 1.0));
        Color32::from_gray((255.0 * shown).round() as u8)
    });
    ColorImage::new([SIDE, SIDE], pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_has_its_picture() {
        let tables = TableSet::embedded().expect("the built-in tables");
        let pictures = all(&tables);
        let shapes = tables.shape_names().count() - 1;
        assert_eq!(pictures.len(), shapes + 3 * tables.scattering().len());
        let at = |image: &ColorImage, x: usize, y: usize| image.pixels[y * SIDE + x].r();
        for (name, image) in &pictures[..shapes] {
            // Shapes are thin at their rim and dense in the middle.
            assert!(at(image, SIDE / 2, SIDE / 2) < at(image, SIDE / 2, 1), "{name}");
        }
        for (name, image) in &pictures[shapes..] {
            if name.ends_with(", 30") {
                let (left, right) =
                    (at(image, SIDE / 8, SIDE / 2), at(image, 7 * SIDE / 8, SIDE / 2));
                assert!(left > right, "{name} is lit from the left: {left} {right}");
            }
        }
    }
}
