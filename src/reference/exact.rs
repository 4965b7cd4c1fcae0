//! The frame's lighting with everything else exact: which particles a ray meets, how they overlap,
//! what their matter lets through, and the air in front of every part of them; in f64, with the
//! true density in place of tables, and all particles in place of lists.

use glam::DVec3;

use self::air::{AirAlong, AirChange, Clouded};
use super::geometry::Ray;
use super::grid::ParticleGrid;
use super::particles::WorldParticle;
use super::world::Densities;
use crate::Result;
use crate::frame::cpu::air_shadow::{CloudLight, light_on_ground};
use crate::frame::cpu::lighting::{Before, ChordLight, RayLight, SunDepth};
use crate::frame::cpu::segments::{ChordInputs, Composed, STEPS, mean_scatter_fraction};
use crate::frame::cpu::sky::Sky;
use crate::frame::gpu_data::{Particle, ParticleLight};
use crate::frame::opaque::Surface;
use crate::frame::population::Shapes;
use crate::frame::renderer::sky_inputs;
use crate::medium::VOLUME_CELL;
use crate::scene::{Scene, Sky as SkyOf};
use crate::tables::TableSet;

/// Steps of rays through the air: its radiance is then within 1e-3 of its limit.
pub const AIR_STEPS: u32 = 64;
/// Steps from one place where the depth to the sun is worked out to the next; linear between them.
const STEPS_TO_THE_SUN: usize = 4;
/// Optical depth of a step from which on it is made of smaller ones: the light of opaque matter comes from a thin skin, over
/// which depths to the sun change evenly, and over a step may not.
const DEEPEST_STEP: f64 = 1.0;
/// Nothing behind this transmittance is seen.
const OPAQUE: f64 = 1e-9;
/// Steps a cell of the density volume: within half a cell matter is as good as evenly mixed.
const STEPS_A_CELL: f64 = 2.0;
/// Abscissae of the two-point Gauss rule on 0..1.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// What a ray through the middle of a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactPixel {
    /// Clouds and all behind them.
    pub radiance: DVec3,
    /// Of the clouds.
    pub transmittance: f64,
    /// Of the clouds, opacity-weighted, m; 0 where there are none.
    pub distance: f64,
}

/// A frame to be composed exactly.
pub struct Exact<'a> {
    inputs: ChordInputs<'a>,
    grid: ParticleGrid,
    frame_particles: Vec<Particle>,
    lights: Vec<ParticleLight>,
    sky: Sky,
    has_air: bool,
    clouded: Clouded,
    has_ground: bool,
    is_filtered: bool,
}

/// Optical depth towards the sun through the true density of all particles.
pub struct SunTruth {
    grid: ParticleGrid,
    sun: DVec3,
}

impl SunTruth {
    /// Of particles relative to the camera.
    pub fn new(tables: &TableSet, particles: &[Particle], sun: DVec3) -> Result<Self> {
        let placed = Densities::default().place(particles, &Shapes::new(tables), DVec3::ZERO)?;
        Ok(Self { grid: ParticleGrid::new(placed), sun })
    }

    /// From a point, relative to the camera.
    pub fn depth(&self, point: DVec3) -> f64 {
        let ray = Ray { origin: point, dir: self.sun };
        let mut found = Vec::new();
        self.grid.along(&ray, f64::INFINITY, &mut found);
        let through = |&i: &u32| {
            let particle = &self.grid.particles()[i as usize];
            particle.span(&ray).map_or(0.0, |(begin, end)| {
                let begin = begin.max(0.0);
                if end > begin { particle.optical_depth(&ray, begin, end) } else { 0.0 }
            })
        };
        found.iter().map(through).sum()
    }
}

/// One chord of a ray.
struct Chord<'a> {
    particle: &'a WorldParticle,
    begin: f64,
    end: f64,
    light: ChordLight,
    /// In place of the particle's own density: a copy of its shape's.
    copied: Option<(&'a TableSet, u32, usize)>,
}

impl Chord<'_> {
    /// Extinction at a point, 1/m.
    fn extinction_at(&self, point: DVec3) -> f64 {
        let particle = self.particle;
        let Some((tables, shape, copy)) = self.copied else {
            return particle.extinction_at(point);
        };
        let offset = (point - particle.centre) / particle.radius;
        particle.extinction * tables.density(shape, particle.to_own * offset, copy)
    }
}

