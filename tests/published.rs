//! The path tracer against published radiative transfer: slabs (DISORT's test problems), critical
//! spheres, escape from an absorbing sphere. `cumuli reference verify` prints the same rows.

use cumuli::reference::{Slab, slab_fluxes, verify};

/// Paths a row: standard errors of 0.1 to 0.5 %, in some seconds.
const SAMPLES: u64 = 200_000;

#[test]
fn published_rows_agree() {
    for check in verify(SAMPLES, 1).expect("computed") {
        assert!(check.pass, "{check:?}");
        // A row that can't tell 5 % would pass whatever the program says.
        let resolution = check.got.standard_error / check.expected.abs().max(1e-3);
        assert!(resolution < 0.15, "{check:?}");
    }
}

#[test]
#[ignore = "takes minutes"]
fn published_rows_agree_with_many_paths() {
    for check in verify(20_000_000, 2).expect("computed") {
        assert!(check.pass, "{check:?}");
    }
}

#[test]
fn majorants_above_the_extinction_change_nothing() {
    let phase: cumuli::medium::Phase = "hg:0.75".parse().expect("a phase function");
    let matter = cumuli::reference::Matter { phase: phase.prepare(), albedo: 0.9 };
    let [tight, loose] =
        [1.0, 1.7].map(|slack| slab_fluxes(&Slab::new(3.0, slack), &matter, 0.6, SAMPLES, 3));
    for (a, b) in [
        (tight.reflected, loose.reflected),
        (tight.diffuse, loose.diffuse),
        (tight.direct, loose.direct),
    ] {
        let z = (a.value - b.value) / a.standard_error.hypot(b.standard_error);
        // Three comparisons of a right program pass 4 standard errors in all but 1 of 5000 seeds.
        assert!(z.abs() < 4.0, "{a:?} {b:?}");
    }
    let sum = tight.reflected.value + tight.diffuse.value + tight.direct.value;
    assert!(sum < 1.0 - 0.05, "albedo 0.9 absorbs: {sum} comes out");
}

#[test]
fn a_slab_without_matter_lets_all_light_through() {
    let phase: cumuli::medium::Phase = "hg:0".parse().expect("a phase function");
    let matter = cumuli::reference::Matter { phase: phase.prepare(), albedo: 1.0 };
    let fluxes = slab_fluxes(&Slab::new(0.0, 1.0), &matter, 0.3, 1000, 0);
    assert_eq!(fluxes.direct.value, 1.0);
    assert_eq!(fluxes.reflected.value + fluxes.diffuse.value, 0.0);
}
