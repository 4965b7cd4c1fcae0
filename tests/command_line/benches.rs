//! `cumuli bench`: what it writes, by schema and counters; never by a clock.

use serde_json::Value;

use super::{Place, Run, assert_sentence};

/// With numbers that make it a matter of seconds.
const TINY: &str = "bench --quick --size 64x36 --frames 2 --set grid_fineness=0.25 \
    --set shadow_steps=2 --set shadow_resolution=32 --out b";

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&place.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The value of NAME=VALUE in the summary line.
fn word<'a>(run: &'a Run, name: &str) -> &'a str {
    let line = run.out.lines().last().expect("a summary line");
    assert!(line.starts_with("bench schema=1 "), "{line}");
    let mut words = line.split(' ').filter_map(|word| word.split_once('='));
    words.find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{line} lacks {name}")).1
}

/// Times are positive and in order; nothing more is said of them.
fn check_spread(spread: &Value) {
    let [min, median, p95, p99, max] =
        ["min", "median", "p95", "p99", "max"].map(|k| spread[k].as_f64().expect(k));
    let rising = min <= median && median <= p95 && p95 <= p99 && p99 <= max;
    assert!(min >= 0.0 && rising && spread["spread"].as_f64().is_some(), "{spread}");
}

fn check_runs(bench: &Value) {
    let runs = bench["runs"].as_array().expect("runs");
    let names: Vec<_> = runs.iter().map(|r| r["case"].as_str().expect("a name")).collect();
    assert_eq!(
        names,
        [
            "still_paused",
            "still_animated",
            "flight",
            "looking_away",
            "empty_sky",
            "low_sun",
            "far_from_origin",
            "overcast"
        ]
    );
    let counter = |case: &str, name: &str| -> Vec<u64> {
        let run = runs.iter().find(|r| r["case"] == case).expect(case);
        let frames = run["frames"].as_array().expect("frames");
        assert_eq!(frames.len(), 2, "{case}");
        frames.iter().map(|f| f["counters"][name].as_u64().expect(name)).collect()
    };
    let ran = |case: &str, pass: &str| -> Vec<bool> {
        let run = runs.iter().find(|r| r["case"] == case).expect(case);
        let frames = run["frames"].as_array().expect("frames").iter();
        let passes = frames.map(|f| f["passes"].as_array().expect("passes"));
        let found = passes.map(|p| p.iter().find(|p| p["name"] == pass).expect(pass));
        found.map(|p| p["ran"].as_bool().expect("ran")).collect()
    };
    for run in runs {
        check_spread(&run["wall_ms"]);
        check_spread(&run["cpu_ms"]);
        let case = run["case"].as_str().expect("a name");
        assert!(run["first_ms"].as_f64().is_some_and(|ms| ms > 0.0), "{case}");
        assert_eq!(counter(case, "overflowed"), [0, 0], "{case}");
        assert_eq!(counter(case, "tiles"), [40, 40], "{case}");
    }
    // What a scene does not need is not done, and what it needs is.
    assert_eq!(ran("still_paused", "blend"), [false, false]);
    assert_eq!(ran("still_paused", "resolve"), [false, false]);
    assert_eq!(ran("still_animated", "blend"), [true, true]);
    assert_eq!(ran("empty_sky", "blend"), [false, false]);
    assert_eq!(counter("empty_sky", "particles_generated"), [0, 0]);
    assert_eq!(counter("looking_away", "particles_visible"), [0, 0]);
    assert_eq!(counter("looking_away", "tiles_empty"), [40, 40]);
    // What is out of view is not even made.
    assert_eq!(counter("looking_away", "particles_generated"), [0, 0]);
    assert_eq!(ran("looking_away", "rings"), [false, false]);
    let [clear, closed] =
        ["still_animated", "overcast"].map(|case| counter(case, "screen_list_entries")[0]);
    assert!(closed > 2 * clear, "{closed} {clear}");
    let lookups = counter("flight", "table_lookups");
    assert!(lookups.iter().all(|n| *n > 0), "{lookups:?}");
}

