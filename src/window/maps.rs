//! The weather map in the window: chosen, dropped, and read again when it changes on disk.

use std::path::PathBuf;

use glam::DVec2;

use super::app::App;
use super::files::Watched;
use super::reader::Job;
use crate::Result;
use crate::scene::{Channel, CloudField, WeatherMap, limits};

/// Coverage of a field that gets its first map: what the map says is what is seen.
const FIRST_COVERAGE: f64 = 1.0;

/// A map as that of a field: laid as the one before it where there is one.
pub(super) fn laid(map: WeatherMap, field: &CloudField) -> WeatherMap {
    let Some(before) = &field.weather else {
        return WeatherMap { extent: allowed(map.extent, field), ..map };
    };
    WeatherMap {
        extent: allowed(map.extent * (before.extent.x / map.extent.x), field),
        centre: before.centre,
        outside: before.outside,
        noise: before.noise,
        ..map
    }
}

/// The nearest extent that a field admits.
fn allowed(extent: DVec2, field: &CloudField) -> DVec2 {
    let range = limits::WEATHER_EXTENT;
    let least = range.least.max(field.cell_size);
    extent.clamp(DVec2::splat(least), DVec2::splat(range.most))
}

impl App {
    /// The map that is shown, and the one that a reset leads to.
    fn maps(&self) -> impl Iterator<Item = &WeatherMap> {
        let scenes = [&self.session.scene, &self.session.start];
        scenes.into_iter().filter_map(|scene| scene.clouds.as_ref()?.weather.as_ref())
    }

    /// Their files.
    pub(super) fn map_files(&self) -> Vec<PathBuf> {
        let mut files: Vec<_> = self.maps().map(|map| map.file.clone()).collect();
        files.dedup();
        files
    }

    /// Takes a map that was chosen; what to say about it.
    pub(super) fn take_map(&mut self, map: WeatherMap) -> String {
        let field = self.session.scene.clouds.clone().unwrap_or_default();
        let map = laid(map, &field);
        let coverage = if field.weather.is_some() { field.coverage } else { FIRST_COVERAGE };
        let ([width, height], file) = (map.image.size(), map.file.clone());
        self.session.scene.clouds = Some(CloudField { coverage, weather: Some(map), ..field });
        self.report.map_mistakes.remove(&file);
        format!("loaded the weather map {}, {width} x {height} pixels", file.display())
    }

    /// Lets the map's colours mean something else, as soon as it is read again.
    pub(super) fn take_channels(&mut self, channels: Vec<Channel>) {
        let field = self.session.scene.clouds.as_ref();
        if let Some(map) = field.and_then(|field| field.weather.clone()) {
            self.read(Job::Channels(Box::new(WeatherMap { channels, ..map })));
        }
    }

    pub(super) fn take_meanings(&mut self, read: Result<Box<WeatherMap>>) {
        let done = read.map(|map| {
            let field = self.session.scene.clouds.as_mut();
            if let Some(shown) = field.and_then(|field| field.weather.as_mut())
                && shown.file == map.file
            {
                (shown.channels, shown.image) = (map.channels.clone(), map.image);
            }
            format!("the weather map is read with {} of its colours", map.channels.len())
        });
        self.tell(done);
    }

    /// Has maps read again whose files have changed.
    pub(super) fn look_at_maps(&mut self) {
        let files = self.map_files();
        self.watched_maps.retain(|watched| files.iter().any(|file| file == watched.path()));
        self.report.map_mistakes.retain(|file, _| files.contains(file));
        for file in files {
            if self.watched_maps.iter().all(|watched| watched.path() != file) {
                self.watched_maps.push(Watched::new(&file, &[]));
            }
        }
        let changed = self.watched_maps.iter_mut().filter_map(|watched| {
            let changed = watched.has_changed();
            changed.then(|| watched.path().to_owned())
        });
        let changed: Vec<PathBuf> = changed.collect();
        let maps: Vec<_> = self.maps().filter(|map| changed.contains(&map.file)).cloned().collect();
        if !maps.is_empty() {
            self.read(Job::Maps(maps));
        }
    }

    /// Takes over maps that were read again; a mistake in one is shown until it is mended, and the
    /// others are taken all the same.
    pub(super) fn take_maps(&mut self, read: Vec<(PathBuf, Result<WeatherMap>)>) {
        // A file may have been read twice, for two meanings of its colours.
        self.report.map_mistakes.retain(|file, _| read.iter().all(|(other, _)| other != file));
        for (file, map) in read {
            match map {
                Ok(map) => {
                    let scenes = [&mut self.session.scene, &mut self.session.start];
                    let fields = scenes.into_iter().filter_map(|scene| scene.clouds.as_mut());
                    for shown in fields.filter_map(|field| field.weather.as_mut()) {
                        renew(shown, &map);
                    }
                    self.tell(Ok(format!("{} was changed: loaded again", file.display())));
                }
                Err(error) => {
                    tracing::info!("{error}");
                    self.report.map_mistakes.insert(file, error.to_string());
                    self.request_redraw();
                }
            }
        }
    }
}

/// Gives a map the image that was read, if it was read for it.
fn renew(shown: &mut WeatherMap, read: &WeatherMap) {
    if read.file == shown.file && read.channels == shown.channels {
        shown.image = read.image.clone();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{Outside, WeatherImage};

    /// A map of an image of so many pixels, as it is opened.
    fn opened(name: &str, [width, height]: [u32; 2], channels: &[Channel]) -> WeatherMap {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join(name);
        image::GrayImage::new(width, height).save(&path).expect("written");
        WeatherMap::open_as(&path, channels).expect("a map")
    }

    #[test]
    fn another_image_is_laid_as_the_one_before() {
        let mut field = CloudField::default();
        let first = laid(opened("square.png", [8, 8], &[Channel::Coverage]), &field);
        assert_eq!(first.extent, DVec2::splat(20_000.0));
        let channels = vec![Channel::Coverage, Channel::Height];
        field.weather = Some(WeatherMap {
            extent: DVec2::new(5000.0, 700.0),
            centre: DVec2::new(1.0, 2.0),
            outside: Outside::Clear,
            channels: channels.clone(),
            noise: 0.25,
            ..first
        });
        let strip = opened("strip.png", [4000, 2], &channels);
        let second = laid(strip.clone(), &field);
        // Square pixels, but no less than a cell; grey has no second channel.
        assert_eq!(second.extent, DVec2::new(5000.0, field.cell_size));
        assert_eq!(second.channels, [Channel::Coverage]);
        assert_eq!((second.centre, second.outside), (DVec2::new(1.0, 2.0), Outside::Clear));
        assert_eq!((second.noise, second.file), (0.25, strip.file));
    }

    #[test]
    fn maps_that_differ_in_their_meaning_get_each_their_own_image() {
        let map = |channel, pixels| WeatherMap {
            image: Arc::new(WeatherImage::new([1, 1], vec![pixels])),
            ..opened("a.png", [1, 1], &[channel])
        };
        let file = PathBuf::from("a.png");
        let named = |map: WeatherMap| WeatherMap { file: file.clone(), ..map };
        let read = [named(map(Channel::Coverage, 1)), named(map(Channel::Height, 2))];
        let mut shown = named(map(Channel::Height, 0));
        read.iter().for_each(|map| renew(&mut shown, map));
        assert_eq!(shown.image.texels(), [2]);
        let mut other = WeatherMap { file: "b.png".into(), ..shown };
        renew(&mut other, &named(map(Channel::Height, 3)));
        assert_eq!(other.image.texels(), [2], "another file");
    }
}
