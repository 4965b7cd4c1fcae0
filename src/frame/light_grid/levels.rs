//! Where the levels of the light grid lie.

use glam::DVec3;

use super::inputs::SMALL_LEVEL;
use crate::frame::gpu_data::{GRID_LEVELS, GridLevel};
use crate::frame::rings;
use crate::scene::{CloudField, ParticleSpec};

/// Radius of a typical listed particle over the side of a cell. With 3 the error against the path
/// tracer is 0.4 % (relMSE) in a clump of optical thickness 30, with 2 it is 0.6, with 1 2.5.
const CELLS_PER_RADIUS: f64 = 2.5;
/// Cells along the longest axis of listed particles, at least: a few large particles have light and dark sides,
/// too.
const LEAST_ALONG: f64 = 32.0;
/// Optical depth of a cell in listed particles at fineness 1, by the extinction of the medium as it is, at most, as far as that
/// many cells go: one sees of thick balls what is near their surfaces. Five balls of thickness 60 mirrored in the sea, cells of 7 and
/// of 2.6 optical depths: 1.06 and 1.02 of the traced light, below the steepest rays 1.20 and 1.15
/// (`mirrored_clouds_are_as_bright_as_traced_ones`); seen directly 0.89 and 0.88.
const CELL_DEPTH: f64 = 2.0;
const DEEP_CELLS: f64 = 12_000.0;
/// Most cells along an axis of a level.
const MOST_ALONG: f64 = 384.0;
/// Most cells of the finest level over listed particles.
const MOST_CELLS: f64 = 450_000.0;
/// Cells of the coarsest level along its longest axis: few enough for light to cross it in a few steps.
const COARSEST_ALONG: f64 = 9.0;
/// Least number of cells of a field's level between base and top.
const LEAST_LAYERS: f64 = 6.0;

/// Words that a buffer of all lights may have: what WebGPU lets every device bind, 128 MiB.
const MOST_WORDS: u64 = (128 << 20) / 4;
/// First guesses of the shares of cells with matter, and of all that keep light: those without any clouds, and what
/// full coverage adds. Of scenes/cumulus.toml, coverage 0.25, fineness 1.55 and 2.5, 0.073 and 0.076 have matter, 0.27
/// and 0.23 keep light; of scenes/sunset.toml, fineness 2.2, 0.084 and 0.25.
const FIRST_MATTER: [f64; 2] = [0.02, 0.4];
const FIRST_KEPT: [f64; 2] = [0.17, 0.6];
/// Most cells that keep light, of a field, over its coverage: those of the lowest layers and beside matter.
const KEPT_BESIDE: f64 = 0.15;
/// Cells of a word; as in the shader.
const WORD_CELLS: u32 = 32;
/// Texels along a side of a 3D texture that WebGPU lets every device have.
const MOST_ALONG_TEXTURE: u32 = 2048;
/// Texels of the light field, of 8 bytes: as many as take what a buffer may.
const MOST_TEXELS: u64 = (128 << 20) / 8;
/// Steps of a field's coverage in which the first guess of its room goes: a slider does not make new buffers each time.
const GUESS_STEP: f64 = 0.25;
/// By this the fineness goes down until the lights fit: little, so that a preset which wants more has no less.
const COARSER: f64 = 0.98;
/// Directions, and the fineness from which on so many are taken rather than fewer in finer cells: 32 at 1.5 beside 20 at 1.8, as much memory, have
/// less bias and as much error in blocks of pixels (ARCHITECTURE.md); below that cells count more.
const FINE_ENOUGH: [(u32, f64); 2] = [(32, 1.35), (20, 0.9)];
const FEWEST_DIRECTIONS: u32 = 12;

/// The levels of a grid, fine to coarse, and the point in the world that they are relative to.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// m.
    pub anchor: DVec3,
    /// The levels.
    pub levels: Vec<GridLevel>,
    /// Directions of travel.
    pub directions: u32,
    /// The last level whose light is looked up: coarser ones over a field reach hardly farther, and are there to solve for
    /// the light.
    pub widest: usize,
}

impl Levels {
    /// Lights of a solution with so many slots: with what flows along the rows of slanted planes, of
    /// which there are up to twice as many as cells along a level.
    pub fn lights(&self, slots: u32) -> u32 {
        self.directions * (slots + 2 * self.longest() * self.longest())
    }

    /// Words of 32 cells of a row, of all levels.
    pub fn words(&self) -> u32 {
        let words = |l: &GridLevel| l.size[0].div_ceil(WORD_CELLS) * l.size[1] * l.size[2];
        self.levels.iter().map(words).sum()
    }

