//! Twin of `shaders/shared/atmosphere.wgsl`: what the air is made of, and rays in it. In f64, where
//! the shader's forms are as good as any; they are kept so that one can be read beside the other.

use glam::{DVec2, DVec3, DVec4};
use std::f64::consts::{FRAC_PI_2, PI};

use crate::frame::sky::gpu_data::PLANET_RADIUS;
use crate::frame::sky::spectrum::{Coefficients, RAYLEIGH_HEIGHT};

/// m, of the air.
pub const TOP_ALTITUDE: f64 = 1e5;
/// m, density halves of aerosol.
pub const AEROSOL_HEIGHT: f64 = 2000.0;
/// Of the aerosol's phase function.
pub const AEROSOL_MEAN_COSINE: f64 = 0.709;
/// m, middle of the ozone layer.
pub const OZONE_ALTITUDE: f64 = 25e3;
/// m, from the middle to where there is none.
pub const OZONE_HALF_WIDTH: f64 = 15e3;
/// rad.
pub const SUN_RADIUS: f64 = 0.00465;
/// m, where a coordinate of distance is in its middle.
pub const AIR_MIDDLE: f64 = 5e4;
/// m.
pub const INFINITELY_FAR: f64 = 1e30;
/// m, altitude up to which air is thick enough that places in it are spread alike.
const LOWER_AIR: f64 = 1e4;
/// A ray of no length, m.
const LEAST_REACH: f64 = 1e-6;
/// Least share of the lower air in a ray to the ground.
const LEAST_SHARE: f64 = 0.05;

/// Air at one altitude, 1/m at the four wavelengths.
#[derive(Clone, Copy, Debug)]
pub struct Medium {
    /// Scattering by air.
    pub rayleigh: DVec4,
    /// Scattering by aerosol.
    pub aerosol: DVec4,
    /// Of all.
    pub extinction: DVec4,
}

/// Air at an altitude; below the ground as at the ground.
pub fn medium_at(c: &Coefficients, altitude: f64) -> Medium {
    let h = altitude.max(0.0);
    let dust = (-h / AEROSOL_HEIGHT).exp();
    let layer = (1.0 - (h - OZONE_ALTITUDE).abs() / OZONE_HALF_WIDTH).max(0.0);
    let rayleigh = c.rayleigh * (-h / RAYLEIGH_HEIGHT).exp();
    Medium {
        rayleigh,
        aerosol: c.aerosol_scattering * dust,
        extinction: rayleigh + c.aerosol_extinction * dust + c.ozone * layer,
    }
}

/// Per sr; its integral over all directions is 1.
pub fn rayleigh_phase(cos_theta: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + cos_theta * cos_theta)
}

/// Per sr; its integral over all directions is 1.
pub fn aerosol_phase(cos_theta: f64) -> f64 {
    let g = AEROSOL_MEAN_COSINE;
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5))
}

/// Squared distance from the horizon, m2.
pub fn horizon_squared(altitude: f64) -> f64 {
    altitude * (2.0 * PLANET_RADIUS + altitude)
}

/// Altitude (m) of a place whose squared distance from the horizon is `x` (m2).
pub fn altitude_of(x: f64) -> f64 {
    x / (PLANET_RADIUS + (PLANET_RADIUS * PLANET_RADIUS + x).max(0.0).sqrt())
}

/// Altitude after a distance along a ray, m.
pub fn altitude_along(altitude: f64, mu: f64, distance: f64) -> f64 {
    altitude_of(
        horizon_squared(altitude) + distance * (2.0 * (PLANET_RADIUS + altitude) * mu + distance),
    )
}

/// Distance to the ground, m; -1 where the ray misses it.
pub fn distance_to_ground(altitude: f64, mu: f64) -> f64 {
    let b = -(PLANET_RADIUS + altitude) * mu;
    let tangent = horizon_squared(altitude).sqrt();
    if b < tangent {
        return -1.0;
    }
    tangent * tangent / (b + ((b - tangent) * (b + tangent)).sqrt()).max(1e-30)
}

