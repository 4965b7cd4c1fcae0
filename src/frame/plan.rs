//! The frame plan: which passes this frame needs, from what changed since the last, and why.

use super::changes::{Changes, FrameKey, Input, Product};
use super::light_grid::GridWork;

/// The passes of a frame, in the order they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pass {
    /// Sky tables.
    Sky,
    /// Cells to particles.
    Rings,
    /// Depth of what is opaque to distances.
    Opaque,
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
    /// What clouds change of the light of air and ground.
    AirShadow,
    /// What a sea reflects.
    Sea,
    /// Particles to pixels.
    Blend,
    /// Sky, ground and air around the clouds.
    Resolve,
    /// Radiance to display values.
    Tonemap,
}

impl Pass {
    /// All passes in order.
    pub const ALL: [Self; 15] = [
        Self::Sky,
        Self::Rings,
        Self::Opaque,
        Self::Project,
        Self::Sort,
        Self::TileLists,
        Self::LightGrid,
        Self::LightField,
        Self::Light,
        Self::Shadow,
        Self::AirShadow,
        Self::Sea,
        Self::Blend,
        Self::Resolve,
        Self::Tonemap,
    ];

    /// The stem of the pass's files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Rings => "rings",
            Self::Opaque => "opaque",
            Self::Project => "project",
            Self::Sort => "sort",
            Self::TileLists => "tile_lists",
            Self::Light => "light",
            Self::LightGrid => "light_grid",
            Self::LightField => "light_field",
            Self::Shadow => "shadow",
            Self::AirShadow => "air_shadow",
            Self::Sea => "sea",
            Self::Blend => "blend",
            Self::Resolve => "resolve",
            Self::Tonemap => "tonemap",
        }
    }
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
    made: Vec<Product>,
    relit: bool,
    clouds_changed: bool,
    has_particles: bool,
    has_clouds: bool,
}