/// Errors of a picture of 64x36 are those of few pixels: signs and order only.
fn check_curve(bench: &Value) {
    let curves = bench["curves"].as_array().expect("curves");
    assert_eq!(curves.len(), 1);
    let points = curves[0]["points"].as_array().expect("points");
    let find = |name: &str| points.iter().find(|p| p["name"] == name).expect(name);
    for name in ["low", "medium", "high", "ultra", "high scale=0.5", "march-8", "view-march-128"] {
        check_spread(&find(name)["wall_ms"]);
    }
    let error = |name: &str| find(name)["algorithm"]["rel_mse"].as_f64().expect("an error");
    assert!(error("high") > 0.0 && error("high") < error("high scale=0.5"));
    assert!(error("view-march-128") < error("view-march-8"));
    assert!(points.iter().any(|p| p["on_algorithm_front"] == true));
    // Processor time counts where the processor draws.
    let software = bench["machine"]["kind"] == "Cpu";
    assert_eq!(curves[0]["cost"], if software { "processor" } else { "wall" });
    // No reference of this size is there.
    assert!(points.iter().all(|p| p["model"].is_null()));
}

/// Names of all fields.
fn fields<'a>(value: &'a Value, found: &mut Vec<&'a str>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(name, value)| {
            found.push(name);
            fields(value, found);
        }),
        Value::Array(values) => values.iter().for_each(|value| fields(value, found)),
        _ => {}
    }
}

/// Every field is told in docs/bench-schema.md.
fn check_schema(bench: &Value) {
    check_fields(bench, 1000);
}

fn check_fields(bench: &Value, least: usize) {
    const SCHEMA: &str = include_str!("../../docs/bench-schema.md");
    let mut found = Vec::new();
    fields(bench, &mut found);
    let told = |name: &str| {
        [format!("`{name}`"), format!("`{name}[]`")].iter().any(|n| SCHEMA.contains(n))
    };
    let missing: Vec<_> = found.iter().filter(|name| !told(name)).collect();
    assert!(found.len() > least && missing.is_empty(), "{missing:?}");
}

#[test]
fn a_quick_bench_writes_what_the_schema_says() {
    let place = Place::new();
    place.write(
        "readme.md",
        "before\n<!-- presets: made by cumuli bench -->\nold\n<!-- /presets -->\nafter\n",
    );
    let run = place.works(&format!("{TINY} --readme readme.md"));
    assert_eq!(place.names("b"), ["bench.csv", "bench.json", "report.html", "trace.json"]);
    let bench = json(&place, "b/bench.json");
    assert_eq!(bench["schema"], 1);
    for field in ["cpu", "adapter", "driver", "commit", "system", "build"] {
        assert!(bench["machine"][field].as_str().is_some_and(|s| !s.is_empty()), "{field}");
    }
    check_runs(&bench);
    check_curve(&bench);
    check_schema(&bench);
    let motion = &bench["motion"][0];
    assert_eq!(motion["case"], "flight");
    assert!(motion["alone"]["rel_mse"].as_f64().is_some_and(|e| (0.0..0.1).contains(&e)));

    assert_eq!(word(&run, "size"), "64x36");
    assert!(word(&run, "flight:low_ms").parse::<f64>().is_ok_and(|ms| ms > 0.0));
    let csv = String::from_utf8(place.read("b/bench.csv")).expect("UTF-8");
    let header = csv.lines().next().expect("a header");
    let columns = header.split(',').count();
    assert!(header.contains("blend_ms") && header.contains("bytes_resident"), "{header}");
    assert_eq!(csv.lines().count(), 1 + 8 * 2);
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
    let trace = json(&place, "b/trace.json");
    let events = trace["traceEvents"].as_array().expect("events");
    assert!(events.iter().filter(|e| e["ph"] == "X").count() > 16);
    let page = String::from_utf8(place.read("b/report.html")).expect("UTF-8");
    assert!(page.matches("<svg").count() >= 3 && page.ends_with("</body></html>\n"));
    let outside = ["http", "src=", "href=", "url(", "@import", "<script", "<link"];
    let own = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!outside.iter().any(|mark| own.contains(mark)), "it needs no other file");
    let readme = String::from_utf8(place.read("readme.md")).expect("UTF-8");
    assert!(readme.starts_with("before\n") && readme.ends_with("<!-- /presets -->\nafter\n"));
    assert!(readme.contains("| cumulus | ultra |") && !readme.contains("old"), "{readme}");

    // Against itself nothing has changed.
    let same = place.works("bench --compare b/bench.json b/bench.json");
    let last = same.out.lines().last().expect("a line");
    assert!(last.contains("slower=0 quicker=0"), "{last}");
}

