//! Renders frames, and writes the images of a sequence as they are done.

use std::path::Path;

use super::frame_name::FrameName;
use super::frames::Frames;
use super::interrupt::Interrupt;
use super::pass_times::PassTimes;
use super::png;
use super::progress::Progress;
use super::run_error::RunError;
use super::sample::FrameTime;
use super::timings::Timings;

/// A source of frames: [`Headless`](super::headless::Headless) is one for samples.
pub trait FrameSource {
    /// Moves the animation to `time`.
    fn update(&mut self, time: FrameTime);

    /// Into how many steps a frame is cut, for the progress bar.
    fn steps_per_frame(&self) -> u64;

    /// Renders a frame and waits for it. Calls `after_step` with the number of steps done.
    ///
    /// # Errors
    /// Its own.
    fn render(&mut self, after_step: &mut dyn FnMut(u64)) -> Result<PassTimes, RunError>;

    /// The last frame: red, green, blue and alpha of each pixel, 8 bits each, sRGB, rows from the top.
    ///
    /// # Errors
    /// Its own.
    fn picture(&self) -> Result<Vec<u8>, RunError>;
}

/// The frames to render and the images to write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RenderRequest {
    /// The frames.
    pub frames: Frames,
    /// Frames that are rendered first and not timed, so that clocks are up.
    pub warm_up: u32,
    /// Frames until the animation repeats itself.
    pub frames_per_round: u32,
    /// Width and height of the pictures in pixels.
    pub size: [u32; 2],
    /// Names of the pictures.
    pub out: FrameName,
    /// True if pictures that are there are left as they are.
    pub resume: bool,
}

/// The result of a request.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderReport {
    /// GPU times of the passes.
    pub timings: Timings,
    /// Pictures written.
    pub written: u32,
    /// Frames left out because their pictures were there.
    pub skipped: u32,
}

impl RenderRequest {
    /// Checks that the frames can be written, without leaving anything behind but the folder of a sequence, which is made.
    ///
    /// # Errors
    /// [`RunError`] says what to change.
    pub fn check(&self) -> Result<(), RunError> {
        let first = match (&self.frames, self.out.has_number()) {
            (Frames::Still(_), true) => return Err(RunError::NoSequence { name: self.name() }),
            (Frames::Sequence(_), false) => return Err(RunError::NoNumber { name: self.name() }),
            (Frames::Still(_), false) if self.resume => return Err(RunError::NothingToResume),
            (Frames::Still(_), false) => self.out.path_for(0),
            (Frames::Sequence(range), true) => {
                let first = self.out.path_for(range.start);
                make_folder(&first)?;
                first
            }
        };
        Ok(png::check_writable(&first)?)
    }

    fn name(&self) -> String {
        lvk::readable_name(self.out.path())
    }

    fn frame_time(&self, frame: u32) -> FrameTime {
        FrameTime::from_frame(frame, self.frames_per_round)
    }
}

/// Renders what `request` asks for. Frame N of a sequence depends on N alone, whatever range it is in. After `interrupt` was
/// raised, the frame under way is the last.
///
/// # Errors
/// [`RunError::Interrupted`], [`RunError::Png`] and those of the source.
pub fn render_frames(
    source: &mut impl FrameSource,
    request: &RenderRequest,
    progress: &mut Progress,
    interrupt: &Interrupt,
) -> Result<RenderReport, RunError> {
    match &request.frames {
        Frames::Still(count) => still(source, request, *count, progress, interrupt),
        Frames::Sequence(range) => sequence(source, request, range.clone(), progress, interrupt),
    }
}

/// Stage of progress. Software drivers compile shaders for seconds, in the first frame.
const RENDERING: &str = "rendering; drivers compile shaders in the first frame";

fn still(
    source: &mut impl FrameSource,
    request: &RenderRequest,
    count: u32,
    progress: &mut Progress,
    interrupt: &Interrupt,
) -> Result<RenderReport, RunError> {
    let steps = source.steps_per_frame();
    let all = u64::from(request.warm_up) + u64::from(count);
    progress.stage(RENDERING, all * steps);
    let mut timings = Timings::new();
    source.update(request.frame_time(0));
    for round in 0..all {
        if interrupt.is_raised() {
            let done = round.saturating_sub(u64::from(request.warm_up)) as u32;
            return Err(RunError::Interrupted { done, count, hint: "" });
        }
        let times = source.render(&mut |step| progress.set(round * steps + step))?;
        if let Some(counted) = round.checked_sub(u64::from(request.warm_up)) {
            times.passes().for_each(|(pass, milliseconds)| timings.push(counted, pass, milliseconds));
        }
    }
    write(source, request, 0)?;
    Ok(RenderReport { timings, written: 1, skipped: 0 })
}

