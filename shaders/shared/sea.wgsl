// The surface of the sea: waves as facets with Gaussian slopes, each a mirror by Fresnel's equations. No bindings. What it
// stands on is told in its twin, src/medium/sea.rs. `mu`: cosine of a direction's zenith angle; `slope`: root mean
// square slope.
#define_import_path cumuli::sea

#import cumuli::atmosphere::{PI, PLANET_RADIUS}

// Refractive index of sea water at 0.55 um.
const WATER_INDEX: f32 = 1.34;
// Least sine of a zenith angle: straight up a direction sees all slopes.
const LEAST_SINE: f32 = 1e-6;
// Least cosine of a facet's zenith angle: the density of steeper ones is 0 in f32 at any wind.
const LEAST_FACET: f32 = 0.05;
// Least product of cosines: below it light runs along the surface and none of it is reflected.
const LEAST_AREA: f32 = 1e-12;

// The complementary error function of a number that is not negative, within 1.5e-7: Abramowitz and Stegun, 7.1.26.
fn erfc(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.3275911 * x);
    let sum = -1.453152027 + t * 1.061405429;
    return t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * sum))) * exp(-x * x);
}

// Reflected share of unpolarised light by the cosine of its angle to a facet's normal: Fresnel's equations.
fn fresnel(cosine: f32) -> f32 {
    let c = saturate(cosine);
    let g = sqrt(WATER_INDEX * WATER_INDEX - 1.0 + c * c);
    let across = (g - c) / (g + c);
    let along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * across * across * (1.0 + along * along);
}

// What a direction sees of a level square metre's facets, hidden ones left out, m2: the cosine over the share that is seen.
fn seen_area(mu: f32, slope: f32) -> f32 {
    let rough = sqrt(max(1.0 - mu * mu, LEAST_SINE * LEAST_SINE)) * slope;
    let a = mu / rough;
    return mu * (1.0 - 0.5 * erfc(a)) + rough * exp(-a * a) * (0.5 / sqrt(PI));
}

// Radiance towards an eye of light from a direction that gives unit irradiance on a level surface, 1/sr: what is reflected.
fn glitter(normal: vec3<f32>, view: vec3<f32>, light: vec3<f32>, slope: f32) -> f32 {
    let mu_view = dot(normal, view);
    let mu_light = dot(normal, light);
    let between = view + light;
    let facet = between / max(length(between), LEAST_SINE);
    let up = dot(normal, facet);
    if (mu_view <= 0.0) | (mu_light <= 0.0) | (up < LEAST_FACET) {
        return 0.0;
    }
    let square = slope * slope;
    let density = exp(-(1.0 / (up * up) - 1.0) / square) / (PI * square * up * up * up * up);
    let both = mu_light * seen_area(mu_view, slope) + mu_view * seen_area(mu_light, slope) - mu_view * mu_light;
    return 0.25 * density * fresnel(dot(view, facet)) / max(both, LEAST_AREA);
}

// Direction in which a facet sends the view of an eye at this height, in the plane of the view, across it, and up.
// `facet`: its slope towards the viewer and across.
fn mirrored(mu: f32, facet: vec2<f32>) -> vec3<f32> {
    let view = vec3(sqrt(max(1.0 - mu * mu, 0.0)), 0.0, mu);
    let normal = normalize(vec3(facet, 1.0));
    return 2.0 * max(dot(view, normal), 0.0) * normal - view;
}

// Upwards at a point of the surface, relative to an eye at this altitude, m.
fn surface_normal(point: vec3<f32>, altitude: f32) -> vec3<f32> {
    return normalize(vec3(point.x, PLANET_RADIUS + (altitude + point.y), point.z));
}
