// Asks the sky's shader functions for values, for the tests.
#import cumuli::sky::{air_between, ground_distance, ground_radiance, sky_ambient_above, sky_ambient_below, sky_radiance, sun_disc_radiance, sun_irradiance_at}

@group(0) @binding(0) var<storage, read> queries: array<Query>;
@group(0) @binding(1) var<storage, read_write> answers: array<Answer>;

struct Query {
    dir: vec3<f32>,
    distance: f32,
    altitude: f32,
    visibility: f32,
    by_clouds: f32,
    sky_share: f32,
}

struct Answer {
    sky: vec3<f32>,
    to_ground: f32,
    disc: vec4<f32>,
    inscatter: vec4<f32>,
    transmittance: vec4<f32>,
    sun: vec4<f32>,
    above: vec4<f32>,
    below: vec4<f32>,
    ground: vec4<f32>,
}

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&queries) {
        return;
    }
    let query = queries[id.x];
    let air = air_between(query.dir, query.distance);
    var answer: Answer;
    answer.sky = sky_radiance(query.dir);
    answer.to_ground = ground_distance(query.dir);
    answer.disc = vec4(sun_disc_radiance(query.dir), 0.0);
    answer.inscatter = vec4(air.inscatter, 0.0);
    answer.transmittance = vec4(air.transmittance, 0.0);
    answer.sun = vec4(sun_irradiance_at(query.altitude), 0.0);
    answer.above = vec4(sky_ambient_above(query.altitude), 0.0);
    answer.below = vec4(sky_ambient_below(query.altitude), 0.0);
    answer.ground = vec4(ground_radiance(query.dir, query.distance, vec3(query.visibility, query.by_clouds, query.sky_share)), 0.0);
    answers[id.x] = answer;
}
