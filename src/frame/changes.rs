//! What has changed since each product of a frame was made: every input has a number that grows when
//! it changes, every product keeps the numbers that it was made from. So what was skipped for a while
//! is made again when it is needed, and only then.

use super::gpu_data::{FrameUniforms, LightView, Particle, ShadowUniforms};
use super::in_view::InView;
use super::light_grid::GridWork;
use super::opaque::Opaque;
use super::rings::PlacedField;
use super::settings::Lighting;

/// Everything a frame's picture depends on, besides tables and settings.
#[derive(Clone, PartialEq)]
pub struct FrameKey {
    /// Camera, size, exposure.
    pub frame: FrameUniforms,
    /// The cloud field at this time, with its weather map.
    pub clouds: Option<PlacedField>,
    /// The scene's own particles, relative to the camera.
    pub listed: Vec<Particle>,
    /// The sun's picture.
    pub light: LightView,
    /// Where the shadow maps lie.
    pub shadow: ShadowUniforms,
    /// Whether the ground is a sea.
    pub is_sea: bool,
    /// What may be in the picture.
    pub in_view: InView,
    /// What is opaque in it: its revision tells of its contents.
    pub opaque: Option<Opaque>,
    /// How clouds are lit: the same for all frames of a renderer.
    pub lighting: Lighting,
    /// Whether the host asks how much sunlight reaches points of its own.
    pub sun_asked: bool,
}

impl FrameKey {
    /// Whether there is air.
    pub fn has_air(&self) -> bool {
        self.frame.has_air != 0
    }

    /// Whether the scene has no particles.
    pub fn is_empty(&self) -> bool {
        self.clouds.is_none() && self.listed.is_empty()
    }

    /// Whether there may be something on which shadows are seen.
    pub fn has_surfaces(&self) -> bool {
        let is_lit = |opaque: &Opaque| opaque.sunlit.is_some();
        self.in_view.ground || self.opaque.as_ref().is_some_and(is_lit)
    }
}

/// What products are made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Field, listed particles.
    Particles,
    /// Camera, size, exposure.
    Camera,
    /// The sun's picture.
    Sun,
    /// Where the shadow maps lie.
    ShadowMaps,
    /// The sky's tables.
    Sky,
    /// The light grid's light.
    Grid,
    /// What the eye sees of it.
    Field,
    /// What is opaque.
    Opaque,
}

const INPUTS: usize = 8;

/// What passes leave on the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Product {
    /// Distances of what is opaque.
    Distances,
    /// The particle buffer.
    Particles,
    /// Order and lists from the eye.
    ScreenLists,
    /// Order and lists from the sun.
    LightLists,
    /// Light of the particles in view.
    Light,
    /// The deep shadow maps.
    Shadow,
    /// What clouds change of the light of air and ground.
    AirShadow,
    /// What a sea reflects of sky and clouds.
    Reflected,
    /// Clouds of every pixel.
    Clouds,
    /// The whole picture.
    Picture,
}

impl Product {
    /// All of them, in the order they are made.
    pub const ALL: [Self; 10] = [
        Self::Distances,
        Self::Particles,
        Self::ScreenLists,
        Self::LightLists,
        Self::Light,
        Self::Shadow,
        Self::AirShadow,
        Self::Reflected,
        Self::Clouds,
        Self::Picture,
    ];

    /// What it is made from, straight or by other products.
    const fn inputs(self) -> &'static [Input] {
        match self {
            Self::Distances => &[Input::Opaque, Input::Camera],
            Self::Particles => &[Input::Particles],
            Self::ScreenLists => &[Input::Particles, Input::Camera, Input::Opaque],
            Self::LightLists => &[Input::Particles, Input::Sun],
            Self::Light => &[
                Input::Particles,
                Input::Camera,
                Input::Sun,
                Input::Sky,
                Input::Grid,
                Input::Opaque,
            ],
            // Only what the eye may see is made.
            Self::Shadow => &[Input::Particles, Input::Camera, Input::Sun, Input::ShadowMaps],
            Self::AirShadow => &[
                Input::Particles,
                Input::Camera,
                Input::Sun,
                Input::Sky,
                Input::Grid,
                Input::ShadowMaps,
                Input::Field,
            ],
            Self::Reflected => &[
                Input::Particles,
                Input::Camera,
                Input::Sun,
                Input::Sky,
                Input::Grid,
                Input::Field,
            ],
            Self::Clouds => &[
                Input::Particles,
                Input::Camera,
                Input::Sun,
                Input::Sky,
                Input::Grid,
                Input::ShadowMaps,
                Input::Field,
                Input::Opaque,
            ],
            Self::Picture => &[Input::Camera, Input::Sky, Input::Opaque],
        }
    }
}

/// The numbers of inputs and products.
#[derive(Clone, Default)]
pub struct Changes {
    last: Option<FrameKey>,
    now: [u64; INPUTS],
    made: [Option<[u64; INPUTS]>; Product::ALL.len()],
}

impl Changes {
    /// Nothing on the device is of use.
    pub fn forget(&mut self) {
        self.made = Default::default();
    }

    /// Compares a frame's key with the last one's. `sky`: the sky's tables are made again in this
    /// frame; `grid`: what of the light grid is.
    pub fn observe(&mut self, key: &FrameKey, sky: bool, grid: &GridWork) {
        let last = self.last.as_ref();
        let differs = |of: &dyn Fn(&FrameKey) -> bool| last.is_none_or(of);
        let changed = [
            (Input::Particles, differs(&|l| l.clouds != key.clouds || l.listed != key.listed)),
            (Input::Camera, differs(&|l| l.frame != key.frame)),
            (Input::Sun, differs(&|l| l.light != key.light)),
            (Input::ShadowMaps, differs(&|l| l.shadow != key.shadow)),
            (Input::Sky, sky),
            (Input::Grid, grid.solved),
            (Input::Field, grid.field),
            (Input::Opaque, differs(&|l| l.opaque != key.opaque)),
        ];
        for (input, changed) in changed {
            self.now[input as usize] += u64::from(changed);
        }
        self.last = Some(key.clone());
    }

    /// Whether a product is not what it would be if it were made now; `but` some inputs.
    pub fn is_stale(&self, product: Product, but: &[Input]) -> bool {
        self.made[product as usize].is_none_or(|made| {
            let inputs = product.inputs().iter().filter(|i| !but.contains(i));
            inputs.into_iter().any(|i| made[*i as usize] != self.now[*i as usize])
        })
    }

    /// Notes that a product has been made.
    pub fn done(&mut self, product: Product) {
        self.made[product as usize] = Some(self.now);
    }
}
