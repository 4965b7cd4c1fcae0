//! The blend in f64: twin of `shaders/frame/blend.wgsl`, and a compositor that keeps all chords
//! and resolves every piece between two events exactly, which tells what a limited number of
//! open chords costs.

use glam::{DQuat, DVec3};

use super::light_grid::FieldSeen;
use super::lighting::{HaloView, Source, SourceInputs, source_function};
use crate::frame::gpu_data::{FrameUniforms, Particle, ParticleLight};
use crate::medium::{Halo, PreparedPhase};
use crate::tables::optical_depth::ChordProfile;
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
    pub source: Source,
}

impl Chord {
    /// Mean source over the light that leaves a piece of the ray, of optical depth `tau`.
    fn source_over(&self, from: f64, to: f64, tau: f64) -> DVec3 {
        let share = |t: f64| (t - self.begin) / (self.end - self.begin);
        self.source.over(share(from), share(to), tau)
    }

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
    /// Light around the sun.
    pub halo: &'a Halo,
    /// Light that the clouds scatter among themselves.
    pub field: &'a FieldSeen,
}

fn vector(v: &[f32]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Mean depth into a uniform chord from which the light comes that leaves it, as a fraction.
pub fn mean_scatter_fraction(tau: f64) -> f64 {
    if tau < 1e-3 { 0.5 - tau / 12.0 } else { 1.0 / tau - 1.0 / tau.exp_m1() }
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
        let profile = self.tables.chord_profile(
            particle.shape,
            turn * place(near),
            turn * place(near + 2.0 * half),
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
            source: Source::default(),
        };
        let visible = optical_depth * (chord.share(end) - chord.share(begin));
        let seen = place(begin + (end - begin) * mean_scatter_fraction(visible));
        let places = [place(near), place(begin), seen, place(end)];
        chord.source = self.source(particle, light, dir, places, visible);
        Some(chord)
    }

    /// Radiance per unit of opacity along a chord. Places in radii from the centre: where the chord
    /// enters the particle, where it becomes visible, where it is seen in the mean, where it ends.
    pub fn source(
        &self,
        particle: &Particle,
        light: &ParticleLight,
        dir: DVec3,
        [entry, begin, place, end]: [DVec3; 4],
        visible_depth: f64,
    ) -> Source {
        let sun = vector(&self.frame.sun);
        let optical_radius = f64::from(particle.optical_radius);
        let delta_scale = f64::from(self.frame.delta_scale);
        let alone = f64::from(light.ambient_below[3]);
        let scattered = if alone > 0.0 {
            self.scattering.lookup(entry, dir, sun, optical_radius / delta_scale)
        } else {
            [0.0; 2]
        };
        let point = vector(&particle.centre) + place * f64::from(particle.radius);
        let inputs = SourceInputs {
            place,
            begin,
            end,
            sun,
            field: self.field.at(point),
            alone,
            scattered,
            phase: self.phase.eval(sun.dot(dir)),
            optical_radius,
            visible_depth,
            delta_scale,
            albedo: self.frame.albedo.into(),
        };
        source_function(light, &inputs)
    }

    /// The halo for a direction of view.
    pub fn halo_view(&self, dir: DVec3) -> HaloView<'_> {
        HaloView {
            halo: self.halo,
            half_sine: 0.5 * (dir - vector(&self.frame.sun)).length(),
            share: self.frame.halo_share.into(),
        }
    }
}

/// The state of one pixel.
struct Sweep {
    // With the share of the chord's matter before the cursor.
    open: Vec<(Chord, f64)>,
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
            let mut pieces = Vec::with_capacity(self.open.len());
            for (chord, done) in self.open.iter_mut().filter(|(c, _)| c.begin <= cursor) {
                let share = chord.share(next);
                pieces.push((*chord, chord.optical_depth * (share - *done).max(0.0)));
                *done = share;
            }
            let tau = pieces.iter().map(|(_, piece)| piece).sum();
            let light =
                pieces.iter().map(|(c, piece)| *piece * c.source_over(cursor, next, tau)).sum();
            self.add(tau, light, next);
            self.open.retain(|(chord, _)| chord.end > next);
        }
        self.cursor = self.cursor.max(limit);
    }
}

/// Composes chords in the order of the list with at most `pending` open at a time; a pixel is
/// finished below the transmittance `stop`.
pub fn compose(chords: &[Chord], halo: &HaloView<'_>, pending: usize, stop: f64) -> Composed {
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
        let source = chord.source.with_halo(halo, -sweep.transmittance.ln());
        sweep.open.push((Chord { begin, end, source, ..*chord }, done));
    }
    sweep.advance(f64::INFINITY, stop);
    sweep.composed()
}

/// Steps that a piece between two events is cut into. Within a step the chords' matter counts as
/// mixed evenly; with uniform particles it is, with noise shapes the error falls with the square
/// of the steps.
const STEPS: u32 = 32;

/// Composes all chords, in small steps of every piece between two events, to the end.
pub fn compose_exactly(chords: &[Chord], halo: &HaloView<'_>) -> Composed {
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
            let depth = -sweep.transmittance.max(f64::MIN_POSITIVE).ln();
            let mut pieces = Vec::with_capacity(open.len());
            for (chord, done) in &mut open {
                let share = chord.share(next);
                let own = chord.optical_depth * (share - *done).max(0.0);
                *done = share;
                let source = chord.source.with_halo(halo, depth);
                pieces.push((Chord { source, ..**chord }, own));
            }
            let tau = pieces.iter().map(|(_, own)| own).sum();
            let from = sweep.cursor;
            let light = pieces.iter().map(|(c, own)| *own * c.source_over(from, next, tau)).sum();
            sweep.add(tau, light, next);
        }
    }
    sweep.composed()
}
