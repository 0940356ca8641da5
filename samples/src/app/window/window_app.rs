//! The program of a sample that has a window: events in, frames out.

use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Rect, ViewportInfo, vec2};
use lvk::{Context, ShaderFiles, SubmitHandle, ValidationSink, WindowHandles};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::PhysicalKey;
use winit::window::{Window, WindowId};

use super::EventLoopBuilder;
use super::camera_controller::CameraController;
use super::clock::Clock;
use super::controls::{Action, Controls, help};
use super::present_pass::PresentPass;
use super::resize::ResizeDebounce;
use super::touch::Finger;
use super::ui_input::{UiInput, notches};
use crate::app::cli::{ReadySample, SampleSetup};
use crate::app::device::report_index_faults;
use crate::app::frame::Frame;
use crate::app::frames::Frames;
use crate::app::run_args::RunArgs;
use crate::app::run_error::RunError;
use crate::app::sample::{FrameTime, Sample};
use crate::app::screenshot::{Screenshot, free_name};
use crate::app::ui::{Panel, PanelInfo};
use crate::app::{print_line, print_message};
use crate::shader_folder;

/// Time between two looks at a window that shows nothing.
const NAP: Duration = Duration::from_millis(30);

/// Time in which a window must get the size of `--resized`.
const RESIZE_PATIENCE: Duration = Duration::from_secs(60);

/// Shows the sample that `make` makes, until its window is closed or `--frames` are shown. Messages of the validation layer
/// go into `sink`.
pub(in crate::app) fn run<S, M>(
    event_loop: &mut EventLoopBuilder,
    name: &str,
    args: &RunArgs,
    sink: &ValidationSink,
    make: M,
) -> Result<(), RunError>
where
    S: Sample,
    M: FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
{
    let event_loop = built(event_loop)?;
    let mut program =
        WindowApp { name, args, sink, make: Some(make), running: None, rests_until: None, ended: Ok(()) };
    event_loop.run_app(&mut program).map_err(|error| RunError::window(&error))?;
    let WindowApp { running, ended, .. } = program;
    let closed = running.map_or(Ok(()), |running| running.close(args.check_indices));
    ended?;
    closed
}

/// Builds the event loop. winit panics where the keyboard descriptions of X11 are missing: that is an error, too.
fn built(event_loop: &mut EventLoopBuilder) -> Result<EventLoop<()>, RunError> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let built = std::panic::catch_unwind(AssertUnwindSafe(|| event_loop.build()));
    std::panic::set_hook(hook);
    let missing = || RunError::NoWindow {
        reason: "the keyboard descriptions of X11 cannot be read; install xkb-data and libxkbcommon-x11-0"
            .to_owned(),
    };
    built.map_err(|_| missing())?.map_err(|error| RunError::window(&error))
}

/// The handler of events.
struct WindowApp<'a, S, M> {
    name: &'a str,
    args: &'a RunArgs,
    sink: &'a ValidationSink,
    make: Option<M>,
    running: Option<Running<S>>,
    /// No frame before, unless something happens to the window.
    rests_until: Option<Instant>,
    ended: Result<(), RunError>,
}

impl<S, M> ApplicationHandler for WindowApp<'_, S, M>
where
    S: Sample,
    M: FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
{
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let resumed = match (self.make.take(), &mut self.running) {
            (Some(make), _) => self.open(event_loop, make).map(|running| self.running = Some(running)),
            (None, Some(running)) => running.resume(Arc::clone(&running.window)),
            (None, None) => Ok(()),
        };
        self.go_on(event_loop, resumed);
    }

    /// Suspends the sample: Android takes the window after this call and returns it before [`resumed`](Self::resumed).
    fn suspended(&mut self, event_loop: &ActiveEventLoop) {
        let suspended = self.running.as_mut().map_or(Ok(()), Running::suspend);
        event_loop.set_control_flow(ControlFlow::Wait);
        if let Err(error) = suspended {
            self.end(event_loop, Err(error));
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        // A window that was replaced may still have events.
        let Some(running) = self.running.as_mut().filter(|running| running.window.id() == id) else { return };
        let done = match event {
            WindowEvent::CloseRequested => Ok(Next::Close),
            WindowEvent::Destroyed => Ok(Next::Reopen),
            WindowEvent::RedrawRequested if running.is_suspended => return,
            WindowEvent::RedrawRequested => running.redraw(self.name, self.args),
            event => running.event(&event),
        };
        match done {
            Ok(Next::Frame) if running.is_suspended => {}
            Ok(Next::Frame) => {
                self.rests_until = None;
                event_loop.set_control_flow(ControlFlow::Poll);
            }
            Ok(Next::Nap) => {
                let until = Instant::now() + NAP;
                self.rests_until = Some(until);
                event_loop.set_control_flow(ControlFlow::WaitUntil(until));
            }
            Ok(Next::Close) => self.end(event_loop, Ok(())),
            // A window that was never drawn in would be followed by others without end.
            Err(RunError::WindowLost(_)) if running.frames_here > 0 => self.reopen(event_loop),
            Ok(Next::Reopen) => self.reopen(event_loop),
            Err(error) => self.end(event_loop, Err(error)),
        }
    }

    fn about_to_wait(&mut self, _: &ActiveEventLoop) {
        // A redraw that is asked for comes at once, whatever is waited for.
        let is_due = self.rests_until.is_none_or(|until| Instant::now() >= until);
        if let Some(running) = self.running.as_ref().filter(|running| is_due && !running.is_suspended) {
            running.window.request_redraw();
        }
    }
}

