//! A file that is dragged to a window and dropped there, as the protocol XDND 5 has it.

use std::path::Path;

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    ClientMessageEvent, ConnectionExt as _, CreateWindowAux, EventMask, PropMode, SELECTION_NOTIFY_EVENT,
    SelectionNotifyEvent, SelectionRequestEvent, WindowClass,
};
use x11rb::wrapper::ConnectionExt as _;

use crate::session::Session;

/// Drops a file on the window of a session.
pub(crate) fn drop_file(session: &Session, path: &Path) {
    let (server, window) = (&session.keys, session.window);
    let atom = |name: &str| server.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom;
    let source = server.generate_id().unwrap();
    let look = CreateWindowAux::new();
    server
        .create_window(0, source, session.root, 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &look)
        .unwrap()
        .check()
        .unwrap();
    server.set_selection_owner(source, atom("XdndSelection"), x11rb::CURRENT_TIME).unwrap();
    let list = atom("text/uri-list");
    let send = |name: &str, data: [u32; 4]| {
        let data = [source, data[0], data[1], data[2], data[3]];
        let message = ClientMessageEvent::new(32, window, atom(name), data);
        server.send_event(false, window, EventMask::NO_EVENT, message).unwrap().check().unwrap();
    };
    send("XdndEnter", [5 << 24, list, 0, 0]);
    let middle = 200 << 16 | 100;
    send("XdndPosition", [0, middle, x11rb::CURRENT_TIME, atom("XdndActionCopy")]);
    // The program asks for the names once the pointer is over its window.
    let request = loop {
        if let Event::SelectionRequest(request) = server.wait_for_event().unwrap() {
            break request;
        }
    };
    let uri = format!("file://{}\r\n", path.to_str().unwrap().replace(' ', "%20"));
    answer(session, &request, uri.as_bytes());
    let status = atom("XdndStatus");
    loop {
        if let Event::ClientMessage(message) = server.wait_for_event().unwrap()
            && message.type_ == status
        {
            assert_eq!(message.data.as_data32()[1] & 1, 1, "the window does not take files");
            break;
        }
    }
    send("XdndDrop", [0, x11rb::CURRENT_TIME, 0, 0]);
}

fn answer(session: &Session, request: &SelectionRequestEvent, bytes: &[u8]) {
    let server = &session.keys;
    let SelectionRequestEvent { requestor, property, target, selection, time, .. } = *request;
    server.change_property8(PropMode::REPLACE, requestor, property, target, bytes).unwrap();
    let notify = SelectionNotifyEvent {
        response_type: SELECTION_NOTIFY_EVENT,
        sequence: 0,
        time,
        requestor,
        selection,
        target,
        property,
    };
    server.send_event(false, requestor, EventMask::NO_EVENT, notify).unwrap().check().unwrap();
}
