use super::*;

fn key(time: f64, position: [f64; 3], turn: f64) -> PathKey {
    PathKey {
        time,
        position: DVec3::from_array(position),
        orientation: DQuat::from_rotation_y(turn),
        fov_x: None,
    }
}

fn at(path: &CameraPath, time: f64) -> Camera {
    path.camera(time, &Camera::default())
}

/// Times that lie unevenly, a hold, and turns of up to 2 radians.
fn uneven() -> CameraPath {
    let keys = vec![
        key(0.0, [0.0, 100.0, 0.0], 0.0),
        key(1.0, [50.0, 120.0, -300.0], 0.5),
        key(1.5, [200.0, 120.0, -350.0], 2.5),
        key(6.0, [900.0, 300.0, 0.0], 1.0),
        key(8.0, [900.0, 300.0, 0.0], 1.0),
        key(9.0, [0.0, 0.0, 0.0], -1.0),
    ];
    CameraPath::new("uneven", keys).expect("a good path")
}

#[test]
fn passes_its_keys_and_stands_at_the_ends() {
    let path = uneven();
    let mut times: Vec<f64> = path.keys().iter().map(|k| k.time).collect();
    for (key, time) in path.keys().iter().zip(times.clone()) {
        let camera = at(&path, time);
        assert!((camera.position - key.position).length() < 1e-9, "{time}");
        let forward = key.orientation * DVec3::NEG_Z;
        assert!((camera.basis().forward - forward).length() < 1e-9, "{time}");
        assert_eq!(camera.fov_x, Camera::default().fov_x);
    }
    times.extend([-5.0, 100.0]);
    assert_eq!(at(&path, -5.0).position, path.keys()[0].position);
    assert_eq!(at(&path, 100.0).position, path.keys()[5].position);
    assert_eq!(path.end(), 9.0);
}

/// One-sided differences on both sides of every key agree: neither speed nor turning jumps. Over
/// 1e-5 s the curvature of this path (below 5000 m/s^2, 50 rad/s^2) leaves a tenth of a m/s and a
/// thousandth of a rad/s.
#[test]
fn neither_speed_nor_turning_jumps() {
    let path = uneven();
    let step = 1e-5;
    for key in &path.keys()[1..path.keys().len() - 1] {
        let [before, here, after] = [-step, 0.0, step].map(|d| at(&path, key.time + d));
        let speeds =
            [here.position - before.position, after.position - here.position].map(|d| d / step);
        assert!((speeds[0] - speeds[1]).length() < 0.1, "{}: {speeds:?}", key.time);
        let forward = |c: &Camera| c.basis().forward;
        let turns =
            [forward(&here) - forward(&before), forward(&after) - forward(&here)].map(|d| d / step);
        assert!((turns[0] - turns[1]).length() < 1e-3, "{}: {turns:?}", key.time);
    }
}

#[test]
fn rests_where_two_keys_are_the_same() {
    let path = uneven();
    for time in [6.0, 6.3, 7.1, 8.0] {
        let camera = at(&path, time);
        assert_eq!(camera.position, DVec3::new(900.0, 300.0, 0.0), "{time}");
        let forward = DQuat::from_rotation_y(1.0) * DVec3::NEG_Z;
        assert!((camera.basis().forward - forward).length() < 1e-12, "{time}");
    }
}

/// A quick step beside a slow one makes no detour: 60 m/s for a second, then 1 m/s. Beyond its key
/// the curve never runs, since the velocity there is at most three times the slow step's.
#[test]
fn a_quick_step_does_not_overshoot_a_slow_one() {
    let keys = vec![
        key(0.0, [0.0; 3], 0.0),
        key(1.0, [60.0, 0.0, 0.0], 3.0),
        key(61.0, [120.0, 0.0, 0.0], 2.0),
    ];
    let path = CameraPath::new("slow", keys).expect("a good path");
    let mut last = 0.0;
    for i in 0..=610 {
        let x = at(&path, 0.1 * f64::from(i)).position.x;
        assert!(x >= last - 1e-9 && x <= 120.0 + 1e-9, "{i}: {x} after {last}");
        last = x;
    }
}

/// Even steps of the same speed and turn give exactly that in between.
#[test]
fn even_motion_stays_even() {
    let keys = (0..5).map(|i| {
        let t = f64::from(i);
        key(t, [10.0 * t, -3.0 * t, 0.0], 0.3 * t)
    });
    let path = CameraPath::new("even", keys.collect()).expect("a good path");
    for i in 0..40 {
        let t = 0.1 * f64::from(i);
        let camera = at(&path, t);
        assert!((camera.position - DVec3::new(10.0 * t, -3.0 * t, 0.0)).length() < 1e-12);
        let forward = DQuat::from_rotation_y(0.3 * t) * DVec3::NEG_Z;
        assert!((camera.basis().forward - forward).length() < 1e-12, "{t}");
    }
}

#[test]
fn turns_the_short_way() {
    let mut keys = vec![key(0.0, [0.0; 3], 0.0), key(1.0, [0.0; 3], 0.2)];
    keys[1].orientation = -keys[1].orientation;
    let path = CameraPath::new("short", keys).expect("a good path");
    let forward = at(&path, 0.5).basis().forward;
    assert!((forward - DQuat::from_rotation_y(0.1) * DVec3::NEG_Z).length() < 1e-12);
}

