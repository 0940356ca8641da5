//! The geometry pass that wins: which triangle each pixel shows, and nothing else. The ray pass finds the rest by
//! meeting the pixel's ray with that triangle.

use lvk::{BufferHandle, CommandBuffer, Context, Error, Holder, TextureHandle};

use super::compute_raster::ComputeRaster;
use super::config::{HybridConfig, Raster};
use super::frame::{Push, VisibilityAddresses};
use super::hardware_raster::HardwareRaster;
use super::raster_choice::RasterChoice;

/// `kNoImage` in `shaders/hybrid/visibility.glsl`.
const NO_IMAGE: u32 = u32::MAX;

/// The pass with the rasterisers that are to be had, of which one is chosen.
pub(super) struct VisibilityPass {
    compute: Option<ComputeRaster>,
    hardware: Option<HardwareRaster>,
    chosen: Raster,
    why: String,
    places: VisibilityAddresses,
}

impl VisibilityPass {
    /// The pass over `triangle_count` triangles by the rasteriser `wish`; without a wish by compute where the device can,
    /// else by hardware.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the device cannot.
    pub(super) fn new(
        ctx: &Context,
        triangle_count: u32,
        config: &HybridConfig,
        wish: Option<Raster>,
    ) -> lvk::Result<Self> {
        let extent = [config.width, config.height];
        let has_numbers = ctx.capabilities().primitive_id;
        let compute = match wish {
            Some(Raster::Hardware) => None,
            Some(Raster::Compute) => Some(ComputeRaster::new(ctx, triangle_count, extent, &config.tuning)?),
            None => match ComputeRaster::new(ctx, triangle_count, extent, &config.tuning) {
                Ok(raster) => Some(raster),
                Err(Error::Unsupported { .. }) if has_numbers => None,
                Err(error) => return Err(error),
            },
        };
        let hardware = match wish {
            Some(Raster::Compute) => None,
            None if !has_numbers => None,
            _ => Some(HardwareRaster::new(ctx, triangle_count, extent)?),
        };
        let chosen = if compute.is_some() { Raster::Compute } else { Raster::Hardware };
        let why = match (wish, &compute, &hardware) {
            (Some(_), ..) => "as asked for",
            (None, None, _) => "the device has no 64-bit atomics",
            (None, _, None) => "the device cannot number triangles in fragment shaders",
            (None, Some(_), Some(_)) => "exact",
        };
        let mut places =
            VisibilityAddresses { triangle_count, image: NO_IMAGE, ..bytemuck::Zeroable::zeroed() };
        if let Some(compute) = &compute {
            compute.name_in(&mut places)?;
        }
        if let Some(hardware) = &hardware {
            hardware.name_in(&mut places)?;
        }
        Ok(Self { compute, hardware, chosen, why: why.to_owned(), places })
    }

    /// Addresses and indices for the shaders, of the chosen rasteriser.
    pub(super) fn addresses(&self) -> VisibilityAddresses {
        let image = self.target().map_or(NO_IMAGE, Holder::index);
        VisibilityAddresses { image, ..self.places }
    }

    /// The textures that the ray pass reads.
    pub(super) fn textures(&self) -> Vec<TextureHandle> {
        self.target().map(Holder::handle).into_iter().collect()
    }

    /// The buffers that the ray pass reads.
    pub(super) fn buffers(&self) -> Vec<BufferHandle> {
        let compute = self.compute.as_ref().filter(|_| self.chosen == Raster::Compute);
        compute.map(ComputeRaster::words).into_iter().collect()
    }

    /// The rasteriser in use, and the reason.
    pub(super) fn choice(&self) -> RasterChoice {
        RasterChoice { raster: self.chosen, why: self.why.clone() }
    }

    /// True if there is a choice.
    pub(super) fn has_both(&self) -> bool {
        self.compute.is_some() && self.hardware.is_some()
    }

    /// Takes another rasteriser, which must be there.
    pub(super) fn choose(&mut self, choice: RasterChoice) {
        (self.chosen, self.why) = (choice.raster, choice.why);
    }

    /// Records the pass.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, push: &Push) -> lvk::Result<()> {
        match (self.chosen, &self.compute, &self.hardware) {
            (Raster::Compute, Some(raster), _) => raster.record(cmd, push),
            (Raster::Hardware, _, Some(raster)) => raster.record(cmd, push),
            _ => Err(Error::InvalidUsage {
                object: "visibility pass".to_owned(),
                message: "the chosen rasteriser was not made".to_owned(),
            }),
        }
    }

    fn target(&self) -> Option<&Holder<TextureHandle>> {
        let hardware = self.hardware.as_ref().filter(|_| self.chosen == Raster::Hardware);
        hardware.map(HardwareRaster::image)
    }
}
