//! The frame plan: which passes this frame needs, from what changed since the last, and why.

use super::gpu_data::{CloudUniforms, FrameUniforms, LightView, Particle, ShadowUniforms};
use super::light_grid::GridWork;

/// The passes of a frame, in the order they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pass {
    /// Sky tables.
    Sky,
    /// Cells to particles.
    Rings,
    /// Particles to tiles and sort keys: screen, sun.
    Project,
    /// Order.
    Sort,
    /// Lists per tile.
    TileLists,
    /// Light that the clouds scatter among themselves.
    LightGrid,
    /// What of it the eye sees.
    LightField,
    /// Occlusion and colour of the light at each particle.
    Light,
    /// Deep shadow maps.
    Shadow,
    /// Particles to pixels.
    Blend,
    /// Sky, ground and air around the clouds.
    Resolve,
    /// Radiance to display values.
    Tonemap,
}

impl Pass {
    /// All passes in order.
    pub const ALL: [Self; 12] = [
        Self::Sky,
        Self::Rings,
        Self::Project,
        Self::Sort,
        Self::TileLists,
        Self::LightGrid,
        Self::LightField,
        Self::Light,
        Self::Shadow,
        Self::Blend,
        Self::Resolve,
        Self::Tonemap,
    ];

    /// The stem of the pass's files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Rings => "rings",
            Self::Project => "project",
            Self::Sort => "sort",
            Self::TileLists => "tile_lists",
            Self::Light => "light",
            Self::LightGrid => "light_grid",
            Self::LightField => "light_field",
            Self::Shadow => "shadow",
            Self::Blend => "blend",
            Self::Resolve => "resolve",
            Self::Tonemap => "tonemap",
        }
    }
}

/// Everything a frame's picture depends on, besides tables and settings.
#[derive(Clone, PartialEq)]
pub struct FrameKey {
    /// Camera, size, exposure.
    pub frame: FrameUniforms,
    /// The cloud field at this time.
    pub clouds: Option<CloudUniforms>,
    /// The scene's own particles, relative to the camera.
    pub listed: Vec<Particle>,
    /// The sun's picture.
    pub light: LightView,
    /// Where the shadow maps lie.
    pub shadow: ShadowUniforms,
}

/// What a pass does in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// The pass.
    pub pass: Pass,
    /// Whether it runs.
    pub runs: bool,
    /// Why, or why not.
    pub reason: &'static str,
}

/// Which passes run, and why the others don't.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePlan {
    decisions: Vec<Decision>,
    screen_order: bool,
    light_order: bool,
    relit: bool,
}

impl FramePlan {
    /// Compares what this frame depends on with what the last one was made from (none: nothing on
    /// the device is of use). `sky_changed`: the sky's tables have to be made again; `grid`: what of
    /// the light grid has to be.
    pub fn new(last: Option<&FrameKey>, now: &FrameKey, sky_changed: bool, grid: GridWork) -> Self {
        let empty = now.clouds.is_none() && now.listed.is_empty();
        let particles = last.is_none_or(|l| l.clouds != now.clouds || l.listed != now.listed);
        let camera = last.is_none_or(|l| l.frame != now.frame);
        let lights = last.is_none_or(|l| l.light != now.light);
        let shadow = last.is_none_or(|l| l.shadow != now.shadow);
        let lit = particles || lights || sky_changed || grid.solve;
        let anything = lit || camera || shadow || grid.field;

        let mut decisions = Vec::new();
        let mut decide = |pass, runs: bool, yes, no| {
            decisions.push(Decision { pass, runs, reason: if runs { yes } else { no } });
        };
        let or_empty = |no| if empty { "no particles in the scene" } else { no };
        decide(Pass::Sky, sky_changed, "sun, altitude or ground changed", "sky unchanged");
        let rings_unneeded =
            if now.clouds.is_none() { "the scene has no cloud field" } else { "field unchanged" };
        decide(
            Pass::Rings,
            now.clouds.is_some() && particles,
            "time, camera or field changed",
            rings_unneeded,
        );
        let screen_order = !empty && (particles || camera);
        let light_order = !empty && (particles || lights);
        let order = screen_order || light_order;
        let moved = "particles, sun or camera changed";
        for pass in [Pass::Project, Pass::Sort, Pass::TileLists] {
            decide(pass, order, moved, or_empty("order unchanged"));
        }
        decide(
            Pass::LightGrid,
            !empty && grid.solve,
            "particles, sun or the grid's place changed",
            or_empty("particles and sun as the grid has them"),
        );
        decide(
            Pass::LightField,
            !empty && grid.field,
            "the grid's light or the eye's place changed",
            or_empty("seen from the same place"),
        );
        decide(
            Pass::Light,
            !empty && (lit || camera),
            if lit { "particles, sun or sky changed" } else { "particles may have come into view" },
            or_empty("light unchanged"),
        );
        decide(
            Pass::Shadow,
            !empty && (particles || lights || shadow || camera),
            "particles, sun or view changed",
            or_empty("shadows unchanged"),
        );
        decide(
            Pass::Blend,
            !empty && (lit || camera || grid.field),
            moved,
            or_empty("clouds unchanged"),
        );
        decide(Pass::Resolve, anything, "something changed", "picture unchanged");
        decide(Pass::Tonemap, anything, "something changed", "picture unchanged");
        Self { decisions, screen_order, light_order, relit: lit }
    }

