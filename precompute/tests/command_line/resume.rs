//! Bakes that are killed, and bakes that get in each other's way.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{SMALL, bake};

fn start(out: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_precompute"))
        .arg("bake")
        .arg(format!("--out={}", out.display()))
        .args(SMALL)
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("it runs")
}

/// Everything in a folder and below, without what is being written.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_none_or(|e| e != "tmp") {
            found.push(path);
        }
    }
    found
}

/// Kills a bake as soon as so many parts of it are there; false where it was done before.
fn kill_after(parts: usize, folder: &Path, out: &Path) -> bool {
    let mut child = start(out);
    let patience = Instant::now();
    while files(folder).len() < parts {
        assert!(patience.elapsed() < Duration::from_secs(120), "it does not get on");
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("it ended");
    true
}

fn sound(path: &Path) -> bool {
    cumuli::tables::TableSet::load(path).is_ok()
}

#[test]
fn a_killed_bake_goes_on_and_comes_to_the_same_bytes() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let whole = dir.path().join("whole");
    assert!(bake(&whole, &[]).status.success());
    let expected = std::fs::read(&whole).expect("written");

    let folder = dir.path().join("new");
    std::fs::create_dir(&folder).expect("a folder");
    let out = folder.join("tables");
    for parts in 0..=2 {
        // A machine may be so quick that the bake was done: there is nothing to go on with then.
        if !kill_after(parts, &folder, &out) {
            std::fs::remove_file(&out).expect("a whole file");
            continue;
        }
        let left = files(&folder);
        assert!(left.len() >= parts && left.iter().all(|path| sound(path)), "{left:?}");
        if !out.exists() {
            let output = bake(&out, &[]);
            let told = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{told}");
            // What is done is not done again.
            assert_eq!(told.contains("of soft-9"), parts < 1, "{parts}: {told}");
            assert_eq!(told.contains("of pyroclastic-9"), left.len() < 2, "{parts}: {told}");
        }
        assert!(std::fs::read(&out).expect("written") == expected, "after {parts} parts");
        // Nothing else is left, not even of the bake that was killed while it wrote.
        let names: Vec<_> = std::fs::read_dir(&folder).expect("a folder").collect();
        assert_eq!(names.len(), 1, "{names:?}");
        std::fs::remove_file(&out).expect("removed");
    }
}

#[test]
fn a_damaged_part_is_computed_anew() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, out) = (dir.path().join("whole"), dir.path().join("new/tables"));
    assert!(bake(&whole, &[]).status.success());
    std::fs::create_dir(dir.path().join("new")).expect("a folder");
    if !kill_after(1, &dir.path().join("new"), &out) {
        return;
    }
    for part in files(&dir.path().join("new")) {
        let bytes = std::fs::read(&part).expect("a part");
        std::fs::write(&part, &bytes[..bytes.len() - 7]).expect("written");
    }
    assert!(bake(&out, &[]).status.success());
    assert!(std::fs::read(&out).expect("written") == std::fs::read(&whole).expect("written"));
}

#[test]
fn parts_of_other_options_are_not_taken() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, out) = (dir.path().join("whole"), dir.path().join("new/tables"));
    assert!(bake(&whole, &["--seed=3"]).status.success());
    std::fs::create_dir(dir.path().join("new")).expect("a folder");
    kill_after(1, &dir.path().join("new"), &out);
    assert!(bake(&out, &["--seed=3"]).status.success());
    assert!(std::fs::read(&out).expect("written") == std::fs::read(&whole).expect("written"));
}

#[test]
fn two_bakes_of_the_same_file_do_not_spoil_it() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, folder) = (dir.path().join("whole"), dir.path().join("new"));
    assert!(bake(&whole, &[]).status.success());
    let out = folder.join("tables");
    let mut children = [start(&out), start(&out)];
    for child in &mut children {
        assert!(child.wait().expect("it ended").success());
    }
    assert!(std::fs::read(&out).expect("written") == std::fs::read(&whole).expect("written"));
    assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 1);
}

#[test]
fn a_file_of_tables_is_replaced_only_by_a_whole_one() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let out = dir.path().join("tables");
    std::fs::write(&out, "old").expect("written");
    let mut child = start(&out);
    child.kill().expect("killed");
    child.wait().expect("it ended");
    assert!(std::fs::read(&out).expect("there") == b"old" || sound(&out));
}

/// Kills bakes at moments of every kind; what is on disk is whole each time, and the end is the same.
fn killed_again_and_again(kills: u32) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, folder) = (dir.path().join("whole"), dir.path().join("new"));
    let begin = Instant::now();
    assert!(bake(&whole, &[]).status.success());
    let longest = begin.elapsed();
    let expected = std::fs::read(&whole).expect("written");
    std::fs::create_dir(&folder).expect("a folder");
    let out = folder.join("tables");
    let mut killed = 0;
    for number in 0_u32.. {
        if killed == kills {
            break;
        }
        assert!(number < 50 + 4 * kills, "it is always done before it is killed");
        let mut child = start(&out);
        // Parts of the golden ratio: every stretch of the bake gets its share of the kills.
        let share = (f64::from(number) * 0.618_033_988_749_895).fract();
        std::thread::sleep(longest.mul_f64(1.1 * share));
        if child.try_wait().expect("a child").is_some() {
            assert!(std::fs::read(&out).expect("written") == expected, "round {number}");
            std::fs::remove_file(&out).expect("removed");
            continue;
        }
        child.kill().expect("killed");
        child.wait().expect("it ended");
        killed += 1;
        let left = files(&folder);
        assert!(left.iter().all(|path| sound(path)), "round {number}: {left:?}");
    }
    assert!(bake(&out, &[]).status.success());
    assert!(std::fs::read(&out).expect("written") == expected);
    println!("killed {killed} times");
}

#[test]
fn a_bake_killed_now_and_then() {
    killed_again_and_again(6);
}

#[test]
#[ignore = "fifty bakes take minutes"]
fn a_bake_killed_fifty_times() {
    killed_again_and_again(50);
}
