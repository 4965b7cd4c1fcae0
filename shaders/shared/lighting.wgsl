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

// Sunlight of order 1 fades along a chord with the depth to the sun, which counts as linear between
// the chord's ends: exp(-depth).
struct Source {
    rest: vec3<f32>,       // all but order 1
    first: vec3<f32>,      // order 1 where the sun is not dimmed
    begin_depth: f32,      // scaled optical depth to the sun where the chord becomes visible
    end_depth: f32,        // and where it ends
}

struct SourceInputs {
    place: vec3<f32>,      // in radii from the centre, where light is scattered in the mean
    begin: vec3<f32>,      // in radii from the centre, where the chord becomes visible
    end: vec3<f32>,        // and where it ends
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

// Scaled optical depth to the sun from a place in a particle: the others' and its own.
fn depth_to_sun(light: ParticleLight, in: SourceInputs, place: vec3<f32>) -> f32 {
    return depth_at(light.sun_front, place) + in.optical_radius * way_out(place, in.sun);
}

// Mean of exp(-depth) over the light that leaves a piece of optical depth `tau`, where the depth goes
// from `front` by `change`, linear along the piece. Written so that nothing overflows: the depth at
// the far end, front + change, is not negative.
fn mean_sunlight(front: f32, change: f32, tau: f32) -> f32 {
    let both = tau + change;
    let peak = exp(-max(select(front, front + both, both < 0.0), 0.0));
    return peak * mean_transmittance(abs(both)) / mean_transmittance(tau);
}

fn source_function(light: ParticleLight, in: SourceInputs) -> Source {
    var source: Source;
    source.begin_depth = depth_to_sun(light, in, in.begin);
    source.end_depth = depth_to_sun(light, in, in.end);
    let path = in.halo_share * (depth_to_sun(light, in, in.place) + in.view_depth);
    let first = in.albedo / in.delta_scale * in.phase * halo_factor(in.halo_row, path);
    var sun = in.field.x;
    if in.alone > 0.0 {
        // The table is that of the unscaled medium: opacity of the chord there over that here.
        let visible = in.visible_depth;
        let denser = mean_transmittance(visible / in.delta_scale) / (mean_transmittance(visible) * in.delta_scale);
        let own = (in.scattered.x * in.phase + in.scattered.y) * denser;
        sun = mix(sun, own * exp(-depth_at(light.sun_front, in.place)), in.alone);
    }
    source.first = (1.0 - in.alone) * first * light.sun_irradiance.rgb;
    source.rest = sun * light.sun_irradiance.rgb
        + in.field.y * light.ambient_above.rgb
        + (in.field.z - in.field.y) * light.ambient_below.rgb;
    return source;
}
