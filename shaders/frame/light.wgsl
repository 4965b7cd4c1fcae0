// Light: optical depth of the others on both sides of several points in each particle along the
// lines of the sun, fitted as an affine function of the place, and the light's colour at the
// particle's altitude. Twin: src/frame/cpu/light.rs.
//
// Only particles in view are lit, each once an epoch: when the camera turns, those that come into
// view are added.
//
// Workgroup contract: one invocation owns one particle in view; it reads its sample points' tile lists and
// writes its ParticleLight.
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle, ParticleLight}
#import cumuli::light_lists::{OPTICAL_DEPTH_LIMIT, Occlusion, particle_occlusion}
#import cumuli::light_view::light_tile
#import cumuli::light_field::crowding
#import cumuli::lighting::aloneness
#import cumuli::sky::{sky_ambient_above, sky_ambient_below, sun_irradiance_at}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> view: LightView;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(4) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(5) var<storage, read> visible: array<u32>; // [0] particles in view
@group(0) @binding(6) var<storage, read> order: array<u32>;   // particles in view come first
@group(0) @binding(7) var<storage, read_write> lights: array<ParticleLight>;

// Distance of the sample points from the centre, in radii: sqrt(3/5), so that they have the second
// moments of a uniform ball and the affine fit is the least-squares one.
const SAMPLE_DISTANCE: f32 = 0.77459667;

// Sample directions: 1 the centre, 2 along the light, 4 a tetrahedron, 8 a cube.
fn sample_direction(index: u32, samples: u32, towards: vec3<f32>) -> vec3<f32> {
    let signs = vec3(
        select(-1.0, 1.0, (index & 1u) != 0u),
        select(-1.0, 1.0, (index & 2u) != 0u),
        select(-1.0, 1.0, (index & 4u) != 0u),
    );
    switch samples {
        case 1u: { return vec3(0.0); }
        case 2u: { return signs.x * towards; }
        case 4u: { return vec3(signs.x, signs.y, signs.x * signs.y) * 0.57735027; }
        default: { return signs * 0.57735027; }
    }
}

fn occlusion_at(point: vec3<f32>, self_index: u32) -> Occlusion {
    var sum: Occlusion;
    let tile = light_tile(view, point);
    if tile >= view.tiles.x * view.tiles.y {
        return sum;
    }
    let end = min(tile_offsets[tile + 1u], arrayLength(&tile_entries));
    for (var i = tile_offsets[tile]; i < end; i++) {
        let other = tile_entries[i];
        if other == self_index {
            continue;
        }
        let taken = particle_occlusion(particles[other], view.towards.xyz, point);
        sum.front += taken.front;
        sum.behind += taken.behind;
        if min(sum.front, sum.behind) > OPTICAL_DEPTH_LIMIT {
            break;
        }
    }
    return sum;
}

@compute @workgroup_size(64)
fn light(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= min(visible[0], arrayLength(&order)) {
        return;
    }
    let index = order[id.x];
    // Small integers are exact as floats.
    let epoch = f32(frame.light_epoch);
    if lights[index].sun_irradiance.w == epoch {
        return;
    }
    let particle = particles[index];
    let samples = view.receiver_samples;
    var front = vec4(0.0);
    var behind = vec4(0.0);
    for (var s = 0u; s < samples; s++) {
        let direction = sample_direction(s, samples, view.towards.xyz);
        let point = particle.centre + direction * SAMPLE_DISTANCE * particle.radius;
        let taken = occlusion_at(point, index);
        front += taken.front * vec4(1.0, direction);
        behind += taken.behind * vec4(1.0, direction);
    }
    // Slope of the least-squares fit: the directions' second moment is 1/3 (2 samples: 1 along the
    // light, 0 across), their distance SAMPLE_DISTANCE.
    let slope = select(3.0, 1.0, samples == 2u) / SAMPLE_DISTANCE;
    let scale = vec4(1.0, vec3(slope)) / f32(samples);
    let altitude = frame.camera_altitude + particle.centre.y;
    lights[index].sun_front = front * scale;
    lights[index].sun_behind = behind * scale;
    lights[index].sun_irradiance = vec4(sun_irradiance_at(altitude), epoch);
    lights[index].ambient_above = vec4(sky_ambient_above(altitude), front.x * scale.x);
    let mass = particle.optical_radius * particle.radius * particle.radius * 4.18879;
    let crowd = crowding(particle.centre - frame.grid_shift.xyz, mass, particle.radius);
    let others = (front.x + behind.x) * scale.x;
    let alone = aloneness(particle.optical_radius, others, crowd);
    lights[index].ambient_below = vec4(sky_ambient_below(altitude), alone);
}
