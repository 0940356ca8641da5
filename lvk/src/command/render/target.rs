//! A target of a render pass: a mip of some layers of a texture.

use std::sync::Arc;

use ash::vk;

use super::area::PassLayers;
use crate::barrier::Subresources;
use crate::error::Result;
use crate::resource::Texture;

/// A mip of some layers of a texture.
pub(super) struct PassTarget {
    pub(super) texture: Arc<Texture>,
    pub(super) mip: u32,
    pub(super) layer: u32,
    pub(super) layers: PassLayers,
}

impl PassTarget {
    pub(super) fn view(&self) -> Result<vk::ImageView> {
        match self.layers.is_layered() {
            false => self.texture.target_view(self.mip, self.layer),
            true => self.texture.layered_target_view(self.mip, self.layer, self.layers.layer_count()),
        }
    }

    /// Returns the view of one aspect of the target.
    pub(super) fn input_view(&self, aspect: vk::ImageAspectFlags) -> Result<vk::ImageView> {
        self.texture.input_view(self.subresources(), self.layers.is_layered(), aspect)
    }

    /// Returns the mip and the layers, or slices, of the target.
    pub(super) fn subresource_texels(&self) -> Subresources {
        let part = self.texture.subresource(self.mip, self.layer);
        Subresources { layer_count: self.layers.layer_count(), ..part }
    }

    /// Returns the width and height of the target in pixels.
    pub(super) fn extent(&self) -> [u32; 2] {
        self.texture.mip_extent(self.mip)
    }

    /// Returns the subresources of the target as barriers use them.
    pub(super) fn subresources(&self) -> Subresources {
        self.texture.attachment_subresources(self.mip, self.layer, self.layers.layer_count())
    }
}
