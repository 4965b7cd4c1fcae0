#define_import_path cumuli::sky
struct Air { inscatter: vec3<f32>, transmittance: vec3<f32> }
fn sky_radiance(d: vec3<f32>) -> vec3<f32> { return mix(vec3(0.09,0.1,0.11), vec3(0.02,0.04,0.09), saturate(d.y)); }
fn sun_disc_radiance(d: vec3<f32>) -> vec3<f32> { return vec3(0.0); }
fn sun_irradiance_at(a: f32) -> vec3<f32> { return vec3(0.9,0.85,0.8); }
fn sky_ambient_above(a: f32) -> vec3<f32> { return vec3(0.04,0.055,0.08); }
fn sky_ambient_below(a: f32) -> vec3<f32> { return vec3(0.03,0.035,0.03); }
fn air_between(d: vec3<f32>, s: f32) -> Air { var a: Air; let t = exp(-s/30000.0); a.transmittance=vec3(t); a.inscatter=(1.0-t)*vec3(0.08,0.09,0.11); return a; }
fn ground_distance(d: vec3<f32>) -> f32 { return select(-1.0, -30.0/d.y, d.y < -0.0005); }
fn ground_radiance(d: vec3<f32>, s: f32, v: f32) -> vec3<f32> { return vec3(0.09,0.11,0.06)*(0.2*v+0.06); }
