//! What passes between the window and the thread that makes pictures.

use std::path::PathBuf;
use std::sync::Arc;

use crate::Error;
use crate::frame::{FrameStats, Picture, RenderSettings};
use crate::scene::{Camera, Scene};

/// A picture that is wanted.
#[derive(Clone, Debug)]
pub(in crate::window) struct Order {
    /// Everything but the camera; a changed scene is another one.
    pub scene: Arc<Scene>,
    /// In place of the scene's.
    pub camera: Camera,
    /// s.
    pub time: f64,
    /// Pixels.
    pub size: [u32; 2],
    /// What the renderer is made for.
    pub settings: RenderSettings,
    /// What of the insides to show in place of the picture.
    pub inside: Option<Inside>,
}

/// A view of the insides of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::window) enum Inside {
    /// Lengths of the lists of tiles on screen.
    Lists,
    /// Sunlight that comes through the others to each particle.
    Light,
    /// Steps of each pixel's march.
    Steps,
    /// Rings by colour.
    Rings,
}

impl Inside {
    /// All of them, with what they are called.
    pub const ALL: [(Self, &str); 4] = [
        (Self::Lists, "lists of tiles"),
        (Self::Light, "sunlight at particles"),
        (Self::Steps, "steps of pixels"),
        (Self::Rings, "rings"),
    ];
}

impl PartialEq for Order {
    fn eq(&self, other: &Self) -> bool {
        // Scenes can have millions of particles: they are compared where they are changed.
        Arc::ptr_eq(&self.scene, &other.scene)
            && self.camera == other.camera
            && self.time == other.time
            && self.size == other.size
            && self.settings == other.settings
            && self.inside == other.inside
    }
}

/// Something to do.
#[derive(Clone, Debug)]
pub(in crate::window) enum Errand {
    /// Make a picture and show it.
    Show(Order),
    /// Make a picture and write it, in the formats of the names' ends.
    Save(Order, Vec<PathBuf>),
    /// Make a picture and hand its radiance over.
    Measure(Order),
}

/// A picture on its way to the screen.
#[derive(Clone, Debug)]
pub(in crate::window) enum Image {
    /// On the window's device; the next picture replaces it.
    Texture(wgpu::Texture),
    /// On the host: sRGB, rows from the top.
    Pixels([u32; 2], Vec<[u8; 4]>),
}

/// A picture that was ordered.
#[derive(Clone, Debug)]
pub(in crate::window) struct Shown {
    /// What it shows.
    pub order: Order,
    /// The picture.
    pub image: Image,
    /// What it took.
    pub stats: FrameStats,
    /// Time from the order's turn to the picture, s.
    pub seconds: f64,
    /// Whether shaders or tables had to be made for it: such a time tells nothing of the next.
    pub cold: bool,
    /// What the colours of a view of the insides mean.
    pub legend: Option<String>,
}

/// What the thread tells.
#[derive(Debug)]
pub(in crate::window) enum Reply {
    /// It has begun something that takes a while, in a few words; none: it is through.
    Stage(Option<String>),
    /// A picture.
    Picture(Box<Shown>),
    /// A picture that was to be measured.
    Measured(Box<(Order, Picture)>),
    /// Files were written.
    Saved(Vec<PathBuf>),
    /// An order or an errand cannot be done; others can.
    Refused(Error),
    /// The device failed; nothing more comes.
    Failed(Error),
}
