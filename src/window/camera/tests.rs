use super::*;

fn level() -> FlyCamera {
    FlyCamera::new(&Camera {
        position: DVec3::new(10.0, 20.0, 30.0),
        target: DVec3::new(10.0, 20.0, -70.0),
        fov_x: 50.0,
        ..Camera::default()
    })
}

/// Far longer than the inertia.
const LONG: f64 = 100.0 * INERTIA;

#[test]
fn a_camera_that_was_not_moved_is_the_scenes_own() {
    let rolled = Camera { up: DVec3::new(0.3, 1.0, 0.0), ..Camera::default() };
    let mut fly = FlyCamera::new(&rolled);
    fly.step(1.0);
    assert_eq!(fly.camera(), rolled);
    assert!(!fly.is_moving());
}

#[test]
fn each_key_pushes_its_way() {
    for (push, direction) in [
        (Push::Forward, DVec3::NEG_Z),
        (Push::Back, DVec3::Z),
        (Push::Left, DVec3::NEG_X),
        (Push::Right, DVec3::X),
        (Push::Up, DVec3::Y),
        (Push::Down, DVec3::NEG_Y),
    ] {
        let mut fly = level();
        fly.push(push, true);
        assert!(fly.is_moving());
        fly.step(LONG);
        let way = fly.camera().position - level().camera().position;
        // The start-up costs one INERTIA of the way.
        let expected = direction * FIRST_SPEED * (LONG - INERTIA);
        assert!((way - expected).length() < 1e-9, "{push:?}: {way}");
        let camera = fly.camera();
        assert!((camera.basis().forward - DVec3::NEG_Z).length() < 1e-9);
        assert_eq!(camera.fov_x, 50.0);
    }
}

#[test]
fn opposite_keys_cancel_and_two_are_no_faster_than_one() {
    let mut fly = level();
    fly.push(Push::Left, true);
    fly.push(Push::Right, true);
    fly.step(1.0);
    assert_eq!(fly.camera(), level().camera());
    fly.push(Push::Left, false);
    fly.push(Push::Forward, true);
    fly.step(LONG);
    assert!((fly.velocity.length() - FIRST_SPEED).abs() < 1e-9);
}

#[test]
fn the_frame_rate_makes_no_difference() {
    let fly_in = |steps: u32| {
        let mut fly = level();
        for (push, down) in [(Push::Forward, true), (Push::Up, true), (Push::Forward, false)] {
            fly.push(push, down);
            fly.tapped = [false; Push::COUNT];
            (0..steps).for_each(|_| fly.step(0.7 / f64::from(steps)));
        }
        fly.camera().position
    };
    // Sums of some hundred roundings of numbers of the order of 100.
    assert!((fly_in(1) - fly_in(300)).length() < 1e-9);
}

#[test]
fn a_released_camera_comes_to_rest() {
    let mut fly = level();
    fly.push(Push::Forward, true);
    fly.step(LONG);
    fly.release();
    let released_at = fly.camera().position;
    assert!(fly.is_moving(), "it glides");
    fly.step(LONG);
    assert!(!fly.is_moving());
    let glide = fly.camera().position.distance(released_at);
    assert!((glide - FIRST_SPEED * INERTIA).abs() < 1e-6, "{glide} m");
}

#[test]
fn a_tap_between_two_frames_is_not_lost() {
    let mut fly = level();
    fly.push(Push::Forward, true);
    fly.push(Push::Forward, false);
    assert!(fly.is_moving());
    fly.step(0.05);
    assert!(fly.camera().position.z < 30.0);
    let velocity = fly.velocity;
    fly.step(0.05);
    assert!(fly.velocity.length() < velocity.length(), "the tap is over");
}

#[test]
fn looking_turns_right_and_down_and_stops_before_straight_down() {
    let mut fly = level();
    fly.look([450.0, 0.0], 0.2);
    assert!((fly.camera().basis().forward - DVec3::X).length() < 1e-9, "a right angle");
    fly.look([0.0, 100.0], 0.1);
    let expected = Angles { azimuth: 90.0, elevation: -10.0 }.direction();
    assert!((fly.camera().basis().forward - expected).length() < 1e-9);
    fly.look([0.0, 1e6], 0.1);
    let forward = fly.camera().basis().forward;
    assert!(forward.y < -0.999 && forward.x > 0.0, "{forward}");
    let before = fly.clone();
    fly.look([f64::NAN, 0.0], 0.1);
    fly.look([0.0, f64::INFINITY], 0.1);
    assert_eq!(fly, before);
}

