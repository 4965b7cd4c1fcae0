// Phase function: one Henyey-Greenstein and one Draine lobe. Twin of src/medium/phase.rs.
#define_import_path cumuli::phase

struct PhaseParams {
    hg_scale: f32,
    hg_base: f32,
    hg_slope: f32,
    hg_sign: f32,
    draine_scale: f32,
    draine_base: f32,
    draine_slope: f32,
    draine_alpha: f32,
}

// Value in 1/sr at the cosine between light's directions of travel before and after.
fn phase_function(p: PhaseParams, cos_theta: f32) -> f32 {
    // 1 - cos in place of 1 + g^2 - 2 g cos keeps the digits of the narrow peak.
    let hg = inverseSqrt(p.hg_base + p.hg_slope * max(1.0 - p.hg_sign * cos_theta, 0.0));
    let draine = inverseSqrt(p.draine_base + p.draine_slope * max(1.0 - cos_theta, 0.0));
    return p.hg_scale * (hg * hg * hg)
        + p.draine_scale * (1.0 + p.draine_alpha * cos_theta * cos_theta) * (draine * draine * draine);
}