    /// Columns of cells of all levels.
    pub fn columns(&self) -> u32 {
        self.levels.iter().map(|l| l.size[0] * l.size[2]).sum()
    }

    /// Cells of all levels.
    pub fn cells(&self) -> u32 {
        self.levels.last().map_or(0, |l| l.size[3] + l.size[0] * l.size[1] * l.size[2])
    }

    /// Cells along the axes of the levels, and the index of each one's first.
    pub fn sizes(&self) -> Vec<[u32; 4]> {
        self.levels.iter().map(|l| l.size).collect()
    }

    /// Cells of a level over those of the largest.
    pub fn over_largest(&self, level: usize) -> f64 {
        let cells = |level: &GridLevel| f64::from(level.size[..3].iter().product::<u32>());
        let most = self.levels.iter().map(cells).fold(1.0, f64::max);
        self.levels.get(level).map_or(0.0, cells) / most
    }

    /// Whether the coarsest level has few cells.
    pub fn has_small_coarsest(&self) -> bool {
        let few = |l: &GridLevel| f64::from(l.size[0].max(l.size[2])) <= COARSEST_ALONG;
        self.levels.last().is_some_and(few)
            || self.over_largest(self.levels.len().saturating_sub(1)) <= SMALL_LEVEL
    }

    /// Whether some of these particles reach out of the finest level at its top or bottom, within the sides of the widest.
    pub fn has_beyond_first(&self, particles: &[ParticleSpec]) -> bool {
        let ends = |l: &GridLevel| {
            let low = DVec3::new(l.low[0].into(), l.low[1].into(), l.low[2].into());
            let cell = DVec3::new(l.cell[0].into(), l.cell[1].into(), l.cell[2].into());
            let size = DVec3::new(l.size[0].into(), l.size[1].into(), l.size[2].into());
            [low, low + cell * size]
        };
        let (Some(first), Some(widest)) = (self.levels.first(), self.levels.get(self.widest))
        else {
            return false;
        };
        let ([low, high], [left, right]) = (ends(first), ends(widest));
        particles.iter().any(|p| {
            let (from, to) = (p.centre - self.anchor - p.radius, p.centre - self.anchor + p.radius);
            let is_beside = to.x < left.x || from.x > right.x || to.z < left.z || from.z > right.z;
            (from.y < low.y || to.y > high.y) && !is_beside
        })
    }

    /// Most cells along an axis of a level.
    pub fn longest(&self) -> u32 {
        self.levels.iter().flat_map(|l| &l.size[..3]).copied().max().unwrap_or(0)
    }

    /// Size of the texture that holds all levels, one above the other, and a row for their columns behind an empty one.
    pub fn texture_size(&self) -> [u32; 3] {
        let most = |axis: usize| self.levels.iter().map(|l| l.size[axis]).max().unwrap_or(1);
        // A row between: what is filtered has none of the other's.
        [most(0), most(1) + 2, self.levels.iter().map(|l| l.size[2]).sum::<u32>().max(1)]
    }

    /// Coarser and coarser levels over all of the last one, until light crosses them in a few steps.
    fn push_coarser(&mut self) {
        while let Some(last) = self.levels.last().filter(|_| self.levels.len() < GRID_LEVELS) {
            let vector = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
            let (low, cell) = (vector(last.low), 2.0 * vector(last.cell));
            let [nx, ny, nz, _] = last.size.map(f64::from);
            if nx.max(nz) <= COARSEST_ALONG {
                break;
            }
            // As many as cover the last one's, evenly beside it.
            let cells = (0.5 * DVec3::new(nx, ny, nz)).ceil();
            let beside = (cells * cell - 0.5 * DVec3::new(nx, ny, nz) * cell) * 0.5;
            let low = low - DVec3::new(beside.x, 0.0, beside.z);
            self.push(low, cell, cells);
        }
    }

    fn push(&mut self, low: DVec3, cell: DVec3, cells: DVec3) {
        let (first, first_word) = (self.cells(), self.words());
        let slice: u32 = self.levels.iter().map(|l| l.size[2]).sum();
        let [x, y, z] = low.as_vec3().to_array();
        let [u, v, w] = cell.as_vec3().to_array();
        let [nx, ny, nz] = cells.to_array().map(|n| n as u32);
        self.levels.push(GridLevel {
            low: [x, y, z, slice as f32],
            cell: [u, v, w, first_word as f32],
            size: [nx, ny, nz, first],
        });
    }
}