    /// The plan with one pass left out, for showing what it does.
    pub fn without(mut self, pass: Option<Pass>) -> Self {
        for decision in &mut self.decisions {
            if Some(decision.pass) == pass {
                *decision = Decision { runs: false, reason: "left out on request", ..*decision };
            }
        }
        self
    }

    /// Whether a pass runs.
    pub fn runs(&self, pass: Pass) -> bool {
        self.decisions.iter().any(|d| d.pass == pass && d.runs)
    }

    /// Whether the screen's order and lists are made anew.
    pub fn screen_order(&self) -> bool {
        self.screen_order
    }

    /// Whether the lights' order and lists are made anew; turning the camera leaves them.
    pub fn light_order(&self) -> bool {
        self.light_order
    }

    /// Whether the light of particles that were lit before has changed.
    pub fn relit(&self) -> bool {
        self.relit
    }

    /// What each pass does, in order.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    fn key() -> FrameKey {
        FrameKey {
            frame: FrameUniforms { has_ground: 1, ..FrameUniforms::zeroed() },
            clouds: Some(CloudUniforms::zeroed()),
            listed: Vec::new(),
            light: LightView::zeroed(),
            shadow: ShadowUniforms::zeroed(),
        }
    }

    const ALL: GridWork = GridWork { solve: true, field: true };
    const NONE: GridWork = GridWork { solve: false, field: false };

    fn running(plan: &FramePlan) -> Vec<Pass> {
        Pass::ALL.into_iter().filter(|p| plan.runs(*p)).collect()
    }

    #[test]
    fn the_first_frame_runs_everything() {
        let plan = FramePlan::new(None, &key(), true, ALL);
        assert_eq!(running(&plan), Pass::ALL);
    }

    #[test]
    fn paused_and_still_runs_nothing() {
        let plan = FramePlan::new(Some(&key()), &key(), false, NONE);
        assert_eq!(running(&plan), []);
        assert!(plan.decisions().iter().all(|d| !d.reason.is_empty()));
    }

    #[test]
    fn a_turned_camera_keeps_the_light() {
        let mut now = key();
        now.frame.forward = [1.0, 0.0, 0.0, 0.0];
        let plan = FramePlan::new(Some(&key()), &now, false, NONE);
        assert!(plan.screen_order() && !plan.light_order() && !plan.relit());
        for pass in [Pass::Sky, Pass::Rings, Pass::LightGrid, Pass::LightField] {
            assert!(!plan.runs(pass), "{pass:?}");
        }
        assert!(plan.runs(Pass::Blend) && plan.runs(Pass::Resolve));
    }

    #[test]
    fn a_moved_sun_keeps_the_particles_and_the_screen_order() {
        let mut now = key();
        now.light.towards = [0.0, 1.0, 0.0, 0.0];
        let plan = FramePlan::new(Some(&key()), &now, true, ALL);
        assert!(plan.light_order() && !plan.screen_order() && plan.relit());
        assert!(!plan.runs(Pass::Rings) && plan.runs(Pass::Light) && plan.runs(Pass::Shadow));
    }

    #[test]
    fn an_empty_sky_needs_sky_and_picture_only() {
        let mut now = key();
        now.clouds = None;
        let plan = FramePlan::new(None, &now, true, NONE);
        assert_eq!(running(&plan), [Pass::Sky, Pass::Resolve, Pass::Tonemap]);
    }
}
