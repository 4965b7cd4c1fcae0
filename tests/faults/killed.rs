//! Sequences and reference renders, killed again and again.

use std::path::Path;
use std::time::Instant;

use cumuli::output::{Layers, is_whole_picture};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Place, names};

/// Kills in the tests for every day, and in the long ones.
const FEW: u32 = 6;
const MANY: u32 = 50;

/// A job that goes on where it was stopped.
struct Job {
    arguments: &'static str,
    /// File or folder that it makes.
    out: &'static str,
    /// Whether a file of its is whole.
    is_whole: fn(&Path) -> bool,
}

/// Whether a kill left this while it was being written.
fn is_temporary(name: &str) -> bool {
    name.starts_with('.') && name.ends_with(".tmp")
}

fn kill_again_and_again(job: &Job, kills: u32) {
    let (place, whole) = (Place::new(), Place::new());
    let start = Instant::now();
    whole.works(job.arguments);
    // Moments from the start to a little after the end.
    let longest = start.elapsed().mul_f64(1.1);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(u64::from(kills));
    let (mut killed, mut finished) = (0, 0);
    while killed < kills {
        let mut child = place.command(job.arguments).spawn().expect("the program starts");
        let share = (random.next_u64() >> 11) as f64 * (-53.0_f64).exp2();
        std::thread::sleep(longest.mul_f64(share));
        if child.try_wait().expect("a state").is_some_and(|status| status.success()) {
            // Done before the kill: what is there is all of it, and the next begins anew.
            assert_same(job, &place, &whole);
            let out = place.path(job.out);
            let _ = std::fs::remove_dir_all(&out).or_else(|_| std::fs::remove_file(&out));
            finished += 1;
            assert!(finished < 50 + 4 * kills, "it is always done before it is killed");
            continue;
        }
        child.kill().expect("killed");
        child.wait().expect("an end");
        killed += 1;
        for name in names(&place.path("")).iter().filter(|n| !is_temporary(n)) {
            let path = place.path(name);
            let files = if path.is_dir() { names(&path) } else { vec![String::new()] };
            for file in files.iter().filter(|n| !is_temporary(n)) {
                let file = if file.is_empty() { path.clone() } else { path.join(file) };
                assert!((job.is_whole)(&file), "{} is not whole", file.display());
            }
        }
    }
    place.works(job.arguments);
    assert_same(job, &place, &whole);
    println!("{}: killed {killed} times, finished {finished} times in between", job.out);
}

/// The same files with the same bytes, and nothing else.
fn assert_same(job: &Job, a: &Place, b: &Place) {
    // Leftovers of other kills than the last are swept by name; none may be a file of the job's.
    let kept = |p: &Place, below: &str| -> Vec<String> {
        p.names(below).into_iter().filter(|n| !is_temporary(n)).collect()
    };
    assert_eq!(kept(a, ""), kept(b, ""));
    let is_folder = a.path(job.out).is_dir();
    let files = if is_folder {
        assert_eq!(a.names(job.out), b.names(job.out));
        a.names(job.out).into_iter().map(|n| format!("{}/{n}", job.out)).collect()
    } else {
        vec![job.out.to_owned()]
    };
    for file in files {
        assert!(a.read(&file) == b.read(&file), "{file} differs");
    }
}

const SEQUENCE: Job = Job {
    arguments: "render --scene scene.toml --size 24x16 --preset low --frames 0..40 --out frames",
    out: "frames",
    is_whole: |path| match path.extension().and_then(|e| e.to_str()) {
        Some("png") => is_whole_picture(path, [24, 16]),
        Some("json") => {
            let bytes = std::fs::read(path).expect("readable");
            serde_json::from_slice::<serde_json::Value>(&bytes).is_ok()
        }
        _ => path.ends_with("scene.toml"),
    },
};

const REFERENCE: Job = Job {
    arguments: "render --scene scene.toml --reference --size 96x64 --spp 40 --save-every 0 --out truth.exr",
    out: "truth.exr",
    is_whole: |path| match path.extension().and_then(|e| e.to_str()) {
        Some("exr") => Layers::read(path, 1000).is_ok_and(|l| l.size == [96, 64]),
        // Damaged samples are refused by the run that goes on.
        Some("partial") => path.metadata().is_ok_and(|m| m.len() > 96 * 64 * 8 * 8),
        _ => path.ends_with("scene.toml"),
    },
};

#[test]
fn a_sequence_killed_now_and_then() {
    kill_again_and_again(&SEQUENCE, FEW);
}

#[test]
fn a_reference_killed_now_and_then() {
    kill_again_and_again(&REFERENCE, FEW);
}

#[test]
#[ignore = "fifty starts of the program take minutes"]
fn a_sequence_killed_fifty_times() {
    kill_again_and_again(&SEQUENCE, MANY);
}

#[test]
#[ignore = "fifty starts of the program take minutes"]
fn a_reference_killed_fifty_times() {
    kill_again_and_again(&REFERENCE, MANY);
}

/// Two at once in the same folder: each frame is written whole by one or the other.
fn two_at_once(job: &Job) {
    let (place, whole) = (Place::new(), Place::new());
    whole.works(job.arguments);
    let mut children = [0, 1].map(|_| place.command(job.arguments).spawn().expect("starts"));
    for child in &mut children {
        assert!(child.wait().expect("an end").success());
    }
    assert_same(job, &place, &whole);
}

#[test]
fn two_sequences_in_one_folder_do_not_spoil_it() {
    two_at_once(&SEQUENCE);
}

#[test]
fn two_reference_sequences_in_one_folder_do_not_spoil_it() {
    two_at_once(&Job {
        arguments: "render --scene scene.toml --reference --size 24x16 --spp 8 --frames 0..40 --save-every 0 --out frames",
        ..SEQUENCE
    });
}
