//! The weather map of the cloud field.

use egui::{ComboBox, Grid, Ui};

use super::{Report, field};
use crate::scene::{Channel, CloudField, Outside, WeatherMap, limits};
use crate::window::wishes::Wish;

/// Chooses a map, and says how it lies and what it means.
pub(super) fn weather(
    ui: &mut Ui,
    clouds: &mut CloudField,
    start: &CloudField,
    report: &Report,
    wishes: &mut Vec<Wish>,
) {
    let file = clouds.weather.as_ref().map(|map| map.file.clone());
    let shown = file.as_ref().map_or("none".to_owned(), |file| file.display().to_string());
    ui.horizontal(|ui| {
        ComboBox::from_label("map").selected_text(shown).width(180.0).show_ui(ui, |ui| {
            if ui.selectable_label(file.is_none(), "none").clicked() {
                clouds.weather = None;
            }
            for path in &report.found.maps {
                let is_it = file.as_ref() == Some(path);
                if ui.selectable_label(is_it, path.display().to_string()).clicked() {
                    wishes.push(Wish::Open(path.clone()));
                }
            }
        });
        let same = clouds.weather == start.weather;
        field::back(ui, "what the scene says", !same, || clouds.weather = start.weather.clone());
    });
    ui.weak("or drop a PNG image on the window");
    let Some(map) = &mut clouds.weather else { return };
    let start = start.weather.clone().unwrap_or_else(|| map.clone());
    Grid::new("weather").num_columns(3).show(ui, |ui| numbers(ui, map, &start));
    channels(ui, map, &start, wishes);
}

fn numbers(ui: &mut Ui, map: &mut WeatherMap, start: &WeatherMap) {
    let [width, height] = map.image.size();
    ui.label("pixels");
    ui.label(format!("{width} x {height}"));
    ui.end_row();
    let (wide, at) = (&limits::WEATHER_EXTENT, &limits::COORDINATE);
    field::number(ui, "width", "west to east", wide, &mut map.extent.x, start.extent.x);
    field::number(ui, "depth", "north to south", wide, &mut map.extent.y, start.extent.y);
    field::number(ui, "middle x", "at time 0", at, &mut map.centre.x, start.centre.x);
    field::number(ui, "middle z", "at time 0", at, &mut map.centre.y, start.centre.y);
    let hint = "1: noise covers as much as the map says; 0: the map says how high clouds are";
    field::number(ui, "noise", hint, &limits::SHARE, &mut map.noise, start.noise);
    ui.label("outside").on_hover_text("what lies beyond the map's edges");
    choice(ui, "outside", &Outside::ALL, &mut map.outside);
    let name = name_of(&Outside::ALL, start.outside);
    field::back(ui, name, map.outside != start.outside, || map.outside = start.outside);
    ui.end_row();
}

/// What the colours mean. The image is read again for it.
fn channels(ui: &mut Ui, map: &WeatherMap, start: &WeatherMap, wishes: &mut Vec<Wish>) {
    const COLOURS: [&str; 3] = ["red", "green", "blue"];
    let before = map.channels.clone();
    let mut wanted = None;
    for (index, colour) in COLOURS.into_iter().enumerate() {
        let old = before.get(index).copied().unwrap_or(Channel::Unused);
        let mut new = old;
        ui.horizontal(|ui| {
            choice(ui, colour, &Channel::ALL, &mut new);
            ui.label(colour);
        });
        if new != old {
            wanted = Some(with(&before, index, new));
        }
    }
    let names: Vec<_> = start.channels.iter().map(|c| name_of(&Channel::ALL, *c)).collect();
    ui.horizontal(|ui| {
        ui.label("back to the scene's colours");
        field::back(ui, &names.join(", "), map.channels != start.channels, || {
            wanted = Some(start.channels.clone());
        });
    });
    wishes.extend(wanted.map(Wish::TakeChannels));
}

/// Channels where this one means something else; none means the same as another.
fn with(channels: &[Channel], index: usize, meaning: Channel) -> Vec<Channel> {
    let mut result = channels.to_vec();
    result.resize(result.len().max(index + 1), Channel::Unused);
    for (i, channel) in result.iter_mut().enumerate() {
        if i == index {
            *channel = meaning;
        } else if *channel == meaning {
            *channel = Channel::Unused;
        }
    }
    // Grey images have one colour only.
    while result.len() > 1 && result.last() == Some(&Channel::Unused) {
        result.pop();
    }
    result
}

fn name_of<T: PartialEq>(all: &[(T, &'static str)], value: T) -> &'static str {
    all.iter().find(|(v, _)| *v == value).map_or("", |(_, name)| name)
}

fn choice<T: Copy + PartialEq>(ui: &mut Ui, id: &str, all: &[(T, &'static str)], value: &mut T) {
    ComboBox::from_id_salt(id).selected_text(name_of(all, *value)).show_ui(ui, |ui| {
        for (other, name) in all {
            ui.selectable_value(value, *other, *name);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_colour_means_something_of_its_own() {
        use Channel::{Coverage, Extinction, Height, Unused};
        assert_eq!(with(&[Coverage], 1, Height), [Coverage, Height]);
        assert_eq!(with(&[Coverage], 2, Coverage), [Unused, Unused, Coverage]);
        assert_eq!(with(&[Coverage, Height], 0, Height), [Height]);
        assert_eq!(with(&[Coverage, Height], 1, Unused), [Coverage]);
        assert_eq!(with(&[Coverage], 0, Unused), [Unused]);
        assert_eq!(with(&[Unused, Height], 0, Extinction), [Extinction, Height]);
    }
}
