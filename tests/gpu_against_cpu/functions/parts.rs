//! Functions of single passes that read nothing but their arguments: their text is taken from the pass.

use cumuli::frame::cpu::tonemap;
use glam::DVec3;

use super::{Function, magnitude, many, one};
use crate::common::Random;

/// Text of an item of WGSL, from its keyword to the end of its body.
pub(super) fn item(source: &str, head: &str) -> String {
    let begin = source.find(head).unwrap_or_else(|| panic!("no {head}"));
    let text = &source[begin..];
    let end = text.find("\n}").unwrap_or_else(|| panic!("{head} has no end"));
    format!("{}\n}}\n", &text[..end])
}

/// Lines that declare constants.
pub(super) fn constants(source: &str) -> String {
    let plain =
        |line: &&str| line.starts_with("const ") && !line.contains("STEPS") && !line.contains("#{");
    source.lines().filter(plain).map(|line| format!("{line}\n")).collect()
}

/// Items of a pass, with its constants.
macro_rules! text {
    ($path:literal, $($head:literal),+) => {{
        let source = include_str!(concat!("../../../shaders/frame/", $path));
        [constants(source), $(item(source, $head)),+].concat()
    }};
}

/// Up to so far away in any direction.
fn place(random: &mut Random, most: f64) -> [f32; 3] {
    let far = f64::from(magnitude(random, 1e-3, most));
    (random.direction() * far).as_vec3().to_array()
}

#[test]
fn parts_of_rays_in_particles() {
    // Lengths that f32 loses are those of the centre's distance: rays that graze are judged by the square of the half
    // chord, of which nothing is left there.
    let rays = many(141, |r| {
        let centre = place(r, 1e5);
        let d = r.direction().as_vec3();
        let distance = DVec3::from_array(centre.map(f64::from)).length();
        let far = if r.bits().is_multiple_of(2) { 1e30 } else { magnitude(r, 1.0, 1e5) };
        // Half of them around the eye; none grazes by less than a thousandth.
        let radius = (distance * r.between(1.1, 3.0)) as f32;
        [centre[0], centre[1], centre[2], radius, d.x, d.y, d.z, far]
    });
    let declarations = text!("blend.wgsl", "struct Span ", "fn span_of(");
    Function::new(
        "blend::span_of",
        &declarations,
        "vec4(span_of(vec3(x[0], x[1], x[2]), x[3], vec3(x[4], x[5], x[6]), x[7]).near,
            span_of(vec3(x[0], x[1], x[2]), x[3], vec3(x[4], x[5], x[6]), x[7]).begin,
            span_of(vec3(x[0], x[1], x[2]), x[3], vec3(x[4], x[5], x[6]), x[7]).end, 0.0)",
    )
    .agrees(&rays, 16.0, |[x, y, z, radius, a, b, c, far]| {
        let (centre, dir) = (DVec3::new(x, y, z), DVec3::new(a, b, c));
        let middle = centre.dot(dir);
        let square = radius * radius - (centre - middle * dir).length_squared();
        let half = square.max(0.0).sqrt();
        let end = if square > 0.0 { (middle + half).min(far) } else { -1.0 };
        [middle - half, (middle - half).max(0.0), end, 0.0]
    });
}

#[test]
fn bounds_of_spheres_on_screen() {
    let spheres = many(142, |r| {
        let (x, z) = (r.between(-1e4, 1e4) as f32, r.between(-1e4, 1e4) as f32);
        let distance = f64::from(x).hypot(f64::from(z));
        [x, z, (distance * r.between(0.001, 1.3)) as f32]
    });
    let declarations = text!("screen_project.wgsl", "fn tangent_bounds(");
    Function::new(
        "screen_project::tangent_bounds",
        &declarations,
        "vec4(tangent_bounds(x[0], x[1], x[2]), 0.0, 0.0)",
    )
    .agrees(&spheres, 16.0, |[x, z, radius]| {
        // By angles, in place of the lines that touch the circle.
        let distance = x.hypot(z);
        if distance <= radius {
            return [-1e30, 1e30, 0.0, 0.0];
        }
        let (middle, half) = (x.atan2(z), (radius / distance).asin());
        let quarter = std::f64::consts::FRAC_PI_2;
        let seen = |angle: f64, beyond: f64| {
            if angle.abs() < quarter { angle.tan() } else { beyond }
        };
        [seen(middle - half, -1e30), seen(middle + half, 1e30), 0.0, 0.0]
    });
}