/// Room for the slots of cells that keep light. Grows when a frame reports that it needed more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GridRoom {
    /// Slots of cells with matter.
    pub matter: u32,
    /// Slots of all cells that keep light, with these.
    pub kept: u32,
    /// As many there may be at most: what a device must be able to bind.
    pub most: u32,
    /// Cells of the levels that it is for.
    pub cells: u32,
    /// Cells of levels for whose lights so many were too few: such have room for all their cells since, and are less
    /// fine for it. 0: none were.
    pub too_many_cells: u32,
}

impl GridRoom {
    /// At least the first guess for these levels, of a field of this coverage (1 for listed particles), whose lights
    /// have so many words.
    pub fn at_least(self, levels: &Levels, coverage: f64, words: u32) -> Self {
        let cells = levels.cells();
        let flows = u64::from(levels.lights(0));
        let most =
            (MOST_WORDS / u64::from(words)).saturating_sub(flows) / u64::from(levels.directions);
        let most = most.min(cells.into()) as u32;
        let guess = |[least, rise]: [f64; 2]| {
            let coverage = (coverage / GUESS_STEP).ceil() * GUESS_STEP;
            ((least + rise * coverage).min(1.0) * f64::from(cells)).ceil() as u32
        };
        let room = |now: u32, first| now.max(guess(first)).min(most).max(1);
        Self {
            matter: room(self.matter, FIRST_MATTER),
            kept: room(self.kept, FIRST_KEPT),
            most: most.max(1),
            cells,
            too_many_cells: self.too_many_cells,
        }
    }

    /// Room for so many cells with matter and so many that keep light.
    pub fn grown(self, [matter, kept]: [u32; 2], with_room: impl Fn(u32) -> u32) -> Self {
        let grow = |now: u32, wanted: u32| {
            if wanted > now { with_room(wanted).min(self.most).max(now) } else { now }
        };
        Self {
            matter: grow(self.matter, matter),
            kept: grow(self.kept, kept),
            too_many_cells: if kept > self.most { self.cells } else { self.too_many_cells },
            ..self
        }
    }
}

/// Share of the cells of a field of this coverage, with particles as large as usual or larger, that keep light at most.
fn most_kept(field: &CloudField) -> f64 {
    let usual = CloudField::default().particle_size;
    let wider = (field.particle_size / usual).max(1.0).powi(2);
    let coverage = if field.weather.is_some() { 1.0 } else { field.coverage };
    (KEPT_BESIDE + coverage * wider).min(1.0)
}

/// Levels of a field as fine as this, or with fewer directions and less fine where their lights, of so many words each,
/// may be more than a device must be able to bind. `for_all`: even if every cell kept some.
pub fn fitting(
    field: &CloudField,
    anchor: DVec3,
    (fineness, directions): (f64, u32),
    words: u32,
    for_all: bool,
) -> Levels {
    fitted(field, anchor, (fineness, directions), words, for_all).0
}

/// The same with how fine they are.
fn fitted(
    field: &CloudField,
    anchor: DVec3,
    (wanted, most): (f64, u32),
    words: u32,
    for_all: bool,
) -> (Levels, f64) {
    let share = if for_all { 1.0 } else { most_kept(field) };
    let (mut fineness, mut directions) = (wanted, most);
    loop {
        let fewer = FINE_ENOUGH.iter().find(|(count, _)| *count == directions);
        if fewer.is_some_and(|(_, enough)| fineness < enough.min(wanted)) {
            // From the start: fewer directions leave room for more cells.
            let next = FINE_ENOUGH.iter().map(|(count, _)| *count).find(|c| *c < directions);
            (fineness, directions) = (wanted, next.unwrap_or(FEWEST_DIRECTIONS));
        }
        let levels = of_field(field, anchor, (fineness, directions));
        let slots = (share * f64::from(levels.cells())).ceil() as u32;
        // An entry for each cell, and its extinction.
        let entries = u64::from(levels.cells()) + u64::from(slots);
        let lights = u64::from(words) * u64::from(levels.lights(slots));
        let [x, y, z] = levels.texture_size();
        let texels = u64::from(x) * u64::from(y) * u64::from(z);
        let has_texture = x.max(y).max(z) <= MOST_ALONG_TEXTURE && texels <= MOST_TEXELS;
        if lights.max(entries) <= MOST_WORDS && has_texture {
            return (levels, fineness);
        }
        fineness *= COARSER;
    }
}

