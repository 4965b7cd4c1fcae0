#define_import_path cumuli::scattering
fn scattering_source(entry: vec3<f32>, dir: vec3<f32>, sun: vec3<f32>, r: f32) -> vec2<f32> { let c = 0.5+0.5*dot(entry, sun); return vec2(mix(exp(-2.0*r),1.0,c)/(1.0+0.3*r), 0.08*c*r/(1.0+r)); }
