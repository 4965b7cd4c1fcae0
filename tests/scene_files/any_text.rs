//! Whatever a file holds, reading it ends in a scene in range or in one sentence.

use proptest::prelude::*;

use super::{EVERY_FIELD, parse};

/// Reads it, and holds the reader to its promises.
fn read(text: &str) -> Result<(), TestCaseError> {
    match parse(text) {
        Ok(scene) => {
            prop_assert!(scene.validate().is_ok(), "{text}");
            let written = scene.to_toml().expect("a scene that was read can be written");
            let again = parse(&written).expect("what was written can be read");
            prop_assert_eq!(again, scene);
        }
        Err(error) => {
            let message = error.to_string();
            prop_assert_eq!(error.exit_code(), 2);
            prop_assert!(message.starts_with("a.toml"), "{}", message);
            prop_assert!(message.len() < 1500, "{} bytes", message.len());
            prop_assert!(!message.contains(|c: char| c.is_control()), "{:?}", message);
        }
    }
    Ok(())
}

/// Values that programs write and people mistype.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|v| format!("{v:?}").replace("NaN", "nan")),
        any::<i64>().prop_map(|v| v.to_string()),
        (-1000.0..1000.0_f64).prop_map(|v| format!("{v:?}")),
        "[a-z:0-9]{0,12}".prop_map(|v| format!("\"{v}\"")),
        proptest::collection::vec(any::<f32>(), 0..5)
            .prop_map(|v| format!("{v:?}").replace("NaN", "nan")),
        Just("true".to_owned()),
        Just("{}".to_owned()),
        Just("[]".to_owned()),
    ]
}

proptest! {
    // Reading takes some 50 us, so this many take less than a second.
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_characters(text in any::<String>()) {
        read(&text)?;
    }

    #[test]
    fn anything_that_looks_like_toml(text in "([a-z_]{1,8}( = |\\.|\\]\\]\n|\\[\\[|\\[|\\]\n|\"|#|\n|[0-9.e+-]{1,9}|\\{|\\}|,){1,3}){0,20}") {
        read(&text)?;
    }

    #[test]
    fn a_scene_with_one_value_changed(line in 0..EVERY_FIELD.lines().count(), value in value()) {
        let lines: Vec<String> = EVERY_FIELD.lines().enumerate().map(|(i, l)| {
            match l.split_once(" = ") {
                Some((key, _)) if i == line => format!("{key} = {value}"),
                _ => l.to_owned(),
            }
        }).collect();
        read(&lines.join("\n"))?;
    }

    #[test]
    fn a_scene_with_a_piece_cut_out_or_put_in(
        at in 0..EVERY_FIELD.len(), length in 0_usize..60, piece in "[ -~\n]{0,8}",
    ) {
        // The scene is ASCII, so every index is between characters.
        let end = (at + length).min(EVERY_FIELD.len());
        read(&format!("{}{piece}{}", &EVERY_FIELD[..at], &EVERY_FIELD[end..]))?;
    }
}
