//! The light grid of one renderer: what it holds, and when it has to be made.
//!
//! A solution takes many turns. All in one frame, it is always that of the frame's own time and place;
//! a few turns a frame, the last whole one is shown until the next is whole.

use std::ops::Range;

use glam::DVec3;

use super::inputs::GridInputs;
use super::job::{GridSize, Job, PARTS};
use crate::frame::cpu::light_grid::{FieldSeen, GridLight};
use crate::frame::passes::Passes;
use crate::gpu::Gpu;
use crate::{Error, Result};

/// A solution, whole or on the way.
pub(super) struct Solution {
    pub job: Job,
    pub inputs: GridInputs,
}

/// The grid of one renderer.
#[derive(Default)]
pub struct LightGrid {
    shown: Option<Solution>,
    /// The next one, and how many of its steps are made.
    next: Option<(Solution, u32)>,
    /// Buffers of one that nobody needs any more.
    spare: Option<Job>,
    seen_from: Option<[f32; 3]>,
    /// Work that was handed out and not heard of since.
    open: bool,
}

/// What of the grid a frame has to make.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GridWork {
    /// Steps of a solution: the matter, then turns.
    pub steps: Range<u32>,
    /// They are the last ones of the solution that this frame shows: its light changes.
    pub solved: bool,
    /// What the eye sees of it.
    pub field: bool,
    /// Steps made so far, with those of this frame, and steps in all, of the solution on the way; 0
    /// where there is none.
    pub progress: [u32; 2],
}

/// A scene's grid at a time, and how it is to be made.
pub struct GridOrder<'a> {
    /// What the light depends on.
    pub inputs: &'a GridInputs,
    /// Room for particles.
    pub size: GridSize,
    /// Steps a frame; 0: all.
    pub slice: u32,
    /// Where nothing that is there serves and steps are spread over frames: a rough solution first.
    pub draft: bool,
    /// s.
    pub time: f64,
    /// m.
    pub eye: DVec3,
}

