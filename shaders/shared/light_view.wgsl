// Where a point is in the picture that a light has of the clouds. Host: src/frame/view.rs; twin:
// src/frame/cpu/light_project.rs.
#define_import_path cumuli::light_view

#import cumuli::gpu_data::LightView

// m, beyond every place.
const OUTSIDE: f32 = 1e30;

// Picture coordinates relative to the camera, warped so that tiles grow with the distance.
fn warped(view: LightView, place: vec2<f32>) -> vec2<f32> {
    // Not on the uniform alone: see `unfolded`.
    if (place.x < OUTSIDE) & (view.warp <= 0.0) {
        return place;
    }
    let x = abs(place) / view.warp;
    return sign(place) * (view.warp * log(x + sqrt(x * x + 1.0)));
}

// Tile of a light's picture that a point falls into, or one past the last where it falls outside.
fn light_tile(view: LightView, point: vec3<f32>) -> u32 {
    let place = (warped(view, vec2(dot(point, view.axis_u.xyz), dot(point, view.axis_v.xyz))) - view.origin) * view.inverse_tile_size;
    let inside = all(place >= vec2(0.0)) && all(place < vec2<f32>(view.tiles));
    let tile = vec2<u32>(clamp(place, vec2(0.0), vec2<f32>(view.tiles)));
    return select(view.tiles.x * view.tiles.y, tile.y * view.tiles.x + tile.x, inside);
}