/// Levels for a cloud field: one for each ring, over all of it. `anchor` is the point of the ground
/// below the middle of the rings; `fineness` the side of a ring's cell over that of the grid's.
pub fn of_field(field: &CloudField, anchor: DVec3, (fineness, directions): (f64, u32)) -> Levels {
    let mut result = Levels { anchor, levels: Vec::new(), directions, widest: 0 };
    for ring in 0..field.rings.min(GRID_LEVELS as u32) {
        let ring_cell = field.cell_size * f64::from(1u32 << ring);
        let reach = rings::reach(&CloudField { rings: ring + 1, ..field.clone() });
        let side = (ring_cell / fineness).max(2.0 * reach / MOST_ALONG);
        let half = (reach / side).ceil() + 1.0;
        let largest = field.particle_size * ring_cell;
        // Lowest and highest matter: particles may reach below the base by a quarter radius.
        let low = field.base - 0.5 * largest.min(field.thickness);
        let high = field.base + field.thickness + largest.min(field.thickness);
        let height = side.min(field.thickness / LEAST_LAYERS).max((high - low) / MOST_ALONG);
        let layers = ((high - low) / height).ceil();
        result.push(
            DVec3::new(-half * side, low, -half * side),
            DVec3::new(side, height, side),
            DVec3::new(2.0 * half, layers, 2.0 * half),
        );
    }
    result.widest = result.levels.len().saturating_sub(1);
    result.push_coarser();
    result
}

/// Levels for listed particles: a box around all of them at finer and finer cells, whose lights, of so many words each, a
/// device is able to bind. None for no particles.
pub fn of_list(
    particles: &[ParticleSpec],
    (fineness, directions): (f64, u32),
    words: u32,
) -> Option<Levels> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut radii, mut weights, mut extinctions) = (0.0, 0.0, 0.0);
    for p in particles {
        low = low.min(p.centre - p.radius);
        high = high.max(p.centre + p.radius);
        // By cross-section: a few large ones among small ones are what is seen.
        radii += p.radius.powi(3);
        weights += p.radius.powi(2);
        extinctions += p.radius.powi(2) * p.extinction;
    }
    if particles.is_empty() {
        return None;
    }
    let size = (high - low).max(DVec3::splat(1e-3));
    let of_particle = radii / weights / CELLS_PER_RADIUS;
    let volume = size.x * size.y * size.z;
    // Without extinction as wide as can be.
    let of_depth = (CELL_DEPTH * weights / extinctions).max((volume / DEEP_CELLS).cbrt());
    let wanted = of_particle.min(size.max_element() / LEAST_ALONG).min(of_depth) / fineness;
    let side = wanted.max(size.max_element() / MOST_ALONG).max((volume / MOST_CELLS).cbrt());
    let middle = 0.5 * (low + high);
    let mut cell = side;
    loop {
        let levels = around(middle, size, cell, directions);
        // Every cell may keep light.
        if u64::from(words) * u64::from(levels.lights(levels.cells())) <= MOST_WORDS {
            return Some(levels);
        }
        cell /= COARSER;
    }
}

