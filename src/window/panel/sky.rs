//! Sun, sky, ground and exposure.

use egui::{CollapsingHeader, ComboBox, Grid, Slider, Ui};

use super::field;
use crate::scene::{Ground, GroundKind, Scene, Sky, limits};
use crate::window::session::Session;

/// Radiance of a uniform sky that takes the atmosphere's place: about that of a clear one.
const PLAIN_SKY: f64 = 0.05;

/// Day and place of the sun.
pub(super) fn sun(ui: &mut Ui, session: &mut Session) {
    let mut day = session.day();
    let hour = Slider::new(&mut day.hour, 0.0..=24.0).custom_formatter(|hour, _| of_clock(hour));
    ui.add(hour.custom_parser(from_clock).text("time of day"));
    let season = CollapsingHeader::new("season and place").open(session.unfold.then_some(true));
    season.show(ui, |ui| {
        ui.add(Slider::new(&mut day.day, 1.0..=365.0).integer().text("day of the year"));
        let latitude = Slider::new(&mut day.latitude, -90.0..=90.0).custom_formatter(short);
        ui.add(latitude.suffix("°").text("latitude"));
    });
    session.set_day(day);
    let mut sun = session.sun();
    ui.add(lenient(Slider::new(&mut sun.elevation, -10.0..=90.0).suffix("°").text("sun's height")));
    ui.add(lenient(Slider::new(&mut sun.azimuth, 0.0..=360.0).suffix("°").text("sun's compass")));
    session.set_sun(sun);
    let start = session.start.sun.direction;
    ui.horizontal(|ui| {
        ui.label("back to the scene's sun");
        let mut wanted = false;
        field::back(ui, "the scene's", session.scene.sun.direction != start, || wanted = true);
        if wanted {
            session.restore_sun();
        }
    });
}

/// The rest.
pub(super) fn sky(ui: &mut Ui, scene: &mut Scene, start: &Scene) {
    Grid::new("sky").num_columns(3).show(ui, |ui| {
        let (sun, of_file) = (&mut scene.sun, &start.sun);
        let hint = "of the sun, at the top of the atmosphere; sets the unit of all radiances";
        let range = &limits::IRRADIANCE;
        field::number(ui, "irradiance", hint, range, &mut sun.irradiance, of_file.irradiance);
        let (hint, range) = ("width of the sun's disc", &limits::ANGULAR_DIAMETER);
        let value = &mut sun.angular_diameter;
        field::number(ui, "sun's width", hint, range, value, of_file.angular_diameter);
        kind(ui, &mut scene.sky, start.sky);
        if let Sky::Uniform { radiance } = &mut scene.sky {
            let start =
                if let Sky::Uniform { radiance } = start.sky { radiance } else { PLAIN_SKY };
            let hint = "from all directions, below the horizon too; irradiance/sr";
            field::number(ui, "sky's radiance", hint, &limits::IRRADIANCE, radiance, start);
        }
        ground(ui, &mut scene.ground, start.ground);
        let (hint, range) = ("each step doubles the brightness", &limits::EXPOSURE);
        field::number(ui, "exposure", hint, range, &mut scene.exposure, start.exposure);
    });
}

fn kind(ui: &mut Ui, sky: &mut Sky, start: Sky) {
    ui.label("sky").on_hover_text("the Earth's clear air, or the same radiance from everywhere");
    let plain =
        if let Sky::Uniform { .. } = start { start } else { Sky::Uniform { radiance: PLAIN_SKY } };
    let is_air = matches!(sky, Sky::Atmosphere);
    let name = |air: bool| if air { "atmosphere" } else { "uniform" };
    ComboBox::from_id_salt("sky").selected_text(name(is_air)).show_ui(ui, |ui| {
        if ui.selectable_label(is_air, name(true)).clicked() {
            *sky = Sky::Atmosphere;
        }
        if ui.selectable_label(!is_air, name(false)).clicked() && is_air {
            *sky = plain;
        }
    });
    field::back(ui, name(start == Sky::Atmosphere), *sky != start, || *sky = start);
    ui.end_row();
}

