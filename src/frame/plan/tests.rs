use bytemuck::Zeroable;

use super::*;
use crate::frame::gpu_data::{FrameUniforms, LightView, ShadowUniforms};
use crate::frame::in_view::InView;
use crate::frame::rings::PlacedField;
use crate::frame::settings::Lighting;
use crate::scene::CloudField;

fn key() -> FrameKey {
    FrameKey {
        frame: FrameUniforms { has_ground: 1, has_air: 1, ..FrameUniforms::zeroed() },
        clouds: Some(PlacedField::new(&CloudField::default(), glam::DVec3::ZERO, 0.0, &[], 0, 0)),
        listed: Vec::new(),
        light: LightView::zeroed(),
        shadow: ShadowUniforms::zeroed(),
        is_sea: false,
        in_view: InView { clouds: true, ground: true },
        opaque: None,
        lighting: Lighting::Grid,
        sun_asked: false,
    }
}

/// What takes the grid's place skips what is made of it, and says why.
#[test]
fn other_lightings_make_no_grid() {
    let without = |lighting| {
        let now = FrameKey { lighting, ..key() };
        let plan = frame(&mut Changes::default(), &now, true, NONE);
        for pass in [Pass::LightGrid, Pass::LightField, Pass::AirShadow] {
            let decision = plan.decisions().iter().find(|d| d.pass == pass).expect("all passes");
            assert_eq!(decision.reason, "clouds are lit without the light grid", "{pass:?}");
            assert!(!decision.runs);
        }
        own_passes().into_iter().filter(|p| !plan.runs(*p)).collect::<Vec<_>>()
    };
    let of_grid = [Pass::LightGrid, Pass::LightField, Pass::AirShadow];
    assert_eq!(without(Lighting::Octaves), of_grid);
    assert_eq!(without(Lighting::Alone), of_grid);
    // The ground shows shadows: without it, maps are made for what looks depths up in them.
    let in_view = InView { clouds: true, ground: false };
    for lighting in Lighting::ALL {
        let now = FrameKey { lighting, in_view, ..key() };
        let plan = frame(&mut Changes::default(), &now, true, NONE);
        assert_eq!(plan.runs(Pass::Shadow), lighting.has_maps(), "{lighting}");
    }
}

/// Everything, a part, nothing of the light grid.
const ALL: GridWork = GridWork { steps: 0..9, solved: true, field: true, progress: [0; 2] };
const PART: GridWork = GridWork { steps: 3..5, solved: false, field: false, progress: [5, 9] };
const NONE: GridWork = GridWork { steps: 0..0, solved: false, field: false, progress: [0; 2] };

fn running(plan: &FramePlan) -> Vec<Pass> {
    Pass::ALL.into_iter().filter(|p| plan.runs(*p)).collect()
}

/// All passes but those for opaque things of a host and for a sea, which `key` has none of.
fn own_passes() -> Vec<Pass> {
    Pass::ALL.into_iter().filter(|p| ![Pass::Opaque, Pass::Sea].contains(p)).collect()
}

/// Plans a frame and notes it as made.
fn frame(changes: &mut Changes, now: &FrameKey, sky: bool, grid: GridWork) -> FramePlan {
    changes.observe(now, sky, &grid);
    let plan = FramePlan::new(changes, now, sky, &grid, false);
    plan.made().iter().for_each(|product| changes.done(*product));
    plan
}

fn after_a_frame() -> Changes {
    let mut changes = Changes::default();
    let plan = frame(&mut changes, &key(), true, ALL);
    assert_eq!(running(&plan), own_passes());
    changes
}

#[test]
fn paused_and_still_runs_nothing() {
    let plan = frame(&mut after_a_frame(), &key(), false, NONE);
    assert_eq!(running(&plan), []);
    assert!(plan.decisions().iter().all(|d| !d.reason.is_empty()));
}

#[test]
fn a_part_of_a_solution_changes_no_picture() {
    let mut changes = after_a_frame();
    assert_eq!(running(&frame(&mut changes, &key(), false, PART)), [Pass::LightGrid]);
    let plan = frame(&mut changes, &key(), false, ALL);
    assert!(plan.relit() && plan.runs(Pass::Blend) && !plan.runs(Pass::Shadow));
}

