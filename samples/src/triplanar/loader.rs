//! Makes textures on a thread of its own, while frames go on.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use lvk::{Context, Error, Holder, TextureHandle};

use crate::app::scene_textures;
use crate::scene::PAINTED;

/// A texture that is wished for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wish {
    /// Its number in [`PAINTED`].
    pub(super) number: usize,
    /// Tells wishes for the same texture apart.
    pub(super) ticket: u64,
}

/// The result of a request.
pub(super) type Answer = (Wish, lvk::Result<Holder<TextureHandle>>);

/// The thread, with its ends of both ways.
pub(super) struct Loader {
    wishes: Option<Sender<Wish>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
}

impl Loader {
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let ((wishes, asked), (answer, answers), ctx) = (channel(), channel(), ctx.clone());
        let work = move || {
            // Ends where nobody wishes, or nobody wants to know, any more.
            for wish in asked {
                let texture = paint(&ctx, wish);
                if answer.send((wish, texture)).is_err() {
                    break;
                }
            }
        };
        let spawned = thread::Builder::new().name("textures".to_owned()).spawn(work);
        let thread = spawned.map_err(|_| Error::OutOfHostMemory { call: "std::thread::Builder::spawn" })?;
        Ok(Self { wishes: Some(wishes), answers, thread: Some(thread) })
    }

    /// Asks for a texture; the answer comes when it comes.
    pub(super) fn ask(&self, wish: Wish) {
        // The thread listens as long as this lives.
        let _ = self.wishes.as_ref().map(|wishes| wishes.send(wish));
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
        self.wishes = None;
        // A texture that the thread is still painting is dropped with the answers.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The upload takes its place before the next submission, whichever thread makes that.
fn paint(ctx: &Context, wish: Wish) -> lvk::Result<Holder<TextureHandle>> {
    scene_textures::picture(ctx, &(PAINTED[wish.number].paint)())
}
