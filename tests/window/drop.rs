//! Drops a file on a window, as a file manager does: the source's side of the XDND protocol
//! (version 5, freedesktop.org).

use std::path::Path;

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ClientMessageEvent, ConnectionExt, CreateWindowAux, EventMask, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, Window, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

use super::flight::{Flight, until};

/// Version of the protocol, where messages want it.
const VERSION: u32 = 5 << 24;

struct Source {
    server: RustConnection,
    window: Window,
    target: Window,
}

impl Source {
    fn atom(&self, name: &str) -> Atom {
        let cookie = self.server.intern_atom(false, name.as_bytes()).expect("sent");
        cookie.reply().expect("an atom").atom
    }

    fn tell(&self, kind: &str, data: [u32; 5]) {
        let message = ClientMessageEvent::new(32, self.target, self.atom(kind), data);
        let none = EventMask::NO_EVENT;
        self.server.send_event(false, self.target, none, message).expect("sent");
        self.server.flush().expect("sent");
    }

    /// Hands the file's name over.
    fn answer(&self, request: &SelectionRequestEvent, path: &Path) {
        let text = format!("file://{}\r\n", path.display());
        let (to, property, kind) = (request.requestor, request.property, request.target);
        self.server
            .change_property8(PropMode::REPLACE, to, property, kind, text.as_bytes())
            .expect("sent");
        let notice = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: request.time,
            requestor: to,
            selection: request.selection,
            target: kind,
            property,
        };
        self.server.send_event(false, to, EventMask::NO_EVENT, notice).expect("sent");
        self.server.flush().expect("sent");
    }

    /// Answers what is asked until the target sends this message.
    fn wait_for(&self, kind: &str, path: &Path) {
        let kind_atom = self.atom(kind);
        until(kind, || {
            loop {
                match self.server.poll_for_event().expect("a connection")? {
                    Event::SelectionRequest(request) => self.answer(&request, path),
                    Event::ClientMessage(message) if message.type_ == kind_atom => return Some(()),
                    _ => {}
                }
            }
        });
    }
}

/// Drops a file in the middle of the window.
pub fn drop_file(flight: &Flight, path: &Path) {
    let (server, screen) = x11rb::connect(Some(flight.display.name())).expect("the server");
    let root = server.setup().roots[screen].root;
    let window = server.generate_id().expect("an id");
    let events = CreateWindowAux::new().event_mask(EventMask::PROPERTY_CHANGE);
    server
        .create_window(0, window, root, 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &events)
        .expect("sent");
    let target = flight.window.parse().expect("a window's number");
    let source = Source { server, window, target };
    let selection = source.atom("XdndSelection");
    let now: u32 = AtomEnum::NONE.into();
    source.server.set_selection_owner(source.window, selection, now).expect("sent");
    let list = source.atom("text/uri-list");
    source.tell("XdndEnter", [source.window, VERSION, list, 0, 0]);
    let (place, copy) = (100 << 16 | 100, source.atom("XdndActionCopy"));
    source.tell("XdndPosition", [source.window, 0, place, now, copy]);
    source.wait_for("XdndStatus", path);
    source.tell("XdndDrop", [source.window, 0, now, 0, 0]);
    source.wait_for("XdndFinished", path);
}
