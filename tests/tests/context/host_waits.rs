//! What the validation layer knows when the host asks for progress.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::{self, vk};
use lvk::{BufferDesc, BufferUsage, ImportedBuffer};

use super::engine::{BYTES, Engine};

/// Bytes that a device fills for longer than two questions take.
const MANY: u64 = 256 << 20;
/// Rounds, as a device may be done before both questions.
const ROUNDS: u32 = 20;

/// Synchronization validation must not take pending work as finished because the host asks twice whether it is.
#[test]
fn questions_of_the_host_hide_no_hazard() {
    let Some(engine) = Engine::new() else { return };
    if !engine.raw().instance_extensions.contains(&ash::ext::debug_utils::NAME) {
        return eprintln!("NOT TESTED without the validation layer");
    }
    let ctx = engine.context();
    let (buffer, memory) = engine.buffer();
    let imported = ImportedBuffer {
        buffer,
        size_bytes: BYTES,
        usage: BufferUsage::STORAGE,
        concurrent: false,
        debug_name: "the engine's buffer",
    };
    // SAFETY: the buffer is as described, and lives on.
    let words = unsafe { ctx.import_buffer(&imported).unwrap() };
    let many = ctx.create_buffer(&BufferDesc { size_bytes: MANY, ..Default::default() }).unwrap();
    let both_asked_in_time = (0..ROUNDS).any(|_| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.fill_buffer(*many, 0, MANY, 1).unwrap();
        cmd.fill_buffer(*words, 0, BYTES, 2).unwrap();
        let submission = ctx.submit(cmd).unwrap();
        if ctx.is_done(submission).unwrap() || ctx.is_done(submission).unwrap() {
            return false;
        }
        assert_eq!(engine.instance.take_messages(), [""; 0]);
        // SAFETY: the buffer has a word for each texel. The order of the fills is not known, which is what the layer is to find.
        let fill =
            |commands| unsafe { engine.device.cmd_fill_buffer(commands, buffer, 0, vk::WHOLE_SIZE, 3) };
        engine.submit(engine.queue, &[], &[], fill);
        true
    });
    assert!(both_asked_in_time, "the device is too fast for {MANY} bytes");
    let messages = engine.instance.take_messages();
    assert!(messages.len() == 1 && messages[0].contains("WRITE_AFTER_WRITE"), "{messages:?}");
    ctx.wait_idle().unwrap();
    drop((words, many, ctx));
    // SAFETY: the engine's own, once each, after all work is done.
    unsafe {
        engine.device.device_wait_idle().unwrap();
        engine.device.destroy_buffer(buffer, None);
        engine.device.free_memory(memory, None);
    }
}
