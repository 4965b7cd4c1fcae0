//! The thread that makes pictures: the window answers, however long one takes.
//!
//! The window says what it wants to see; only the last order counts. Errands, such as saving a
//! picture, are done one by one before the next order. On a software driver the thread has a device
//! of its own, whose queue the window does not wait for.

mod counter;
mod insides;
mod maker;
mod order;

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::guard::guarded;
use crate::Error;
use crate::gpu::Gpu;
use crate::tables::TableSet;

pub(super) use order::{Errand, Image, Inside, Order, Reply, Shown};

/// What is under way when the window closes has so long to be finished.
const FAREWELL: Duration = Duration::from_secs(10);

/// Tells the window that there is a reply.
pub(super) type Wake = Arc<dyn Fn() + Send + Sync>;

/// The thread, from the window's side.
pub(super) struct Studio {
    shared: Arc<Shared>,
    replies: Receiver<(Number, Reply)>,
    thread: Option<JoinHandle<()>>,
    /// What was ordered last.
    last: Option<Order>,
    given: Number,
    answered: Number,
}

/// Orders are numbered from 1; replies that answer none have 0.
type Number = u64;

/// What both sides see.
#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    filled: Condvar,
    /// The thread's device, as soon as there is one.
    gpu: Mutex<Option<Gpu>>,
}

#[derive(Default)]
struct Inbox {
    order: Option<(Number, Order)>,
    errands: VecDeque<Errand>,
    closing: bool,
}

impl Studio {
    /// Starts the thread. Without a device it makes one of its own.
    pub fn new(gpu: Option<Gpu>, tables: Arc<TableSet>, wake: Wake) -> crate::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (send, replies) = channel();
        let of_thread = shared.clone();
        let thread = std::thread::Builder::new()
            .name("pictures".to_owned())
            .spawn(move || {
                let reply = |number, reply| {
                    // Nobody listens any more when the window is closed.
                    let _ = send.send((number, reply));
                    wake();
                };
                let ended =
                    guarded("making a picture", || maker::run(&of_thread, gpu, tables, &reply));
                if let Err(error) = ended {
                    reply(0, Reply::Failed(error));
                }
            })
            .map_err(|e| Error::Failed(format!("no thread for pictures: {e}")))?;
        Ok(Self { shared, replies, thread: Some(thread), last: None, given: 0, answered: 0 })
    }

    /// Asks for a picture, unless it is the one that was asked for last, or `again`.
    pub fn order(&mut self, order: Order, again: bool) {
        if !again && self.last.as_ref() == Some(&order) {
            return;
        }
        self.given += 1;
        lock(&self.shared.inbox).order = Some((self.given, order.clone()));
        self.shared.filled.notify_one();
        self.last = Some(order);
    }

    /// Asks for something besides the pictures.
    pub fn send(&self, errand: Errand) {
        lock(&self.shared.inbox).errands.push_back(errand);
        self.shared.filled.notify_one();
    }

    /// The next reply, if there is one.
    pub fn reply(&mut self) -> Option<Reply> {
        let (number, reply) = self.replies.try_recv().ok()?;
        self.answered = self.answered.max(number);
        Some(reply)
    }

    /// Whether the last order is not answered yet.
    pub fn is_busy(&self) -> bool {
        self.answered < self.given
    }

    /// Shaders that the thread has compiled so far.
    pub fn compiled(&self) -> u32 {
        lock(&self.shared.gpu).as_ref().map_or(0, Gpu::compiled)
    }

    /// Loses the device, as a driver that is reset does.
    pub fn lose_device(&self) {
        if let Some(gpu) = &*lock(&self.shared.gpu) {
            gpu.lose();
        }
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        lock(&self.shared.inbox).closing = true;
        self.shared.filled.notify_one();
        let Some(thread) = self.thread.take() else { return };
        // A picture that is under way is finished first: what is on the device stays valid. Tables
        // that take a minute end with the program.
        let end = Instant::now() + FAREWELL;
        while !thread.is_finished() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
        if thread.is_finished() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// What to do next; none when the window closes.
    fn next(&self) -> Option<(Number, Errand)> {
        let mut inbox = lock(&self.inbox);
        loop {
            if inbox.closing {
                return None;
            }
            if let Some(errand) = inbox.errands.pop_front() {
                return Some((0, errand));
            }
            if let Some((number, order)) = inbox.order.take() {
                return Some((number, Errand::Show(order)));
            }
            inbox = self.filled.wait(inbox).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// A thread that died while it held a lock leaves whole values behind.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