#[test]
fn targets_look_as_a_scenes_camera_does() {
    let text = "[[keys]]\ntime = 0\nposition = [3, 20, 1]\ntarget = [-4, 30, 9]\nfov_x = 40\n";
    let path = CameraPath::from_toml(text, "p.toml").expect("a good path");
    let scene = Camera {
        position: DVec3::new(3.0, 20.0, 1.0),
        target: DVec3::new(-4.0, 30.0, 9.0),
        fov_x: 40.0,
        ..Camera::default()
    };
    let (ours, scenes) = (at(&path, 0.0), scene);
    let (a, b) = (ours.basis(), scenes.basis());
    for (a, b) in [(a.forward, b.forward), (a.right, b.right), (a.up, b.up)] {
        assert!((a - b).length() < 1e-12);
    }
    assert_eq!((ours.position, ours.fov_x), (scenes.position, 40.0));
}

#[test]
fn writes_what_it_reads() {
    let mut path = uneven();
    path.keys[2].fov_x = Some(33.0);
    let text = path.to_toml().expect("written");
    assert_eq!(CameraPath::from_toml(&text, "again").expect("read"), path);
}

#[test]
fn bad_files_are_told_by_line_and_field() {
    let good = "[[keys]]\ntime = 0\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\n";
    for (text, parts) in [
        (String::new(), ["p.toml", "keys: is missing"]),
        ("keys = []".to_owned(), ["p.toml:1: keys", "1 to 100000 keys"]),
        ("keys = [[0, 1]]".to_owned(), ["p.toml:1: keys[0]", "expected a table"]),
        (good.replace("time = 0", "time = -1"), ["p.toml:2: keys[0].time", "from 0 to"]),
        (good.replace("time = 0", "time = nan"), ["p.toml:2: keys[0].time", "NaN"]),
        (good.replace("time = 0\n", ""), ["keys[0].time", "is missing"]),
        (good.replace("target", "targt"), ["keys[0]", "did you mean `target`"]),
        (good.replace("target = [0, 0, -1]\n", ""), ["keys[0].target", "is missing"]),
        (good.replace("[0, 0, -1]", "[0, 0, 0]"), ["p.toml:4: keys[0].target", "other than"]),
        (good.replace("[0, 0, -1]", "[0, 0]"), ["p.toml:4: keys[0].target", "3 numbers"]),
        (format!("{good}orientation = [0, 0, 0, 1]"), ["p.toml:5: keys[0].orientation", "both"]),
        (format!("{good}fov_x = 180"), ["p.toml:5: keys[0].fov_x", "1 to 179"]),
        (format!("{good}up = [0, 0, 0]"), ["p.toml:5: keys[0].up", "a direction"]),
        (
            good.replace("target = [0, 0, -1]", "orientation = [0, 0, 0, 0]"),
            ["p.toml:4: keys[0].orientation", "not zero"],
        ),
        (
            good.replace("target = [0, 0, -1]", "orientation = [0, 0, 0, 1]\nup = [0, 1, 0]"),
            ["p.toml:5: keys[0].up", "goes with target"],
        ),
        (good.replace("[0, 0, 0]", "[0, 1e12, 0]"), ["p.toml:3: keys[0].position[1]", "1e11"]),
        (format!("{good}{good}"), ["p.toml:6: keys[1].time", "the key before (0)"]),
        ("keys = 3".to_owned(), ["p.toml:1: keys", "sequence"]),
        ("= 3".to_owned(), ["p.toml:1", ""]),
    ] {
        let error = CameraPath::from_toml(&text, "p.toml").expect_err(&text).to_string();
        for part in parts {
            assert!(error.contains(part), "{text}: {error} lacks {part}");
        }
        assert!(!error.contains('\n'), "{error}");
    }
}

proptest::proptest! {
    /// Any keys within the limits give cameras within the limits.
    #[test]
    fn every_camera_is_sound(
        steps in proptest::collection::vec((1e-4..1e3f64, -1e11..1e11f64, -7.0..7.0f64, -7.0..7.0f64, 1.0..179.0f64), 1..8),
        place in -0.2..1.2f64,
    ) {
        let mut time = 0.0;
        let keys = steps.iter().map(|&(step, x, yaw, pitch, fov)| {
            time += step;
            let orientation = DQuat::from_rotation_y(yaw) * DQuat::from_rotation_x(pitch);
            PathKey { time, position: DVec3::new(x, 0.5 * x, -x), orientation, fov_x: Some(fov) }
        });
        let path = CameraPath::new("any", keys.collect()).expect("within the limits");
        let camera = at(&path, place * path.end());
        proptest::prop_assert!(camera.position.is_finite() && camera.target.is_finite());
        proptest::prop_assert!((1.0..=179.0).contains(&camera.fov_x));
        let basis = camera.basis();
        proptest::prop_assert!((basis.forward.length() - 1.0).abs() < 1e-9);
        proptest::prop_assert!(basis.forward.dot(basis.right).abs() < 1e-9);
    }
}
