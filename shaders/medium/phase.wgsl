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
    return phase_lobes(p, cos_theta, max(1.0 - p.hg_sign * cos_theta, 0.0), max(1.0 - cos_theta, 0.0));
}

// The same for light from `sun` that leaves against `dir` (unit vectors). From their difference:
// next to the sun the cosine has lost the digits that tell the lobe's flank, 1 % of it in cloud.
fn phase_between(p: PhaseParams, dir: vec3<f32>, sun: vec3<f32>) -> f32 {
    let apart = dir - sun;
    let turned = dir - p.hg_sign * sun;
    let versine = 0.5 * dot(apart, apart);
    return phase_lobes(p, 1.0 - versine, 0.5 * dot(turned, turned), versine);
}

// `hg_versine` and `versine`: 1 - cosine, in place of 1 + g^2 - 2 g cosine, from the peak of each
// lobe.
fn phase_lobes(p: PhaseParams, cos_theta: f32, hg_versine: f32, versine: f32) -> f32 {
    let hg = inverseSqrt(p.hg_base + p.hg_slope * hg_versine);
    let draine = inverseSqrt(p.draine_base + p.draine_slope * versine);
    return p.hg_scale * (hg * hg * hg)
        + p.draine_scale * (1.0 + p.draine_alpha * cos_theta * cos_theta) * (draine * draine * draine);
}
