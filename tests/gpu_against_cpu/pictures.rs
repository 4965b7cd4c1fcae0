//! Particles and their lists as seen from the eye and from a light, made on the device.

use cumuli::frame::gpu_data::{FrameUniforms, LightView, Particle};
use cumuli::frame::opaque::OpaqueJob;
use cumuli::frame::picture_lists::{ListPasses, PictureLists, ProjectPass, Projection};
use cumuli::frame::rings::particle_count_buffer;
use cumuli::frame::tile_lists::ListSize;
use cumuli::frame::view::SCREEN_TILE;
use cumuli::gpu::buffers;
use cumuli::scene::Camera;
use glam::DVec3;

use crate::common::{gpu, library, submit};

/// Entries of lists: more than any test here needs.
const ROOM: u32 = 1 << 19;

/// The buffers that all pictures of some particles share.
pub struct Population {
    pub particles: wgpu::Buffer,
    pub count: wgpu::Buffer,
    pub frame: wgpu::Buffer,
    pub visible: wgpu::Buffer,
    capacity: u32,
}

/// A particle with density 1 and the identity as orientation.
pub fn ball(centre: DVec3, radius: f64, extinction: f64) -> Particle {
    Particle {
        centre: centre.as_vec3().to_array(),
        radius: radius as f32,
        orientation: [0.0, 0.0, 0.0, 1.0],
        extinction: extinction as f32,
        shape: 0,
        id: 0,
        optical_radius: (extinction * radius) as f32,
    }
}

/// What the passes here read of a frame: the camera's axes and sizes.
pub fn frame(camera: &Camera, size: [u32; 2]) -> FrameUniforms {
    let basis = camera.basis();
    let half = camera.half_width();
    let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
    FrameUniforms {
        right: four(basis.right * half),
        up: four(basis.up * half * f64::from(size[1]) / f64::from(size[0])),
        forward: four(basis.forward),
        size,
        tiles: size.map(|s| s.div_ceil(SCREEN_TILE)),
        blocks: size,
        stride: 1,
        phase: 1,
        in_place: 1,
        light_epoch: 1,
        ..<FrameUniforms as bytemuck::Zeroable>::zeroed()
    }
}

impl Population {
    pub fn new(frame: &FrameUniforms, particles: &[Particle]) -> Self {
        // Some slots stay unused, as in a frame.
        let capacity = particles.len() as u32 + 70;
        let mut slots = particles.to_vec();
        let unused = ball(DVec3::new(0.0, 0.0, -5.0), 100.0, 1.0);
        slots.resize(capacity as usize, unused);
        let frame = FrameUniforms { particle_capacity: capacity, ..*frame };
        Self {
            particles: buffers::storage_with(gpu(), "particles", &slots),
            count: particle_count_buffer(gpu(), particles.len() as u32),
            frame: buffers::uniform(gpu(), "frame", &frame),
            visible: buffers::storage_with(gpu(), "visible", &[0_u32]),
            capacity,
        }
    }

    fn lists(&self, project: &ProjectPass, tiles: [u32; 2], how: &Projection<'_>) -> PictureLists {
        let passes = ListPasses::new(gpu(), library()).expect("the list passes");
        let size =
            ListSize { tiles, particles: self.capacity, bin_entries: ROOM, tile_entries: ROOM };
        let lists = PictureLists::new(
            gpu(),
            &passes,
            project,
            size,
            &self.frame,
            &self.particles,
            &self.count,
            how,
        );
        submit(|pass| {
            lists.encode_project(pass, project);
            lists.encode_sort(pass, &passes);
            lists.encode_lists(pass, &passes);
        });
        lists
    }

    /// The screen's lists, and the particles in view near to far.
    pub fn screen(&self, frame: &FrameUniforms) -> (PictureLists, Vec<u32>) {
        self.screen_before(frame, &OpaqueJob::none(gpu()))
    }

    /// The same before something opaque.
    pub fn screen_before(
        &self,
        frame: &FrameUniforms,
        opaque: &OpaqueJob,
    ) -> (PictureLists, Vec<u32>) {
        let project = ProjectPass::screen(gpu(), library(), SCREEN_TILE).expect("the projection");
        let how = Projection::Screen { visible: &self.visible, opaque };
        let lists = self.lists(&project, frame.tiles, &how);
        let visible = gpu().read_buffer::<u32>(&self.visible, 1).expect("a count")[0];
        let order = gpu().read_buffer(lists.order(), visible as usize).expect("the order");
        (lists, order)
    }

    /// A light's lists, its uniforms, and all particles from the light on.
    pub fn light(&self, view: &LightView) -> (PictureLists, wgpu::Buffer, Vec<u32>) {
        let project = ProjectPass::light(gpu(), library()).expect("the projection");
        let uniforms = buffers::uniform(gpu(), "light view", view);
        let how = Projection::Light { view: &uniforms };
        let lists = self.lists(&project, view.tiles, &how);
        let count = gpu().read_buffer::<u32>(&self.count, 1).expect("a count")[0];
        let order = gpu().read_buffer(lists.order(), count as usize).expect("the order");
        (lists, uniforms, order)
    }
}

/// The lists of all tiles, row by row.
pub fn read_lists(lists: &PictureLists) -> Vec<Vec<u32>> {
    let lists = &lists.lists;
    let [across, up] = lists.size().tiles;
    let offsets: Vec<u32> =
        gpu().read_buffer(&lists.tile_offsets, (across * up + 1) as usize).expect("offsets");
    let total = offsets[offsets.len() - 1];
    assert!(total <= ROOM, "{total} entries: the test needs more room");
    let entries: Vec<u32> =
        gpu().read_buffer(&lists.tile_entries, total as usize).expect("entries");
    offsets.windows(2).map(|w| entries[w[0] as usize..w[1] as usize].to_vec()).collect()
}
