// Sky: radiance in all directions from the camera, air and bare ground; without the sun's disc.
//
// Workgroup contract: one invocation owns one texel.
#import cumuli::atmosphere::{TABLE_SCALE, VIEW_SIZE, direction_of, to_rgb}
#import cumuli::sky_march::{AirRay, gather_all, sky}

@group(0) @binding(0) var table: texture_storage_2d<rgba16float, write>;

const STEPS: u32 = 32u;

@compute @workgroup_size(8, 8)
fn sky_view(@builtin(global_invocation_id) id: vec3<u32>) {
    let direction = direction_of(vec2<f32>(id.xy), sky.disc.zw, VIEW_SIZE);
    let elevation = direction.y - sky.horizon_dip;
    var ray: AirRay;
    ray.altitude = sky.camera_altitude;
    ray.mu = sin(elevation);
    ray.sun_mu = clamp(sky.sun.y, -1.0, 1.0);
    ray.cos_sun = ray.mu * ray.sun_mu + cos(elevation) * sqrt(1.0 - ray.sun_mu * ray.sun_mu) * direction.x;
    let below = f32(id.y) < 0.5 * VIEW_SIZE.y;
    let light = to_rgb(sky, gather_all(ray, below, STEPS).radiance);
    textureStore(table, id.xy, vec4(TABLE_SCALE * max(light, vec3(0.0)), 0.0));
}
