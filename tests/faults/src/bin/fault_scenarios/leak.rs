//! A scenario with defects: it proves that the layer and the process see leaks.

use std::fs::File;

use lvk::ContextDesc;
use lvk::ash::vk;

use crate::{Failure, context};

/// Bytes of the memory that is forgotten.
const BYTES: usize = 1 << 16;

/// Creates a fence, an open file, a thread and memory. Forgets them where `forgets` says so.
pub(crate) fn leak(forgets: bool) -> Result<Vec<u8>, Failure> {
    let ctx = context(ContextDesc::default())?;
    let device = ctx.raw_device();
    let (file, memory) = (File::open("/dev/null")?, vec![1_u8; BYTES]);
    let (stop, stopped) = std::sync::mpsc::channel::<()>();
    let thread = std::thread::spawn(move || stopped.recv());
    // SAFETY: the description is valid, and nothing uses the fence.
    unsafe {
        let fence = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
        if !forgets {
            device.destroy_fence(fence, None);
        }
    }
    if forgets {
        std::mem::forget((file, memory, stop));
    } else {
        drop(stop);
        // The thread has nothing to tell.
        let _ = thread.join();
    }
    Ok(b"done".to_vec())
}
