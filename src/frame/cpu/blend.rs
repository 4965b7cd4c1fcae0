//! The blend in f64: twin of `shaders/frame/blend.wgsl`, and a compositor that keeps all chords
//! and resolves every piece between two events exactly, which tells what a limited number of
//! open chords costs.

use glam::{DQuat, DVec3};

use super::lighting::{SourceInputs, source_function};
use crate::frame::gpu_data::{FrameUniforms, Particle, ParticleLight};
use crate::medium::PreparedPhase;
use crate::tables::optical_depth::ChordProfile;
use crate::tables::optical_depth::volume::copy_for;
use crate::tables::{ScatteringTable, TableSet};

/// Part of a ray within one particle.
#[derive(Clone, Copy, Debug)]
pub struct Chord {
    /// m along the ray: no later particle of the list begins before it.
    pub order: f64,
    /// m, of what is visible.
    pub begin: f64,
    /// m, of what is visible.
    pub end: f64,
    /// m, where the whole chord begins.
    pub near: f64,
    /// m, of the whole chord.
    pub length: f64,
    /// Optical depth of the whole chord.
    pub optical_depth: f64,
    /// Where its matter lies.
    pub profile: ChordProfile,
    /// Radiance per unit of opacity.
    pub source: DVec3,
}

impl Chord {
    /// Share of the whole chord's matter before a distance along the ray.
    fn share(&self, distance: f64) -> f64 {
        self.profile.fraction(((distance - self.near) / self.length) as f32).into()
    }
}

/// What a pixel sees of the particles.
#[derive(Clone, Copy, Debug)]
pub struct Composed {
    /// Radiance of the particles.
    pub radiance: DVec3,
    /// Of all of them.
    pub transmittance: f64,
    /// m, opacity-weighted; 0 where nothing is seen.
    pub distance: f64,
}

/// What chords are made from.
pub struct ChordInputs<'a> {
    /// Sun, albedo, mean cosine.
    pub frame: &'a FrameUniforms,
    /// Where the matter lies.
    pub tables: &'a TableSet,
    /// What a particle alone scatters.
    pub scattering: &'a ScatteringTable,
    /// Phase function.
    pub phase: PreparedPhase,
}

fn vector(v: &[f32]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Mean depth into a uniform chord from which the light comes that leaves it, as a fraction.
pub fn mean_scatter_fraction(tau: f64) -> f64 {
    if tau < 1e-3 { 0.5 - tau / 12.0 } else { 1.0 / tau - 1.0 / tau.exp_m1() }
}

fn henyey_greenstein(g: f64, cos_theta: f64) -> f64 {
    let base = 1.0 + g * g - 2.0 * g * cos_theta;
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * base * base.sqrt())
}

impl ChordInputs<'_> {
    /// The chord of a ray from the eye through a particle, up to `far` (m), where there is one.
    pub fn chord(
        &self,
        particle: &Particle,
        light: &ParticleLight,
        dir: DVec3,
        far: f64,
    ) -> Option<Chord> {
        let (centre, radius) = (vector(&particle.centre), f64::from(particle.radius));
        let middle = centre.dot(dir);
        let half_squared = radius * radius - (centre - middle * dir).length_squared();
        if half_squared <= 0.0 {
            return None;
        }
        let half = half_squared.sqrt();
        let near = middle - half;
        let (begin, end) = (near.max(0.0), (middle + half).min(far));
        if end <= begin {
            return None;
        }
        let place = |distance: f64| (distance * dir - centre) / radius;
        let turn = DQuat::from_array(particle.orientation.map(f64::from));
        let pixels_per_radian =
            0.5 * f64::from(self.frame.size[0]) / vector(&self.frame.right).length();
        let profile = self.tables.copied_profile(
            particle.shape,
            turn * place(near),
            turn * place(near + 2.0 * half),
            copy_for((radius * pixels_per_radian / centre.length().max(radius)) as f32),
        );
        let length = 2.0 * half;
        let optical_depth =
            f64::from(particle.extinction) * length * f64::from(profile.mean_density);
        let mut chord = Chord {
            order: centre.length() - radius,
            begin,
            end,
            near,
            length,
            optical_depth,
            profile,
            source: DVec3::ZERO,
        };
        let visible = optical_depth * (chord.share(end) - chord.share(begin));
        let seen = place(begin + (end - begin) * mean_scatter_fraction(visible));
        chord.source = self.source(particle, light, dir, place(near), seen);
        Some(chord)
    }

    /// Radiance per unit of opacity along a chord that enters the particle at `entry` and is seen
    /// at `place` in the mean, both in radii from the centre.
    pub fn source(
        &self,
        particle: &Particle,
        light: &ParticleLight,
        dir: DVec3,
        entry: DVec3,
        place: DVec3,
    ) -> DVec3 {
        let sun = vector(&self.frame.sun);
        let cos_theta = sun.dot(dir);
        let mean_cosine = f64::from(self.frame.mean_cosine);
        let optical_radius = particle.optical_radius.into();
        let inputs = SourceInputs {
            place,
            scattered: self.scattering.lookup(entry, dir, sun, optical_radius),
            phase: self.phase.eval(cos_theta),
            phase_twice: henyey_greenstein(mean_cosine * mean_cosine, cos_theta),
            optical_radius,
            albedo: self.frame.albedo.into(),
            mean_cosine,
        };
        source_function(light, &inputs)
    }
}

