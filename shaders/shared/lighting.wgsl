// The source function of a particle: radiance towards the eye per unit of its opacity.
// Twin: src/frame/cpu/lighting.rs.
//
// A particle alone is lit exactly by its scattering table. The particles around it change that in
// three ways, all taken from theory without free constants:
// - sunlight is attenuated on its way by exp(-tau); what is scattered forwards on that way still
//   arrives from near the sun. By delta scaling (Joseph, Wiscombe and Weinman 1976) the two
//   together decay as exp(-(1 - g) tau).
// - light that the others scatter diffusely comes from all sides: mean intensity by the Eddington
//   approximation in a layer across the beam as thick as the others are along it.
// - light of sky and ground spreads through the layer of the others above and below: the same
//   approximation with diffuse light on both faces.
// A sphere in uniform light J adds J times its opacity whatever it is made of (albedo 1), so the
// diffuse parts enter the source function as they are.
#define_import_path cumuli::lighting

#import cumuli::gpu_data::ParticleLight
#import cumuli::numerics::opacity

const PI: f32 = 3.14159265;

// Affine optical depth at a place in the particle (in radii from its centre); never negative.
fn depth_at(affine: vec4<f32>, place: vec3<f32>) -> f32 {
    return max(affine.x + dot(affine.yzw, place), 0.0);
}

// Diffuse mean intensity in a conservative, isotropically scattering layer at optical depth
// `front` of `total`, lit perpendicularly by irradiance 1 (Eddington approximation with Marshak's
// boundary conditions, solved in closed form).
fn slab_diffuse(front: f32, total: f32) -> f32 {
    let passed = opacity(front);
    let net_flux = (4.0 + opacity(total)) / (4.0 + 3.0 * total);
    let j = 2.0 * (1.0 - net_flux) + 3.0 * (passed - net_flux * front);
    return max(j, 0.0) / (4.0 * PI);
}

// Mean intensity in a conservative layer between radiance `above` and `below`, at optical depth
// `front` from above and `behind` from below (Eddington approximation).
fn slab_between(above: vec3<f32>, below: vec3<f32>, front: f32, behind: f32) -> vec3<f32> {
    let share = (front + 2.0 / 3.0) / (front + behind + 4.0 / 3.0);
    return mix(above, below, share);
}

// Escape probability of light from within a sphere, Wigner's rational approximation.
fn escape_probability(optical_radius: f32) -> f32 {
    return 1.0 / (1.0 + 4.0 / 3.0 * optical_radius);
}

// Share of diffuse light that a sphere gives back; 1 at albedo 1.
fn diffuse_response(albedo: f32, optical_radius: f32) -> f32 {
    let escape = escape_probability(optical_radius);
    // Absorbed plus escaping: written so that nothing cancels however little escapes.
    return albedo * escape / (1.0 - albedo + albedo * escape);
}

struct SourceInputs {
    place: vec3<f32>,          // in radii from the centre, where the light is scattered
    scattered: vec2<f32>,      // of the particle alone: order 1 without phase function, orders >= 2
    phase: f32,                // phase function, sun to eye
    phase_twice: f32,          // the same after one more forward scattering
    optical_radius: f32,
    albedo: f32,
    mean_cosine: f32,
}

fn source_function(light: ParticleLight, in: SourceInputs) -> vec3<f32> {
    let diffusing = 1.0 - in.mean_cosine;
    let front = depth_at(light.sun_front, in.place);
    let behind = depth_at(light.sun_behind, in.place);
    let direct = exp(-front);
    let scaled = exp(-diffusing * front);
    let response = diffuse_response(in.albedo, in.optical_radius);
    let sun = in.scattered.x * (in.phase * direct + in.phase_twice * max(scaled - direct, 0.0))
        + in.scattered.y * scaled
        + response * slab_diffuse(diffusing * front, diffusing * (front + behind));
    // The particle's own matter above and below the place belongs to the layer here.
    let up = diffusing * (depth_at(light.zenith_front, in.place) + in.optical_radius * (1.0 - in.place.y));
    let down = diffusing * (depth_at(light.zenith_behind, in.place) + in.optical_radius * (1.0 + in.place.y));
    let ambient = slab_between(light.ambient_above.rgb, light.ambient_below.rgb, up, down);
    return sun * light.sun_irradiance.rgb + response * ambient;
}