/// Where a ray enters and leaves the air, m; both 0 where it misses it.
pub fn air_span(altitude: f64, mu: f64) -> (f64, f64) {
    let b = (PLANET_RADIUS + altitude) * mu;
    let q = (TOP_ALTITUDE - altitude) * (2.0 * PLANET_RADIUS + TOP_ALTITUDE + altitude);
    if q >= 0.0 {
        let s = (b * b + q).sqrt();
        return (0.0, if b > 0.0 { q / (b + s).max(1e-30) } else { s - b });
    }
    let tangent = (-q).sqrt();
    if -b <= tangent {
        return (0.0, 0.0);
    }
    let s = ((-b - tangent) * (-b + tangent)).sqrt();
    (-q / (s - b), s - b)
}

/// Share of the sun's disc above the horizon of a place.
pub fn sun_visible(altitude: f64, sun_mu: f64) -> f64 {
    let horizon = -horizon_squared(altitude).sqrt() / (PLANET_RADIUS + altitude);
    let t = ((sun_mu - horizon + SUN_RADIUS) / (2.0 * SUN_RADIUS)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Place in the optical depth table, 0 to 1.
pub fn depth_place(altitude: f64, mu: f64) -> DVec2 {
    let h = altitude.clamp(0.0, TOP_ALTITUDE);
    let reach = horizon_squared(TOP_ALTITUDE).sqrt();
    let rho = horizon_squared(h).sqrt();
    let least = TOP_ALTITUDE - h;
    DVec2::new((air_span(h, mu).1 - least) / (rho + reach - least), rho / reach)
}

/// Altitude and mu of a place in that table.
pub fn depth_ray(place: DVec2) -> (f64, f64) {
    let reach_squared = horizon_squared(TOP_ALTITUDE);
    let rho = place.y * reach_squared.sqrt();
    let h = altitude_of(rho * rho);
    let least = TOP_ALTITUDE - h;
    let d = least + (rho + reach_squared.sqrt() - least) * place.x;
    if d <= 0.0 {
        return (h, 1.0);
    }
    let mu = (reach_squared - rho * rho - d * d) / (2.0 * (PLANET_RADIUS + h) * d.max(1e-6));
    (h, mu.clamp(-1.0, 1.0))
}

/// Place of a height of the sun, 0 to 1.
pub fn sun_place(sun_mu: f64) -> f64 {
    0.5 + 0.5 * sun_mu.signum() * sun_mu.abs().sqrt()
}

/// The inverse.
pub fn sun_at_place(x: f64) -> f64 {
    let s = 2.0 * x - 1.0;
    (s * s.abs()).clamp(-1.0, 1.0)
}

/// Place of an altitude, 0 to 1.
pub fn altitude_place(altitude: f64) -> f64 {
    (altitude / TOP_ALTITUDE).clamp(0.0, 1.0).sqrt()
}

/// The inverse.
pub fn altitude_at_place(y: f64) -> f64 {
    y * y * TOP_ALTITUDE
}

/// Texture coordinate of x in 0 to 1 among n texels.
pub fn texel_centre(x: f64, n: f64) -> f64 {
    (x.clamp(0.0, 1.0) * (n - 1.0) + 0.5) / n
}

/// Angles from the horizon straight down and up to where there is air, seen from an altitude (m): from above the air no more
/// than its rim, rad.
pub fn sky_spans(altitude: f64) -> [f64; 2] {
    let dip = horizon_squared(altitude).sqrt().atan2(PLANET_RADIUS);
    let over = (altitude - TOP_ALTITUDE) * (2.0 * PLANET_RADIUS + TOP_ALTITUDE + altitude);
    let up = if over > 0.0 {
        // Between two tangents, from the difference of their lengths' angles.
        dip - over.sqrt().atan2(PLANET_RADIUS + TOP_ALTITUDE)
    } else {
        FRAC_PI_2 + dip
    };
    [FRAC_PI_2 - dip, up]
}

/// Texture coordinates of a direction: cosine of the azimuth from the sun, angle over the horizon.
pub fn direction_place(
    azimuth_cosine: f64,
    above_horizon: f64,
    spans: [f64; 2],
    size: DVec2,
) -> DVec2 {
    let x = (0.5 - 0.5 * azimuth_cosine).clamp(0.0, 1.0).sqrt();
    let half_rows = 0.5 * size.y;
    let up = above_horizon >= 0.0;
    let most = spans[usize::from(up)];
    let y = (above_horizon.abs() / most).clamp(0.0, 1.0).sqrt() * (half_rows - 1.0);
    let row = if up { half_rows + y } else { half_rows - 1.0 - y };
    DVec2::new(texel_centre(x, size.x), (row + 0.5) / size.y)
}

/// The inverse, for a texel.
pub fn direction_of(texel: DVec2, spans: [f64; 2], size: DVec2) -> DVec2 {
    let x = texel.x / (size.x - 1.0);
    let half_rows = 0.5 * size.y;
    let up = texel.y >= half_rows;
    let y = if up { texel.y - half_rows } else { half_rows - 1.0 - texel.y } / (half_rows - 1.0);
    let above = if up { y * y * spans[1] } else { -y * y * spans[0] };
    DVec2::new(1.0 - 2.0 * x * x, above)
}

/// Where a ray that points below the horizon meets the ground, m.
pub fn ground_reach(altitude: f64, mu: f64) -> f64 {
    let reach = distance_to_ground(altitude, mu);
    if reach >= 0.0 { reach } else { (-(PLANET_RADIUS + altitude) * mu).max(0.0) }
}

/// How places are spread over the air of a ray that begins at `before`: m, to its end, and how much denser they are
/// at its beginning than if they were even.
pub fn air_spread(altitude: f64, mu: f64, before: f64, to_ground: bool) -> [f64; 2] {
    let over = |h: f64| (h - LOWER_AIR).max(0.0) * (2.0 * PLANET_RADIUS + LOWER_AIR + h);
    if !to_ground {
        let horizon = over(altitude.min(TOP_ALTITUDE)).sqrt();
        return [INFINITELY_FAR, 1.0 + INFINITELY_FAR / (AIR_MIDDLE + horizon)];
    }
    let lowest = -(PLANET_RADIUS + altitude) * mu;
    let to_tangent = (lowest * lowest - over(altitude)).max(0.0).sqrt();
    let enters = over(altitude) / (lowest + to_tangent).max(1.0);
    let ground = ground_reach(altitude, mu);
    let reach = (ground - before).max(0.0);
    let low = (ground - enters).min(reach);
    let share = (low / reach.max(LEAST_REACH)).clamp(LEAST_SHARE, 1.0);
    [reach, (1.0 + low.max(0.0) / AIR_MIDDLE) * share]
}

/// Place of a distance (m) from where the air begins, 0 to 1.
pub fn air_place(distance: f64, [reach, dense]: [f64; 2]) -> f64 {
    let x = (distance / reach.max(LEAST_REACH)).clamp(0.0, 1.0);
    (x * dense / (1.0 + x * (dense - 1.0))).min(1.0).sqrt()
}

/// The inverse.
pub fn air_distance(w: f64, [reach, dense]: [f64; 2]) -> f64 {
    let s = w * w;
    reach * (s / (s + dense * (1.0 - s))).min(1.0)
}

/// A unit vector from height and azimuth, in the frame of the tables: the sun's azimuth is +x.
pub fn unit(mu: f64, azimuth_cosine: f64) -> DVec3 {
    let level = (1.0 - mu * mu).max(0.0).sqrt();
    let across = (1.0 - azimuth_cosine * azimuth_cosine).max(0.0).sqrt();
    DVec3::new(level * azimuth_cosine, mu, level * across)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few ulp of numbers around 1, after a dozen operations.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn mappings_are_the_inverses_of_their_inverses() {
        for i in 0..=20 {
            let x = f64::from(i) / 20.0;
            assert!((sun_place(sun_at_place(x)) - x).abs() < ROUNDING);
            assert!((altitude_place(altitude_at_place(x)) - x).abs() < ROUNDING);
            let rays =
                [(2.0, -0.5), (6e3, -0.03), (1e4, 0.5), (6e4, -0.9), (4e5, -0.35), (1e9, -1.0)];
            for (altitude, mu) in rays {
                let before = air_span(altitude, mu).0;
                let spread = air_spread(altitude, mu, before, mu < 0.0);
                // Towards infinity the distance itself runs out of digits: 1 - w^2 has 1e-16.
                let w = x * 0.999;
                let back = air_place(air_distance(w, spread), spread);
                assert!((back - w).abs() < 1e-9, "{w} {altitude} {mu}");
            }
            for j in 0..=20 {
                let place = DVec2::new(x, f64::from(j) / 20.0);
                let (h, mu) = depth_ray(place);
                // At the very top all ways out are one but the downward ones: x is lost only where
                // the way out has no length. Elsewhere cancellation costs 9 digits of 16, since
                // the planet is that much larger than the least way out squared.
                let back = depth_place(h, mu);
                assert!((back.y - place.y).abs() < 1e-9, "{place} {back}");
                assert!((back.x - place.x).abs() < 1e-6, "{place} {back}");
            }
        }
    }

    #[test]
    fn directions_are_found_again() {
        let size = DVec2::new(7.0, 12.0);
        for dip in [0.0, 0.001, 0.3, 1.5] {
            for column in 0..7 {
                for row in 0..12 {
                    let texel = DVec2::new(f64::from(column), f64::from(row));
                    let spans = [FRAC_PI_2 - dip, FRAC_PI_2 + dip];
                    let direction = direction_of(texel, spans, size);
                    // The horizon's row of the lower half: its elevation is the upper one's.
                    let above = if row == 5 { -1e-30 } else { direction.y };
                    let place = direction_place(direction.x, above, spans, size) * size - 0.5;
                    // sqrt(1 - cos) has half of the digits near the sun.
                    assert!((place - texel).length() < 1e-6, "{texel} {place} dip {dip}");
                }
            }
        }
    }

    #[test]
    fn phase_functions_integrate_to_one() {
        let n = 20_000;
        let sum = |f: fn(f64) -> f64| -> f64 {
            let width = 2.0 / f64::from(n);
            (0..n).map(|i| f(-1.0 + (f64::from(i) + 0.5) * width)).sum::<f64>() * width * 2.0 * PI
        };
        // The midpoint rule's error is width^2 / 24 times the change of slope: 1e-6 for the peak.
        assert!((sum(rayleigh_phase) - 1.0).abs() < 1e-6);
        assert!((sum(aerosol_phase) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn distances_to_the_ground() {
        // Straight down, along the horizon, above it.
        assert!((distance_to_ground(2.0, -1.0) - 2.0).abs() < 1e-9);
        let horizon = (2.0 * (2.0 * PLANET_RADIUS + 2.0)).sqrt();
        let mu = -horizon / (PLANET_RADIUS + 2.0);
        // Near the horizon the distance changes as the square root of the angle.
        assert!((distance_to_ground(2.0, mu * (1.0 + 1e-12)) - horizon).abs() < 1e-2);
        assert_eq!(distance_to_ground(2.0, mu * (1.0 - 1e-9)), -1.0);
        assert_eq!(distance_to_ground(0.0, -0.5), 0.0);
        // Flat-earth limit: 2 m up, 0.1 down per 1 forwards.
        let flat = 2.0 / 0.1;
        let curved = distance_to_ground(2.0, -0.1);
        assert!((curved / flat - 1.0).abs() < flat / PLANET_RADIUS * 10.0);
    }
}