impl FramePlan {
    /// From what has changed, after it has observed `now`. `sky_changed`: the sky's tables have to be
    /// made again; `grid`: what of the light grid has to be; `unfinished`: some pixels are of the past.
    pub fn new(
        changes: &Changes,
        now: &FrameKey,
        sky_changed: bool,
        grid: &GridWork,
        unfinished: bool,
    ) -> Self {
        let empty = now.is_empty();
        // Only what is shown is made: clouds, and shadows where there is anything to see them on.
        let has_clouds = !empty && now.in_view.clouds;
        let has_shadows = !empty && now.has_surfaces();
        let has_grid = now.lighting.has_grid();
        let has_maps = (has_clouds && now.lighting.has_maps()) || has_shadows;
        // Without clouds in view there is no light field; what others change of the air is left.
        let has_air_shadow = has_clouds && has_grid && now.has_air();
        let has_particles = has_clouds || has_shadows || (!empty && now.sun_asked);
        let stale = |product| changes.is_stale(product, &[]);
        let relit = has_clouds && changes.is_stale(Product::Light, &[Input::Camera, Input::Opaque]);
        let mut made = Vec::new();
        let clouds_changed = has_clouds && stale(Product::Clouds);
        let mut make = |product, needed: bool| {
            let more = product == Product::Clouds && unfinished;
            let makes = needed && (more || stale(product));
            made.extend(makes.then_some(product));
            makes
        };
        let distances = make(Product::Distances, now.opaque.is_some());
        let particles = make(Product::Particles, has_particles);
        let screen = make(Product::ScreenLists, has_clouds);
        let light_lists = make(Product::LightLists, has_particles);
        let light = make(Product::Light, has_clouds);
        let shadow = make(Product::Shadow, has_maps);
        let air_shadow = make(Product::AirShadow, has_air_shadow);
        let reflected = make(Product::Reflected, now.is_sea && now.in_view.ground);
        let clouds = make(Product::Clouds, has_clouds);
        let picture = stale(Product::Picture) || shadow || air_shadow || reflected || clouds;
        made.extend(picture.then_some(Product::Picture));

        let mut decisions = Vec::new();
        let mut decide = |pass, runs: bool, yes, no| {
            decisions.push(Decision { pass, runs, reason: if runs { yes } else { no } });
        };
        let unless_empty = |no| if empty { "no particles in the scene" } else { no };
        let or_unseen = |no| unless_empty(if has_clouds { no } else { "no cloud is in view" });
        let without_grid = (!has_grid).then_some("clouds are lit without the light grid");
        let or_unneeded = |no| {
            unless_empty(if has_particles { no } else { "neither clouds nor surfaces in view" })
        };
        let moved = "particles, sun, camera or what is opaque changed";
        decide(Pass::Sky, sky_changed, "sun, altitude or ground changed", "sky unchanged");
        decide(
            Pass::Rings,
            now.clouds.is_some() && particles,
            "time, camera or field changed",
            match now.clouds {
                None => "the scene has no cloud field",
                Some(_) => or_unneeded("field unchanged"),
            },
        );
        decide(
            Pass::Opaque,
            distances,
            "camera or what is opaque changed",
            match now.opaque {
                None => "nothing opaque was given",
                Some(_) => "what is opaque unchanged",
            },
        );
        for pass in [Pass::Project, Pass::Sort, Pass::TileLists] {
            decide(pass, screen || light_lists, moved, or_unneeded("order unchanged"));
        }
        decide(
            Pass::LightGrid,
            has_clouds && !grid.steps.is_empty(),
            if grid.solved { "particles, sun or the grid's place changed" } else { "on the way" },
            or_unseen(without_grid.unwrap_or("particles and sun as the grid has them")),
        );
        decide(
            Pass::LightField,
            has_clouds && grid.field,
            "the grid's light or the eye's place changed",
            or_unseen(without_grid.unwrap_or("seen from the same place")),
        );
        let relit_why =
            if relit { "particles, sun or sky changed" } else { "others may be in view" };
        decide(Pass::Light, light, relit_why, or_unseen("light unchanged"));
        decide(
            Pass::Shadow,
            shadow,
            "particles, sun or camera changed",
            or_unneeded(match (has_maps, has_clouds) {
                (true, _) => "shadows unchanged",
                (false, true) => "clouds are lit without shadow maps",
                (false, false) => "neither clouds nor surfaces in view",
            }),
        );
        decide(
            Pass::AirShadow,
            air_shadow,
            "clouds, their light, sky or camera changed",
            or_unseen(match without_grid {
                Some(why) if now.has_air() => why,
                _ if has_air_shadow => "air unchanged",
                _ => "there is no air",
            }),
        );
        decide(
            Pass::Sea,
            reflected,
            "clouds, their light, sky or camera changed",
            match (now.is_sea, now.in_view.ground) {
                (false, _) => "the ground is no sea",
                (true, false) => "the sea is not in view",
                (true, true) => "what it reflects is unchanged",
            },
        );
        let blended_why = if clouds_changed { moved } else { "pixels of the past" };
        decide(Pass::Blend, clouds, blended_why, or_unseen("clouds unchanged"));
        for pass in [Pass::Resolve, Pass::Tonemap] {
            decide(pass, picture, "something changed", "picture unchanged");
        }
        Self { decisions, made, relit, clouds_changed, has_particles, has_clouds }
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

    /// Whether something is made anew, in part or whole.
    pub fn makes(&self, product: Product) -> bool {
        self.made.contains(&product)
    }

    /// What is made anew.
    pub fn made(&self) -> &[Product] {
        &self.made
    }

    /// Whether clouds or their shadows may be in view: else nobody has counted particles.
    pub fn has_particles(&self) -> bool {
        self.has_particles
    }

    /// Whether clouds may be in view.
    pub fn has_clouds(&self) -> bool {
        self.has_clouds
    }

    /// Whether the light of particles that were lit before has changed.
    pub fn relit(&self) -> bool {
        self.relit
    }

    /// Whether the clouds in the picture have changed.
    pub fn clouds_changed(&self) -> bool {
        self.clouds_changed
    }

    /// What each pass does, in order.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }
}

#[cfg(test)]
mod tests;
