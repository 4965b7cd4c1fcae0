// Guards that are exact in the limit they guard.
#define_import_path cumuli::numerics

// Below this optical depth 1 - exp(-tau) is summed as a series: the first dropped term is
// tau^5 / 120 < 3e-9 of tau.
const SERIES_BELOW: f32 = 0.02;

// 1 - exp(-tau), with all its digits for small tau.
fn opacity(tau: f32) -> f32 {
    let series = tau * (1.0 - tau * (0.5 - tau * (0.16666667 - tau * 0.041666667)));
    return select(1.0 - exp(-tau), series, tau < SERIES_BELOW);
}

// (1 - exp(-tau)) / tau; 1 at 0.
fn mean_transmittance(tau: f32) -> f32 {
    let series = 1.0 - tau * (0.5 - tau * (0.16666667 - tau * 0.041666667));
    return select((1.0 - exp(-tau)) / max(tau, SERIES_BELOW), series, tau < SERIES_BELOW);
}

// Where, as a fraction of a uniform chord of optical depth tau, the light that leaves its near end
// was scattered on average: 1 / tau - 1 / (exp(tau) - 1); 1/2 at 0.
fn mean_scatter_fraction(tau: f32) -> f32 {
    let t = max(tau, FRACTION_SERIES_BELOW);
    let exact = 1.0 / t - 1.0 / (exp(min(t, DEEPEST)) - 1.0);
    return select(exact, 0.5 - tau / 12.0, tau < FRACTION_SERIES_BELOW);
}

// Below this optical depth the fraction is a series: the next term, tau^3 / 720, is below 2e-6.
const FRACTION_SERIES_BELOW: f32 = 0.1;
// Optical depth whose exponential is still finite; exp(-80) = 2e-35 of 1/80 changes no digit.
const DEEPEST: f32 = 80.0;

// A value of a uniform buffer for the condition of a branch or the end of a loop; `never` is true for no
// invocation, but the compiler cannot know. lavapipe of Mesa 22.3 compiles a kernel anew for every
// dispatch where a condition depends on uniform buffers alone (lvp_inline_uniforms.c): 5 to 20 times
// the time of a small picture, and memory that is not given back.
fn unfolded(value: u32, never: bool) -> u32 {
    return select(value, 0u, never);
}

// Order of unsigned integers equal to the order of the floats they were made from.
fn sortable(value: f32) -> u32 {
    let bits = bitcast<u32>(value);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}
