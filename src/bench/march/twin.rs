//! Twin of `shaders/bench/march.wgsl` without `LIT`, in double precision and without lists: every
//! particle is asked.

use glam::{DQuat, DVec3};

use crate::frame::cpu::segments::{Composed, mean_scatter_fraction};
use crate::frame::gpu_data::Particle;
use crate::medium::PreparedPhase;
use crate::tables::TableSet;
use crate::tables::optical_depth::volume::{copy_for, pixels_per_radian};

/// Octaves of sunlight, and the factor from one to the next.
const OCTAVES: u32 = 8;
const OCTAVE: f64 = 0.5;

/// What a march goes through, and how.
pub struct MarchTwin<'a> {
    /// The frame's particles, by the distance where they begin.
    pub particles: Vec<Particle>,
    /// Their densities.
    pub tables: &'a TableSet,
    /// The medium's phase function.
    pub phase: PreparedPhase,
    /// Single-scattering albedo.
    pub albedo: f64,
    /// Extinction of the particles over the true one.
    pub delta_scale: f64,
    /// Of the phase function in the scaled medium.
    pub mean_cosine: f64,
    /// Towards the sun.
    pub sun: DVec3,
    /// Irradiance perpendicular to its beam.
    pub sunlight: DVec3,
    /// Mean radiance of sky and ground.
    pub ambient: DVec3,
    /// A ray ends below this transmittance.
    pub stop: f64,
    /// Pixels across the picture.
    pub width: u32,
    /// Half of the picture's width at a distance of 1.
    pub tangent: f64,
    /// The view axis.
    pub forward: DVec3,
    /// Along the eye's ray.
    pub steps: u32,
    /// Through each chord of a sun's ray.
    pub sun_steps: u32,
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

impl<'a> MarchTwin<'a> {
    /// Through these particles; what else there is to be known starts at a white sun overhead.
    pub fn new(particles: &[Particle], tables: &'a TableSet, phase: PreparedPhase) -> Self {
        let begin = |p: &Particle| vector(p.centre).length() - f64::from(p.radius);
        let mut particles = particles.to_vec();
        particles.sort_by(|a, b| begin(a).total_cmp(&begin(b)));
        Self {
            particles,
            tables,
            phase,
            albedo: 1.0,
            delta_scale: 1.0,
            mean_cosine: 0.0,
            sun: DVec3::Y,
            sunlight: DVec3::ONE,
            ambient: DVec3::ZERO,
            stop: 0.0,
            width: 1,
            // Nothing is filtered.
            tangent: 0.0,
            forward: DVec3::ZERO,
            steps: 64,
            sun_steps: 8,
        }
    }

    /// Density of a particle at a place in radii from its centre.
    fn density(&self, particle: &Particle, place: DVec3, copy: usize) -> f64 {
        if particle.shape == 0 {
            return 1.0;
        }
        let own = DQuat::from_array(particle.orientation.map(f64::from)) * place;
        let table = self.tables.optical_depth().get(particle.shape as usize - 1);
        table.map_or(0.0, |table| f64::from(table.volumes()[copy].density(own.as_vec3())))
    }

    fn depth_to_sun(&self, point: DVec3) -> f64 {
        let through = |particle: &Particle| {
            let offset = point - vector(particle.centre);
            let along = offset.dot(self.sun);
            let across = offset - along * self.sun;
            let radius = f64::from(particle.radius);
            let half = (radius * radius - across.length_squared()).max(0.0).sqrt();
            let begin = along.max(-half);
            if begin >= half {
                return 0.0;
            }
            let step = (half - begin) / f64::from(self.sun_steps);
            let density = |i: u32| {
                let t = begin + (f64::from(i) + 0.5) * step;
                self.density(particle, (across + t * self.sun) / radius, 0)
            };
            f64::from(particle.extinction) * step * (0..self.sun_steps).map(density).sum::<f64>()
        };
        self.particles.iter().map(through).sum()
    }

    fn octaves(&self, dir: DVec3, depth: f64) -> f64 {
        let cos = dir.dot(self.sun);
        let first = self.albedo / self.delta_scale * self.phase.eval(cos) * (-depth).exp();
        let higher = |i: u32| {
            let share = OCTAVE.powi(i as i32);
            let g = self.mean_cosine * share;
            let lobe = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5);
            self.albedo * share * lobe / (4.0 * std::f64::consts::PI) * (-share * depth).exp()
        };
        first + (1..OCTAVES).map(higher).sum::<f64>()
    }

    /// What is seen in a direction from the eye, up to `far` (m).
    pub fn ray(&self, dir: DVec3, far: f64) -> Composed {
        let spans: Vec<_> = self
            .particles
            .iter()
            .filter_map(|particle| {
                let (centre, radius) = (vector(particle.centre), f64::from(particle.radius));
                let middle = centre.dot(dir);
                let square = radius * radius - (centre - middle * dir).length_squared();
                let half = square.max(0.0).sqrt();
                let span = [(middle - half).max(0.0), (middle + half).min(far)];
                (span[1] > span[0]).then_some((particle, span))
            })
            .collect();
        let (mut covered, mut occupied) = (0.0_f64, 0.0);
        for (_, [begin, end]) in &spans {
            occupied += (end - begin.max(covered)).max(0.0);
            covered = covered.max(*end);
        }
        let mut sum = Composed { radiance: DVec3::ZERO, transmittance: 1.0, distance: 0.0 };
        let step = occupied / f64::from(self.steps);
        let pixels = pixels_per_radian(self.width, self.tangent, dir.dot(self.forward));
        let mut t = 0.0;
        while sum.transmittance > self.stop && step > 0.0 {
            let at = t + 0.5 * step;
            let point = at * dir;
            let here = || spans.iter().filter(|(_, span)| span[0] <= at && span[1] > at);
            if here().next().is_none() {
                let next = spans.iter().map(|(_, span)| span[0]).filter(|begin| *begin > at);
                t = next.fold(f64::INFINITY, f64::min);
                if t.is_infinite() {
                    break;
                }
                continue;
            }
            let extinction = |(particle, _): &(&Particle, [f64; 2])| {
                let (centre, radius) = (vector(particle.centre), f64::from(particle.radius));
                let pixels = radius * pixels / centre.length().max(radius);
                let place = (point - centre) / radius;
                f64::from(particle.extinction)
                    * self.density(
                        particle,
                        place,
                        copy_for(pixels as f32, particle.optical_radius),
                    )
            };
            let tau = step * here().map(extinction).sum::<f64>();
            if tau > 0.0 {
                let sunlit = self.octaves(dir, self.depth_to_sun(point)) * self.sunlight;
                let weight = sum.transmittance * -(-tau).exp_m1();
                sum.radiance += weight * (sunlit + self.albedo * self.ambient);
                sum.distance += weight * (t + step * mean_scatter_fraction(tau));
                sum.transmittance *= (-tau).exp();
            }
            t += step;
        }
        if sum.transmittance < 1.0 {
            sum.distance /= 1.0 - sum.transmittance;
        }
        sum
    }
}
