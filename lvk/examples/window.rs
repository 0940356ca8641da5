//! Draws a triangle in a window that can be resized.
use std::sync::Arc;

use lvk::*;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

type Error = Box<dyn std::error::Error>;

const VERTEX: &str = r"
    const vec2 CORNERS[] = { vec2(-0.7, 0.7), vec2(0.7, 0.7), vec2(0, -0.7) };
    layout(location = 0) out vec3 shade;
    void main() {
        gl_Position = vec4(CORNERS[gl_VertexIndex], 0, 1);
        shade = vec3(gl_VertexIndex == 0, gl_VertexIndex == 1, gl_VertexIndex == 2);
    }";
const FRAGMENT: &str = r"
    layout(location = 0) in vec3 shade;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(shade, 1); }";

/// The window, with the objects that draw to it.
struct Renderer {
    window: Arc<Window>,
    ctx: Context,
    swapchain: Holder<SwapchainHandle>,
    pipeline: Holder<RenderPipelineHandle>,
}

impl Renderer {
    fn new(event_loop: &ActiveEventLoop) -> Result<Self, Error> {
        let window = Arc::new(event_loop.create_window(Window::default_attributes().with_title("lvk"))?);
        let ctx = Context::new(&ContextDesc { window: Some(window.clone()), ..Default::default() })?;
        let extent = window.inner_size().into();
        let swapchain = ctx.create_swapchain(&SwapchainDesc { extent, ..Default::default() })?;
        let module = |stage, text| {
            let source = ShaderSource::Glsl(text);
            ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })
        };
        let vertex = module(ShaderStage::Vertex, VERTEX)?;
        let fragment = module(ShaderStage::Fragment, FRAGMENT)?;
        let pipeline = ctx.create_render_pipeline(&RenderPipelineDesc {
            vertex: Some(*vertex),
            fragment: Some(*fragment),
            color: &[ctx.swapchain_info(*swapchain)?.format.into()],
            ..Default::default()
        })?;
        Ok(Self { window, ctx, swapchain, pipeline })
    }

    fn draw(&self) -> Result<(), Error> {
        self.ctx.next_frame()?;
        // No image while the window is minimised or changes its size.
        if let Some(image) = self.ctx.next_image(*self.swapchain)? {
            let mut cmd = self.ctx.acquire_command_buffer()?;
            let color = [ColorAttachment::clear(image.texture(), [0.0, 0.0, 0.0, 1.0])];
            let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() })?;
            pass.bind_render_pipeline(*self.pipeline)?;
            pass.draw(0..3, 0..1)?;
            drop(pass);
            self.ctx.present(cmd, image)?;
        }
        self.window.request_redraw();
        Ok(())
    }
}

/// The renderer from the moment when a window may be opened, or the error that ended the program.
#[derive(Default)]
struct App {
    renderer: Option<Renderer>,
    error: Option<Error>,
}

impl App {
    fn end_on_error<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T, Error>) -> Option<T> {
        result.map_err(|error| self.error = Some(error)).inspect_err(|()| event_loop.exit()).ok()
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.renderer.is_none() {
            self.renderer = self.end_on_error(event_loop, Renderer::new(event_loop));
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(renderer) = &self.renderer else { return };
        let result = match event {
            WindowEvent::RedrawRequested => renderer.draw(),
            // Only Wayland needs to be told.
            WindowEvent::Resized(size) => {
                renderer.ctx.resize_swapchain(*renderer.swapchain, size.into()).map_err(Error::from)
            }
            WindowEvent::CloseRequested => {
                event_loop.exit();
                Ok(())
            }
            _ => Ok(()),
        };
        self.end_on_error(event_loop, result);
    }
}

pub(crate) fn main() -> Result<(), Error> {
    let mut app = App::default();
    EventLoop::new()?.run_app(&mut app)?;
    app.error.map_or(Ok(()), Err)
}
