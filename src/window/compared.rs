//! The reference beside the frame: begun where the view rests, given up where it moves.

use super::app::App;
use super::graphics::Graphics;
use super::studio::{Errand, Image, Order};
use super::truth::{Beside, Truth};
use crate::Result;
use crate::frame::Picture;

/// What is chosen of the comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Comparison {
    /// Whether it is wanted.
    pub wanted: bool,
    /// What is shown right of the line.
    pub beside: Beside,
    /// Where the line is, 0 to 1 from the left.
    pub split: f32,
    /// The compared pictures' sides as a part of the window's.
    pub scale: f32,
}

impl Default for Comparison {
    fn default() -> Self {
        Self { wanted: false, beside: Beside::Reference, split: 0.5, scale: 0.25 }
    }
}

impl App {
    /// Begins, goes on or gives up, as the view asks for.
    pub fn attend_truth(&mut self, window: [u32; 2]) -> Result<()> {
        let Comparison { wanted, scale, .. } = self.session.compare;
        if !wanted || self.session.is_lively() {
            if self.truth.take().is_some() || self.news.is_some() {
                self.forget_truth();
            }
            return Ok(());
        }
        if !self.rests() {
            return Ok(());
        }
        let most = self.graphics.as_ref().map_or(1, Graphics::most_pixels);
        let size = window.map(|side| ((side as f32 * scale).round() as u32).clamp(1, most));
        let subject = self.present_order(size);
        if self.truth.as_ref().is_some_and(|truth| truth.subject == subject) {
            if self.beside != self.session.compare.beside {
                self.show_beside();
            }
            return Ok(());
        }
        self.forget_truth();
        // The one before ends first: both would want all cores.
        self.truth = None;
        self.truth = Some(Truth::start(subject.clone(), self.tables.clone(), self.wake.clone())?);
        if let Some(studio) = &self.studio {
            studio.send(Errand::Measure(subject));
        }
        Ok(())
    }

    fn forget_truth(&mut self) {
        self.news = None;
        self.report.samples = 0;
        self.report.figures = None;
        self.show_beside();
    }

    /// Takes the frame that is to be compared.
    pub fn compare_with(&mut self, (order, picture): (Order, Picture)) {
        if let Some(truth) = self.truth.as_ref().filter(|truth| truth.subject == order) {
            truth.set_frame(picture);
        }
    }

    /// Takes over what the reference's thread has made.
    pub fn take_news(&mut self) {
        match self.truth.as_ref().and_then(Truth::news) {
            None => {}
            Some(Ok(news)) => {
                self.report.samples = news.samples;
                self.report.figures = news.errors.as_ref().map(|(_, figures)| *figures);
                tracing::info!(
                    "reference: {} paths a pixel, {:?}",
                    news.samples,
                    self.report.figures
                );
                self.news = Some(news);
                self.show_beside();
            }
            Some(Err(error)) => {
                self.session.compare.wanted = false;
                self.report.message.tell(error.to_string());
            }
        }
    }

    /// Shows what was chosen right of the line, if it is there.
    pub fn show_beside(&mut self) {
        self.beside = self.session.compare.beside;
        let image =
            self.news.as_ref().map(|news| match (self.session.compare.beside, &news.errors) {
                (Beside::Difference, Some(([difference, _], _))) => difference,
                (Beside::Flip, Some(([_, flip], _))) => flip,
                _ => &news.reference,
            });
        if let Some(graphics) = &mut self.graphics {
            graphics.set_picture(1, image.map(|image: &Image| image));
        }
    }
}
