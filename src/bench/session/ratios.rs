//! What `--ratios` orders: pairs that take turns, and popping.

use super::{Listener, Order};
use crate::Result;
use crate::bench::cases::{self, Case, Motion};
use crate::bench::curve::Setup;
use crate::bench::fetches::over_fetches;
use crate::bench::marched::{HEARD, over_marches};
use crate::bench::motion::WINDOW;
use crate::bench::popping::popping;
use crate::bench::record::{Popping, Ratio};
use crate::bench::run::Flight;
use crate::bench::scaling;
use crate::bench::variants::Variant;
use crate::gpu::Gpu;
use crate::reference::Window;
use crate::tables::TableSet;

impl Order {
    pub(super) fn pairs(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<Vec<Ratio>> {
        let mut found = Vec::new();
        let scenes = self.curve_scenes()?;
        let size = self.error_size();
        let flight = Flight { size, ..self.flight };
        let each = (scenes.len() * self.presets.len()) as u64;
        listener.begin(each, "kernels of look-ups");
        for (name, scene) in &scenes {
            let (name, scene) = (name.clone(), scene.clone());
            let case = Case { name, scene, motion: Motion::Paused };
            for preset in &self.presets {
                let mut subject = self.subject(gpu, tables, &case.scene, *preset)?;
                let quality = Variant::preset(*preset, &self.set).quality;
                let (ratio, counts) = over_fetches(gpu, &case, &mut subject, &quality, &flight)?;
                tracing::info!(case.name, ?counts);
                found.extend(ratio);
                listener.step();
            }
        }
        listener.begin(each * u64::from(HEARD), "marchers");
        let setup = Setup {
            gpu,
            tables,
            more_tables: &[],
            size,
            window: Window::middle(size, WINDOW),
            frames: self.flight.frames,
            march_limit: true,
        };
        for (name, scene) in &scenes {
            for preset in &self.presets {
                let subject = || self.subject(gpu, tables, scene, *preset);
                let variant = Variant::preset(*preset, &self.set);
                let (subjects, scene) = ([subject()?, subject()?], (name.as_str(), scene));
                let mut step = || listener.step();
                found.extend(over_marches(&setup, scene, &variant, subjects, &flight, &mut step)?);
            }
        }
        let pairs = scaling::pairs()?;
        let frames = 2 * (self.flight.frames + self.flight.warmup.max(1));
        let flights = (pairs.len() * self.presets.len()) as u64;
        listener.begin(flights * u64::from(frames), "frames of pairs");
        for pair in &pairs {
            for preset in &self.presets {
                let [first, second] = &pair.cases;
                let subjects = [
                    self.subject(gpu, tables, &first.scene, *preset)?,
                    self.subject(gpu, tables, &second.scene, *preset)?,
                ];
                let (ratios, particles) =
                    scaling::scaling(pair, subjects, &self.flight, &mut || listener.step())?;
                tracing::info!(pair.name, ?particles);
                found.extend(ratios);
            }
        }
        Ok(found)
    }

    pub(super) fn popping(
        &self,
        gpu: &Gpu,
        tables: &TableSet,
        listener: &mut dyn Listener,
    ) -> Result<Vec<Popping>> {
        listener.begin(self.presets.len() as u64, "straight flights");
        let mut found = Vec::new();
        for preset in &self.presets {
            let scene = cases::built_in("flight", cases::FLIGHT)?;
            let mut subject = self.subject(gpu, tables, &scene, *preset)?;
            found.push(popping(&mut subject, self.error_size(), self.flight.frames)?);
            listener.step();
        }
        Ok(found)
    }
}
