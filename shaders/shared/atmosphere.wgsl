// The Earth's clear atmosphere: what it is made of, and the geometry of rays in it. No bindings.
//
// Light is carried at four wavelengths (src/frame/sky/spectrum.rs) and becomes linear sRGB where
// a pass reads it. Distances in m; altitudes are above the ground of a spherical planet. A ray is
// given by its start's altitude and the cosine `mu` of its zenith angle there. Differences of
// squared radii are written with altitudes throughout: at 6360 km an f32 resolves half a metre.
// Twin: src/frame/cpu/sky.rs.
#define_import_path cumuli::atmosphere

// Everything the sky depends on. Host: src/frame/sky/gpu_data.rs.
struct SkyUniforms {
    rayleigh: vec4<f32>,           // 1/m, scattering of air at altitude 0
    aerosol_scattering: vec4<f32>, // 1/m, at altitude 0
    aerosol_extinction: vec4<f32>, // 1/m, at altitude 0
    ozone: vec4<f32>,              // 1/m, absorption in the middle of the layer
    to_red: vec4<f32>,             // from the four wavelengths to linear sRGB; white is sunlight
    to_green: vec4<f32>,
    to_blue: vec4<f32>,
    ground_albedo: vec4<f32>,      // at the four wavelengths
    ground_colour: vec4<f32>,      // rgb: the same albedo; w: 1 where there is a ground under a uniform sky
    sun: vec4<f32>,                // xyz: towards the sun; w: irradiance
    disc: vec4<f32>,               // x: angular radius, rad; y: radiance of the middle per irradiance; z, w: rad, angles from the horizon straight down, and up to where there is air
    camera_altitude: f32,          // m, never below 0
    horizon_dip: f32,              // rad, from the horizontal down to the horizon
    uniform_radiance: f32,         // of a uniform sky
    is_uniform: u32,               // 1: a uniform sky and no air
    // Of a sea, 0 where there is none. x: root mean square slope; y: reflected share of an even sky, z: of this sun's light
    sea: vec4<f32>,
    sea_reflectances: array<vec4<f32>, 8>, // share of the light that it reflects; see sea_place
}

const PLANET_RADIUS: f32 = 6.36e6; // m
const TOP_ALTITUDE: f32 = 1e5;     // m, of the air; 7e-6 of the density at the ground is left there

// Density halves of air: pressure over weight at 15 C, 101325 / (1.225 * 9.80665), so that the
// density at the ground and the whole column are both those of the standard atmosphere.
const RAYLEIGH_HEIGHT: f32 = 8434.5; // m
// Aerosol fills the mixing layer.
const AEROSOL_HEIGHT: f32 = 2000.0;  // m
// Continental clean air at 0.55 um: Hess, Koepke and Schult (1998), OPAC.
const AEROSOL_MEAN_COSINE: f32 = 0.709;
// Ozone lies in a layer whose density falls linearly to 0 on both sides.
const OZONE_ALTITUDE: f32 = 25e3;    // m
const OZONE_HALF_WIDTH: f32 = 15e3;  // m

// Half the width of the sun, rad: over this range it sets for a place in the air.
const SUN_RADIUS: f32 = 0.00465;

const PI: f32 = 3.14159265;

struct Medium {
    rayleigh: vec4<f32>,   // 1/m, scattering
    aerosol: vec4<f32>,    // 1/m, scattering
    extinction: vec4<f32>, // 1/m, of all
}

// Air at an altitude; below the ground as at the ground.
fn medium_at(sky: SkyUniforms, altitude: f32) -> Medium {
    let h = max(altitude, 0.0);
    let air = exp(-h / RAYLEIGH_HEIGHT);
    let dust = exp(-h / AEROSOL_HEIGHT);
    let layer = max(1.0 - abs(h - OZONE_ALTITUDE) / OZONE_HALF_WIDTH, 0.0);
    var medium: Medium;
    medium.rayleigh = sky.rayleigh * air;
    medium.aerosol = sky.aerosol_scattering * dust;
    medium.extinction = medium.rayleigh + sky.aerosol_extinction * dust + sky.ozone * layer;
    return medium;
}

