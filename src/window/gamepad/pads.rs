//! Gamepads by gilrs. A thread waits for them: the window sleeps where nothing happens.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use gilrs::ev::filter::{Filter, axis_dpad_to_button};
use gilrs::{Axis, Button, EventType, Gamepad, Gilrs, GilrsBuilder};

use super::Sticks;
use crate::window::camera::Lean;
use crate::window::guard::guarded;
use crate::window::input::Key;
use crate::window::studio::Wake;

/// How often the thread sees whether the window is still there.
const LOOK: Duration = Duration::from_millis(500);

/// What a gamepad does.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::window) enum News {
    /// Sticks and triggers moved.
    Lean(Lean),
    /// A button that means a key goes down or up.
    Key(Key, bool),
    /// A notch of the speed: up or down.
    Speed(f64),
    /// One was found, or went away.
    Message(String),
}

/// All gamepads, from the window's side.
pub(in crate::window) struct Pads {
    news: Receiver<News>,
    closed: Arc<AtomicBool>,
}

impl Pads {
    /// Starts to listen.
    pub fn start(wake: Wake) -> Self {
        let (send, news) = channel();
        let closed = Arc::new(AtomicBool::new(false));
        let ends = closed.clone();
        std::thread::spawn(move || {
            // The dead zone is ours: gilrs' own is one for each axis, and leaves a cross.
            let builder = GilrsBuilder::new().with_default_filters(false).set_update_state(false);
            let listened = guarded("listening to gamepads", || match builder.build() {
                Ok(gilrs) => listen(gilrs, &send, &wake, &ends),
                Err(error) => tracing::warn!("no gamepads: {error}"),
            });
            // What a defect of theirs costs is the gamepads: the window is told, and goes on.
            if let Err(error) = listened {
                tracing::error!("{error}");
                let _ = send.send(News::Message(error.to_string()));
                wake();
            }
        });
        Self { news, closed }
    }

    /// The next news, if there is some.
    pub fn news(&self) -> Option<News> {
        self.news.try_recv().ok()
    }
}

impl Drop for Pads {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Relaxed);
    }
}

fn listen(mut gilrs: Gilrs, send: &mpsc::Sender<News>, wake: &Wake, ends: &AtomicBool) {
    for (_, pad) in gilrs.gamepads() {
        tracing::info!("gamepad: {}", pad.name());
    }
    while !ends.load(Ordering::Relaxed) {
        let event = gilrs.next_event_blocking(Some(LOOK));
        // Some pads have their cross as two axes.
        let Some(event) = event.filter_ev(&axis_dpad_to_button, &mut gilrs) else { continue };
        gilrs.update(&event);
        let pad = gilrs.gamepad(event.id);
        let news = match event.event {
            EventType::ButtonPressed(button, _) => meaning(button, true).into_iter().collect(),
            EventType::ButtonReleased(button, _) => meaning(button, false).into_iter().collect(),
            EventType::AxisChanged(..) | EventType::ButtonChanged(..) => {
                vec![News::Lean(sticks(&pad).lean())]
            }
            EventType::Connected => vec![News::Message(format!("gamepad: {}", pad.name()))],
            EventType::Disconnected => gone(pad.name()),
            _ => Vec::new(),
        };
        for news in news {
            if send.send(news).is_err() {
                return;
            }
            wake();
        }
    }
}

fn sticks(pad: &Gamepad<'_>) -> Sticks {
    let axis = |axis| pad.value(axis).into();
    let trigger = |button| pad.button_data(button).map_or(0.0, |data| data.value().into());
    Sticks {
        left: [axis(Axis::LeftStickX), axis(Axis::LeftStickY)],
        right: [axis(Axis::RightStickX), axis(Axis::RightStickY)],
        triggers: [trigger(Button::LeftTrigger2), trigger(Button::RightTrigger2)],
    }
}

/// A pad that is gone asks for nothing any more: its sticks stand, and no button is held.
fn gone(name: &str) -> Vec<News> {
    vec![
        News::Lean(Lean::default()),
        News::Key(Key::Faster, false),
        News::Message(format!("{name} is gone")),
    ]
}

/// What a button means; many do nothing.
fn meaning(button: Button, down: bool) -> Option<News> {
    let key = match button {
        Button::South => Key::Faster,
        Button::North => Key::Home,
        Button::Start => Key::Pause,
        Button::Select => Key::Panel,
        Button::DPadLeft => Key::Slower,
        Button::DPadRight => Key::Quicker,
        Button::DPadUp if down => return Some(News::Speed(1.0)),
        Button::DPadDown if down => return Some(News::Speed(-1.0)),
        _ => return None,
    };
    Some(News::Key(key, down))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::window::session::Session;

    #[test]
    fn buttons_do_what_the_help_says() {
        assert_eq!(meaning(Button::South, true), Some(News::Key(Key::Faster, true)));
        assert_eq!(meaning(Button::South, false), Some(News::Key(Key::Faster, false)));
        assert_eq!(meaning(Button::Start, true), Some(News::Key(Key::Pause, true)));
        assert_eq!(meaning(Button::DPadUp, true), Some(News::Speed(1.0)));
        assert_eq!(meaning(Button::DPadUp, false), None);
        assert_eq!(meaning(Button::Mode, true), None);
    }

    #[test]
    fn what_was_held_is_let_go_with_the_pad() {
        // Each button that goes on to mean something while it is held.
        let held = [Button::South, Button::North, Button::Start, Button::DPadUp, Button::DPadLeft];
        let mut session = Session::new(Scene::default(), 0.0);
        let mut take = |news: News| match news {
            News::Key(key, down) => session.key(key, down, false),
            News::Lean(lean) => session.fly.lean(lean),
            News::Speed(_) | News::Message(_) => {}
        };
        take(News::Lean(Lean { way: glam::DVec3::Z, ..Lean::default() }));
        held.into_iter().filter_map(|button| meaning(button, true)).for_each(&mut take);
        gone("pad").into_iter().for_each(&mut take);
        // It glides to a stand, at the pace of a flight that is not hurried.
        assert!(!session.fly.fast);
        for _ in 0..600 {
            session.fly.step(0.1);
        }
        assert!(!session.fly.is_moving());
    }

    #[test]
    fn without_pads_there_is_no_news_and_it_ends() {
        let pads = Pads::start(Arc::new(|| ()));
        assert_eq!(pads.news(), None);
    }
}
