// What crosses from the host to the shaders. The Rust structs of the same names are in
// src/frame/gpu_data.rs; a test compares every size and offset.
//
// Spaces: positions are relative to the camera (metres, world axes, +Y up); directions are unit
// vectors in world axes; `sun` points towards the sun.
#define_import_path cumuli::gpu_data

// One spherical particle of the cloud.
struct Particle {
    centre: vec3<f32>,       // m, relative to the camera
    radius: f32,             // m
    orientation: vec4<f32>,  // unit quaternion that turns world axes into the particle's own
    extinction: f32,         // 1/m at density 1, faded at the border of its ring
    shape: u32,              // index in the tables; 0 is uniform
    id: u32,                 // a hash that stays with the particle
    optical_radius: f32,     // extinction * radius * mean density of the shape
}

// Light that reaches one particle.
struct ParticleLight {
    sun_irradiance: vec4<f32>, // rgb, perpendicular to the beam, after the air; w: epoch
    ambient_above: vec4<f32>,  // rgb, mean radiance of the sky over the particle; w: optical depth of the others from its centre to the sun, where it is alone at all
    ambient_below: vec4<f32>,  // rgb, mean radiance of what lies below; w: how much it is alone
}

// Constant for a frame.
struct FrameUniforms {
    right: vec4<f32>,    // xyz: image x axis, scaled by tan(fov_x / 2)
    up: vec4<f32>,       // xyz: image y axis (upwards), scaled by tan(fov_y / 2)
    forward: vec4<f32>,  // xyz: view axis
    sun: vec4<f32>,      // xyz: towards the sun
    size: vec2<u32>,     // pixels
    tiles: vec2<u32>,    // screen tiles
    camera_altitude: f32,     // m
    albedo: f32,              // single-scattering albedo of the medium
    delta_scale: f32,         // extinction of the particles here over the true one: 1 - albedo * peak
    transmittance_stop: f32,  // a pixel is finished below this transmittance
    exposure: f32,            // factor on radiance before the tone curve
    has_air: u32,             // 1: atmosphere between things; 0: vacuum
    has_ground: u32,          // 1: there is a ground
    particle_capacity: u32,   // slots in the particle buffers
    has_clouds: u32,          // 1: the blend has run
    light_epoch: u32,          // changes whenever the light of any particle does; below 2^24
    halo_share: f32,           // optical depth of forward-peak scatterings over the scaled one
    has_shadows: u32,          // 1: there are shadow maps
    grid_shift: vec4<f32>,     // xyz: m, anchor of the light grid relative to the camera
    blocks: vec2<u32>,         // of pixels
    stride: u32,               // sides of a block, pixels: 1 or 2
    phase: u32,                // which pixel of its block the blend shades; all where there is no such pixel
    in_place: u32,             // 1: the blend writes to the pixels, 0: to the blocks, layers of them beside each other
    has_air_shadow: u32,       // 1: it is known what sunlight clouds take from the air
    mean_cosine: f32,          // of the phase function without the peak that delta_scale takes out
    ray_block: u32,            // sides of the blocks of pixels whose corners have rays: what clouds change of the air, what a sea reflects
}

// Place of a pixel in its block: no two in a row are neighbours in a row.
fn block_pixel(phase: u32) -> vec2<u32> {
    return vec2((phase ^ (phase >> 1u)) & 1u, phase & 1u);
}

// The phase of a place in a block of 2x2 pixels: the inverse.
fn phase_of_pixel(place: vec2<u32>) -> u32 {
    return place.y | ((place.x ^ place.y) << 1u);
}

// A set of parallel lines seen as a picture: from the sun.
struct LightView {
    axis_u: vec4<f32>,     // xyz: picture x axis, world
    axis_v: vec4<f32>,     // xyz: picture y axis, world
    towards: vec4<f32>,    // xyz: towards the light
    origin: vec2<f32>,     // m, warped picture coordinates of the corner of tile (0, 0)
    tile_size: f32,        // m
    inverse_tile_size: f32,
    tiles: vec2<u32>,
    warp: f32,             // m, distance from the camera from which on tiles grow with it; 0: never
    padding_a: u32,
}

// One ring of cells around the camera.
struct Ring {
    first_cell: vec2<i32>,    // cell coordinates of the ring's corner, x and z
    corner: vec2<f32>,        // m, the same corner relative to the camera
    cell_size: f32,           // m
    layer_height: f32,        // m
    fade_in: vec2<f32>,       // m, horizontal distance where this ring begins and is fully there
    fade_out: vec2<f32>,      // m, where it begins to fade and has gone
    layers: u32,
    first_column: u32,        // index of its first column of cells among all rings'
    map_first: vec2<i32>,     // weather map: texel of the corner of the first cell
    map_first_share: vec2<u32>, // 2^-32 texels more
    map_step: vec2<i32>,      // texels from cell to cell
    map_step_share: vec2<u32>, // 2^-32 texels more
}

// A weather map.
struct MapUniforms {
    size: vec2<u32>,   // pixels
    texels: vec2<f32>, // in an innermost cell
    coverage: f32,     // where it is white
    noise: f32,        // share of the coverage noise
    outside: u32,      // beyond its edges: 0 again, 1 its outermost pixels, 2 clear
    padding_a: u32,
}

// The cloud field, constant for a frame.
struct CloudUniforms {
    seed: u32,
    rings: u32,
    cells: u32,                 // per side of a ring
    columns: u32,               // cells of all rings
    base: f32,                  // m, altitude of the cloud base relative to the camera
    thickness: f32,             // m, of the tallest clouds
    threshold: f32,             // value of the coverage noise above which there is cloud
    inverse_range: f32,         // 1 / (99.9th percentile of the noise - threshold)
    extinction: f32,            // 1/m
    particle_size: f32,         // radius in cells
    octaves: u32,               // of the coverage noise
    largest_shift: u32,         // log2 of its largest wavelength in innermost cells
    shapes: u32,                // number of entries in use of shape_list
    capacity: u32,              // slots for particles
    first_slot: u32,            // slots before it hold the scene's own particles
    padding_a: u32,
    map: MapUniforms,           // where there is a map
    evolution_cell: array<vec4<i32>, 8>, // per octave: x lattice cell in time
    evolution: array<vec4<f32>, 8>,      // per octave: x fraction of that cell
    shape_list: array<vec4<u32>, 8>,     // x: shape index in the tables, y: bits of its mean density
    ring: array<Ring, 8>,
}

// How many particles there are, listed ones and those of the rings.
struct ParticleCount {
    particles: u32,
    wanted: u32, // before the capacity cut them
}