#[test]
fn cells_of_the_light_grid() {
    let cells = many(143, |r| {
        let size: [f32; 3] = std::array::from_fn(|_| 1.0 + (r.bits() % 80) as f32);
        let all = (size[0] * size[1] * size[2]) as u64;
        [size[0], size[1], size[2], (r.bits() % all) as f32]
    });
    let declarations = text!("light_grid.wgsl", "fn cell_in(");
    Function::new(
        "light_grid::cell_in",
        &declarations,
        "vec4(vec3<f32>(cell_in(u32(x[3]), vec3<u32>(vec3(x[0], x[1], x[2])))), 0.0)",
    )
    .agrees(&cells, 0.0, |[w, h, _, i]| {
        // Numbers beside a whole one, which the condition of a function is asked of, count as it.
        let i = i.round();
        [i % w, (i / w).floor() % h, (i / (w * h)).floor(), 0.0]
    });
    let level = "#import cumuli::light_grid_data::GridLevel
        fn level_at(x: array<f32, 9>) -> GridLevel {
            var level: GridLevel;
            level.low = vec4(x[0], x[1], x[2], 0.0);
            level.cell = vec4(x[3], x[4], x[5], 0.0);
            level.size = vec4(20u, 10u, 30u, 0u);
            return level;
        }\n";
    let places = many(144, |r| {
        let low = place(r, 1e5);
        let side: [f32; 3] = std::array::from_fn(|_| magnitude(r, 1.0, 1e4));
        let size = [20.0, 10.0, 30.0];
        // In the level, and a cell around it.
        let at: [f32; 3] = std::array::from_fn(|i| {
            let cells = r.between(-1.0, size[i] + 1.0);
            (f64::from(low[i]) + cells * f64::from(side[i])) as f32
        });
        [low[0], low[1], low[2], side[0], side[1], side[2], at[0], at[1], at[2]]
    });
    let split = |v: [f64; 9]| {
        let three = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
        (three(0), three(3), three(6))
    };
    let centre = level.to_owned() + &text!("light_grid.wgsl", "fn cell_centre(");
    Function::new(
        "light_grid::cell_centre",
        &centre,
        "vec4(cell_centre(level_at(x), vec3(x[6], x[7], x[8])), 0.0)",
    )
    .agrees(&places, 8.0, |v| {
        let (low, side, cell) = split(v);
        (low + (cell + 0.5) * side).extend(0.0).to_array()
    });
    let sampled = level.to_owned()
        + &text!(
            "light_grid.wgsl",
            "struct GridPlace ",
            "fn grid_place(",
            "fn corner_of(",
            "fn corner_weight("
        )
        + "fn sampled(x: array<f32, 9>) -> vec4<f32> {
            let place = grid_place(level_at(x), vec3(x[6], x[7], x[8]));
            var sum = vec4(0.0);
            for (var corner = 0u; corner < 8u; corner++) {
                sum += corner_weight(place, corner) * vec4(vec3<f32>(corner_of(place, corner)), 1.0);
            }
            return sum;
        }";
    Function::new("light_grid::grid_place, corner_of, corner_weight", &sampled, "sampled(x)")
        .agrees(&places, 64.0, |v| {
            // Places between cells, of what grows by 1 from cell to cell; all weights together.
            let (low, side, point) = split(v);
            let size = DVec3::new(20.0, 10.0, 30.0);
            let at = ((point - low) / side - 0.5).clamp(DVec3::ZERO, size - 1.0);
            at.extend(1.0).to_array()
        });
    let rates = many(145, |r| {
        let d = r.direction() / f64::from(magnitude(r, 1e-2, 1e4));
        let mut f = || r.uniform() as f32;
        [f(), f(), f(), d.x as f32, if f() < 0.1 { 0.0 } else { d.y as f32 }, d.z as f32]
    });
    let borders = text!("light_grid.wgsl", "fn to_borders(", "fn least(");
    Function::new(
        "light_grid::to_borders, least",
        &borders,
        "vec4(to_borders(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5])), least(to_borders(vec3(x[0], x[1], x[2]), vec3(x[3], x[4], x[5]))))",
    )
    .agrees(&rates, 8.0, |v| {
        let to = |i: usize| {
            let (f, rate) = (v[i], v[i + 3]);
            let left = if rate > 0.0 { 1.0 - f } else { f };
            if rate.abs() > 1e-30 { left / rate.abs() } else { 1e30 }
        };
        let all = [to(0), to(1), to(2)];
        [all[0], all[1], all[2], all.into_iter().fold(f64::INFINITY, f64::min)]
    });
    let balls = many(146, |r| {
        let ball = magnitude(r, 1.0, 1e4);
        let side: [f32; 3] = std::array::from_fn(|_| magnitude(r, 1.0, 1e3));
        let offset = (r.direction() * r.between(0.0, 2.0 * f64::from(ball))).as_vec3();
        [ball, offset.x, offset.y, offset.z, side[0], side[1], side[2]]
    });
    let shares = text!("light_grid_matter.wgsl", "fn ball_share(", "fn large_total(");
    Function::new(
        "light_grid_matter::ball_share, large_total",
        &shares,
        "vec4(ball_share(x[0], vec3(x[1], x[2], x[3]), vec3(x[4], x[5], x[6])), large_total(x[0], vec3(x[4], x[5], x[6])), 0.0, 0.0)",
    )
    .agrees(&balls, 32.0, |[ball, x, y, z, a, b, c]| {
        let (offset, side) = (DVec3::new(x, y, z), DVec3::new(a, b, c));
        let distance = offset.length();
        let width = (offset.abs().dot(side) / distance.max(1e-6)).max(side.min_element());
        let share = ((ball - distance) / width + 0.5).clamp(0.0, 1.0);
        let pi = std::f64::consts::PI;
        let square = side.length_squared() / 3.0 + 4.0 / (3.0 * pi) * (a * b + b * c + c * a);
        let total = 4.0 / 3.0 * pi * ball * (ball * ball + 0.25 * square) / (a * b * c);
        [share, total, 0.0, 0.0]
    });
}