/// The state of one pixel.
struct Sweep {
    open: Vec<(Chord, f64)>, // with the share of the chord's matter before the cursor
    cursor: f64,
    radiance: DVec3,
    transmittance: f64,
    distance_sum: f64,
}

impl Sweep {
    fn new() -> Self {
        let (radiance, transmittance) = (DVec3::ZERO, 1.0);
        Self { open: Vec::new(), cursor: 0.0, radiance, transmittance, distance_sum: 0.0 }
    }

    /// Adds a piece of the ray from the cursor on.
    fn add(&mut self, tau: f64, light: DVec3, next: f64) {
        let opacity = -(-tau).exp_m1();
        if tau > 0.0 {
            self.radiance += self.transmittance * opacity / tau * light;
        }
        let seen = self.cursor + (next - self.cursor) * mean_scatter_fraction(tau);
        self.distance_sum += self.transmittance * opacity * seen;
        self.transmittance *= (-tau).exp();
        self.cursor = next;
    }

    fn composed(&self) -> Composed {
        let opacity = 1.0 - self.transmittance;
        let distance = if opacity > 0.0 { self.distance_sum / opacity } else { 0.0 };
        Composed { radiance: self.radiance, transmittance: self.transmittance, distance }
    }

    fn advance(&mut self, limit: f64, stop: f64) {
        while !self.open.is_empty() && self.cursor < limit && self.transmittance > stop {
            let cursor = self.cursor;
            let event = |c: &Chord| if c.begin > cursor { c.begin } else { c.end };
            let next = self.open.iter().fold(limit, |next, (c, _)| next.min(event(c)));
            let (mut tau, mut light) = (0.0, DVec3::ZERO);
            for (chord, done) in self.open.iter_mut().filter(|(c, _)| c.begin <= cursor) {
                let share = chord.share(next);
                let piece = chord.optical_depth * (share - *done).max(0.0);
                *done = share;
                tau += piece;
                light += piece * chord.source;
            }
            self.add(tau, light, next);
            self.open.retain(|(chord, _)| chord.end > next);
        }
        self.cursor = self.cursor.max(limit);
    }
}

/// Composes chords in the order of the list with at most `pending` open at a time; a pixel is
/// finished below the transmittance `stop`.
pub fn compose(chords: &[Chord], pending: usize, stop: f64) -> Composed {
    let mut sweep = Sweep::new();
    for chord in chords {
        sweep.advance(chord.order, stop);
        if sweep.open.len() == pending {
            let first_end = sweep.open.iter().fold(f64::INFINITY, |e, (c, _)| e.min(c.end));
            sweep.advance(first_end, stop);
        }
        if sweep.transmittance <= stop {
            break;
        }
        let done = chord.share(chord.begin);
        let begin = chord.begin.max(sweep.cursor);
        // As the shader: matter that lies behind the cursor is put just before it.
        let end = chord.end.max(begin + 1e-5 * begin.max(1.0));
        sweep.open.push((Chord { begin, end, ..*chord }, done));
    }
    sweep.advance(f64::INFINITY, stop);
    sweep.composed()
}

/// Steps that a piece between two events is cut into. Within a step the chords' matter counts as
/// mixed evenly; with uniform particles it is, with noise shapes the error falls with the square
/// of the steps.
const STEPS: u32 = 32;

/// Composes all chords, in small steps of every piece between two events, to the end.
pub fn compose_exactly(chords: &[Chord]) -> Composed {
    let mut events: Vec<f64> = chords.iter().flat_map(|c| [c.begin, c.end]).collect();
    events.sort_by(f64::total_cmp);
    let mut sweep = Sweep::new();
    for piece in events.windows(2) {
        let [from, to] = [piece[0], piece[1]];
        let mut open: Vec<_> = chords
            .iter()
            .filter(|c| c.begin <= from && c.end >= to && to > from)
            .map(|c| (c, c.share(from)))
            .collect();
        sweep.cursor = from;
        for step in 1..=STEPS {
            let next = from + (to - from) * f64::from(step) / f64::from(STEPS);
            let (mut tau, mut light) = (0.0, DVec3::ZERO);
            for (chord, done) in &mut open {
                let share = chord.share(next);
                let own = chord.optical_depth * (share - *done).max(0.0);
                *done = share;
                tau += own;
                light += own * chord.source;
            }
            sweep.add(tau, light, next);
        }
    }
    sweep.composed()
}
