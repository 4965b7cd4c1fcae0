//! A finished frame on the host, and what it took.

use serde::{Deserialize, Serialize};

/// A finished frame, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Linear Rec. 709 radiance (red, green, blue) in the unit of the sun's irradiance per
    /// steradian; the fourth number is the opacity of the clouds, 1 - transmittance.
    pub radiance: Vec<[f32; 4]>,
    /// Exposed and tone mapped: sRGB, and an alpha that is not used.
    pub pixels: Vec<[u8; 4]>,
    /// What the frame took.
    pub stats: FrameStats,
}

impl Picture {
    /// Pixels of a picture of this size.
    pub fn pixel_count(size: [u32; 2]) -> usize {
        size[0] as usize * size[1] as usize
    }
}

/// What one frame took, and why.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameStats {
    /// The passes in the order they run.
    pub passes: Vec<PassTime>,
    /// How much there was to do.
    pub counters: Counters,
    /// A further frame of the same scene and time would differ: something is spread over several.
    pub unfinished: bool,
}

/// One pass of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    /// Name of the pass, the stem of its file.
    pub name: String,
    /// Time, ms; none where the pass did not run or was not timed.
    pub milliseconds: Option<f64>,
    /// Whether it ran in this frame.
    pub ran: bool,
    /// Why it ran, or why it did not have to.
    pub reason: String,
}

/// How much there was to do in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Particles that exist: listed, or generated with a size above 0.
    pub particles_generated: u64,
    /// Particles that touch the picture.
    pub particles_visible: u64,
    /// Entries in the lists of tiles seen from the sun.
    pub light_list_entries: u64,
    /// Entries in the lists of tiles on screen.
    pub screen_list_entries: u64,
    /// 4D table look-ups of the blend.
    pub table_lookups: u64,
    /// Pixels in tiles that a particle touches.
    pub pixels_shaded: u64,
    /// Tiles on screen.
    pub tiles: u64,
    /// Tiles on screen without a particle.
    pub tiles_empty: u64,
    /// Memory on the device, bytes.
    pub bytes_resident: u64,
    /// Steps of the light grid's next solution that are made; 0 where the one shown is that of this
    /// frame.
    #[serde(default)]
    pub grid_steps_made: u64,
    /// All of its steps; 0 as above.
    #[serde(default)]
    pub grid_steps: u64,
    /// How often the frame was made until all lists had room: 1, but for frames whose lists outgrow
    /// those of all frames before.
    pub attempts: u64,
    /// Particles and list entries that found no room and were left out; anything but 0 is a defect of the
    /// picture.
    pub overflowed: u64,
    /// Rays of pixels and of shadow maps and sums of the light grid that the device left before their end, and lists
    /// longer than it walks: Mesa's software driver ends all loops of an invocation after 65535 turns. Anything but 0 is a
    /// defect of the picture.
    #[serde(default)]
    pub cut: u64,
}
