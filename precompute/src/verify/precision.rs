//! What f16 costs: of tables that are stored in f32, the same rays through what the device gets of them.

use cumuli::tables::ScatteringTable;

use super::Effort;
use super::device::rays;
use super::row::{Row, Worst};

/// Half a step of f16 in numbers from 1 to 2; from 2 to 4 it is twice that, and so on.
const HALF_STEP: f64 = 1.0 / 2048.0;
/// f32 beside f64 in what is left of the logarithms.
const ROUNDING: f64 = 1e-6;

/// The largest and the root mean square difference of the light of orders from 2 on, over that light; nothing for a
/// table that is stored in f16.
pub fn rows(table: &ScatteringTable, effort: &Effort) -> Vec<Row> {
    let Some(values) = table.precise_values() else { return Vec::new() };
    let most = values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
    // Logarithms are interpolated: no mean of them is farther off than the worst of them.
    let half_step = HALF_STEP * f64::from(most.max(1.0)).log2().floor().exp2();
    let tolerance = (half_step + ROUNDING).exp_m1();
    let rounded = table.rounded();
    let (mut worst, mut squares) = (Worst::NONE, 0.0);
    let rays = rays(effort, table);
    for ray in &rays {
        let light = [table, &rounded]
            .map(|table| table.lookup(ray.entry, ray.dir, ray.sun, ray.optical_radius)[1]);
        let error = (light[1] / light[0] - 1.0).abs();
        worst.add(light, error, tolerance);
        squares += error * error;
    }
    let rms = (squares / rays.len().max(1) as f64).sqrt();
    let medium = super::medium(table);
    let name = |what: &str| format!("f16 beside f32, {what}: orders from 2 on, {medium}");
    // Errors that are even within half a step have a third of its square, less where several are averaged.
    let typical = tolerance / 3.0f64.sqrt();
    vec![worst.row(name("largest")), Row::measured(name("RMS"), [0.0, rms], rms, typical)]
}
