//! Creation and destruction of buffers and images.

use vk_graph::driver::ash::vk;
use vk_graph::driver::image::ImageViewInfo;

use lvk_bench::peers::{Failure, RowRun, Sample};

use super::device::Gpu;

pub(super) struct Buffers {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Buffers {
    fn sample(&mut self) -> Result<Sample, Failure> {
        use vk::BufferUsageFlags as Usage;
        let usage = Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::STORAGE_BUFFER;
        let submit = || {
            let create = |_| self.gpu.buffer(256, usage);
            drop((0..self.count).map(create).collect::<Result<Vec<_>, _>>()?);
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}

pub(super) struct Textures {
    pub(super) gpu: Gpu,
    pub(super) count: u32,
}

impl RowRun for Textures {
    fn sample(&mut self) -> Result<Sample, Failure> {
        use vk::ImageUsageFlags as Usage;
        let usage = Usage::TRANSFER_SRC | Usage::TRANSFER_DST | Usage::SAMPLED;
        let submit = || {
            let create = |_| -> Result<_, Failure> {
                let image = self.gpu.image(4, usage)?;
                image.view(ImageViewInfo::from_image_info(image.info)?)?;
                Ok(image)
            };
            drop((0..self.count).map(create).collect::<Result<Vec<_>, _>>()?);
            Ok(())
        };
        Sample::take(submit, |()| Ok(()))
    }
}
