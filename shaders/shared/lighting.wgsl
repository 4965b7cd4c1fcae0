// Light of a piece of a ray: radiance towards the eye per unit of the piece's opacity.
// Twin: src/frame/cpu/lighting.rs.
//
// The medium is delta-M scaled (src/medium/truncation.rs): light that is scattered within the
// forward peak counts as not scattered, all extinctions here are smaller by that.
// - Order 1: the whole phase function over the scaled medium (TMS, Nakajima and Tanaka 1988), and
//   near the sun the halo of repeated peak scatterings (src/medium/halo.rs). The depth to the sun is that of
//   the deep shadow maps (sun_depth.wgsl).
// - Higher orders, sky and ground light are the light grid's (light_field.wgsl).
// - A particle alone is smaller than what the grid resolves: its own scattering table takes the
//   place of sunlight in all orders, the more so the less other matter there is around it.
// In uniform light J from all sides (albedo 1) the source is J whatever the particles are.
#define_import_path cumuli::lighting

#import cumuli::numerics::mean_transmittance

// Share of a particle in the matter on the sun's ray through its middle from which on its own table
// counts, and from which on it counts alone.
const ALONE_BEGIN: f32 = 0.5;
const ALONE_END: f32 = 0.95;
// Matter around it over its own, up to which it is alone and from which on it is not. The grid holds
// a particle alone with 0.6 to 1.4 times its own extinction.
const CROWD_BEGIN: f32 = 1.5;
const CROWD_END: f32 = 2.5;

// Optical depth below which there is no matter at all: a share of nothing counts as none, and what
// has no optical depth sends no light.
const LEAST_DEPTH: f32 = 1e-20;

// Along a mean chord.
fn mean_depth(optical_radius: f32) -> f32 {
    return 4.0 / 3.0 * optical_radius;
}

// Optical depth of others on the sun's ray through a particle's middle from which on it is not alone.
fn crowding_depth(optical_radius: f32) -> f32 {
    return mean_depth(optical_radius) * (1.0 / ALONE_BEGIN - 1.0);
}

// How much of a particle's sunlight its own table tells: 0 among others, 1 alone. `others`: optical
// depth of the others on the sun's ray through its middle; `crowd`: matter around it over its own.
fn aloneness(optical_radius: f32, others: f32, crowd: f32) -> f32 {
    let own = mean_depth(optical_radius);
    let share = smoothstep(ALONE_BEGIN, ALONE_END, own / max(own + others, LEAST_DEPTH));
    return share * (1.0 - smoothstep(CROWD_BEGIN, CROWD_END, crowd));
}

// Opacity of a piece, seen through its particle, over the same in the scaled medium. A particle's
// table is that of the unscaled medium, where its source counts per opacity. `before`, `tau`: scaled
// optical depth from the last gap to the piece, and of it.
fn own_share(before: f32, tau: f32, delta_scale: f32) -> f32 {
    let denser = 1.0 / delta_scale;
    return denser * exp(before * (1.0 - denser)) * mean_transmittance(tau * denser) / mean_transmittance(tau);
}

// Mean of exp(-depth) over the light that leaves a piece of optical depth `tau`, where the depth goes
// from `front` to `back`, linear along the piece. Written so that nothing overflows.
fn mean_sunlight(front: f32, back: f32, tau: f32) -> f32 {
    let both = tau + back - front;
    let peak = exp(-select(front, back + tau, both < 0.0));
    return peak * mean_transmittance(abs(both)) / mean_transmittance(tau);
}
