//! Ray traced shadows of `lvk` in a picture that wgpu draws, on one Vulkan device and one queue.
//!
//! wgpu opens the instance and owns the device, which is created with what [`lvk::Context::requirements`] asks for. `lvk`
//! traces rays from a plane to the light and writes the shadows into a texture of wgpu; wgpu samples the texture. A
//! timeline semaphore orders the two. The manual's page on interoperation explains each step.

mod device;
mod picture;
mod shadows;

use lvk::Context;

use picture::Picture;
use shadows::Shadows;

/// An error of either library.
pub type Error = Box<dyn std::error::Error + Send + Sync>;

/// Corners of the triangle that casts the shadow. The plane `z = 0` receives it.
pub const TRIANGLE: [[f32; 3]; 3] = [[-0.5, -0.4, 0.4], [0.5, -0.3, 0.4], [0.0, 0.5, 0.4]];

/// A picture of the plane from -1 to 1 in x and y, seen from above, in the shadow of [`TRIANGLE`].
pub struct Guest {
    // Fields drop in this order: objects of `lvk`, its context, and then wgpu with the device.
    shadows: Shadows,
    ctx: Context,
    picture: Picture,
    side: u32,
    /// The last value of the semaphore that is signalled or will be.
    value: u64,
}

impl Guest {
    /// Opens a driver, wgpu and `lvk`. `side` is that of the square picture, in pixels, a multiple of 64. `validation`
    /// turns on the validation layer, whose messages wgpu sends to the `log` crate.
    ///
    /// # Errors
    /// Errors of the driver, of wgpu and of `lvk`.
    pub fn new(side: u32, validation: bool) -> Result<Self, Error> {
        let (ctx, device, queue) = device::open(validation)?;
        let picture = Picture::new(device, queue, side);
        let shadows = Shadows::new(&ctx, picture.shadow_texture(), side)?;
        let value = 1;
        picture.prepare(&ctx, shadows.semaphore, value)?;
        Ok(Self { shadows, ctx, picture, side, value })
    }

    /// Renders a frame, and returns its RGBA pixels. `light` points from the plane to the light.
    ///
    /// # Errors
    /// Errors of wgpu and of `lvk`.
    pub fn frame(&mut self, light: [f32; 3]) -> Result<Vec<u8>, Error> {
        let [before, traced, drawn] = [self.value, self.value + 1, self.value + 2];
        self.shadows.trace(&self.ctx, self.side, light, before, traced)?;
        self.value = drawn;
        self.picture.draw(&self.ctx, self.shadows.semaphore, traced, drawn)
    }
}