fn sequence(
    source: &mut impl FrameSource,
    request: &RenderRequest,
    range: std::ops::Range<u32>,
    progress: &mut Progress,
    interrupt: &Interrupt,
) -> Result<RenderReport, RunError> {
    let steps = source.steps_per_frame();
    let count = range.end.saturating_sub(range.start);
    progress.stage(RENDERING, u64::from(count) * steps);
    let mut played = RenderReport::default();
    for (done, frame) in (0_u32..).zip(range) {
        if interrupt.is_raised() {
            let hint = "; the same command with --resume does the rest";
            return Err(RunError::Interrupted { done, count, hint });
        }
        let before = u64::from(done) * steps;
        if request.resume && request.out.path_for(frame).is_file() {
            played.skipped += 1;
            progress.set(before + steps);
            continue;
        }
        source.update(request.frame_time(frame));
        let times = source.render(&mut |step| progress.set(before + step))?;
        times.passes().for_each(|(pass, milliseconds)| played.timings.push(frame.into(), pass, milliseconds));
        write(source, request, frame)?;
        played.written += 1;
    }
    Ok(played)
}

fn write(source: &impl FrameSource, request: &RenderRequest, frame: u32) -> Result<(), RunError> {
    let picture = source.picture()?;
    Ok(png::write(&request.out.path_for(frame), request.size[0], request.size[1], &picture)?)
}

fn make_folder(picture: &Path) -> Result<(), RunError> {
    match picture.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => std::fs::create_dir_all(folder)
            .map_err(|source| png::PngError::Unwritable { path: picture.to_owned(), source }.into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shows the number of its frame, and raises the flag in one of them.
    struct Counter {
        frame: u32,
        rendered: Vec<u32>,
        raise_in: u32,
        interrupt: Interrupt,
    }

    impl Counter {
        fn new(raise_in: u32) -> Self {
            Self { frame: 0, rendered: Vec::new(), raise_in, interrupt: Interrupt::without_handlers() }
        }

        fn render_frames(&mut self, request: &RenderRequest) -> Result<RenderReport, RunError> {
            let interrupt = self.interrupt.clone();
            render_frames(self, request, &mut Progress::hidden(), &interrupt)
        }
    }

    impl FrameSource for Counter {
        fn update(&mut self, time: FrameTime) {
            self.frame = time.frame;
        }

        fn steps_per_frame(&self) -> u64 {
            1
        }

        fn render(&mut self, after_step: &mut dyn FnMut(u64)) -> Result<PassTimes, RunError> {
            after_step(1);
            self.rendered.push(self.frame);
            if self.frame == self.raise_in {
                self.interrupt.raise();
            }
            Ok(PassTimes::default())
        }

        fn picture(&self) -> Result<Vec<u8>, RunError> {
            Ok(vec![self.frame as u8, 0, 0, 255])
        }
    }

    fn request(folder: &Path, frames: &str) -> RenderRequest {
        RenderRequest {
            frames: frames.parse().unwrap(),
            warm_up: 2,
            frames_per_round: 10,
            size: [1, 1],
            out: FrameName::new(&folder.join("made/frame_##.png")),
            resume: false,
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder.join("made")).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_sequence_is_a_picture_for_each_frame() {
        let folder = tempfile::tempdir().unwrap();
        let request = request(folder.path(), "8..11");
        request.check().unwrap();
        let played = Counter::new(99).render_frames(&request).unwrap();
        assert_eq!((played.written, played.skipped), (3, 0));
        assert_eq!(names(folder.path()), ["frame_08.png", "frame_09.png", "frame_10.png"]);
        let picture = image::open(request.out.path_for(9)).unwrap().into_rgba8();
        assert_eq!(picture.as_raw(), &[9, 0, 0, 255]);
    }

    #[test]
    fn an_interrupted_sequence_keeps_its_frames_and_can_be_resumed() {
        let folder = tempfile::tempdir().unwrap();
        let mut request = request(folder.path(), "0..6");
        request.check().unwrap();
        let error = Counter::new(2).render_frames(&request).unwrap_err();
        assert!(matches!(error, RunError::Interrupted { done: 3, count: 6, .. }), "{error}");
        assert_eq!((error.status(), names(folder.path()).len()), (130, 3));
        std::fs::remove_file(request.out.path_for(1)).unwrap();
        request.resume = true;
        let mut counter = Counter::new(99);
        let played = counter.render_frames(&request).unwrap();
        assert_eq!((played.written, played.skipped), (4, 2));
        assert_eq!(counter.rendered, [1, 3, 4, 5]);
    }

    #[test]
    fn a_still_is_one_picture_of_frame_0_and_its_warm_up_does_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let out = FrameName::new(&folder.path().join("a.png"));
        let request = RenderRequest { out, ..request(folder.path(), "4") };
        request.check().unwrap();
        let mut counter = Counter::new(99);
        let played = counter.render_frames(&request).unwrap();
        assert_eq!((counter.rendered.len(), played.written), (6, 1));
        assert!(request.out.path_for(0).is_file());
    }

    #[test]
    fn names_must_fit_the_frames() {
        let folder = tempfile::tempdir().unwrap();
        let still = request(folder.path(), "4");
        assert!(matches!(still.check(), Err(RunError::NoSequence { .. })));
        let plain = FrameName::new(&folder.path().join("a.png"));
        let unnumbered = RenderRequest { out: plain.clone(), ..request(folder.path(), "0..4") };
        assert!(matches!(unnumbered.check(), Err(RunError::NoNumber { .. })));
        let resumed = RenderRequest { out: plain, resume: true, ..still };
        assert!(matches!(resumed.check(), Err(RunError::NothingToResume)));
        assert!(!folder.path().join("made").exists(), "nothing is left behind");
    }
}