fn rayleigh_phase(cos_theta: f32) -> f32 {
    return 3.0 / (16.0 * PI) * (1.0 + cos_theta * cos_theta);
}

fn aerosol_phase(cos_theta: f32) -> f32 {
    let g = AEROSOL_MEAN_COSINE;
    let base = 1.0 + g * g - 2.0 * g * cos_theta;
    return (1.0 - g * g) / (4.0 * PI * base * sqrt(base));
}

fn to_rgb(sky: SkyUniforms, light: vec4<f32>) -> vec3<f32> {
    return vec3(dot(sky.to_red, light), dot(sky.to_green, light), dot(sky.to_blue, light));
}

// Place in the tables of a sea for the cosine of a zenith angle: even in its square root.
const SEA_HEIGHTS: f32 = 32.0;

fn sea_place(mu: f32) -> f32 {
    return min(sqrt(saturate(mu)) * (SEA_HEIGHTS - 1.0), SEA_HEIGHTS - 1.001);
}

// Squared distance from the horizon, in a straight line: r^2 - R^2.
fn horizon_squared(altitude: f32) -> f32 {
    return altitude * (2.0 * PLANET_RADIUS + altitude);
}

// Altitude of a place whose squared distance from the horizon is `x`.
fn altitude_of(x: f32) -> f32 {
    return x / (PLANET_RADIUS + sqrt(max(PLANET_RADIUS * PLANET_RADIUS + x, 0.0)));
}

// Altitude after a distance along a ray.
fn altitude_along(altitude: f32, mu: f32, distance: f32) -> f32 {
    return altitude_of(horizon_squared(altitude) + distance * (2.0 * (PLANET_RADIUS + altitude) * mu + distance));
}

// Divisor where a length may be 0 only together with what it divides: 0 comes out, as it should.
const LEAST_LENGTH: f32 = 1e-30; // m

// Distance to the ground; -1 where the ray misses it.
fn distance_to_ground(altitude: f32, mu: f32) -> f32 {
    let b = -(PLANET_RADIUS + altitude) * mu; // to the ray's lowest place
    let c = horizon_squared(altitude);
    let tangent = sqrt(c);
    if b < tangent {
        return -1.0;
    }
    return c / max(b + sqrt((b - tangent) * (b + tangent)), LEAST_LENGTH);
}

// A number above every cosine.
const NO_COSINE: f32 = 2.0;

// Where a ray enters (x) and leaves (y) the air; both 0 where it misses it. The ground is not
// looked at.
fn air_span(altitude: f32, mu: f32) -> vec2<f32> {
    let b = (PLANET_RADIUS + altitude) * mu;
    // Top's squared radius less the start's.
    let q = (TOP_ALTITUDE - altitude) * (2.0 * PLANET_RADIUS + TOP_ALTITUDE + altitude);
    // Never on a uniform altitude alone: see `unfolded`.
    if (mu < NO_COSINE) & (q >= 0.0) {
        let s = sqrt(b * b + q);
        return vec2(0.0, select(s - b, q / max(b + s, LEAST_LENGTH), b > 0.0));
    }
    let tangent = sqrt(-q);
    if -b <= tangent {
        return vec2(0.0);
    }
    let s = sqrt((-b - tangent) * (-b + tangent));
    return vec2(-q / (s - b), s - b);
}

// Share of the sun's disc above the horizon of a place.
fn sun_visible(altitude: f32, sun_mu: f32) -> f32 {
    let horizon = -sqrt(horizon_squared(altitude)) / (PLANET_RADIUS + altitude);
    return smoothstep(-SUN_RADIUS, SUN_RADIUS, sun_mu - horizon);
}

// Texture coordinate of x in [0, 1], with 0 and 1 at the middles of the first and last of n texels.
fn texel_centre(x: f32, n: f32) -> f32 {
    return (saturate(x) * (n - 1.0) + 0.5) / n;
}