impl<S: Sample, M> WindowApp<'_, S, M>
where
    M: FnOnce(&mut SampleSetup<'_>) -> Result<ReadySample<S>, RunError>,
{
    fn open(&self, event_loop: &ActiveEventLoop, make: M) -> Result<Running<S>, RunError> {
        let window = self.new_window(event_loop)?;
        let mut setup = SampleSetup::new(self.name, self.args, self.sink);
        setup.window = Some(Arc::clone(&window) as Arc<_>);
        let ReadySample { sample, summary } = make(&mut setup)?;
        drop(setup);
        if !summary.is_empty() {
            print_line(&summary);
        }
        Running::new(window, sample, self.args)
    }

    fn new_window(&self, event_loop: &ActiveEventLoop) -> Result<Arc<Window>, RunError> {
        let size = PhysicalSize::new(self.args.width, self.args.height);
        let look = Window::default_attributes().with_title(self.name).with_inner_size(size);
        let window = event_loop.create_window(look).map_err(|error| RunError::window(&error))?;
        Ok(Arc::new(window))
    }

    /// Goes on after the window was lost without having been closed, or where the user asks for it. On Android the window comes back with
    /// [`resumed`](Self::resumed), elsewhere another one takes its place.
    fn reopen(&mut self, event_loop: &ActiveEventLoop) {
        self.suspended(event_loop);
        if cfg!(target_os = "android") || event_loop.exiting() {
            return;
        }
        let window = self.new_window(event_loop);
        let resumed = match &mut self.running {
            Some(running) => window.and_then(|window| running.resume(window)),
            None => Ok(()),
        };
        self.go_on(event_loop, resumed);
    }

    fn go_on(&mut self, event_loop: &ActiveEventLoop, resumed: Result<(), RunError>) {
        self.rests_until = None;
        event_loop.set_control_flow(ControlFlow::Poll);
        if let Err(error) = resumed {
            self.end(event_loop, Err(error));
        }
    }

    fn end(&mut self, event_loop: &ActiveEventLoop, ended: Result<(), RunError>) {
        if self.ended.is_ok() {
            self.ended = ended;
        }
        // Loading that is still in progress may take some time to end.
        self.running.iter().for_each(|running| running.window.set_visible(false));
        event_loop.exit();
    }
}

/// The next step of the event loop.
enum Next {
    /// A frame, at once.
    Frame,
    /// A frame, later: nothing is seen for now.
    Nap,
    /// A frame in another window: this one is gone, or is to go.
    Reopen,
    /// Nothing any more.
    Close,
}

/// A sample in its window.
struct Running<S> {
    sample: S,
    present_pass: PresentPass,
    panel: Panel,
    controls: Controls,
    ui_input: UiInput,
    resize: ResizeDebounce,
    finger: Finger,
    shader_files: Option<ShaderFiles>,
    camera_controller: CameraController,
    clock: Clock,
    /// The time that the sample shows.
    at: Option<FrameTime>,
    shown: u32,
    wants_screenshot: bool,
    /// The latest frame.
    latest: SubmitHandle,
    ctx: Context,
    window: Arc<Window>,
    /// Size of the window in pixels, as it was told last: a window that is gone cannot be asked.
    size: [u32; 2],
    /// The time at which the window was asked for the size of `--resized`.
    asked_for_size: Option<Instant>,
    /// True until the sample is loaded.
    is_new: bool,
    /// Frames that the window has shown.
    frames_here: u32,
    /// True while there is no window to draw in.
    is_suspended: bool,
}

impl<S: Sample> Running<S> {
    fn new(window: Arc<Window>, sample: S, args: &RunArgs) -> Result<Self, RunError> {
        let ctx = sample.context().clone();
        let size = window.inner_size().into();
        let present_pass = PresentPass::new(&ctx, size)?;
        let (mode, _) = present_pass.present_modes()?;
        ctx.set_profiling(ctx.capabilities().limits.timestamp_bits > 0)?;
        let panel = Panel::new(mode);
        Ok(Self {
            sample,
            present_pass,
            panel,
            controls: Controls::default(),
            ui_input: UiInput::default(),
            resize: ResizeDebounce::new([args.width, args.height]),
            finger: Finger::default(),
            shader_files: shader_folder::watched_files(),
            camera_controller: CameraController::new(false),
            clock: Clock::new(Instant::now()),
            at: None,
            shown: 0,
            wants_screenshot: false,
            latest: SubmitHandle::default(),
            ctx,
            window,
            size,
            asked_for_size: None,
            is_new: true,
            frames_here: 0,
            is_suspended: false,
        })
    }

    /// Gives the window up. Device, sample and panel stay as they are.
    fn suspend(&mut self) -> Result<(), RunError> {
        self.is_suspended = true;
        self.controls.release_all();
        Ok(self.present_pass.suspend()?)
    }

    /// Goes on in `window`. The animation goes on where it stood.
    fn resume(&mut self, window: Arc<Window>) -> Result<(), RunError> {
        self.size = window.inner_size().into();
        let handles = Arc::clone(&window) as Arc<dyn WindowHandles>;
        self.present_pass.resume(&handles, self.size)?;
        let before = std::mem::replace(&mut self.window, window);
        if before.id() != self.window.id() {
            // The context keeps the window that it was made for.
            before.set_visible(false);
        }
        (self.frames_here, self.is_suspended) = (0, false);
        self.clock.tick(Instant::now(), false);
        Ok(())
    }

    fn event(&mut self, event: &WindowEvent) -> Result<Next, RunError> {
        if let WindowEvent::Touch(touch) = event {
            for event in self.finger.as_mouse(touch) {
                self.event(&event)?;
            }
            return Ok(Next::Frame);
        }
        self.ui_input.push(event, self.per_point());
        let is_over_panel = self.is_over_panel();
        let ui = self.present_pass.ui();
        match event {
            WindowEvent::Resized(size) => {
                self.size = [size.width, size.height];
                self.present_pass.resize(self.size)?;
            }
            WindowEvent::DroppedFile(path) => self.sample.drop_file(path),
            WindowEvent::Focused(false) => self.controls.release_all(),
            WindowEvent::CursorMoved { position, .. } => {
                self.controls.pointer([position.x as f32, position.y as f32]);
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                let is_down = *state == ElementState::Pressed;
                self.controls.drag(is_down && !is_over_panel);
            }
            WindowEvent::MouseWheel { delta, .. } if !is_over_panel => {
                self.controls.wheel(notches(*delta));
            }
            WindowEvent::KeyboardInput { event, .. } => {
                let PhysicalKey::Code(code) = event.physical_key else { return Ok(Next::Frame) };
                // A released key counts as released, even if the panel had the focus.
                let is_down = event.state.is_pressed();
                if (!is_down || !ui.wants_keyboard_input())
                    && let Some(action) = self.controls.key(code, is_down)
                {
                    return Ok(self.act(action));
                }
            }
            _ => {}
        }
        Ok(Next::Frame)
    }

    fn act(&mut self, action: Action) -> Next {
        match action {
            Action::Pause => self.panel.animates = !self.panel.animates,
            Action::ReleaseCamera => {
                self.camera_controller.release();
                self.at = None;
            }
            Action::Orbit => self.camera_controller.set_orbits(!self.camera_controller.orbits()),
            Action::Panel => self.panel.is_open = !self.panel.is_open,
            Action::Next => self.sample.next(),
            Action::Reload => self.reload(),
            Action::Reopen => return Next::Reopen,
            Action::Screenshot => self.wants_screenshot = true,
            Action::Close => return Next::Close,
        }
        Next::Frame
    }

    /// Compiles all shaders again. If one is wrong, all old pipelines stay.
    fn reload(&mut self) {
        self.panel.shader_error = self.sample.reload().err().map(|error| error.to_string());
        match &self.panel.shader_error {
            Some(error) => {
                print_message("error", format_args!("{error}\nthe shaders from before stay in use"))
            }
            None => eprintln!("shaders compiled anew"),
        }
    }

    /// Ends what is loading, and waits for the GPU. `checks_indices`: index faults are an error.
    fn close(self, checks_indices: bool) -> Result<(), RunError> {
        let Self { sample, ctx, .. } = self;
        drop(sample);
        if checks_indices {
            report_index_faults(&ctx)?;
        }
        Ok(ctx.wait_idle()?)
    }

    fn redraw(&mut self, name: &str, args: &RunArgs) -> Result<Next, RunError> {
        if self.sample.is_loading()? {
            self.is_new = true;
            return self.redraw_loading(name, args);
        }
        if std::mem::take(&mut self.is_new) {
            // Frames that are counted are those of the animation.
            self.panel.animates &= args.frames.is_some() || !self.sample.stands_at_first();
            self.camera_controller = CameraController::new(self.sample.orbits_at_first());
        }
        if self.is_resizing(args)? {
            return Ok(Next::Nap);
        }
        self.ctx.next_frame()?;
        let seconds = self.clock.tick(Instant::now(), self.panel.animates);
        self.follow(args, seconds)?;
        let Some(image) = self.present_pass.next_image()? else { return Ok(Next::Nap) };
        self.panel.count_frame(seconds);
        let mut frame = Frame::free(&self.ctx)?;
        let picture = self.sample.record(&mut frame)?;
        let mut cmd = frame.into_commands();
        let (input, profile) = (self.input(image.extent()), self.ctx.last_profile()?);
        let (_, modes) = self.present_pass.present_modes()?;
        let before = self.panel.present_mode;
        let info = PanelInfo {
            device: &self.ctx.capabilities().device_name,
            extent: image.extent(),
            present_modes: &modes,
            profile: profile.as_deref(),
            keys: help(self.sample.view().is_some()),
        };
        let (panel, sample) = (&mut self.panel, &mut self.sample);
        self.present_pass.record(&mut cmd, &image, picture, input, |ui| {
            panel.show(ui, name, &info, |ui| sample.panel(ui));
            sample.overlay(ui);
        })?;
        let last = self.is_last(args);
        let file = args.out.as_deref().filter(|_| last);
        let shot = (self.wants_screenshot || file.is_some())
            .then(|| Screenshot::record(&self.ctx, &mut cmd, &image));
        self.latest = self.ctx.present(cmd, image)?;
        self.frames_here = self.frames_here.saturating_add(1);
        self.shown += 1;
        self.clock.count_frame(self.panel.animates);
        if let Some(shot) = shot {
            self.save(shot, file, name)?;
        }
        if before != self.panel.present_mode {
            self.present_pass.set_present_mode(self.panel.present_mode)?;
        }
        Ok(if last { Next::Close } else { Next::Frame })
    }

    /// Draws a frame without an image now and then, so that the loading thread is not delayed. Draws none while the GPU works
    /// for the load, so that the window is not delayed either. Where frames are counted it draws one, so that a run repeats to the call.
    fn redraw_loading(&mut self, name: &str, args: &RunArgs) -> Result<Next, RunError> {
        self.follow_size(args)?;
        let is_enough = args.frames.is_some() && self.frames_here > 0;
        if is_enough || !self.ctx.is_done(self.latest)? {
            return Ok(Next::Nap);
        }
        self.ctx.next_frame()?;
        let Some(image) = self.present_pass.next_image()? else { return Ok(Next::Nap) };
        // The animation begins with the picture.
        self.clock.tick(Instant::now(), false);
        let mut frame = Frame::free(&self.ctx)?;
        let picture = self.sample.record(&mut frame)?;
        let mut cmd = frame.into_commands();
        let input = self.input(image.extent());
        let sample = &mut self.sample;
        self.present_pass.record(&mut cmd, &image, picture, input, |ui| sample.overlay(ui))?;
        let shot = self.wants_screenshot.then(|| Screenshot::record(&self.ctx, &mut cmd, &image));
        self.latest = self.ctx.present(cmd, image)?;
        self.frames_here = self.frames_here.saturating_add(1);
        if let Some(shot) = shot {
            self.save(shot, None, name)?;
        }
        Ok(Next::Nap)
    }

    /// Resizes the sample once the window keeps its size. Pictures that cannot have the size of `--resized` are an error.
    fn follow_size(&mut self, args: &RunArgs) -> Result<(), RunError> {
        let Some(size) = self.resize.next(self.size, Instant::now()) else { return Ok(()) };
        let Err(error) = self.sample.resize(size) else {
            self.resize.resized();
            return Ok(());
        };
        let is_tried_again = self.resize.failed(Instant::now());
        if args.resized.is_some() && !is_tried_again {
            return Err(error);
        }
        let so_far = if is_tried_again { " for now" } else { "" };
        print_message("warning", format_args!("pictures keep their size{so_far}: {error}"));
        Ok(())
    }

    /// True after the first frame until window and pictures have the size of `--resized`, which the window is asked for once.
    fn is_resizing(&mut self, args: &RunArgs) -> Result<bool, RunError> {
        let Some(size) = args.resized.filter(|_| self.shown == 1) else { return Ok(false) };
        self.follow_size(args)?;
        if self.resize.pictures() == size {
            return Ok(false);
        }
        match self.asked_for_size {
            None => {
                // `WindowEvent::Resized` tells of the size that the window gets.
                let _ = self.window.request_inner_size(PhysicalSize::<u32>::from(size));
                self.asked_for_size = Some(Instant::now());
            }
            Some(asked) if asked.elapsed() > RESIZE_PATIENCE => return Err(RunError::WindowKeepsSize),
            Some(_) => {}
        }
        Ok(true)
    }

    /// Applies changes of size, shaders, time and camera.
    fn follow(&mut self, args: &RunArgs, seconds: f32) -> Result<(), RunError> {
        self.follow_size(args)?;
        if self.shader_files.as_ref().is_some_and(ShaderFiles::changed) {
            self.reload();
        }
        if self.sample.takes_camera_back() {
            self.camera_controller.release();
        }
        let steering = self.controls.take_steering();
        let is_steered = self.camera_controller.steer(self.sample.view().as_ref(), &steering, seconds);
        let time = self.clock.frame_time(args.frames.is_some(), args.round);
        let is_later = self.at != Some(time);
        if is_later {
            self.sample.update(time);
            self.at = Some(time);
        }
        if let (true, Some(camera)) = (is_steered || is_later, self.camera_controller.camera()) {
            self.sample.set_view(&camera);
        }
        Ok(())
    }

    fn is_last(&self, args: &RunArgs) -> bool {
        matches!(args.frames, Some(Frames::Still(count)) if self.shown + 1 >= count)
    }

    /// Writes `shot`. A picture that only a key has asked for is no reason to end.
    fn save(
        &mut self,
        shot: Result<Screenshot, RunError>,
        file: Option<&Path>,
        name: &str,
    ) -> Result<(), RunError> {
        self.wants_screenshot = false;
        let path = file.map_or_else(|| free_name(Path::new(""), name), Path::to_owned);
        match shot.and_then(|shot| shot.write(&self.ctx, &path)) {
            Ok(()) => print_line(&format!("wrote {}", lvk::readable_name(path))),
            Err(error) if file.is_some() => return Err(error),
            Err(error) => print_message("error", error),
        }
        Ok(())
    }

    fn input(&mut self, [width, height]: [u32; 2]) -> egui::RawInput {
        let (events, modifiers) = self.ui_input.take_events();
        let per_point = self.per_point();
        let size = vec2(width as f32, height as f32) / per_point;
        let viewport = ViewportInfo { native_pixels_per_point: Some(per_point), ..ViewportInfo::default() };
        let mut input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(egui::Pos2::ZERO, size)),
            time: Some(self.clock.seconds()),
            modifiers,
            events,
            ..egui::RawInput::default()
        };
        input.viewports.insert(input.viewport_id, viewport);
        input
    }

    /// True if the pointer is on the panel, also where a finger has put it just now.
    fn is_over_panel(&self) -> bool {
        let layer = self.present_pass.ui().layer_id_at(self.ui_input.pointer());
        layer.is_some_and(|layer| layer.order != egui::Order::Background)
    }

    fn per_point(&self) -> f32 {
        self.window.scale_factor() as f32
    }
}