/// Ratios of pairs of cases, and what borders of rings do; how much, is not to be seen in so few pixels.
#[test]
fn ratios_and_popping_in_place_of_the_cases() {
    let place = Place::new();
    let run = place.works(&format!("{TINY} --ratios"));
    let bench = json(&place, "b/bench.json");
    assert!(["runs", "curves", "motion"].iter().all(|part| bench[part] == serde_json::json!([])));
    check_fields(&bench, 100);
    let against = bench["against"].as_array().expect("ratios");
    for pair in [
        "one_more_ring",
        "ten_times_the_particles",
        "looking_away_over_empty_sky",
        "paused_over_animated",
    ] {
        let whole = |r: &&Value| r["case"] == format!("{pair} low") && r["what"] == "cpu";
        let ratio = against.iter().find(whole).expect(pair);
        assert!(ratio["ratio"].as_f64().is_some_and(|r| r > 0.0), "{ratio}");
    }
    let ratios = |of: &str, what: &str| -> Vec<f64> {
        let is_it =
            |r: &&Value| r["what"] == what && r["case"].as_str().is_some_and(|c| c.contains(of));
        against.iter().filter(is_it).map(|r| r["ratio"].as_f64().expect(of)).collect()
    };
    // The blend does more than look up, and marching the sun's rays takes longer than all of a frame.
    let fetches = ratios("blend_over_its_fetches cumulus low", "blend");
    assert!(fetches.len() == 1 && fetches[0] > 0.5, "{fetches:?}");
    for march in ["view-march-", "march-"] {
        assert!(ratios(march, "blend").iter().any(|r| *r > 0.0), "{march}: {against:?}");
    }
    let popping = &bench["popping"][0];
    let of = |how: &str| popping[how]["rms"].as_f64().expect(how);
    assert!(popping["fading"]["pixels"].as_u64().is_some_and(|n| n > 100), "{popping}");
    assert!(of("fading") > 0.0 && of("at_once") != of("fading"), "{popping}");
    assert!(word(&run, "flight:low_popping").parse::<f64>().is_ok_and(|v| v > 0.0));
    let page = String::from_utf8(place.read("b/report.html")).expect("UTF-8");
    assert!(page.contains("Popping") && page.contains("one_more_ring") && page.contains("march-"));
}

