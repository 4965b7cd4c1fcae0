// Optical depth along a line of light, through the particles of the line's tile. Used for the
// particles themselves and for what lies below them (shadows). Twin: src/frame/cpu/light.rs.
#define_import_path cumuli::light_lists

#import cumuli::gpu_data::Particle
#import cumuli::optical_depth::{chord_step, step_fraction}
#import cumuli::quaternion::rotate

// Optical depth on the two sides of a point on a line of light.
struct Occlusion {
    front: f32,  // towards the light
    behind: f32, // away from it
}

// Beyond this optical depth on both sides nothing that follows changes a bit of any picture:
// exp(-80) is below the smallest radiance an f16 holds by 27 orders of magnitude.
const OPTICAL_DEPTH_LIMIT: f32 = 80.0;

// What one particle takes from a line of light, on both sides of a point on it.
fn particle_occlusion(particle: Particle, towards: vec3<f32>, point: vec3<f32>) -> Occlusion {
    var result: Occlusion;
    let offset = point - particle.centre;
    let along = dot(offset, towards); // of the point, from the middle of the chord
    let across = offset - along * towards;
    let h2 = particle.radius * particle.radius - dot(across, across);
    if h2 <= 0.0 {
        return result;
    }
    let h = sqrt(h2);
    // From the light's end of the chord to the far end.
    let light_end = rotate(particle.orientation, (across + h * towards) / particle.radius);
    let far_end = rotate(particle.orientation, (across - h * towards) / particle.radius);
    let profile = chord_step(particle.shape, light_end, far_end);
    let tau = particle.extinction * 2.0 * h * profile.mean_density;
    let t = clamp((h - along) / (2.0 * h), 0.0, 1.0); // 0: the point lies before the chord
    let share = step_fraction(profile, t);
    result.front = tau * share;
    result.behind = tau * (1.0 - share);
    return result;
}
