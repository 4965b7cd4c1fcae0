//! What passes between the window and the thread that makes pictures.

use std::path::PathBuf;
use std::sync::Arc;

use crate::Error;
use crate::frame::{FrameStats, RenderSettings};
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
}

impl PartialEq for Order {
    fn eq(&self, other: &Self) -> bool {
        // Scenes can have millions of particles: they are compared where they are changed.
        Arc::ptr_eq(&self.scene, &other.scene)
            && self.camera == other.camera
            && self.time == other.time
            && self.size == other.size
            && self.settings == other.settings
    }
}

/// Something to do.
#[derive(Clone, Debug)]
pub(in crate::window) enum Errand {
    /// Make a picture and show it.
    Show(Order),
    /// Make a picture and write it, in the formats of the names' ends.
    Save(Order, Vec<PathBuf>),
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
}

/// What the thread tells.
#[derive(Debug)]
pub(in crate::window) enum Reply {
    /// It has begun something that takes a while, in a few words; none: it is through.
    Stage(Option<String>),
    /// A picture.
    Picture(Box<Shown>),
    /// Files were written.
    Saved(Vec<PathBuf>),
    /// An order or an errand cannot be done; others can.
    Refused(Error),
    /// The device failed; nothing more comes.
    Failed(Error),
}
