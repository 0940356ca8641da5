//! Makes textures on a thread of its own, while frames go on.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use lvk::{Context, Error, Holder, TextureHandle};

use crate::app::scene_textures;
use crate::scene::PAINTED;

/// A request for a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LoadRequest {
    /// Number of the texture in [`PAINTED`].
    pub(super) number: usize,
    /// Distinguishes requests for the same texture.
    pub(super) ticket: u64,
}

/// The result of a request.
pub(super) type Answer = (LoadRequest, lvk::Result<Holder<TextureHandle>>);

/// The thread, with its ends of both ways.
pub(super) struct Loader {
    requests: Option<Sender<LoadRequest>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
}

impl Loader {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let ((requests, incoming), (answer, answers), ctx) = (channel(), channel(), ctx.clone());
        let work = move || {
            // Ends when the loader drops its end of either channel.
            for request in incoming {
                let texture = paint(&ctx, request);
                if answer.send((request, texture)).is_err() {
                    break;
                }
            }
        };
        let spawned = thread::Builder::new().name("textures".to_owned()).spawn(work);
        let thread = spawned.map_err(|_| Error::OutOfHostMemory {
            call: "std::thread::Builder::spawn",
            object: "textures".to_owned(),
        })?;
        Ok(Self { requests: Some(requests), answers, thread: Some(thread) })
    }

    /// Requests a texture. [`poll`](Self::poll) or [`wait`](Self::wait) returns it later.
    pub(super) fn request(&self, request: LoadRequest) {
        // The thread listens as long as this lives.
        let _ = self.requests.as_ref().map(|requests| requests.send(request));
    }

    /// An answer that is there.
    pub(super) fn poll(&self) -> Option<Answer> {
        self.answers.try_recv().ok()
    }

    /// Waits for the next result; a request must be pending.
    pub(super) fn wait(&self) -> Option<Answer> {
        self.answers.recv().ok()
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        self.requests = None;
        // A texture that the thread is still painting is dropped with the answers.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The upload takes its place before the next submission, whichever thread makes that.
fn paint(ctx: &Context, request: LoadRequest) -> lvk::Result<Holder<TextureHandle>> {
    scene_textures::picture(ctx, &(PAINTED[request.number].paint)())
}