// Optical depth table: x from the nearest to the farthest way out of the air, y from the ground to
// the top (Bruneton and Neyret 2008). The mapping is smooth at the horizon.
const DEPTH_SIZE: vec2<f32> = vec2(256.0, 64.0);

fn depth_place(altitude: f32, mu: f32) -> vec2<f32> {
    let h = clamp(altitude, 0.0, TOP_ALTITUDE);
    let reach = sqrt(horizon_squared(TOP_ALTITUDE));
    let rho = sqrt(horizon_squared(h));
    let least = TOP_ALTITUDE - h;
    let most = rho + reach;
    return vec2((air_span(h, mu).y - least) / (most - least), rho / reach);
}

// Way through the air below which its direction is straight up: the top of the air itself.
const LEAST_WAY: f32 = 1e-6; // m

// Altitude and mu of a place in the table; the inverse of depth_place.
fn depth_ray(place: vec2<f32>) -> vec2<f32> {
    let reach_squared = horizon_squared(TOP_ALTITUDE);
    let reach = sqrt(reach_squared);
    let rho = place.y * reach;
    let h = altitude_of(rho * rho);
    let least = TOP_ALTITUDE - h;
    let d = mix(least, rho + reach, place.x);
    let mu = (reach_squared - rho * rho - d * d) / (2.0 * (PLANET_RADIUS + h) * max(d, LEAST_WAY));
    return vec2(h, clamp(select(mu, 1.0, d <= 0.0), -1.0, 1.0));
}

// Tables by the sun's height: fine where it sets.
fn sun_place(sun_mu: f32) -> f32 {
    return 0.5 + 0.5 * sign(sun_mu) * sqrt(abs(sun_mu));
}

fn sun_at_place(x: f32) -> f32 {
    let s = 2.0 * x - 1.0;
    return clamp(s * abs(s), -1.0, 1.0);
}

// Tables by altitude: fine near the ground.
fn altitude_place(altitude: f32) -> f32 {
    return sqrt(saturate(altitude / TOP_ALTITUDE));
}

fn altitude_at_place(y: f32) -> f32 {
    return y * y * TOP_ALTITUDE;
}

const MULTIPLE_SIZE: vec2<f32> = vec2(32.0, 32.0); // sun's height, altitude
// Sun's height; irradiance of the sky at the four wavelengths, of the sun in rgb, of the sky in rgb.
const GROUND_SIZE: vec2<f32> = vec2(128.0, 3.0);
const ALTITUDE_SIZE: vec2<f32> = vec2(64.0, 5.0);  // altitude; sun, above, below: air, ground lit by the sun, by the sky
const VIEW_SIZE: vec2<f32> = vec2(64.0, 192.0);    // azimuth, elevation
const AIR_SIZE: vec3<f32> = vec3(32.0, 96.0, 40.0); // azimuth, elevation, distance

// Directions around the camera: x = sin of half the azimuth from the sun, dense around the sun and
// even at both ends; y = elevation in two halves that meet at the horizon without mixing, each
// dense there (Hillaire 2020), up to the angles from the horizon straight down and to where the air ends: seen from
// outside it is a thin rim. Coordinates of a texture with `rows` rows of elevations.
fn direction_place(azimuth_cosine: f32, above_horizon: f32, spans: vec2<f32>, size: vec2<f32>) -> vec2<f32> {
    let x = sqrt(saturate(0.5 - 0.5 * azimuth_cosine));
    let half_rows = 0.5 * size.y;
    let up = above_horizon >= 0.0;
    let most = select(spans.x, spans.y, up);
    let y = sqrt(saturate(abs(above_horizon) / most)) * (half_rows - 1.0);
    let row = select(half_rows - 1.0 - y, half_rows + y, up);
    return vec2(texel_centre(x, size.x), (row + 0.5) / size.y);
}