fn ground(ui: &mut Ui, ground: &mut Option<Ground>, start: Option<Ground>) {
    let mut is_own = ground.is_some();
    ui.label("ground")
        .on_hover_text("unchecked: grass under an atmosphere, and none under a uniform sky");
    ui.checkbox(&mut is_own, "of the scene's own");
    if is_own != ground.is_some() {
        *ground = is_own.then(|| start.unwrap_or_default());
    }
    field::back(ui, "the scene's", *ground != start, || *ground = start);
    ui.end_row();
    if let Some(ground) = ground {
        let start = start.unwrap_or_default();
        surface(ui, &mut ground.kind, start.kind);
        let hint = "reflected share: red, green, blue; of a sea, of what enters the water the share that leaves it";
        field::vector(
            ui,
            "ground's albedo",
            hint,
            &limits::ALBEDO,
            &mut ground.albedo,
            start.albedo,
        );
    }
}

/// Wind over a sea that takes a plain ground's place, m/s: a gentle breeze.
const BREEZE: f64 = 5.0;

fn surface(ui: &mut Ui, kind: &mut GroundKind, start: GroundKind) {
    ui.label("surface").on_hover_text("alike from everywhere, or waves that mirror sky and clouds");
    let is_sea = matches!(kind, GroundKind::Sea { .. });
    let name = |sea: bool| if sea { "sea" } else { "plain" };
    ComboBox::from_id_salt("surface").selected_text(name(is_sea)).show_ui(ui, |ui| {
        if ui.selectable_label(!is_sea, name(false)).clicked() {
            *kind = GroundKind::Plain;
        }
        if ui.selectable_label(is_sea, name(true)).clicked() && !is_sea {
            let sea = GroundKind::Sea { wind_speed: BREEZE };
            *kind = if matches!(start, GroundKind::Sea { .. }) { start } else { sea };
        }
    });
    let was_sea = matches!(start, GroundKind::Sea { .. });
    field::back(ui, name(was_sea), *kind != start, || *kind = start);
    ui.end_row();
    if let GroundKind::Sea { wind_speed } = kind {
        let start = if let GroundKind::Sea { wind_speed } = start { wind_speed } else { BREEZE };
        let hint = "over the sea: it sets how rough the waves are";
        field::number(ui, "wind over the sea", hint, &limits::WIND_SPEED, wind_speed, start);
    }
}

/// Values of a file beyond the slider's range stay as they are until they are touched.
pub(super) fn lenient(slider: Slider<'_>) -> Slider<'_> {
    slider.clamping(egui::SliderClamping::Edits)
}

/// Hours as a clock shows them.
fn of_clock(hour: f64) -> String {
    let minutes = (60.0 * hour).round();
    format!("{:.0}:{:02.0}", (minutes / 60.0).floor(), minutes.rem_euclid(60.0))
}

/// Hours from `9:15`, `9.25` or `9`.
fn from_clock(text: &str) -> Option<f64> {
    let Some((hours, minutes)) = text.trim().split_once(':') else {
        return text.trim().parse().ok();
    };
    let (hours, minutes): (f64, f64) = (hours.parse().ok()?, minutes.parse().ok()?);
    (0.0..60.0).contains(&minutes).then_some(hours + minutes / 60.0)
}

/// Few digits, where the value has more: a slider with few decimals would round it untouched.
fn short(value: f64, _: std::ops::RangeInclusive<usize>) -> String {
    format!("{value:.2}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_are_read_as_they_are_shown() {
        for (hour, shown) in
            [(0.0, "0:00"), (9.25, "9:15"), (12.0, "12:00"), (23.999, "24:00"), (24.0, "24:00")]
        {
            assert_eq!(of_clock(hour), shown);
            let read = from_clock(shown).expect("a time");
            assert!((read - hour).abs() < 1.0 / 60.0, "{shown}");
        }
        assert_eq!((from_clock("9.5"), from_clock(" 9 ")), (Some(9.5), Some(9.0)));
        for nonsense in ["", "9:75", "9:", "noon", "9:-1"] {
            assert_eq!(from_clock(nonsense), None, "{nonsense}");
        }
    }
}