#[test]
fn the_wheel_changes_the_speed_within_limits() {
    let mut fly = level();
    fly.wheel(4.0);
    assert!((fly.speed / FIRST_SPEED - 2.0).abs() < 0.01, "four notches double it");
    fly.wheel(1000.0);
    assert_eq!(fly.speed, *SPEEDS.end());
    fly.wheel(-1e9);
    assert_eq!(fly.speed, *SPEEDS.start());
    fly.wheel(f64::NAN);
    assert_eq!(fly.speed, *SPEEDS.start());
}

#[test]
fn no_flight_leaves_the_range_of_a_scene() {
    let mut fly = level();
    fly.fast = true;
    fly.push(Push::Right, true);
    fly.step(1e12);
    let scene = crate::scene::Scene { camera: fly.camera(), ..Default::default() };
    scene.validate().expect("a camera in range");
    // f64 still tells the target from the camera, 1e11 m away from the origin.
    assert!((fly.camera().basis().forward - DVec3::NEG_Z).length() < 1e-6);
}

#[test]
fn resetting_goes_back_to_the_start() {
    let mut fly = level();
    fly.push(Push::Up, true);
    fly.step(1.0);
    fly.look([5.0, 5.0], 1.0);
    fly.push(Push::Up, false);
    fly.reset();
    assert_eq!(fly.camera(), level().camera());
    assert!(!fly.is_moving());
}

#[test]
fn put_elsewhere_it_shows_that_view_and_still_knows_the_way_home() {
    let mut fly = level();
    let elsewhere = Camera {
        position: DVec3::new(1.0, 2.0, 3.0),
        target: DVec3::new(1.5, 2.5, 9.0),
        up: DVec3::new(0.2, 1.0, 0.0),
        fov_x: 33.0,
        aperture: 0.5,
        ..Camera::default()
    };
    fly.set(&elsewhere);
    assert_eq!(fly.camera(), elsewhere, "to the bit");
    fly.look([1.0, 0.0], 0.1);
    let (turned, lens) = (fly.camera(), (fly.camera().fov_x, fly.camera().aperture));
    assert_eq!((turned.position, lens), (elsewhere.position, (33.0, 0.5)));
    fly.reset();
    assert_eq!(fly.camera(), level().camera());
    fly.begin(&elsewhere);
    fly.look([9.0, 9.0], 1.0);
    fly.reset();
    assert_eq!(fly.camera(), elsewhere);
}

#[test]
fn sticks_ask_for_parts_of_the_speed_and_turn_the_view() {
    let lean = |way, turn| {
        let mut fly = level();
        fly.lean(Lean { way, turn });
        assert!(fly.is_moving());
        fly.step(LONG);
        fly
    };
    let half = lean(0.5 * DVec3::Z, [0.0; 2]);
    assert!((half.velocity - 0.5 * FIRST_SPEED * DVec3::NEG_Z).length() < 1e-9);
    // With a key that asks for the same there is no more than all of the speed.
    let mut both = lean(DVec3::Z, [0.0; 2]);
    both.push(Push::Forward, true);
    both.step(LONG);
    assert!((both.velocity.length() - FIRST_SPEED).abs() < 1e-9);
    let mut turned = level();
    turned.lean(Lean { way: DVec3::ZERO, turn: [0.5, 0.25] });
    turned.step(0.1);
    let view = Angles::of(turned.camera().basis().forward);
    // To the right and up, from north.
    assert!((view.azimuth - 0.05 * TURN).abs() < 1e-6, "{view:?}");
    assert!((view.elevation - 0.025 * TURN).abs() < 1e-6, "{view:?}");
    turned.release();
    assert!(!turned.is_moving(), "another window has the pad");
    let mut broken = level();
    broken.lean(Lean { way: DVec3::NAN, turn: [0.0; 2] });
    assert!(!broken.is_moving());
}
