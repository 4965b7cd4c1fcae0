//! The rules for a frame's numbers and the numbers there are: neither without the other.

use std::collections::BTreeSet;

use cumuli::frame::{OpaquePicture, Preset, Surface};
use cumuli::gpu::watch::Resource;
use cumuli::medium::Phase;
use cumuli::scene::Medium;
use cumuli::stress::corners::corners;
use cumuli::stress::rules::{FLOATS, WHOLE, rule};
use cumuli::stress::{Case, MEDIA, Stress, Way};

use glam::DVec3;

use crate::{SIZE, alone};

#[test]
fn every_number_has_a_rule_and_every_rule_a_number() {
    let _turn = alone();
    let mut stress = Stress::new(&MEDIA).expect("a device and tables");
    let mut found = BTreeSet::new();
    // A field and listed particles; and a medium that absorbs, which has other shaders; and pixels that are
    // taken over.
    let mut cases = corners(SIZE, Preset::Low);
    cases.retain(|case| {
        ["a giant over a field", "a sea under a field"].contains(&case.name.as_str())
    });
    let mut absorbing = cases[0].clone();
    absorbing.scene.medium = Medium { phase: Phase::Hg { g: -0.5 }, albedo: 0.5 };
    let live = Case { way: Way::Live, ..cases[0].clone() };
    cases.extend([absorbing, live]);
    for (index, case) in cases.iter().enumerate() {
        if index == 0 {
            // Something opaque in half the picture, and shadows at a point.
            let ahead = case.scene.camera.basis().forward;
            let surfaces = OpaquePicture::cast(&case.scene.camera, SIZE, |dir| {
                let (distance, radiance) = (1000.0, DVec3::splat(0.1));
                (dir.x > ahead.x).then_some(Surface { distance, radiance, sunlit: radiance })
            });
            let opaque = surfaces.upload(stress.gpu(), 0).expect("a picture");
            let renderer = &mut stress.made(case).expect("a renderer").renderer;
            renderer.set_opaque(Some(opaque));
            renderer.frame(&case.scene, 0.0, SIZE).expect("a frame");
            renderer.sun_transmittance(&[DVec3::ZERO]).expect("a shadow");
        }
        stress.run(case);
        let watch = stress.gpu().watch().expect("a device that is watched");
        for binding in watch.bindings() {
            match binding.resource {
                Resource::Texture(_) => {
                    found.insert(binding.name);
                }
                Resource::Buffer(_, values) => {
                    assert!(!values.leaves.is_empty(), "{} holds nothing", binding.name);
                    found.extend(values.leaves.iter().map(|leaf| leaf.name.clone()));
                }
            }
        }
    }
    let without: Vec<_> = found.iter().filter(|name| rule(name).is_none()).collect();
    assert!(without.is_empty(), "no rule for {without:?}");
    let ruled = FLOATS.iter().map(|(name, _)| *name).chain(WHOLE.iter().copied());
    let stale: Vec<_> = ruled.filter(|name| !found.contains(*name)).collect();
    assert!(stale.is_empty(), "rules for nothing: {stale:?}");
}