#[test]
fn weights_colours_and_rectangles() {
    let fractions = many(147, |r| [r.uniform() as f32]);
    let cubic = text!("reuse.wgsl", "fn cubic(");
    Function::new(
        "reuse::cubic",
        &cubic,
        "vec4(cubic(0, x[0]), cubic(1, x[0]), cubic(2, x[0]), cubic(3, x[0]))",
    )
    .of_terms(1.0)
    .agrees(&fractions, 16.0, |[f]| {
        // Catmull and Rom's spline from its matrix.
        let powers = [1.0, f, f * f, f * f * f];
        let rows = [
            [0.0, -0.5, 1.0, -0.5],
            [1.0, 0.0, -2.5, 1.5],
            [0.0, 0.5, 2.0, -1.5],
            [0.0, 0.0, -0.5, 0.5],
        ];
        rows.map(|row| row.iter().zip(powers).map(|(a, b)| a * b).sum())
    });
    let distances = many(148, |r| {
        let begin = magnitude(r, 1.0, 1e5);
        [begin, begin * r.between(1.01, 2.0) as f32, begin * r.between(0.5, 3.0) as f32]
    });
    let fade = text!("rings.wgsl", "fn fade(");
    Function::new("rings::fade", &fade, "vec4(fade(vec2(x[0], x[1]), x[2]), 0.0, 0.0, 0.0)")
        .agrees(&distances, 16.0, |[begin, end, at]| {
            let t = ((at - begin) / (end - begin)).clamp(0.0, 1.0);
            one(t * t * (3.0 - 2.0 * t))
        });
    let colours = many(149, |r| match r.bits() % 8 {
        0 => [0.0; 3],
        1 => [65504.0; 3],
        _ => std::array::from_fn(|_| magnitude(r, 1e-6, 65504.0)),
    });
    let curve = text!("tonemap.wgsl", "fn aces(", "fn srgb(");
    Function::new("tonemap::aces", &curve, "vec4(aces(vec3(x[0], x[1], x[2])), 0.0)").agrees(
        &colours,
        1e9,
        |c| tonemap::aces(DVec3::from_array(c)).extend(0.0).to_array(),
    );
    let shown =
        many(150, |r| [if r.bits().is_multiple_of(4) { 0.0031308 } else { r.uniform() as f32 }]);
    Function::new("tonemap::srgb", &curve, "vec4(srgb(vec3(x[0])), 0.0)").agrees(
        &shown,
        32.0,
        |[v]| {
            let v = tonemap::srgb(v);
            [v, v, v, 0.0]
        },
    );
    let rectangles = many(151, |r| {
        let mut n = || (r.bits() % 24) as f32;
        let ([a, b], [c, d]) = ([n(), n()], [n(), n()]);
        [a, b, a + c, b + d, n(), n(), 1.0 + (n() / 6.0).floor()]
    });
    let touches = text!("tile_lists.wgsl", "fn touches(");
    Function::new(
        "tile_lists::touches",
        &touches,
        "vec4(select(0.0, 1.0, touches(
            vec2(u32(x[0]) | (u32(x[1]) << 16u), u32(x[2]) | (u32(x[3]) << 16u)),
            vec2(u32(x[4]), u32(x[5])), vec2(u32(x[4] + x[6]), u32(x[5] + x[6])))), 0.0, 0.0, 0.0)",
    )
    .agrees(&rectangles, 0.0, |v| {
        let [left, top, right, bottom, x, y, side] = v.map(f64::round);
        let meets = left < x + side && x < right && top < y + side && y < bottom;
        one(f64::from(u8::from(meets)))
    });
}