impl<'a> Exact<'a> {
    /// Particles as the frame has them, with their light.
    pub fn new(
        scene: &Scene,
        inputs: ChordInputs<'a>,
        particles: Vec<Particle>,
        lights: Vec<ParticleLight>,
    ) -> Result<Self> {
        let sky = Sky::new(&sky_inputs(scene), AIR_STEPS);
        Self::with_sky(scene, inputs, particles, lights, sky)
    }

    /// The same with a sky that is there already.
    pub fn with_sky(
        scene: &Scene,
        inputs: ChordInputs<'a>,
        particles: Vec<Particle>,
        lights: Vec<ParticleLight>,
        sky: Sky,
    ) -> Result<Self> {
        let shapes = Shapes::new(inputs.tables);
        let placed = Densities::default().place(&particles, &shapes, DVec3::ZERO)?;
        // The grid leaves out what has no matter: so must the light.
        let kept = || placed.iter().map(WorldParticle::has_matter);
        let frame_particles =
            particles.into_iter().zip(kept()).filter_map(|(p, k)| k.then_some(p)).collect();
        let lights = lights.into_iter().zip(kept()).filter_map(|(l, k)| k.then_some(l)).collect();
        Ok(Self {
            inputs,
            frame_particles,
            lights,
            sky,
            has_air: matches!(scene.sky, SkyOf::Atmosphere),
            has_ground: scene.effective_ground().is_some(),
            clouded: Clouded::new(&placed, scene.sun.direction),
            grid: ParticleGrid::new(placed),
            is_filtered: false,
        })
    }

    /// With the filtered copies of densities that the frame reads for particles of a few pixels, in place of the
    /// densities: what the frame then is to be the same as.
    pub fn filtered(self) -> Self {
        Self { is_filtered: true, ..self }
    }

    /// What is seen in a direction from the eye.
    pub fn pixel(&self, dir: DVec3) -> ExactPixel {
        self.pixel_before(dir, None)
    }

    /// The same before something opaque.
    pub fn pixel_before(&self, dir: DVec3, surface: Option<Surface>) -> ExactPixel {
        let (ground, change) = (self.far(dir), self.air_change(dir));
        let surface = surface.filter(|s| s.distance < ground);
        let clouds = self.clouds_before(dir, surface.map_or(ground, |s| s.distance), &change);
        self.with_behind(dir, &clouds, surface, (&change, self.inputs.sun_depth))
    }

    /// What clouds change of the light of the air of a ray.
    fn air_change(&self, dir: DVec3) -> AirChange {
        let far = if self.has_air { self.far(dir) } else { 0.0 };
        let light = CloudLight { sun_depth: self.inputs.sun_depth, field: self.inputs.field };
        AirChange::new(&self.sky, &self.clouded, dir, far, &light)
    }

    /// The same of clouds that have been composed without the air: it is taken at their distance, as the frame does.
    /// `ground_depth` says how deep the ground lies in the clouds' shadow.
    pub fn pixel_of(
        &self,
        dir: DVec3,
        mut clouds: Composed,
        ground_depth: SunDepth<'_>,
    ) -> ExactPixel {
        let change = self.air_change(dir);
        if self.has_air && clouds.transmittance < 1.0 {
            // A bin that the ground cuts counts whole for the distance; the air ends on the ground, here as in the frame.
            let distance = clouds.distance.min(self.far(dir));
            let air = self.sky.air_between(dir, distance);
            let opacity = 1.0 - clouds.transmittance;
            let added = change.of(air.inscatter, distance);
            clouds.radiance = clouds.radiance * air.transmittance + opacity * added;
        }
        self.with_behind(dir, &clouds, None, (&change, ground_depth))
    }

    /// Where rays end: m, to the ground, if they meet it.
    pub fn far(&self, dir: DVec3) -> f64 {
        let ground = if self.has_ground { self.sky.ground_distance(dir) } else { -1.0 };
        if ground >= 0.0 { ground } else { f64::INFINITY }
    }

