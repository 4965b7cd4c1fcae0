//! Light among overlapping particles as tables: for a terminal, a README, other programs.

use crate::bench::record::{Bench, Clumps, LightCost, Lit, LitCase};
use crate::frame::Lighting;

/// What is asked of the frame: bias, relMSE from outside and from inside, mean LDR FLIP, relMSE of particles alone over
/// its own.
pub const TARGETS: Targets =
    Targets { bias: 0.03, outside: 0.005, inside: 0.01, flip: 0.04, alone_over_grid: 4.0 };

/// What figures are compared with.
#[derive(Clone, Copy, Debug)]
pub struct Targets {
    /// Mean radiance over the reference's, less 1.
    pub bias: f64,
    /// relMSE, the eye outside of clouds.
    pub outside: f64,
    /// relMSE, the eye within.
    pub inside: f64,
    /// LDR FLIP.
    pub flip: f64,
    /// relMSE of particles alone over the frame's.
    pub alone_over_grid: f64,
}

impl LitCase {
    /// The picture lit in one way.
    pub fn with(&self, lighting: Lighting) -> Option<&Lit> {
        self.lit.iter().find(|lit| lit.lighting == lighting)
    }

    /// What of the frame's figures misses its target: bias, relMSE, FLIP, ratio.
    pub fn missed(&self) -> [bool; 4] {
        let Some(grid) = self.with(Lighting::Grid) else { return [true; 4] };
        let most = if self.case.ends_with("inside") { TARGETS.inside } else { TARGETS.outside };
        [
            grid.error.bias.abs() > TARGETS.bias,
            grid.rel_mse_without_noise > most,
            grid.error.flip > TARGETS.flip,
            self.alone_over_grid < TARGETS.alone_over_grid,
        ]
    }
}

/// One line of cells for each case; the frame's figures that miss their targets carry a star.
fn rows(clumps: &Clumps) -> Vec<[String; 14]> {
    let row = |case: &LitCase| {
        let star = |text: String, missed: bool| if missed { format!("{text} *") } else { text };
        let [bias, rel_mse, flip, ratio] = case.missed();
        let of = |lighting, figure: &dyn Fn(&Lit) -> String| {
            case.with(lighting).map_or_else(String::new, figure)
        };
        let figures = |lighting| {
            [
                of(lighting, &|l| format!("{:+.1} %", 100.0 * l.error.bias)),
                of(lighting, &|l| format!("{:.4}", l.rel_mse_without_noise)),
                of(lighting, &|l| format!("{:.3}", l.error.flip)),
            ]
        };
        let [grid, octaves, alone] = Lighting::ALL.map(figures);
        let times = Lighting::ALL
            .map(|lighting| of(lighting, &|l| format!("{:.0}", l.cpu_ms.median)))
            .join(" / ");
        let name = format!("{} {}", case.case, case.preset);
        let own_noise = of(Lighting::Grid, &|l| format!("{:.4}", l.error.rel_mse_of_noise));
        let flip_of_noise = of(Lighting::Grid, &|l| format!("{:.3}", l.flip_of_noise));
        [
            name,
            star(grid[0].clone(), bias),
            star(grid[1].clone(), rel_mse),
            own_noise,
            star(grid[2].clone(), flip),
            flip_of_noise,
            octaves[0].clone(),
            octaves[1].clone(),
            octaves[2].clone(),
            alone[0].clone(),
            alone[1].clone(),
            alone[2].clone(),
            star(format!("{:.1}", case.alone_over_grid), ratio),
            times,
        ]
    };
    clumps.cases.iter().map(row).collect()
}

const HEAD: [&str; 14] = [
    "case",
    "bias",
    "relMSE",
    "of noise",
    "FLIP",
    "of noise",
    "octaves: bias",
    "relMSE",
    "FLIP",
    "alone: bias",
    "relMSE",
    "FLIP",
    "alone / ours",
    "processor ms",
];