#[test]
fn pixels_of_the_past_are_shaded_without_anything_else() {
    let mut changes = after_a_frame();
    changes.observe(&key(), false, &NONE);
    let plan = FramePlan::new(&changes, &key(), false, &NONE, true);
    assert_eq!(running(&plan), [Pass::Blend, Pass::Resolve, Pass::Tonemap]);
    assert!(!plan.clouds_changed() && plan.makes(Product::Clouds));
}

#[test]
fn a_turned_camera_keeps_lists_and_light() {
    let mut now = key();
    now.frame.forward = [1.0, 0.0, 0.0, 0.0];
    let plan = frame(&mut after_a_frame(), &now, false, NONE);
    assert!(plan.makes(Product::ScreenLists) && !plan.makes(Product::LightLists) && !plan.relit());
    for pass in [Pass::Sky, Pass::Rings, Pass::LightGrid, Pass::LightField] {
        assert!(!plan.runs(pass), "{pass:?}");
    }
    assert!(plan.runs(Pass::Shadow), "what comes into view");
    assert!(plan.runs(Pass::Blend) && plan.runs(Pass::Resolve));
}

#[test]
fn a_moved_sun_keeps_the_particles_and_the_screen_order() {
    let mut now = key();
    now.light.towards = [0.0, 1.0, 0.0, 0.0];
    let plan = frame(&mut after_a_frame(), &now, true, ALL);
    assert!(plan.makes(Product::LightLists) && !plan.makes(Product::ScreenLists) && plan.relit());
    assert!(!plan.runs(Pass::Rings) && plan.runs(Pass::Light) && plan.runs(Pass::Shadow));
}

#[test]
fn an_empty_sky_needs_sky_and_picture_only() {
    let mut now = key();
    now.clouds = None;
    let plan = frame(&mut Changes::default(), &now, true, NONE);
    assert_eq!(running(&plan), [Pass::Sky, Pass::Resolve, Pass::Tonemap]);
}

#[test]
fn what_is_out_of_view_waits_until_it_is_seen() {
    let mut changes = after_a_frame();
    let mut now = key();
    let moving = |now: &mut FrameKey| {
        if let Some(clouds) = &mut now.clouds {
            clouds.uniforms.base += 1.0;
        }
    };
    let shadows = [Pass::Rings, Pass::Project, Pass::Sort, Pass::TileLists, Pass::Shadow];
    let picture = [Pass::Resolve, Pass::Tonemap];
    now.frame.forward = [0.0, 1.0, 0.0, 0.0];
    now.in_view = InView { clouds: false, ground: false };
    moving(&mut now);
    assert_eq!(running(&frame(&mut changes, &now, false, NONE)), picture);
    // Nothing moves in an empty view.
    moving(&mut now);
    assert_eq!(running(&frame(&mut changes, &now, false, NONE)), []);
    // Ground: the shadows of clouds that stay out of view.
    now.in_view.ground = true;
    moving(&mut now);
    let plan = frame(&mut changes, &now, false, NONE);
    assert_eq!(running(&plan), [&shadows[..], &picture].concat());
    assert!(!plan.makes(Product::ScreenLists) && !plan.relit());
    assert!(plan.runs(Pass::Shadow));
    // Turned back without anything else: what was left out so far is made, and no more.
    now.in_view.clouds = true;
    let plan = frame(&mut changes, &now, false, ALL);
    assert!(plan.makes(Product::ScreenLists) && !plan.makes(Product::Particles) && plan.relit());
    assert!(!plan.makes(Product::LightLists) && !plan.runs(Pass::Shadow));
    assert!(plan.runs(Pass::Light) && plan.runs(Pass::Blend) && plan.runs(Pass::LightGrid));
}

#[test]
fn a_sea_reflects_what_changed() {
    let sea = FrameKey { is_sea: true, ..key() };
    let mut changes = Changes::default();
    let plan = frame(&mut changes, &sea, true, ALL);
    assert!(plan.runs(Pass::Sea) && plan.makes(Product::Reflected));
    assert_eq!(running(&frame(&mut changes, &sea, false, NONE)), []);
    // The light of the clouds changes what is reflected, and that the picture.
    let plan = frame(&mut changes, &sea, false, ALL);
    assert!(plan.runs(Pass::Sea) && plan.runs(Pass::Resolve));
    // Looking up, nothing of it is seen.
    let up = InView { clouds: true, ground: false };
    let plan = frame(&mut changes, &FrameKey { in_view: up, ..sea }, true, ALL);
    assert!(!plan.runs(Pass::Sea));
}