impl LightGrid {
    /// Decides what is shown and what has to be made for it. The work must be recorded in this frame,
    /// and `done` told of it. Returns it with the anchor of what is shown relative to the eye, m.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        passes: &Passes,
        order: &GridOrder<'_>,
    ) -> (GridWork, DVec3) {
        if std::mem::replace(&mut self.open, true) {
            // Its buffers hold nobody knows what.
            *self = Self { open: true, ..Self::default() };
        }
        let inputs = order.inputs;
        let mut work = GridWork::default();
        let serves = |s: &Solution| s.inputs.is_near(inputs);
        let sliced = order.slice > 0 && self.shown.as_ref().is_some_and(serves);
        if self.shown.as_ref().is_some_and(|s| s.inputs == *inputs) {
            self.drop_next();
        } else if !sliced {
            self.drop_next();
            let old = self.shown.take().map(|s| s.job);
            let rough = order.draft && order.slice > 0;
            let first = if rough { inputs.draft() } else { inputs.clone() };
            let job = self.job(gpu, passes, &GridOrder { inputs: &first, ..*order }, old);
            work.steps = 0..first.steps();
            work.solved = true;
            if first != *inputs {
                work.progress = [0, inputs.steps()];
            }
            self.shown = Some(Solution { job, inputs: first });
        } else {
            let goes_on = |(next, _): &(Solution, u32)| {
                next.inputs.is_near(inputs)
                    && next.inputs.has_sun_near(inputs)
                    && next.job.fits(inputs, order.size)
            };
            if !self.next.as_ref().is_some_and(goes_on) {
                self.drop_next();
                let job = self.job(gpu, passes, order, None);
                self.next = Some((Solution { job, inputs: inputs.clone() }, 0));
            }
            if let Some((next, done)) = self.next.take() {
                let all = next.inputs.steps();
                work.steps = done..next.inputs.steps_within(done, order.slice);
                work.progress = [work.steps.end, all];
                if work.steps.end == all {
                    work.solved = true;
                    self.spare = self.shown.replace(next).map(|s| s.job);
                } else {
                    self.next = Some((next, work.steps.end));
                }
            }
        }
        let shown = self.shown.as_ref().map_or(inputs, |s| &s.inputs);
        let shift = shown.anchor_at(order.time) - order.eye;
        work.field = work.solved || self.seen_from != Some(eye_of(shift));
        (work, shift)
    }

    /// Drops what was made last: it found no room for some of its cells, and lacks light there. Whether it was shown.
    pub fn drop_last(&mut self) -> bool {
        self.next.take().is_none() && self.shown.take().is_some()
    }

    fn drop_next(&mut self) {
        if let Some((next, _)) = self.next.take() {
            self.spare = Some(next.job);
        }
    }

    /// Buffers that fit: old ones where they do.
    fn job(&mut self, gpu: &Gpu, passes: &Passes, order: &GridOrder<'_>, old: Option<Job>) -> Job {
        let old = old.or_else(|| self.spare.take());
        old.filter(|j| j.fits(order.inputs, order.size)).unwrap_or_else(|| {
            let kept = [self.shown.as_ref().map(|s| &s.job), self.spare.as_ref()];
            let is_free = |part: &&&str| kept.iter().flatten().all(|job| job.part != **part);
            let part = PARTS.iter().find(is_free).unwrap_or(&PARTS[2]);
            Job::new(gpu, passes, part, order.size, order.inputs)
        })
    }

    /// Notes that the work of `prepare` is recorded. `shift`: what it returned.
    pub fn done(&mut self, shift: DVec3) {
        self.open = false;
        self.seen_from = Some(eye_of(shift));
    }

    /// What is shown.
    pub(super) fn shown(&self) -> Option<&Solution> {
        self.shown.as_ref()
    }

    /// What steps are made of: the solution on the way, or the one that becomes whole by them.
    pub(super) fn making(&self, work: &GridWork) -> Option<&Solution> {
        if work.solved { self.shown.as_ref() } else { self.next.as_ref().map(|(next, _)| next) }
    }

    /// The list of large particles of what is shown: its second word counts what a driver cut.
    pub fn large(&self) -> Option<&wgpu::Buffer> {
        self.shown.as_ref().map(|s| &s.job.large)
    }

    /// Sources and lights of what is shown: all its steps are made.
    pub fn solved(&self) -> Option<[&wgpu::Buffer; 2]> {
        self.shown.as_ref().map(|s| [&s.job.sources, &s.job.lights])
    }

    /// Share of the sunlight by slot, of what is shown.
    pub fn sun_mean(&self) -> Option<&wgpu::Buffer> {
        self.shown.as_ref().map(|s| &s.job.sun)
    }

    /// Bind group 3 of passes that read the field.
    pub fn bind_group(&self) -> Option<&wgpu::BindGroup> {
        self.shown.as_ref().map(|s| &s.job.read)
    }

    /// `ParticleCount` of the grid's own particles: of those that were made last.
    pub fn particle_count(&self) -> Option<&wgpu::Buffer> {
        let next = self.next.as_ref().map(|(next, _)| next);
        next.or(self.shown.as_ref()).map(|s| &s.job.count)
    }

    /// Numbers of cells with matter, and of those without that keep light, of what was made last: buffers that
    /// hold them at this word.
    pub fn slot_counts(&self) -> Option<([&wgpu::Buffer; 2], u64)> {
        let next = self.next.as_ref().map(|(next, _)| next);
        let slots = &next.or(self.shown.as_ref())?.job.slots;
        Some((slots.offsets.each_ref(), slots.words.into()))
    }

    /// What the last eye sees of it, read back.
    pub fn seen(&self, gpu: &Gpu) -> Result<FieldSeen> {
        let (Some(Solution { job, inputs }), Some(eye)) = (&self.shown, self.seen_from) else {
            return Err(Error::Gpu("the light grid was not made".to_owned()));
        };
        let lights = gpu.read_buffer::<u32>(&job.lights, job.lights.size() as usize / 4)?;
        let sun = gpu.read_buffer::<f32>(&job.sun, job.room.kept as usize)?;
        let words = (job.cells + job.room.matter) as usize;
        let cells = gpu.read_buffer::<u32>(&job.slots.cells, words)?;
        let light =
            GridLight::from_device(&inputs.uniforms, &lights, job.light_words, &sun, &cells);
        Ok(light.seen_from(DVec3::from_array(eye.map(f64::from))))
    }

    /// Device memory, bytes.
    pub fn bytes(&self) -> u64 {
        let next = self.next.as_ref().map(|(next, _)| &next.job);
        let shown = self.shown.as_ref().map(|s| &s.job);
        [shown, next, self.spare.as_ref()].into_iter().flatten().map(|job| job.bytes).sum()
    }
}

/// The eye relative to the anchor, m.
fn eye_of(shift: DVec3) -> [f32; 3] {
    (-shift).as_vec3().to_array()
}