    /// What clouds change of the air's light, and the optical depth to the sun from what is behind them.
    fn with_behind(
        &self,
        dir: DVec3,
        clouds: &Composed,
        surface: Option<Surface>,
        (change, sun_depth): (&AirChange, SunDepth<'_>),
    ) -> ExactPixel {
        let ground = self.far(dir);
        let scale = f64::from(self.inputs.frame.delta_scale);
        let straight = clouds.transmittance.powf(1.0 / scale);
        let behind = if clouds.transmittance <= OPAQUE {
            DVec3::ZERO
        } else if let Some(Surface { distance, radiance, sunlit }) = surface {
            let light = radiance + sunlit * (-sun_depth(dir * distance)).exp();
            let air = self.sky.air_between(dir, distance);
            let before = change.of(air.inscatter, distance);
            if self.has_air { light * air.transmittance + before } else { light }
        } else if ground.is_finite() {
            let sunlit = (-sun_depth(dir * ground)).exp();
            let [by_clouds, sky] = if self.has_air {
                light_on_ground(self.inputs.field, dir * ground)
            } else {
                [0.0, 1.0]
            };
            let light = self.sky.ground_radiance(dir, ground, [sunlit, by_clouds, sky]);
            let air = self.sky.air_between(dir, ground);
            light * air.transmittance + change.of(air.inscatter, ground)
        } else {
            // The disc is seen by light that is not scattered at all, not even within the peak.
            let disc = self.sky.sun_disc_radiance(dir) * (straight / clouds.transmittance);
            change.of(self.sky.sky_radiance(dir), f64::INFINITY) + disc
        };
        ExactPixel {
            radiance: clouds.radiance + clouds.transmittance * behind,
            transmittance: straight,
            distance: clouds.distance,
        }
    }

    fn chords(&self, ray: &Ray, far: f64) -> Vec<Chord<'_>> {
        let mut found = Vec::new();
        self.grid.along(ray, far, &mut found);
        let chord = |&i: &u32| {
            let particle = &self.grid.particles()[i as usize];
            let (near, leaves) = particle.span(ray)?;
            let (begin, end) = (near.max(0.0), leaves.min(far));
            if end <= begin {
                return None;
            }
            let entry = (ray.at(near) - particle.centre) / particle.radius;
            let (own, light) = (&self.frame_particles[i as usize], &self.lights[i as usize]);
            let light = self.inputs.light(own, light, ray.dir, entry);
            let copy = if self.is_filtered { self.inputs.copy(own, ray.dir) } else { 0 };
            let copied = (copy > 0).then_some((self.inputs.tables, own.shape, copy));
            Some(Chord { particle, begin, end, light, copied })
        };
        found.iter().filter_map(chord).collect()
    }

    /// The clouds up to a distance (m), with the air before them.
    pub fn clouds(&self, dir: DVec3, far: f64) -> Composed {
        self.clouds_before(dir, far, &self.air_change(dir))
    }

    fn clouds_before(&self, dir: DVec3, far: f64, change: &AirChange) -> Composed {
        let ray = Ray { origin: DVec3::ZERO, dir };
        let chords = self.chords(&ray, far);
        let lit = self.inputs.ray(dir);
        let mut events: Vec<f64> = chords.iter().flat_map(|c| [c.begin, c.end]).collect();
        events.sort_by(f64::total_cmp);
        let mut sum = Composed { radiance: DVec3::ZERO, transmittance: 1.0, distance: 0.0 };
        let (Some(&first), Some(&last)) = (events.first(), events.last()) else { return sum };
        let air = self.has_air.then(|| AirAlong::new(&self.sky, dir, first, last, change));
        let mut since_gap = 0.0;
        for piece in events.windows(2) {
            let [from, to] = [piece[0], piece[1]];
            let open: Vec<_> =
                chords.iter().filter(|c| c.begin <= from && c.end >= to && to > from).collect();
            if open.is_empty() && to > from {
                since_gap = 0.0;
            }
            if !open.is_empty() && sum.transmittance > OPAQUE {
                let before = sum.transmittance;
                compose_piece(&ray, &open, [from, to], air.as_ref(), &lit, since_gap, &mut sum);
                since_gap += (before / sum.transmittance).ln();
            }
        }
        let opacity = 1.0 - sum.transmittance;
        if opacity > 0.0 {
            sum.distance /= opacity;
        }
        sum
    }
}

