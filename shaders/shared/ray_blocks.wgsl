// Rays through the corners of blocks of pixels, between which light is interpolated: what clouds change of the air
// (shared/air_shadow.wgsl), and what a sea reflects (shared/sea_light.wgsl). Host: src/frame/air_shadow.rs.
#define_import_path cumuli::ray_blocks

// Rays across and up, through the corners of blocks of so many pixels a side.
fn corners_of(size: vec2<u32>, block: u32) -> vec2<u32> {
    return (size + block - 1u) / block + 1u;
}

// Where a ray runs through a picture, pixels; not beyond it. Of blocks of one pixel that is its middle.
fn ray_place(ray: vec2<u32>, size: vec2<u32>, block: u32) -> vec2<f32> {
    return min(vec2<f32>(ray * block) + select(0.0, 0.5, block == 1u), vec2<f32>(size));
}

// Where a pixel lies between the first of the four rays around it and the others.
fn share_of_rays(pixel: vec2<u32>, first: vec2<u32>, size: vec2<u32>, block: u32) -> vec2<f32> {
    let sides = min(size - first * block, vec2(block));
    let share = (vec2<f32>(pixel - first * block) + 0.5) / vec2<f32>(sides);
    return select(share, vec2(0.0), block == 1u);
}
