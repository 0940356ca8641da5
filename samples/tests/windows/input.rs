//! Keys, the animation, other sizes and other windows.

use std::path::Path;
use std::thread;
use std::time::Duration;

use crate::session::{
    BESIDE_PANEL, F1, KEY_N, KEY_W, SPACE, Session, assert_success, differing, differing_by, sample, texts,
};

#[test]
fn keys_hide_the_panel_and_fly_and_the_image_follows_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_rtx_textures");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("rtx_textures_window_{number:04}.png"));
    session.press(SPACE);
    // The first frame lays the panel out and does not show it.
    session.take_screenshot(&shot(1));
    let with_panel = session.take_screenshot(&shot(2));
    session.press(F1);
    let without = session.take_screenshot(&shot(3));
    assert!(differing(&with_panel, &without, BESIDE_PANEL) < 1e-3, "the animation stands");
    assert!(differing(&with_panel, &without, 0) > 0.1, "the panel is still there");
    session.key(KEY_W, true);
    thread::sleep(Duration::from_millis(500));
    session.key(KEY_W, false);
    let flown = session.take_screenshot(&shot(4));
    assert!(differing(&without, &flown, 0) > 0.1, "nothing has moved");
    session.resize([300, 260]);
    thread::sleep(Duration::from_millis(600));
    assert_eq!(session.take_screenshot(&shot(5)).dimensions(), (300, 260));
    session.close();
}

#[test]
fn an_animation_by_frames_stands_too() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let Some(mut session) = Session::new(program, &["--frames", "1000000"], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("hello_triangle_window_{number:04}.png"));
    session.press(F1);
    let (first, second) = (session.take_screenshot(&shot(1)), session.take_screenshot(&shot(2)));
    assert!(differing(&first, &second, 0) > 0.0, "it stands already");
    session.press(SPACE);
    let first = session.take_screenshot(&shot(3));
    assert!(session.take_screenshot(&shot(4)) == first, "it goes on");
    session.press(SPACE);
    assert!(session.take_screenshot(&shot(5)) != first, "it still stands");
    session.close();
}

/// As on Android when an application is paused and comes back, by the same functions: on its device, with what was pressed
/// before, and without a message of the validation layer. A window that is destroyed from outside takes the same way, but
/// winit panics where it asks for such a window before it has read that it is gone.
#[test]
fn a_sample_goes_on_where_it_was_in_another_window() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_rtx_textures");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = |number: u32| folder.path().join(format!("rtx_textures_window_{number:04}.png"));
    session.press(SPACE);
    session.press(F1);
    let before = session.take_screenshot(&shot(1));
    for number in 2..12 {
        session.reopen();
        assert!(session.take_screenshot(&shot(number)) == before, "picture {number} is another one");
    }
    session.resize([300, 260]);
    thread::sleep(Duration::from_millis(600));
    assert_eq!(session.take_screenshot(&shot(12)).dimensions(), (300, 260));
    session.reopen();
    // The picture follows the size of the window a little later.
    thread::sleep(Duration::from_millis(600));
    assert!(session.take_screenshot(&shot(13)) == before, "a new window has the size of the first");
    session.press(SPACE);
    let animated = session.take_screenshot(&shot(14));
    assert!(differing(&before, &animated, 0) > 0.0, "the animation stands");
    let said = session.close();
    let is_wrong = |line: &&String| ["warning", "error", "alive"].iter().any(|word| line.contains(word));
    assert_eq!(said.iter().find(is_wrong), None);
}

/// Sizes without a pattern, the same in each run: up to 400 pixels, and each eighth one up to 4.
fn sizes(count: u32) -> impl Iterator<Item = [u32; 2]> {
    let mut state = 0x9e37_79b9_u32;
    let mut below = move |end: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % end
    };
    (0..count).map(move |number| {
        let end = if number % 8 == 5 { 4 } else { 400 };
        [1 + below(end), 1 + below(end)]
    })
}

/// A screenshot of a size tells that frames have it, and that no swapchain is being made: a window that changes while one
/// is made, between the question for its size and the answer, causes a message of the validation layer that no application can prevent.
#[test]
fn two_hundred_sizes_of_a_window_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let Some(mut session) = Session::new(program, &[], folder.path()) else { return };
    let shot = folder.path().join("hello_triangle_window_0001.png");
    session.press(SPACE);
    session.press(F1);
    for (number, size) in sizes(200).enumerate() {
        session.resize(size);
        session.shoot_until(&shot, |_, shot| shot.dimensions() == size.into());
        if number % 40 == 39 {
            // By then the picture has the size too, and stands still.
            thread::sleep(Duration::from_millis(300));
            session.shoot_until(&shot, |session, shot| {
                shot.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).eq(session.seen(size))
            });
        }
    }
    session.close();
}

/// A swapchain is made of a size that its window had when it was asked: told where the window has changed since.
const SIZE_HAS_CHANGED: &str = "VUID-VkSwapchainCreateInfoKHR-pNext-07781";

/// At any time, swapchains being made or not. The layer is told to skip the one message that this can cause and that no application can prevent.
#[test]
fn two_hundred_sizes_in_a_hurry_are_followed_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_hello_triangle");
    let variables = [("VK_LAYER_MESSAGE_ID_FILTER", SIZE_HAS_CHANGED)];
    let Some(mut session) = Session::with_variables(program, &[], folder.path(), &variables) else { return };
    let shot = folder.path().join("hello_triangle_window_0001.png");
    session.press(SPACE);
    session.press(F1);
    for (pause, size) in (0..16).cycle().zip(sizes(200)) {
        session.resize(size);
        thread::sleep(Duration::from_millis(pause));
    }
    let last = [311, 207];
    session.resize(last);
    session.shoot_until(&shot, |_, shot| shot.dimensions() == last.into());
    session.close();
}

/// The formats that the device has, as the sample says them.
fn yuv_formats(program: &str, folder: &Path) -> Vec<String> {
    let output = sample(program, &["--frames", "1"], folder).output().unwrap();
    assert_success(&output);
    let (said, _) = texts(&output);
    let (_, list) = said.split_once("the device has [").unwrap();
    list.split_once(']').unwrap().0.split(", ").map(str::to_owned).collect()
}

/// Formats of 8 bits give one picture, those of 10 bits another, which is rounded otherwise: the key goes through all, and back
/// to the first.
#[test]
fn a_key_goes_through_the_formats() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_yuv");
    let formats = yuv_formats(program, folder.path());
    let Some(mut session) = Session::new(program, &["--model", "bt601"], folder.path()) else { return };
    let mut shots = 0;
    let mut take_screenshot = |session: &mut Session| {
        shots += 1;
        session.take_screenshot(&folder.path().join(format!("yuv_window_{shots:04}.png")))
    };
    session.press(SPACE);
    session.press(F1);
    take_screenshot(&mut session);
    let first = take_screenshot(&mut session);
    assert!(take_screenshot(&mut session) == first, "the picture stands still");
    let bits = |format: &String| if format.ends_with("10") { 10 } else { 8 };
    for format in formats.iter().cycle().skip(1).take(formats.len()) {
        session.press(KEY_N);
        thread::sleep(Duration::from_millis(300));
        let next = take_screenshot(&mut session);
        assert_eq!(next == first, bits(format) == bits(&formats[0]), "{format} of {formats:?}");
        let others = differing_by(8, &first, &next, 0);
        assert!(others < 0.01, "{format} shows something else in {others} of the picture");
    }
    session.close();
}
