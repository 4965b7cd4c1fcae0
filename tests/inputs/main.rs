//! Inputs under attack: every reader is given files that were sound and have been cut, flipped,
//! spliced and mistyped. Whatever they hold, reading ends soon, in a value or in one sentence, without
//! a panic and without taking more memory than a stated multiple of the file's size.
//!
//! The long tests read a million each: `cargo test --release --test inputs -- --ignored --nocapture`.

mod damage;
mod large_maps;
mod readers;

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use cpu_time::ThreadTime;
use peak_alloc::PeakAlloc;

use damage::Damage;
use readers::Reader;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Inputs of the tests for every day, and of the long ones.
const FEW: u64 = 10_000;
const MANY: u64 = 1_000_000;
/// No input may take more of a processor's time to read: they are a few hundred kilobytes at most, which
/// takes milliseconds.
const MOST_TIME: Duration = Duration::from_secs(1);
/// Longest message, bytes: it quotes at most a few names of the input.
const MOST_MESSAGE: usize = 1500;

/// What one test allocates is not to be counted for another.
static TURN: Mutex<()> = Mutex::new(());

fn attack(reader: &Reader, inputs: u64) {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let seeds = (reader.seeds)();
    for seed in &seeds {
        (reader.read)(seed).unwrap_or_else(|e| panic!("{}: {e}", reader.name));
    }
    let mut damage = Damage::new(seeds);
    let (mut accepted, mut most, mut longest) = (0_u64, 0.0_f64, Duration::ZERO);
    for number in 0..inputs {
        let input = damage.input();
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let start = ThreadTime::now();
        let result = (reader.read)(&input);
        let took = start.elapsed();
        let taken = MEMORY.peak_usage().saturating_sub(before);
        let allowed = reader.multiple * input.len() + reader.constant;
        let show = || format!("{} {number}: {:?}", reader.name, String::from_utf8_lossy(&input));
        assert!(taken <= allowed, "{taken} bytes taken, {allowed} allowed; {}", show());
        assert!(took <= MOST_TIME, "{took:?}; {}", show());
        most = most.max(taken.saturating_sub(reader.constant) as f64 / input.len().max(1) as f64);
        longest = longest.max(took);
        match result {
            Ok(()) => accepted += 1,
            Err(error) => {
                let text = error.to_string();
                assert_eq!(error.exit_code(), 2, "{text}; {}", show());
                assert!(text.starts_with(readers::PLACE), "{text}; {}", show());
                assert!(text.len() <= MOST_MESSAGE, "{} bytes; {}", text.len(), show());
                assert!(!text.contains(char::is_control), "{text:?}; {}", show());
            }
        }
    }
    println!(
        "{}: {inputs} inputs, {accepted} accepted, {} refused; most memory {most:.1} times the input \
         and {} bytes, longest {:.1} ms",
        reader.name,
        inputs - accepted,
        reader.constant,
        longest.as_secs_f64() * 1e3
    );
    // Damage that always or never matters would test little.
    assert!(accepted > inputs / 1000 && accepted < inputs - inputs / 1000, "{accepted} accepted");
}

macro_rules! attacks {
    ($($name:ident, $long:ident, $reader:expr;)*) => {$(
        #[test]
        fn $name() {
            attack(&$reader, FEW);
        }

        #[test]
        #[ignore = "a million inputs take minutes"]
        fn $long() {
            attack(&$reader, MANY);
        }
    )*};
}

attacks! {
    scenes, a_million_scenes, readers::SCENES;
    particle_lists, a_million_particle_lists, readers::PARTICLES;
    camera_paths, a_million_camera_paths, readers::PATHS;
    tables, a_million_tables, readers::TABLES;
    weather_maps, a_million_weather_maps, readers::MAPS;
    rays, a_million_ray_files, readers::RAYS;
}
