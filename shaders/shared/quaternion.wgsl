// Unit quaternions, stored (x, y, z, w).
#define_import_path cumuli::quaternion

// Turns a vector.
fn rotate(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// A rotation drawn uniformly, from three numbers in [0, 1). Shoemake, Graphics Gems III (1992).
fn uniform_rotation(u: vec3<f32>) -> vec4<f32> {
    let tau = 6.283185307;
    let a = sqrt(1.0 - u.x);
    let b = sqrt(u.x);
    return vec4(a * sin(tau * u.y), a * cos(tau * u.y), b * sin(tau * u.z), b * cos(tau * u.z));
}
