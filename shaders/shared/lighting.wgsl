// The source function of a particle: radiance towards the eye per unit of its opacity.
// Twin: src/frame/cpu/lighting.rs.
//
// The medium is delta-M scaled (src/medium/truncation.rs): light that is scattered within the
// forward peak counts as not scattered, all extinctions here are smaller by that.
// - Order 1 is exact: the whole phase function over the scaled medium (TMS, Nakajima and Tanaka
//   1988), and near the sun the halo of repeated peak scatterings (src/medium/halo.rs).
// - Higher orders, sky and ground light are those of the light grid (light_field.wgsl).
// - A particle alone is smaller than what the grid resolves: its own scattering table takes the
//   place of both, the more so the less other matter is on the sun's ray through it.
// In uniform light J from all sides (albedo 1) the source is J whatever the particles are.
#define_import_path cumuli::lighting

#import cumuli::gpu_data::ParticleLight
#import cumuli::light_field::halo_factor
#import cumuli::numerics::{mean_transmittance}

// Share of a particle in the matter on the sun's ray through its middle from which on its own table
// counts, and from which on it counts alone.
const ALONE_BEGIN: f32 = 0.5;
const ALONE_END: f32 = 0.95;
// Matter around it over its own, up to which it is alone and from which on it is not. The grid holds
// a particle alone with 0.6 to 1.4 times its own extinction.
const CROWD_BEGIN: f32 = 1.5;
const CROWD_END: f32 = 2.5;

// Affine optical depth at a place in the particle (in radii from its centre); never negative.
fn depth_at(affine: vec4<f32>, place: vec3<f32>) -> f32 {
    return max(affine.x + dot(affine.yzw, place), 0.0);
}

// Distance, in radii, from a place in the unit sphere to its surface along a direction.
fn way_out(place: vec3<f32>, direction: vec3<f32>) -> f32 {
    let along = dot(place, direction);
    return max(sqrt(max(along * along + 1.0 - dot(place, place), 0.0)) - along, 0.0);
}

// How much of a particle's sunlight its own table tells: 0 among others, 1 alone. `others`: optical
// depth of the others on the sun's ray through its middle; `crowd`: matter around it over its own.
fn aloneness(optical_radius: f32, others: f32, crowd: f32) -> f32 {
    let own = 4.0 / 3.0 * optical_radius; // along a mean chord
    let share = smoothstep(ALONE_BEGIN, ALONE_END, own / max(own + others, 1e-20));
    return share * (1.0 - smoothstep(CROWD_BEGIN, CROWD_END, crowd));
}

struct SourceInputs {
    place: vec3<f32>,      // in radii from the centre, where the light is scattered
    sun: vec3<f32>,        // towards the sun
    field: vec3<f32>,      // light grid there: per sun irradiance, per radiance above, all around
    alone: f32,            // of `aloneness`
    scattered: vec2<f32>,  // of the particle's table: order 1 without phase function, orders >= 2
    phase: f32,            // phase function, sun to eye
    halo_row: f32,         // angle from the sun, for halo_factor
    optical_radius: f32,   // scaled, of the particle
    visible_depth: f32,    // scaled, of the chord's visible part
    view_depth: f32,       // scaled, from the eye to the chord
    delta_scale: f32,
    halo_share: f32,
    albedo: f32,
}

fn source_function(light: ParticleLight, in: SourceInputs) -> vec3<f32> {
    let front = depth_at(light.sun_front, in.place);
    let sun_depth = front + in.optical_radius * way_out(in.place, in.sun);
    let halo = halo_factor(in.halo_row, in.halo_share * (sun_depth + in.view_depth));
    var sun = in.albedo / in.delta_scale * in.phase * halo * exp(-sun_depth) + in.field.x;
    if in.alone > 0.0 {
        // The table is that of the unscaled medium: opacity of the chord there over that here.
        let visible = in.visible_depth;
        let denser = mean_transmittance(visible / in.delta_scale) / (mean_transmittance(visible) * in.delta_scale);
        let own = (in.scattered.x * in.phase + in.scattered.y) * denser;
        sun = mix(sun, own * exp(-front), in.alone);
    }
    return sun * light.sun_irradiance.rgb
        + in.field.y * light.ambient_above.rgb
        + (in.field.z - in.field.y) * light.ambient_below.rgb;
}