/// Two clumps with paths so few that nothing is said of their errors but that they are there.
#[test]
fn clumps_are_lit_in_turn_and_their_references_kept() {
    const CLUMPS: &str = "bench --clumps --only clump-5-side --only clump-20-back-inside --seed 3 --size 12x8 --spp 4 \
        --frames 2 --preset low --set grid_fineness=0.25 --set shadow_resolution=32 --references none --out c";
    let place = Place::new();
    place.write(
        "readme.md",
        "before\n<!-- clumps: made by cumuli bench --clumps -->\nold\n<!-- /clumps -->\nafter\n",
    );
    let run = place.works(&format!("{CLUMPS} --readme readme.md"));
    let bench = json(&place, "c/bench.json");
    check_fields(&bench, 100);
    assert!(["runs", "curves", "motion"].iter().all(|part| bench[part] == serde_json::json!([])));
    let clumps = &bench["clumps"];
    assert_eq!(clumps["seed"], 3);
    assert!(clumps["cost"].is_null(), "{clumps}");
    let cases = clumps["cases"].as_array().expect("cases");
    let names: Vec<_> = cases.iter().map(|c| c["case"].as_str().expect("a name")).collect();
    assert_eq!(names, ["clump-5-side-outside", "clump-5-side-inside", "clump-20-back-inside"]);
    for case in cases {
        assert_eq!((&case["size"], &case["preset"]), (&serde_json::json!([12, 8]), &"low".into()));
        let lit = case["lit"].as_array().expect("pictures");
        let how: Vec<_> = lit.iter().map(|l| l["lighting"].as_str().expect("a name")).collect();
        assert_eq!(how, ["grid", "octaves", "alone"]);
        for lit in lit {
            let error = |name: &str| lit["error"][name].as_f64().expect(name);
            assert!(error("rel_mse") > 0.0 && error("rel_mse_of_noise") > 0.0, "{lit}");
            let most = error("rel_mse");
            let own = lit["rel_mse_without_noise"].as_f64().expect("an error");
            assert!(own > 0.0 && own <= most, "{lit}");
            check_spread(&lit["wall_ms"]);
            check_spread(&lit["cpu_ms"]);
        }
        // Whole frames, made alone, take longer than without a grid; by how much no clock is asked.
        assert_eq!(case["times"].as_array().expect("ratios").len(), 4, "{case}");
        let name = case["case"].as_str().expect("a name");
        assert!(!place.read(&format!("c/{name}.toml")).is_empty());
        for of in ["reference.png", "reference.exr", "low-grid.png", "low-alone.png"] {
            assert!(!place.read(&format!("c/{name}-{of}")).is_empty());
        }
    }
    // Pictures differ: each lighting was made, and the light's errors with it.
    let bytes = |of: &str| place.read(&format!("c/clump-5-side-outside-low-{of}.png"));
    assert!(bytes("grid") != bytes("octaves") && bytes("octaves") != bytes("alone"));
    let csv = String::from_utf8(place.read("c/clumps.csv")).expect("UTF-8");
    assert_eq!(csv.lines().count(), 1 + 3 * 3);
    assert!(csv.lines().all(|line| line.split(',').count() == 15), "{csv}");
    let readme = String::from_utf8(place.read("readme.md")).expect("UTF-8");
    assert!(readme.starts_with("before\n") && readme.ends_with("<!-- /clumps -->\nafter\n"));
    assert!(readme.contains("| clump-20-back-inside low |") && !readme.contains("old"), "{readme}");
    assert!(run.out.contains("Of 3 cases miss their targets"), "{}", run.out);

    // Again, all paths are there; the same seed, the same clumps, and to the bit the same pictures.
    let reference = place.read("c/clump-5-side-inside-reference.exr");
    let samples = place.read("c/clump-5-side-inside.samples");
    let again = place.works(CLUMPS);
    assert!(!again.err.contains("paths of each pixel 1/4"), "{}", again.err);
    assert_eq!(place.read("c/clump-5-side-inside-reference.exr"), reference);
    assert_eq!(place.read("c/clump-5-side-inside.samples"), samples);
    let error = |bench: &Value| bench["clumps"]["cases"][1]["lit"][2]["error"].clone();
    assert_eq!(error(&json(&place, "c/bench.json")), error(&bench));
}

#[test]
fn scenes_of_ones_own_and_presets_in_turn() {
    let place = Place::new();
    let tables = cumuli::tables::TableSet::embedded().expect("the built-in tables");
    tables.save(&place.path("same.safetensors")).expect("saved");
    let run = place.works(
        "bench --quick --size 32x18 --frames 3 --scene small.toml --preset low --against high \
         --set steps=3 --spp 2 --more-tables same.safetensors --out b",
    );
    let bench = json(&place, "b/bench.json");
    let runs = bench["runs"].as_array().expect("runs");
    let names: Vec<_> = runs
        .iter()
        .map(|r| [&r["case"], &r["preset"]].map(|v| v.as_str().expect("a name")))
        .collect();
    let [paused, animated] = ["small/paused", "small/animated"];
    assert_eq!(names, [[paused, "low"], [paused, "high"], [animated, "low"], [animated, "high"]]);
    assert_eq!(bench["settings"]["set"], serde_json::json!(["steps=3"]));
    assert_eq!(bench["curves"][0]["reference"], "traced with 2 paths a pixel");
    let model = &bench["curves"][0]["points"][0]["model"];
    assert!(model["rel_mse_of_noise"].as_f64().is_some_and(|e| e > 0.0), "{model}");
    // Tables that are the same make the same picture.
    let points = bench["curves"][0]["points"].as_array().expect("points");
    let error = |name: &str| &points.iter().find(|p| p["name"] == name).expect(name)["model"];
    assert_eq!(error("high same.safetensors"), error("high"));
    let walls = bench["against"].as_array().expect("ratios");
    assert_eq!(walls.iter().filter(|r| r["what"] == "wall").count(), 2);
    assert!(run.out.contains("ratios="), "{}", run.out);
}

