use super::*;
use crate::frame::{Counters, PassTime};
use crate::scene::{Channel, CloudField, Outside, ParticleSpec, Scene, WeatherImage, WeatherMap};

fn report() -> Report {
    let pass = |name: &str, ran, milliseconds| PassTime {
        name: name.to_owned(),
        milliseconds,
        ran,
        reason: "a reason".to_owned(),
    };
    Report {
        adapter: "an adapter".to_owned(),
        software: true,
        size: [640, 360],
        interval: 0.1,
        stats: FrameStats {
            unfinished: false,
            passes: vec![pass("sky", false, None), pass("blend", true, Some(1.25))],
            counters: Counters { particles_generated: 4321, ..Counters::default() },
        },
        message: Message { text: "a message".to_owned(), number: 1 },
        mistake: Some("line 3: a mistake".to_owned()),
        map_mistakes: [("map.png".into(), "no image".to_owned())].into(),
        shapes: vec!["uniform".to_owned(), "soft-1".to_owned()],
        ..Report::default()
    }
}

/// Shows the panel a few times, as its layout takes more than one frame to settle, with the
/// events of the last one; returns all text that is painted.
fn shown(session: &mut Session, events: Vec<Vec<egui::Event>>) -> String {
    let ctx = egui::Context::default();
    let mut text = String::new();
    for events in [vec![Vec::new(); 3], events].concat() {
        let size = egui::vec2(1280.0, 9000.0);
        let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size));
        let input = egui::RawInput { screen_rect, events, ..Default::default() };
        let output = ctx.run_ui(input, |ui| show(ui.ctx(), session, &report()));
        text.clear();
        for clipped in &output.shapes {
            if let egui::Shape::Text(shape) = &clipped.shape {
                text.push_str(shape.galley.text());
                text.push('\n');
            }
        }
        output.drop_without_applying_deltas();
    }
    text
}

fn session() -> Session {
    let weather = WeatherMap {
        file: "some/map.png".into(),
        extent: glam::DVec2::new(1234.5678, 98.7),
        centre: glam::DVec2::new(-3e10, 1.0 / 3.0),
        outside: Outside::Edge,
        channels: vec![Channel::Unused, Channel::Height],
        noise: 0.123_456_789,
        image: Arc::new(WeatherImage::new([3, 7], vec![0; 21])),
    };
    let clouds =
        Some(CloudField { coverage: 0.333_333, weather: Some(weather), ..CloudField::default() });
    let mut session = Session::new(Scene { clouds, ..Scene::default() }, 1234.567);
    // Values that sliders would round or pull into their range.
    session.scene.exposure = 20.5;
    session.clock.pace = 0.012_345;
    session.resolution.scale = 0.123_45;
    session.resolution.rate = 12.345;
    session.resolution.automatic = false;
    session.unfold = true;
    session.compare.wanted = true;
    session.help = true;
    session.clock.running = false;
    session.scene.particles.push(ParticleSpec {
        centre: glam::DVec3::new(1.234_567_891_2, -2e9, 3e-7),
        radius: 1e-3,
        extinction: 123_456.789,
        shape: "soft-1".to_owned(),
        orientation: glam::DQuat::from_xyzw(0.1, 0.7, -0.7, 0.1).normalize(),
    });
    session.start = session.scene.clone();
    session
}

#[test]
fn showing_it_changes_nothing() {
    let mut shown_session = session();
    let text = shown(&mut shown_session, Vec::new());
    assert_eq!(shown_session.seen(), session().seen());
    assert_eq!(shown_session.clock, session().clock);
    assert_eq!(shown_session.settings, session().settings);
    assert_eq!(shown_session.resolution, session().resolution);
    assert_eq!(shown_session.fly, session().fly);
    assert_eq!(shown_session.wishes, []);
    for part in [
        "a message",
        "software driver: an adapter",
        "at rest, 640 x 360 pixels",
        "blend",
        "1.25 ms",
        "skipped",
        "a reason",
        // One of each section.
        "Save scene",
        "time of day",
        "irradiance",
        "feature size",
        "diameter",
        "turn",
        "shutter",
        "pace",
        "Fly along",
        "preset",
        "sunlight at particles",
        "they begin when the view rests",
        "fly along the camera path",
        "4321, 0 in view",
        "line 3: a mistake",
        "no image",
        "some/map.png",
        "3 x 7",
        "green",
    ] {
        assert!(text.contains(part), "{text} lacks {part}");
    }
}

#[test]
fn without_a_field_there_is_no_coverage() {
    let mut session = session();
    assert!(shown(&mut session, Vec::new()).contains("feature size"));
    session.scene.clouds = None;
    assert!(!shown(&mut session, Vec::new()).contains("feature size"));
}

/// A message goes after a while, and comes again where the same is told again.
#[test]
fn the_same_message_twice_is_shown_twice() {
    let ctx = egui::Context::default();
    let mut report = Report::default();
    let is_shown = |report: &Report, time| {
        let input = egui::RawInput { time: Some(time), ..Default::default() };
        let output = ctx.run_ui(input, |ui| notes::news(ui.ctx(), report, &mut Corner::default()));
        let texts = output.shapes.iter().filter_map(|clipped| match &clipped.shape {
            egui::Shape::Text(shape) => Some(shape.galley.text().to_owned()),
            _ => None,
        });
        let found = texts.into_iter().any(|text| text == "loaded again");
        output.drop_without_applying_deltas();
        found
    };
    for begin in [1.0, 100.0] {
        report.message.tell("loaded again".to_owned());
        // Its first layout is not painted yet.
        is_shown(&report, begin);
        assert!(is_shown(&report, begin + 1.0), "told at {begin}");
        assert!(!is_shown(&report, begin + 50.0), "told at {begin}");
    }
}

/// Keys, news and mistakes share a corner; what is told beside the picture stands above it.
#[test]
fn no_note_hides_another() {
    for size in [egui::vec2(640.0, 480.0), egui::vec2(1280.0, 720.0), egui::vec2(1920.0, 1080.0)] {
        let ctx = egui::Context::default();
        let mut session = session();
        (session.help, session.panel) = (true, false);
        session.clock.running = false;
        session.compare.wanted = true;
        let later = Report { has_picture: true, legend: Some("colours".to_owned()), ..report() };
        let first = Report {
            mistake: None,
            map_mistakes: BTreeMap::new(),
            message: Message::default(),
            ..later.clone()
        };
        // What was there alone makes room.
        for report in [&first, &first, &first, &later, &later, &later] {
            let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size));
            let input = egui::RawInput { screen_rect, ..Default::default() };
            let output = ctx.run_ui(input, |ui| show(ui.ctx(), &mut session, report));
            output.drop_without_applying_deltas();
        }
        let rect = |name: &str| {
            let rect = ctx.memory(|memory| memory.area_rect(egui::Id::unique(name)));
            rect.unwrap_or_else(|| panic!("{name} is not shown"))
        };
        // From below to above.
        let names = ["Mistake in the file", "News", "Keys", "Beside the picture"];
        let rects = names.map(rect);
        for (pair, names) in rects.windows(2).zip(names.windows(2)) {
            assert!(pair[1].bottom() <= pair[0].top(), "{names:?} in {size}: {pair:?}");
        }
        assert!(rects[0].bottom() <= size.y && rects[3].top() >= 0.0, "{rects:?}");
    }
}