/// For people at a terminal: columns of even width, and a line on what misses its target.
pub fn lines(clumps: &Clumps) -> Vec<String> {
    let all: Vec<_> = std::iter::once(HEAD.map(str::to_owned)).chain(rows(clumps)).collect();
    let width = |column: usize| all.iter().map(|row| row[column].chars().count()).max();
    let line = |row: &[String; 14]| {
        let cell = |(i, cell): (usize, &String)| {
            let width = width(i).unwrap_or(0);
            if i == 0 { format!("{cell:width$}") } else { format!("{cell:>width$}") }
        };
        row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    let mut lines: Vec<_> = all.iter().map(line).collect();
    lines.push(told(clumps));
    lines.extend(clumps.cost.as_ref().map(cost));
    lines
}

/// How many figures miss their targets.
fn told(clumps: &Clumps) -> String {
    let missed = clumps.cases.iter().fold([0; 4], |mut sum, case| {
        sum.iter_mut().zip(case.missed()).for_each(|(n, missed)| *n += u32::from(missed));
        sum
    });
    let Targets { bias, outside, inside, flip, alone_over_grid } = TARGETS;
    let [a, b, c, d] = missed;
    format!(
        "Of {} cases miss their targets (*): bias of {bias}: {a}; relMSE of {outside}, inside {inside}: {b}; FLIP of {flip}: \
         {c}; alone / ours, relMSE, of {alone_over_grid}: {d}",
        clumps.cases.len()
    )
}

fn cost(cost: &LightCost) -> String {
    let passes: Vec<_> =
        cost.passes_ms.iter().map(|(name, ms)| format!("{name} {ms:.0}")).collect();
    let octaves = cost.over_octaves.iter().find(|ratio| ratio.what == "cpu");
    let octaves = octaves.map_or_else(
        || "an unknown multiple".to_owned(),
        |r| {
            let [least, most] = r.interval;
            format!("{:.2} times the processor time ({least:.2} to {most:.2})", r.ratio)
        },
    );
    format!(
        "Light takes {:.2} of a frame that follows others ({}, {} ms of {:.0}; {}, preset {}, {}x{}, {} frames), and {:.2} of \
         one made alone; frames that follow others take {octaves} of those by octaves",
        cost.share,
        passes.join(", "),
        passes_sum(cost),
        cost.frame_ms,
        cost.case,
        cost.preset,
        cost.size[0],
        cost.size[1],
        cost.frames,
        cost.share_alone
    )
}

fn passes_sum(cost: &LightCost) -> String {
    format!("{:.0}", cost.passes_ms.iter().map(|(_, ms)| ms).sum::<f64>())
}

/// For a README: a table of Markdown, with how it was made.
pub fn markdown(bench: &Bench, clumps: &Clumps) -> String {
    let [width, height] = bench.settings.size;
    let machine = &bench.machine;
    let row = |cells: &[String; 14]| format!("| {} |", cells.join(" | "));
    let mut lines = vec![
        format!(
            "Clumps at {width}x{height}, scenes at their references' size, seed {}; {} threads of {}, {} ({}), commit {}:",
            clumps.seed,
            machine.threads,
            machine.cpu,
            machine.adapter,
            machine.driver,
            machine.commit
        ),
        String::new(),
        row(&HEAD.map(str::to_owned)),
        format!("|{}", "---|".repeat(HEAD.len())),
    ];
    lines.extend(rows(clumps).iter().map(row));
    lines.extend([String::new(), format!("{}.", told(clumps))]);
    lines.extend(clumps.cost.as_ref().map(|c| format!("{}.", cost(c))));
    lines.push(String::new());
    lines.join("\n")
}

/// `clumps.csv`: a line for each case and lighting.
pub fn csv(clumps: &Clumps) -> String {
    let mut text = "case,preset,width,height,reference,lighting,bias,rel_mse,rel_mse_of_noise,\
        rel_mse_without_noise,flip,flip_of_noise,pixels,wall_ms,cpu_ms\n"
        .to_owned();
    for case in &clumps.cases {
        for lit in &case.lit {
            let error = &lit.error;
            let cells = [
                crate::bench::tables::field(&case.case),
                case.preset.clone(),
                case.size[0].to_string(),
                case.size[1].to_string(),
                crate::bench::tables::field(&case.reference),
                lit.lighting.to_string(),
                error.bias.to_string(),
                error.rel_mse.to_string(),
                error.rel_mse_of_noise.to_string(),
                lit.rel_mse_without_noise.to_string(),
                error.flip.to_string(),
                lit.flip_of_noise.to_string(),
                error.pixels.to_string(),
                lit.wall_ms.median.to_string(),
                lit.cpu_ms.median.to_string(),
            ];
            text.push_str(&cells.join(","));
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::record::{PictureError, Ratio, Spread};

    fn clumps() -> Clumps {
        let spread = Spread { median: 2.0, p95: 2.0, p99: 2.0, min: 2.0, max: 2.0, spread: 0.0 };
        let lit = |lighting, bias, rel_mse| Lit {
            lighting,
            error: PictureError { bias, rel_mse, rel_mse_of_noise: 0.001, flip: 0.03, pixels: 9 },
            rel_mse_without_noise: rel_mse - 0.001,
            flip_of_noise: 0.01,
            wall_ms: spread,
            cpu_ms: spread,
        };
        let case = |case: &str| LitCase {
            case: case.to_owned(),
            preset: "high".to_owned(),
            size: [8, 4],
            reference: "a \"file\", of paths".to_owned(),
            noise: Some(0.02),
            lit: vec![
                lit(Lighting::Grid, 0.05, 0.008),
                lit(Lighting::Octaves, -0.2, 0.1),
                lit(Lighting::Alone, -0.5, 0.3),
            ],
            alone_over_grid: 299.0 / 7.0,
            times: Vec::new(),
        };
        let cost = LightCost {
            case: "cumulus".to_owned(),
            preset: "high".to_owned(),
            size: [8, 4],
            frames: 3,
            passes_ms: vec![("light_grid".to_owned(), 20.0), ("light".to_owned(), 5.0)],
            frame_ms: 100.0,
            share: 0.25,
            share_alone: 0.6,
            over_octaves: vec![Ratio {
                case: "grid over octaves".to_owned(),
                what: "cpu".to_owned(),
                old_ms: 80.0,
                new_ms: 100.0,
                ratio: 1.25,
                interval: [1.2, 1.3],
            }],
        };
        let cases = vec![case("clump-5-back-inside"), case("clump-5-back-outside")];
        Clumps { seed: 3, cases, cost: Some(cost) }
    }

    #[test]
    fn what_misses_its_target_is_told() {
        let clumps = clumps();
        // The bias in both; relMSE of 0.007 from outside only.
        assert_eq!(clumps.cases[0].missed(), [true, false, false, false]);
        assert_eq!(clumps.cases[1].missed(), [true, true, false, false]);
        let lines = lines(&clumps);
        assert_eq!(lines.len(), 5, "{lines:#?}");
        assert!(lines[1].contains("+5.0 % *") && lines[1].contains("0.0070  "), "{}", lines[1]);
        assert!(lines[2].contains("0.0070 *") && lines[2].contains("42.7"), "{}", lines[2]);
        assert!(lines[3].contains("bias of 0.03: 2; relMSE of 0.005, inside 0.01: 1; FLIP"));
        assert!(lines[4].starts_with("Light takes 0.25 of a frame"), "{}", lines[4]);
        assert!(lines[4].contains("1.25 times the processor time (1.20 to 1.30)"), "{}", lines[4]);
    }

    #[test]
    fn a_line_of_numbers_for_each_picture() {
        let text = csv(&clumps());
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 7);
        assert!(lines[0].starts_with("case,preset,width") && lines[0].split(',').count() == 15);
        assert!(lines[3].starts_with(
            "clump-5-back-inside,high,8,4,\"a \"\"file\"\", of paths\",alone,-0.5,0.3,"
        ));
    }

    #[test]
    fn a_readme_gets_a_row_for_each_case() {
        let bench = crate::bench::samples::bench("case", &[1.0]);
        let text = markdown(&bench, &clumps());
        let rows: Vec<_> = text.lines().filter(|line| line.starts_with('|')).collect();
        assert_eq!(rows.len(), 4, "{text}");
        assert!(rows.iter().all(|row| row.matches('|').count() == 15), "{text}");
    }
}
