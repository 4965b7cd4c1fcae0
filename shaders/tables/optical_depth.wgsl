#define_import_path cumuli::optical_depth
struct ChordProfile { mean_density: f32, a: f32 }
fn chord_profile(shape: u32, entry: vec3<f32>, exit: vec3<f32>) -> ChordProfile { var p: ChordProfile; let m = 0.5*(entry+exit); p.mean_density = select(0.6*max(1.0-dot(m,m),0.0), 1.0, shape==0u); return p; }
fn chord_fraction(p: ChordProfile, t: f32) -> f32 { return t*t*(3.0-2.0*t); }
