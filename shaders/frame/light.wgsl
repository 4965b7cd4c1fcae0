// Light: how much each particle is alone, by the others on the sun's ray through its centre and around
// it, and the light's colour at its altitude. Twin: src/frame/cpu/light.rs.
//
// GRIDLESS is for lightings that do without the light grid (`Lighting` in src/frame/settings.rs).
//
// Only particles in view are lit, each once an epoch: when the camera turns, those that come into
// view are added.
//
// Workgroup contract: one invocation owns one particle in view; it reads its centre's tile list and
// writes its ParticleLight.
#import cumuli::gpu_data::{FrameUniforms, LightView, Particle, ParticleLight}
#import cumuli::light_lists::{OPTICAL_DEPTH_LIMIT, Occlusion, particle_occlusion}
#import cumuli::light_view::light_tile
#ifndef GRIDLESS
#import cumuli::light_field::{crowding, ground_shares}
#import cumuli::lighting::{CROWD_END, aloneness, crowding_depth}
#endif
#import cumuli::sky::{sky_ambient_above, sky_below, sun_irradiance_at}

@group(0) @binding(0) var<uniform> frame: FrameUniforms;
@group(0) @binding(1) var<uniform> view: LightView;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> tile_offsets: array<u32>;
@group(0) @binding(4) var<storage, read> tile_entries: array<u32>;
@group(0) @binding(5) var<storage, read> visible: array<u32>; // [0] particles in view
@group(0) @binding(6) var<storage, read> order: array<u32>;   // particles in view come first
@group(0) @binding(7) var<storage, read_write> lights: array<ParticleLight>;

// Optical depth beyond all: the whole sum is asked for.
const NEVER_CROWDED: f32 = 1e30;

// Optical depth of the others on the sun's ray through a particle's centre, or some of it that is `most` or more: a
// particle behind and before that much is not alone, and what else there is on its ray is not asked for.
fn occlusion_at(point: vec3<f32>, self_index: u32, most: f32) -> Occlusion {
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
        if sum.front + sum.behind >= most || min(sum.front, sum.behind) > OPTICAL_DEPTH_LIMIT {
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
    let altitude = frame.camera_altitude + particle.centre.y;
    lights[index].sun_irradiance = vec4(sun_irradiance_at(altitude), epoch);
#ifdef GRIDLESS
    // Nothing is known of the ground's shadows, and every particle is alone: octaves do not ask.
    let taken = occlusion_at(particle.centre, index, NEVER_CROWDED);
    lights[index].ambient_above = vec4(sky_ambient_above(altitude), taken.front);
    lights[index].ambient_below = vec4(sky_below(altitude, vec2(1.0)), 1.0);
#else
    let mass = particle.optical_radius * particle.radius * particle.radius * 4.18879;
    let place = particle.centre - frame.grid_shift.xyz;
    let crowd = crowding(place, mass, particle.radius);
    // What is crowded is not alone, whatever stands on its ray.
    var taken: Occlusion;
    if crowd < CROWD_END {
        taken = occlusion_at(particle.centre, index, crowding_depth(particle.optical_radius));
    }
    let alone = aloneness(particle.optical_radius, taken.front + taken.behind, crowd);
    lights[index].ambient_above = vec4(sky_ambient_above(altitude), taken.front);
    lights[index].ambient_below = vec4(sky_below(altitude, ground_shares(place)), alone);
#endif
}
