//! Reading the table: twin of `shaders/tables/scattering.wgsl`.

use glam::DVec3;

use super::ScatteringTable;
use super::mapping::{Coordinates, Geometry, RadiusMap, azimuth_coordinate, incidence_coordinate};
use super::march::single_source;
use super::single::opacity;

/// Part of a slice by which f32 may misplace a fetch among the most slices of a texture.
const SLICE_MARGIN: f64 = 2e-4;

impl ScatteringTable {
    /// Source of order 1 without phase function, and of the orders from 2 on with it, for a ray
    /// that enters the unit sphere at `entry` along `dir`, with the sun towards `sun` (unit
    /// vectors). Radiance is the source times the chord's opacity, per unit of sun irradiance.
    pub fn lookup(&self, entry: DVec3, dir: DVec3, sun: DVec3, optical_radius: f64) -> [f64; 2] {
        self.lookup_geometry(&Geometry::of(entry, dir, sun), optical_radius)
    }

    /// The same for a ray in the table's terms.
    pub fn lookup_geometry(&self, geometry: &Geometry, optical_radius: f64) -> [f64; 2] {
        let logarithm = self.interpolate(&self.coordinates(geometry, optical_radius));
        let single = self.albedo * single_source(geometry, optical_radius);
        let [low, high] = self.optical_radius;
        let fall = self.terminator.factor(geometry.elevation(), optical_radius.clamp(low, high));
        [single, opacity(optical_radius) * fall * logarithm.exp()]
    }

    /// Where a ray lies in the table.
    pub fn coordinates(&self, geometry: &Geometry, optical_radius: f64) -> Coordinates {
        let radii = RadiusMap { range: self.optical_radius };
        Coordinates {
            incidence: incidence_coordinate(geometry.incidence.clamp(0.0, 1.0)),
            azimuth: azimuth_coordinate(geometry.azimuth.cos()),
            view_sun: self.map.coordinate((0.5 * geometry.view_sun).sin()),
            optical_radius: radii.coordinate(optical_radius),
        }
    }

    /// Linear in all four coordinates.
    fn interpolate(&self, at: &Coordinates) -> f64 {
        let [radii, incidences, azimuths, views] = self.resolution;
        let split = |coordinate: f64, count: usize| {
            let place = coordinate * (count - 1) as f64;
            let index = (place as usize).min(count - 2);
            (index, place - index as f64)
        };
        let (i, a) = split(at.optical_radius, radii);
        // As the shader does, whose texture has the next optical radius behind the last incidence.
        let margin = SLICE_MARGIN / (incidences - 1) as f64;
        let (j, b) = split(at.incidence.clamp(margin, 1.0 - margin), incidences);
        let (k, c) = split(at.azimuth, azimuths);
        let (l, d) = split(at.view_sun, views);
        let mut sum = 0.0;
        for (i, a) in [(i, 1.0 - a), (i + 1, a)] {
            for (j, b) in [(j, 1.0 - b), (j + 1, b)] {
                for (k, c) in [(k, 1.0 - c), (k + 1, c)] {
                    for (l, d) in [(l, 1.0 - d), (l + 1, d)] {
                        let entry = ((i * incidences + j) * azimuths + k) * views + l;
                        let weight = a * b * c * d;
                        let value: f64 = match &self.precise {
                            Some(values) => values[entry].into(),
                            None => self.values[entry].into(),
                        };
                        sum += weight * value;
                    }
                }
            }
        }
        sum
    }
}