// Azimuth's cosine and elevation over the horizon of a texel. Rows below `size.y / 2` look below
// the horizon, whatever the sign of their elevation (the horizon itself is in both halves).
fn direction_of(texel: vec2<f32>, spans: vec2<f32>, size: vec2<f32>) -> vec2<f32> {
    let x = texel.x / (size.x - 1.0);
    let half_rows = 0.5 * size.y;
    let up = texel.y >= half_rows;
    let y = select(half_rows - 1.0 - texel.y, texel.y - half_rows, up) / (half_rows - 1.0);
    let most = select(spans.x, spans.y, up);
    return vec2(1.0 - 2.0 * x * x, select(-1.0, 1.0, up) * y * y * most);
}

// Where a ray that points below the horizon meets the ground. The horizon's own ray may miss it by
// rounding: its lowest place then.
fn ground_reach(altitude: f32, mu: f32) -> f32 {
    let reach = distance_to_ground(altitude, mu);
    return select(max(-(PLANET_RADIUS + altitude) * mu, 0.0), reach, reach >= 0.0);
}

// Distances in the air: w in [0, 1] from its beginning to infinity or to the ground. From an eye in the lower air
// w^2 = d / (d + AIR_MIDDLE), over the same of the ground: places are dense at the eye. From above, the air is where the ray
// ends, and so are the places.
const AIR_MIDDLE: f32 = 5e4; // m
const INFINITELY_FAR: f32 = 1e30; // m
// m, altitude up to which air is thick enough that places are spread alike.
const LOWER_AIR: f32 = 1e4;

// A ray of no length, m: any place on it will do, for a camera on the ground has no air below it.
const LEAST_REACH: f32 = 1e-6;
// Least share of the lower air in a ray: every one to the ground has more than 0.09.
const LEAST_SHARE: f32 = 0.05;

// How places are spread over the air of a ray that begins at `before`. x: m, to its end; y: how much denser they are at its
// beginning than if they were even.
fn air_spread(altitude: f32, mu: f32, before: f32, to_ground: bool) -> vec2<f32> {
    // Squared distance from the horizon of the lower air.
    let over = max(altitude - LOWER_AIR, 0.0) * (2.0 * PLANET_RADIUS + LOWER_AIR + altitude);
    let tangent = sqrt(over);
    let lowest = -(PLANET_RADIUS + altitude) * mu;
    // From over it, what reaches the ground has hundreds of kilometres to its lowest place.
    let enters = over / max(lowest + sqrt(max(lowest - tangent, 0.0) * (lowest + tangent)), 1.0);
    let ground = ground_reach(altitude, mu);
    let reach = max(ground - before, 0.0);
    let low = min(ground - enters, reach);
    let share = clamp(low / max(reach, LEAST_REACH), LEAST_SHARE, 1.0);
    // Past the horizon the lower air is as far as it is, or nowhere.
    let start = min(altitude, TOP_ALTITUDE);
    let horizon = sqrt(max(start - LOWER_AIR, 0.0) * (2.0 * PLANET_RADIUS + LOWER_AIR + start));
    let below = vec2(reach, (1.0 + max(low, 0.0) / AIR_MIDDLE) * share);
    return select(vec2(INFINITELY_FAR, 1.0 + INFINITELY_FAR / (AIR_MIDDLE + horizon)), below, to_ground);
}

fn air_place(distance: f32, spread: vec2<f32>) -> f32 {
    let x = clamp(distance / max(spread.x, LEAST_REACH), 0.0, 1.0);
    return sqrt(min(x * spread.y / (1.0 + x * (spread.y - 1.0)), 1.0));
}

fn air_distance(w: f32, spread: vec2<f32>) -> f32 {
    let s = w * w;
    return spread.x * min(s / (s + spread.y * (1.0 - s)), 1.0);
}

// Radiances and irradiances are stored times this: f16 then keeps its digits well into the night
// (its normal numbers begin at 6e-5).
const TABLE_SCALE: f32 = 1024.0;
