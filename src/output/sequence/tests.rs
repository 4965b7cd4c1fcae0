use super::*;
use crate::output::tests::gradient;

fn sequence(folder: &Path) -> Sequence {
    Sequence {
        key: SequenceKey {
            program: "1".to_owned(),
            scene: "a scene".to_owned(),
            tables: "embedded".to_owned(),
            size: [16, 9],
            preset: Some(Preset::Low),
            lighting: None,
            reference: None,
            start_time: 10.0,
            fps: 4.0,
            path: None,
        },
        frames: FrameRange { start: 0, end: 6 },
        format: Format::Png,
        folder: folder.to_owned(),
        replace: false,
    }
}

fn fake(frame: u32, _: f64) -> Result<Picture> {
    Ok(gradient([16, 9], frame))
}

fn ignore(_: u32, _: FrameState, _: &Path) {}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn ranges_are_read_as_written() {
    assert_eq!("0..24".parse(), Ok(FrameRange { start: 0, end: 24 }));
    assert_eq!("3..=3".parse(), Ok(FrameRange { start: 3, end: 4 }));
    for bad in
        ["", "5", "..", "5..5", "6..5", "a..b", "-1..5", "0..5..6", "0..=4294967295", "0..1e3"]
    {
        assert!(bad.parse::<FrameRange>().is_err(), "{bad}");
    }
}

#[test]
fn times_follow_from_the_frame_alone() {
    let dir = folder();
    let mut times = Vec::new();
    let mut sequence = sequence(dir.path());
    sequence.frames = FrameRange { start: 2, end: 5 };
    let render = |frame, time| {
        times.push(time);
        fake(frame, time)
    };
    sequence.run(render, ignore).expect("written");
    assert_eq!(times, [10.5, 10.75, 11.0]);
}

#[test]
fn a_stopped_run_goes_on_where_it_stopped() {
    let (stopped, whole) = (folder(), folder());
    let first = sequence(stopped.path());
    let fail_at_3 = |frame, time| {
        if frame == 3 { Err(Error::Gpu("lost".to_owned())) } else { fake(frame, time) }
    };
    first.run(fail_at_3, ignore).expect_err("the device was lost");

    let mut rendered = Vec::new();
    let count = |frame, time| {
        rendered.push(frame);
        fake(frame, time)
    };
    let report = first.run(count, ignore).expect("written");
    assert_eq!(rendered, [3, 4, 5]);
    assert_eq!(report, SequenceReport { kept: 3, written: 3 });

    sequence(whole.path()).run(fake, ignore).expect("written");
    for frame in 0..6 {
        let read = |s: Sequence| std::fs::read(s.path(frame)).expect("readable");
        assert!(read(sequence(stopped.path())) == read(sequence(whole.path())), "frame {frame}");
    }
}

#[test]
fn a_damaged_frame_is_rendered_again() {
    let dir = folder();
    let sequence = sequence(dir.path());
    sequence.run(fake, ignore).expect("written");
    let bytes = std::fs::read(sequence.path(2)).expect("readable");
    std::fs::write(sequence.path(2), &bytes[..bytes.len() / 2]).expect("writable");
    let report = sequence.run(fake, ignore).expect("written");
    assert_eq!(report, SequenceReport { kept: 5, written: 1 });
    assert_eq!(std::fs::read(sequence.path(2)).expect("readable"), bytes);
}

#[test]
fn frames_of_other_settings_are_refused_or_replaced_but_never_mixed() {
    let dir = folder();
    let old = sequence(dir.path());
    old.run(fake, ignore).expect("written");

    let mut longer = sequence(dir.path());
    longer.frames.end = 8;
    let report = longer.run(fake, ignore).expect("more frames of the same");
    assert_eq!(report, SequenceReport { kept: 6, written: 2 });

    let changes: [fn(&mut SequenceKey); 8] = [
        |k| k.scene.push('!'),
        |k| k.preset = Some(Preset::High),
        |k| k.lighting = Some(Lighting::Octaves),
        |k| k.reference = Some("64 paths".to_owned()),
        |k| k.fps = 5.0,
        |k| k.path = Some("a path".to_owned()),
        |k| k.start_time = -1.0,
        |k| k.tables = "other".to_owned(),
    ];
    for change in changes {
        let mut other = sequence(dir.path());
        change(&mut other.key);
        assert!(other.check().is_err());
        let message = other.run(fake, ignore).expect_err("other frames").to_string();
        assert!(message.contains("--overwrite"), "{message}");
    }
    assert_eq!(old.run(fake, ignore).expect("untouched").kept, 6);

    let mut other = sequence(dir.path());
    other.key.fps = 5.0;
    other.frames.end = 2;
    other.replace = true;
    assert_eq!(other.run(fake, ignore).expect("replaced").written, 2);
    assert!(!other.path(7).exists(), "a frame of the old settings stayed");
}

#[test]
fn frames_without_a_description_are_somebody_elses() {
    let dir = folder();
    let sequence = sequence(dir.path());
    std::fs::write(sequence.path(4), "a picture of somebody").expect("writable");
    std::fs::write(dir.path().join("notes.txt"), "kept").expect("writable");
    assert!(sequence.run(fake, ignore).is_err());
    let replacing = Sequence { replace: true, ..sequence };
    assert_eq!(replacing.run(fake, ignore).expect("replaced").written, 6);
    assert!(dir.path().join("notes.txt").exists());
}

#[cfg(unix)]
#[test]
fn frames_of_others_are_not_mixed_in_while_a_run_goes_on() {
    let dir = folder();
    let first = sequence(dir.path());
    let mut other = Sequence { replace: true, ..sequence(dir.path()) };
    other.key.fps = 5.0;
    let mut rest = sequence(dir.path());
    rest.frames = FrameRange { start: 6, end: 8 };
    let mut told = Vec::new();
    let render = |frame, time| {
        // Before the first frame there is nothing to be seen in the folder but the description.
        told.push(other.run(fake, ignore).expect_err("another run goes on").to_string());
        assert_eq!(
            rest.run(fake, ignore).map(|r| r.kept + r.written).expect("the same sequence"),
            2
        );
        fake(frame, time)
    };
    assert_eq!(first.run(render, ignore).expect("written").written, 6);
    assert!(told.iter().all(|t| t.contains("being written by another run")), "{told:?}");
    assert!((0..8).all(|frame| rest.path(frame).exists()));
    // Once it has ended, what is asked for is done.
    assert_eq!(other.run(fake, ignore).expect("replaced").written, 6);
}
