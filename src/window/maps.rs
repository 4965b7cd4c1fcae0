//! The weather map in the window: chosen, dropped, and read again when it changes on disk.

use std::path::{Path, PathBuf};

use glam::DVec2;

use super::app::App;
use super::files::Watched;
use crate::Result;
use crate::scene::{Channel, CloudField, WeatherMap, limits};

/// Coverage of a field that gets its first map: what the map says is what is seen.
const FIRST_COVERAGE: f64 = 1.0;

/// An image as the map of a field: laid as the one before it where there is one.
pub(super) fn laid(path: &Path, field: &CloudField) -> Result<WeatherMap> {
    let mut map = WeatherMap::open(path)?;
    let Some(before) = &field.weather else {
        return Ok(WeatherMap { extent: allowed(map.extent, field), ..map });
    };
    map.extent = allowed(map.extent * (before.extent.x / map.extent.x), field);
    (map.centre, map.outside, map.noise) = (before.centre, before.outside, before.noise);
    let same = WeatherMap { channels: before.channels.clone(), ..map.clone() };
    // An image with fewer colours tells the coverage at least.
    Ok(same.read_again().unwrap_or(map))
}

/// The nearest extent that a field admits.
fn allowed(extent: DVec2, field: &CloudField) -> DVec2 {
    let range = limits::WEATHER_EXTENT;
    let least = range.least.max(field.cell_size);
    extent.clamp(DVec2::splat(least), DVec2::splat(range.most))
}

impl App {
    /// The map that is shown.
    fn map(&self) -> Option<&WeatherMap> {
        self.session.scene.clouds.as_ref()?.weather.as_ref()
    }

    /// Takes an image as the weather map; what to say about it.
    pub(super) fn load_map(&mut self, path: &Path) -> Result<String> {
        let field = self.session.scene.clouds.clone().unwrap_or_default();
        let map = laid(path, &field)?;
        let coverage = if field.weather.is_some() { field.coverage } else { FIRST_COVERAGE };
        let [width, height] = map.image.size();
        self.session.scene.clouds = Some(CloudField { coverage, weather: Some(map), ..field });
        self.report.map_mistake = None;
        self.watch_map();
        let path = path.display();
        Ok(format!("loaded the weather map {path}, {width} x {height} pixels"))
    }

    /// Lets the map's colours mean something else; what to say about it.
    pub(super) fn take_channels(&mut self, channels: Vec<Channel>) -> Result<String> {
        let Some(map) = self.map() else { return Ok(String::new()) };
        let map = WeatherMap { channels, ..map.clone() }.read_again()?;
        let count = map.channels.len();
        if let Some(field) = &mut self.session.scene.clouds {
            field.weather = Some(map);
        }
        Ok(format!("the weather map is read with {count} of its colours"))
    }

    /// Looks out for changes of the map that is shown, and of no other.
    pub(super) fn watch_map(&mut self) {
        let file: Option<PathBuf> = self.map().map(|map| map.file.clone());
        if self.watched_map.as_ref().map(Watched::path) != file.as_deref() {
            self.watched_map = file.map(|file| Watched::alone(&file));
            self.report.map_mistake = None;
        }
    }

    /// Reads the map again where it has changed; a mistake in it is shown until it is mended. Whether
    /// there is something new to see.
    pub(super) fn look_at_map(&mut self) -> bool {
        self.watch_map();
        if !self.watched_map.as_mut().is_some_and(Watched::has_changed) {
            return false;
        }
        let Some(read) = self.map().map(WeatherMap::read_again) else { return false };
        match read {
            Ok(map) => {
                self.report.map_mistake = None;
                self.report.message = format!("{} was changed: loaded again", map.file.display());
                tracing::info!("{}", self.report.message);
                let scenes = [&mut self.session.scene, &mut self.session.start];
                let fields = scenes.into_iter().filter_map(|scene| scene.clouds.as_mut());
                for shown in fields.filter_map(|field| field.weather.as_mut()) {
                    if shown.file == map.file && shown.channels == map.channels {
                        shown.image = map.image.clone();
                    }
                }
            }
            Err(error) => {
                tracing::info!("{error}");
                self.report.map_mistake = Some(error.to_string());
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Outside;

    #[test]
    fn another_image_is_laid_as_the_one_before() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let image = |name: &str, width, height| {
            let path = dir.path().join(name);
            image::GrayImage::new(width, height).save(&path).expect("written");
            path
        };
        let mut field = CloudField::default();
        let square = image("square.png", 8, 8);
        let first = laid(&square, &field).expect("a map");
        assert_eq!(first.extent, DVec2::splat(20_000.0));
        field.weather = Some(WeatherMap {
            extent: DVec2::new(5000.0, 700.0),
            centre: DVec2::new(1.0, 2.0),
            outside: Outside::Clear,
            channels: vec![Channel::Coverage, Channel::Height],
            noise: 0.25,
            ..first
        });
        let strip = image("strip.png", 4000, 2);
        let second = laid(&strip, &field).expect("a map");
        // Square pixels, but no less than a cell; grey has no second channel.
        assert_eq!(second.extent, DVec2::new(5000.0, field.cell_size));
        assert_eq!(second.channels, [Channel::Coverage]);
        assert_eq!((second.centre, second.outside), (DVec2::new(1.0, 2.0), Outside::Clear));
        assert_eq!((second.noise, second.file), (0.25, strip));
        assert!(laid(&dir.path().join("none.png"), &field).is_err());
    }
}