/// Adds a piece of a ray on which the same chords are open.
fn compose_piece(
    ray: &Ray,
    open: &[&Chord<'_>],
    [from, to]: [f64; 2],
    air: Option<&AirAlong>,
    lit: &RayLight<'_>,
    since_gap: f64,
    sum: &mut Composed,
) {
    let mut piece =
        Piece { ray, open, air, lit, since_gap, at_begin: -sum.transmittance.ln(), sum };
    let finest = open
        .iter()
        .filter(|c| !c.particle.shape.volume().is_empty())
        .fold(f64::INFINITY, |finest, c| finest.min(c.particle.radius * VOLUME_CELL));
    let steps = ((to - from) * STEPS_A_CELL / finest).ceil().max(f64::from(STEPS));
    let step = (to - from) / steps;
    let sunk = |t: f64| (lit.sun_depth)(ray.at(t));
    // Depth to the sun at the last place where it was worked out and at the next one.
    let mut depths = [0.0, sunk(from)];
    for i in 0..steps as usize {
        let begin = from + step * i as f64;
        let within = i % STEPS_TO_THE_SUN;
        if within == 0 {
            depths = [depths[1], sunk((begin + STEPS_TO_THE_SUN as f64 * step).min(to))];
        }
        let stretch = (steps as usize - (i - within)).min(STEPS_TO_THE_SUN) as f64;
        let sun_depths =
            [within, within + 1].map(|s| depths[0] + (depths[1] - depths[0]) * s as f64 / stretch);
        let taus = piece.depths([begin, begin + step]);
        if taus.iter().sum::<f64>() > DEEPEST_STEP {
            piece.add_deep([begin, begin + step]);
        } else {
            piece.add([begin, begin + step], &taus, sun_depths);
        }
        if piece.sum.transmittance <= OPAQUE {
            return;
        }
    }
}

/// A piece of a ray on which the same chords are open, and what is known of the ray up to some place of it.
struct Piece<'a> {
    ray: &'a Ray,
    open: &'a [&'a Chord<'a>],
    air: Option<&'a AirAlong>,
    lit: &'a RayLight<'a>,
    since_gap: f64,
    /// Optical depth before the piece.
    at_begin: f64,
    sum: &'a mut Composed,
}

impl Piece<'_> {
    /// Optical depth of each chord from one place to another.
    fn depths(&self, [begin, end]: [f64; 2]) -> Vec<f64> {
        let at = GAUSS.map(|place| self.ray.at(begin + (end - begin) * place));
        let own = |chord: &&Chord<'_>| {
            at.iter().map(|point| 0.5 * (end - begin) * chord.extinction_at(*point)).sum()
        };
        self.open.iter().map(own).collect()
    }

    /// Adds a step of these optical depths, with the depth to the sun at both ends.
    fn add(&mut self, [begin, end]: [f64; 2], depths: &[f64], sun_depths: [f64; 2]) {
        let tau: f64 = depths.iter().sum();
        if tau <= 0.0 {
            return;
        }
        let view = -self.sum.transmittance.ln();
        let before = Before { view, since_gap: self.since_gap + view - self.at_begin };
        let within = mean_scatter_fraction(tau);
        let piece = self.lit.piece_below([begin, end], tau, within, before, sun_depths);
        let both = self.open.iter().zip(depths);
        let light: DVec3 = both.map(|(chord, own)| *own * piece.source(&chord.light)).sum();
        let weight = self.sum.transmittance * -(-tau).exp_m1();
        let seen = begin + (end - begin) * within;
        let mut radiance = light / tau;
        if let Some(air) = self.air {
            let (inscatter, transmittance) = air.at(seen);
            radiance = radiance * transmittance + inscatter;
        }
        self.sum.radiance += weight * radiance;
        self.sum.distance += weight * seen;
        self.sum.transmittance *= (-tau).exp();
    }

    /// The same of a step that is deep: in halves of halves, up to what is seen of it.
    fn add_deep(&mut self, step: [f64; 2]) {
        let sunk = |t: f64| (self.lit.sun_depth)(self.ray.at(t));
        let mut left = vec![(step, step.map(sunk))];
        while let Some(([begin, end], sun_depths)) = left.pop() {
            let depths = self.depths([begin, end]);
            let middle = 0.5 * (begin + end);
            let is_deep = depths.iter().sum::<f64>() > DEEPEST_STEP;
            // As far as there are places between the two.
            if is_deep && begin < middle && middle < end {
                let there = (self.lit.sun_depth)(self.ray.at(middle));
                left.push(([middle, end], [there, sun_depths[1]]));
                left.push(([begin, middle], [sun_depths[0], there]));
                continue;
            }
            self.add([begin, end], &depths, sun_depths);
            if self.sum.transmittance <= OPAQUE {
                return;
            }
        }
    }
}

mod air;
#[cfg(test)]
mod tests;