/// Nothing to be seen is nothing to be wrong about, in a bench and in an exact picture.
#[test]
fn a_scene_without_clouds_is_measured() {
    let place = Place::new();
    let clear =
        "[camera]\nposition = [0, 100, 0]\ntarget = [0, 100, -1]\n[sun]\ndirection = [0, 1, 1]\n";
    place.write("clear.toml", clear);
    let run = place.works(
        "bench --quick --size 1x1 --frames 1 --scene clear.toml --set grid_fineness=0.25 --out b",
    );
    assert!(word(&run, "clear/animated:low_ms").parse::<f64>().is_ok_and(|ms| ms > 0.0));
    let bench = json(&place, "b/bench.json");
    let points = bench["curves"][0]["points"].as_array().expect("points");
    assert!(points.iter().all(|p| p["model"].is_null() && p["algorithm"].is_null()), "{points:?}");
    assert_eq!(bench["motion"], serde_json::json!([]));
    place.works("render --exact --size 2x1 --scene clear.toml --out exact.exr");
    assert!(place.read("exact.exr").len() > 100);
}

/// Frames that take pixels and light over from those before do the same work in both flights of a case.
#[test]
fn frames_that_take_over_are_measured() {
    let place = Place::new();
    // Clouds that drift, so that every frame shades some pixels anew.
    place.write(
        "field.toml",
        "[camera]\nposition = [0, 250, 0]\ntarget = [1, 250, 0]\n[sun]\ndirection = [0, 1, 1]\n[clouds]\n\
         base = 100\nthickness = 300\ncoverage = 0.9\ncells = 8\nrings = 1\nlayers = 3\n",
    );
    place.works(
        "bench --quick --size 16x9 --frames 2 --scene field.toml --set pixel_stride=2 \
         --set grid_slice=2 --set grid_fineness=0.25 --out b",
    );
    let bench = json(&place, "b/bench.json");
    let shaded = bench["runs"][1]["frames"][0]["counters"]["pixels_shaded"].as_u64();
    // A quarter of the pixels, and those at the odd lower edge.
    assert!(shaded.is_some_and(|n| n > 0 && n <= 8 * 5), "{shaded:?}");
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let place = Place::new();
    place.write("bench.json", "{\"schema\": 99}");
    place.write("other.json", "[]");
    place.write("cut.json", "{\"schema\": 1, \"machine\": {");
    place.write("nan.json", "{\"schema\": NaN}");
    for (arguments, parts) in [
        ("bench --scene none.toml", ["none.toml", "no such file"]),
        ("bench --compare bench.json bench.json", ["bench.json", "schema 1, found 99"]),
        ("bench --compare other.json other.json", ["other.json", "no bench"]),
        ("bench --compare none.json none.json", ["none.json", "bench.json"]),
        ("bench --compare cut.json other.json", ["cut.json", "no bench"]),
        ("bench --compare nan.json other.json", ["nan.json", "no bench"]),
        ("bench --compare . other.json", [".:", "cannot be read"]),
        ("bench --preset low --against low", ["--against", "another preset"]),
        ("bench --scene small.toml --scene small.toml", ["--scene", "different names"]),
        ("bench --preset low --preset low", ["--preset", "twice"]),
        ("bench --out small.toml", ["small.toml", "expected a folder"]),
        ("bench --readme none.md", ["none.md", "cannot be read"]),
        ("bench --more-tables small.toml", ["small.toml", "table"]),
        ("bench --clumps --only nowhere", ["--only", "no case"]),
        ("bench --readme small.toml", ["small.toml", "presets"]),
        ("bench --clumps --readme small.toml", ["small.toml", "clumps"]),
    ] {
        assert_sentence(&place.refuses(arguments), &parts);
    }
    for (arguments, part) in [
        ("bench --frames 0", "1 to 1000000"),
        ("bench --only clump", "--clumps"),
        ("bench --seed 2", "--clumps"),
        ("bench --clumps --seed x", "--seed"),
        ("bench --clumps --ratios", "--ratios"),
        ("bench --clumps --scene small.toml", "--scene"),
        ("bench --set steps=0", "from 1 to 32"),
        ("bench --compare bench.json", "2 values"),
        ("bench --compare bench.json bench.json --quick", "--quick"),
        ("bench --compare bench.json bench.json --out b", "--out"),
    ] {
        let message = place.refuses(arguments);
        assert!(message.contains(part), "{message}");
    }
}
