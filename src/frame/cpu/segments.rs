//! Composition of chords, each with a profile of where its matter lies: with a limited number of
//! open chords a pixel, which the blend was before it marched (with one open chord it is the merge
//! of neighbouring segments of Yusov 2014), and with all of them in small steps. Comparisons for
//! tests, and what lights a chord, for the exact frame.

use glam::{DQuat, DVec3};

use super::light_grid::FieldSeen;
use super::lighting::{Before, ChordLight, PieceLight, RayLight, SunDepth};
use crate::frame::gpu_data::{FrameUniforms, Particle, ParticleLight};
use crate::medium::{Halo, PreparedPhase};
use crate::tables::optical_depth::ChordProfile;
use crate::tables::optical_depth::volume::{copy_for, pixels_per_radian};
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
    /// What lights it.
    pub light: ChordLight,
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
    /// Light around the sun.
    pub halo: &'a Halo,
    /// Light that the clouds scatter among themselves.
    pub field: &'a FieldSeen,
    /// Optical depth to the sun.
    pub sun_depth: SunDepth<'a>,
}

fn vector(v: &[f32]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Mean depth into a uniform chord from which the light comes that leaves it, as a fraction.
pub fn mean_scatter_fraction(tau: f64) -> f64 {
    if tau < 1e-3 { 0.5 - tau / 12.0 } else { 1.0 / tau - 1.0 / tau.exp_m1() }
}

impl ChordInputs<'_> {
    /// The filtered copy of a particle's density that a ray from the eye reads.
    pub fn copy(&self, particle: &Particle, dir: DVec3) -> usize {
        let cosine = dir.dot(vector(&self.frame.forward));
        let pixels =
            pixels_per_radian(self.frame.size[0], vector(&self.frame.right).length(), cosine);
        let (centre, radius) = (vector(&particle.centre), f64::from(particle.radius));
        copy_for((radius * pixels / centre.length().max(radius)) as f32, particle.optical_radius)
    }

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
        let profile = self.tables.copied_profile(
            particle.shape,
            turn * place(near),
            turn * place(near + 2.0 * half),
            self.copy(particle, dir),
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
            light: ChordLight::default(),
        };
        chord.light = self.light(particle, light, dir, place(near));
        Some(chord)
    }

    /// What lights a chord that enters the particle at this place, in radii from the centre.
    pub fn light(
        &self,
        particle: &Particle,
        light: &ParticleLight,
        dir: DVec3,
        entry: DVec3,
    ) -> ChordLight {
        let sun = vector(&self.frame.sun);
        let optical_radius = f64::from(particle.optical_radius);
        let mut own = 0.0;
        if light.ambient_below[3] > 0.0 {
            let scale = f64::from(self.frame.delta_scale);
            let [once, more] = self.scattering.lookup(entry, dir, sun, optical_radius / scale);
            own = once * self.phase.eval(sun.dot(dir)) + more;
        }
        ChordLight::new(light, own)
    }

    /// What all chords of a ray share.
    pub fn ray(&self, dir: DVec3) -> RayLight<'_> {
        let sun = vector(&self.frame.sun);
        let scale = f64::from(self.frame.delta_scale);
        RayLight {
            field: self.field,
            halo: self.halo,
            sun_depth: self.sun_depth,
            dir,
            half_sine: 0.5 * (dir - sun).length(),
            halo_share: self.frame.halo_share.into(),
            first: f64::from(self.frame.albedo) / scale * self.phase.eval(sun.dot(dir)),
            delta_scale: scale,
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
    since_gap: f64,
    distance_sum: f64,
}

impl Sweep {
    fn new() -> Self {
        let (radiance, transmittance) = (DVec3::ZERO, 1.0);
        let (cursor, since_gap, distance_sum) = (0.0, 0.0, 0.0);
        Self { open: Vec::new(), cursor, radiance, transmittance, since_gap, distance_sum }
    }

    /// Light of the piece from the cursor on.
    fn piece(&self, ray: &RayLight<'_>, next: f64, tau: f64) -> PieceLight {
        let view = -self.transmittance.max(1e-30).ln();
        let before = Before { view, since_gap: self.since_gap };
        ray.piece(self.cursor, next, tau, mean_scatter_fraction(tau), before)
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
        self.since_gap += tau;
        self.cursor = next;
    }

    fn composed(&self) -> Composed {
        let opacity = 1.0 - self.transmittance;
        let distance = if opacity > 0.0 { self.distance_sum / opacity } else { 0.0 };
        Composed { radiance: self.radiance, transmittance: self.transmittance, distance }
    }

    fn advance(&mut self, ray: &RayLight<'_>, limit: f64, stop: f64) {
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
            if pieces.is_empty() {
                self.since_gap = 0.0;
            }
            let tau = pieces.iter().map(|(_, piece)| piece).sum();
            let lit = self.piece(ray, next, tau);
            let light = pieces.iter().map(|(c, own)| *own * lit.source(&c.light)).sum();
            self.add(tau, light, next);
            self.open.retain(|(chord, _)| chord.end > next);
        }
        if self.open.is_empty() && self.cursor < limit {
            self.since_gap = 0.0;
        }
        self.cursor = self.cursor.max(limit);
    }
}

/// Composes chords in the order of the list with at most `pending` open at a time; a pixel is
/// finished below the transmittance `stop`.
pub fn compose(chords: &[Chord], ray: &RayLight<'_>, pending: usize, stop: f64) -> Composed {
    let mut sweep = Sweep::new();
    for chord in chords {
        sweep.advance(ray, chord.order, stop);
        if sweep.open.len() == pending {
            let first_end = sweep.open.iter().fold(f64::INFINITY, |e, (c, _)| e.min(c.end));
            sweep.advance(ray, first_end, stop);
        }
        if sweep.transmittance <= stop {
            break;
        }
        let done = chord.share(chord.begin);
        let begin = chord.begin.max(sweep.cursor);
        // Matter that lies behind the cursor is put just before it.
        let end = chord.end.max(begin + 1e-5 * begin.max(1.0));
        sweep.open.push((Chord { begin, end, ..*chord }, done));
    }
    sweep.advance(ray, f64::INFINITY, stop);
    sweep.composed()
}

/// Steps that a piece between two events is cut into. Within a step the chords' matter counts as
/// mixed evenly; with uniform particles it is, with noise shapes the error falls with the square
/// of the steps.
pub const STEPS: u32 = 32;

/// Composes all chords, in small steps of every piece between two events, to the end.
pub fn compose_exactly(chords: &[Chord], ray: &RayLight<'_>) -> Composed {
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
        if open.is_empty() && to > from {
            sweep.since_gap = 0.0;
        }
        for step in 1..=STEPS {
            let next = from + (to - from) * f64::from(step) / f64::from(STEPS);
            let mut pieces = Vec::with_capacity(open.len());
            for (chord, done) in &mut open {
                let share = chord.share(next);
                let own = chord.optical_depth * (share - *done).max(0.0);
                *done = share;
                pieces.push((**chord, own));
            }
            let tau = pieces.iter().map(|(_, own)| own).sum();
            let lit = sweep.piece(ray, next, tau);
            let light = pieces.iter().map(|(c, own)| *own * lit.source(&c.light)).sum();
            sweep.add(tau, light, next);
        }
    }
    sweep.composed()
}
