use glam::DVec3;

use super::super::camera::Push;
use super::*;

fn session() -> Session {
    Session::new(Scene { clouds: Some(Default::default()), ..Scene::default() }, 5.0)
}

#[test]
fn untouched_it_shows_the_scene_as_it_was_loaded() {
    let mut session = session();
    session.clock.running = false;
    session.set_sun(session.sun());
    session.set_day(session.day());
    session.step(1.0);
    assert_eq!(session.seen(), session.start, "to the bit");
    assert!(!session.is_lively());
}

#[test]
fn only_what_changes_is_lively() {
    let mut session = session();
    assert!(session.is_lively(), "clouds drift");
    session.scene.clouds = None;
    assert!(!session.is_lively(), "listed particles don't");
    session.fly.push(Push::Left, true);
    assert!(session.is_lively());
    session.fly.push(Push::Left, false);
    (0..100).for_each(|_| session.step(0.1));
    assert!(!session.is_lively(), "it has come to rest");
}

#[test]
fn a_stall_is_no_jump() {
    let mut session = session();
    session.fly.push(Push::Up, true);
    session.step(3600.0);
    assert_eq!(session.clock.time, 5.0 + LONGEST_TICK);
    let (before, after) = (session.start.camera, session.seen().camera);
    let way = after.position.distance(before.position);
    assert!(way > 0.0 && way < session.fly.speed * LONGEST_FLIGHT, "{way} m");
    session.step(-1.0);
    assert_eq!(session.clock.time, 5.0 + LONGEST_TICK, "a clock set back changes nothing");
    assert_eq!(session.seen().camera, after);
}

#[test]
fn the_sun_goes_where_it_is_put_and_comes_back() {
    let mut session = session();
    session.set_sun(Angles { azimuth: 90.0, elevation: 30.0 });
    let direction = session.seen().sun.direction;
    assert!((direction - DVec3::new(0.75_f64.sqrt(), 0.5, 0.0)).length() < 1e-12);
    session.set_day(Day { hour: 6.0, latitude: 0.0, day: 81.0 });
    assert!((session.seen().sun.direction - DVec3::X).length() < 1e-12, "it rises in the east");
    session.fly.push(Push::Up, true);
    session.step(0.1);
    session.fly.push(Push::Up, false);
    assert_ne!(session.seen().camera, session.start.camera);
    session.reset();
    assert_eq!(session.seen(), session.start);
}

#[test]
fn keys_do_what_the_help_says() {
    let mut session = session();
    let press = |session: &mut Session, key| {
        session.key(key, true, false);
        session.key(key, true, true);
        session.key(key, false, false);
        std::mem::take(&mut session.wishes)
    };
    assert_eq!(press(&mut session, Key::Pause), []);
    assert!(!session.clock.running, "holding a key is no second press");
    press(&mut session, Key::Panel);
    press(&mut session, Key::Help);
    assert!(!session.panel && session.help);
    press(&mut session, Key::Quicker);
    assert_eq!(session.clock.pace, 4.0, "held, it goes on");
    press(&mut session, Key::Slower);
    assert_eq!(session.clock.pace, 1.0);
    assert_eq!(press(&mut session, Key::Quit), [Wish::Quit]);
    assert_eq!(press(&mut session, Key::SaveScene), [Wish::SaveScene(None)]);
    let both = vec![Format::Png, Format::Exr];
    assert_eq!(press(&mut session, Key::Screenshot), [Wish::Screenshot(both)]);
    session.key(Key::Push(Push::Forward), true, false);
    session.key(Key::Push(Push::Forward), true, true);
    assert!(session.fly.is_moving());
    session.key(Key::Push(Push::Forward), false, false);
    (0..100).for_each(|_| session.step(0.1));
    assert!(!session.fly.is_moving());
    press(&mut session, Key::AddView);
    assert_eq!(session.path.len(), 1);
    press(&mut session, Key::Record);
    assert!(session.path.is_recording());
    press(&mut session, Key::Record);
    press(&mut session, Key::Replay);
    assert!(session.path.is_replaying());
    press(&mut session, Key::Replay);
    session.clock.running = true;
    press(&mut session, Key::Compare);
    assert!(session.compare.wanted && !session.clock.running, "only a view at rest has one");
    press(&mut session, Key::Compare);
    assert!(!session.compare.wanted);
    let seen = [0; 5].map(|_| {
        press(&mut session, Key::Inside);
        session.inside
    });
    assert_eq!(seen[..4], Inside::ALL.map(|(inside, _)| Some(inside)));
    assert_eq!(seen[4], None, "the picture again");
    press(&mut session, Key::Home);
    assert_eq!(session.seen().camera, session.start.camera);
}

#[test]
fn a_changed_file_keeps_the_flight_unless_it_moves_the_camera() {
    let mut session = session();
    session.fly.push(Push::Up, true);
    session.step(0.2);
    session.fly.release();
    let flown = session.fly.camera();
    let mut edited = session.start.clone();
    edited.exposure = 2.0;
    session.reload(edited.clone());
    assert_eq!((session.fly.camera(), session.scene.exposure), (flown, 2.0));
    assert_eq!(session.start, edited, "what a reset leads to");
    edited.camera.position.x += 5.0;
    session.reload(edited.clone());
    assert_eq!(session.fly.camera(), edited.camera);
    let other = Scene { name: "other".to_owned(), ..Scene::default() };
    session.load(other.clone());
    assert_eq!(session.seen(), other);
}

#[test]
fn every_window_has_a_picture_of_at_least_a_pixel() {
    let mut session = session();
    for (scale, window, picture) in [
        (1.0, [1280, 720], [1280, 720]),
        (0.5, [1281, 3], [641, 2]),
        (0.1, [1, 4], [1, 1]),
        (1.0, [9000, 10], [8192, 10]),
    ] {
        session.resolution.scale = scale;
        assert_eq!(session.picture_size(window, 8192, false), picture);
    }
    session.resolution.scale = 0.25;
    assert_eq!(session.picture_size([40, 20], 8192, true), [40, 20], "there is time");
    session.sharp = false;
    assert_eq!(session.picture_size([40, 20], 8192, true), [10, 5], "not asked for");
}