/// Levels of a box of this size, from cells of this side on.
fn around(middle: DVec3, size: DVec3, side: f64, directions: u32) -> Levels {
    let mut result = Levels { anchor: middle, levels: Vec::new(), directions, widest: 0 };
    let mut cell = side;
    for _ in 0..GRID_LEVELS {
        // Half a cell around, so that matter does not touch the border.
        let cells = (size / cell).ceil() + 1.0;
        result.push(-0.5 * cell * cells, DVec3::splat(cell), cells);
        if cells.max_element() <= COARSEST_ALONG {
            break;
        }
        cell *= 2.0;
    }
    result.widest = result.levels.len() - 1;
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Preset;

    fn field(cell_size: f64, cells: u32, rings: u32, coverage: f64, thickness: f64) -> CloudField {
        CloudField { cell_size, cells, rings, coverage, thickness, ..CloudField::default() }
    }

    /// What WebGPU lets every device have, for fields of all sizes in all finenesses of the presets.
    #[test]
    fn levels_fit_every_device() {
        let usual = CloudField::default();
        for (cells, rings) in [(2, 1), (96, 2), (128, 4), (128, 8), (160, 2), (160, 8), (256, 10)] {
            for (coverage, thickness) in [(0.0, 300.0), (0.1, 2000.0), (0.5, 5000.0), (1.0, 1e4)] {
                for (fine, words) in [((0.8, 12), 1), ((1.8, 20), 1), ((2.2, 32), 2)] {
                    for for_all in [false, true] {
                        let field = field(usual.cell_size, cells, rings, coverage, thickness);
                        let levels = fitting(&field, DVec3::ZERO, fine, words, for_all);
                        let [x, y, z] = levels.texture_size();
                        assert!(x.max(y).max(z) <= 2048, "{field:?}: {x} x {y} x {z} texels");
                        assert!(u64::from(x) * u64::from(y) * u64::from(z) * 8 <= 128 << 20);
                        let share = if for_all { 1.0 } else { most_kept(&field) };
                        let slots = (share * f64::from(levels.cells())) as u32;
                        let lights = u64::from(words) * u64::from(levels.lights(slots));
                        assert!(4 * lights <= 128 << 20, "{field:?}: {lights} words of lights");
                    }
                }
            }
        }
    }

    /// What a device can bind takes fineness and directions, but never more of a preset that wants more.
    #[test]
    fn a_higher_preset_has_no_coarser_light() {
        let usual = CloudField::default();
        for coverage in [0.1, 0.25, 0.3, 0.5, 0.7, 0.85, 1.0] {
            for words in [1, 2] {
                let field =
                    field(usual.cell_size, usual.cells, usual.rings, coverage, usual.thickness);
                let of = |preset: Preset| {
                    let grid = preset.quality().grid;
                    let fine = (grid.fineness, grid.directions.count());
                    let (levels, fineness) = fitted(&field, DVec3::ZERO, fine, words, false);
                    (fineness, levels.directions)
                };
                for pair in Preset::ALL.windows(2) {
                    let [(low, few), (high, many)] = [of(pair[0]), of(pair[1])];
                    // More directions may cost cells, down to where they are not worth it; else what a step of the search leaves.
                    let enough = FINE_ENOUGH.iter().find(|(count, _)| *count == many);
                    let least = match enough {
                        Some((_, enough)) if few < many => low.min(*enough),
                        _ => low,
                    };
                    assert!(high >= COARSER * least, "{coverage} {words} {pair:?}: {low} {high}");
                    assert!(many >= few, "{coverage} {words} {pair:?}: {few} {many}");
                }
            }
        }
    }

    #[test]
    fn lists_fit_every_device() {
        let ball = |x: f64, y: f64, radius: f64, extinction: f64| ParticleSpec {
            centre: DVec3::new(x, y, 0.0),
            radius,
            extinction,
            shape: "uniform".to_owned(),
            orientation: glam::DQuat::IDENTITY,
        };
        for [along, up] in [[1.0, 1.0], [5.0, 1.0], [11.0, 1.0], [10.0, 10.0]] {
            for extinction in [0.0, 1e-12, 0.05, 1e6] {
                let list = [
                    ball(0.0, 0.0, 1.0, extinction),
                    ball(100.0 * along, 100.0 * up, 1.0, extinction),
                ];
                for words in [1, 2] {
                    let levels = of_list(&list, (2.2, 32), words).expect("there are two");
                    let lights = u64::from(levels.lights(levels.cells()));
                    assert!(u64::from(words) * lights <= MOST_WORDS, "{along} {up} {lights}");
                    assert!(levels.cells() > 1000, "{}", levels.cells());
                }
            }
            let alone = of_list(&[ball(0.0, 0.0, 1.0, 1e6)], (1.7, 32), 1).expect("a ball");
            assert!(
                f64::from(alone.cells())
                    < 1.5 * 1.7f64.powi(3) * f64::max(DEEP_CELLS, 32f64.powi(3))
            );
        }
    }

    #[test]
    fn room_grows_to_what_is_wanted_and_no_scene_leaves_its_mark_on_another() {
        let levels = of_field(&CloudField::default(), DVec3::ZERO, (1.0, 12));
        let room = GridRoom::default().at_least(&levels, 0.25, 1);
        // A slider that is drawn meets few steps.
        assert_eq!(room, GridRoom::default().at_least(&levels, 0.13, 1));
        assert_eq!(room.grown([room.matter, room.kept], |n| 2 * n), room);
        let grown = room.grown([room.matter + 1, room.kept + 7], |n| n + 5);
        assert_eq!([grown.matter, grown.kept], [room.matter + 6, room.kept + 12]);
        // What it has grown to stays.
        assert_eq!(grown, grown.at_least(&levels, 0.25, 1));
        let passed = room.grown([1, room.most + 1], |n| n);
        assert_eq!((passed.kept, passed.too_many_cells), (room.most, levels.cells()));
    }
}
