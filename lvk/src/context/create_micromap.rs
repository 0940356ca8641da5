//! Creation of opacity micromaps, which are built before the next submission.

use std::sync::Arc;

use super::Context;
use super::create::NO_SLOT;
use super::holder::Holder;
use crate::accel::micromap::{Micromap, query_sizes};
use crate::accel::micromap_desc::{MicromapPlan, OpacityMicromapDesc};
use crate::device_state::DeferredObject;
use crate::error::Result;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::handle::OpacityMicromapHandle;

impl Context {
    /// Creates the opacity of the triangles of a geometry, and builds it before the next submission
    /// (`vkCreateMicromapEXT`, `vkCmdBuildMicromapsEXT`). [`BlasDesc::opacity`](crate::BlasDesc::opacity) gives it to
    /// a geometry; a BLAS keeps it alive. It cannot be changed.
    ///
    /// No device with the extension was at hand: the calls are tested with functions that record their arguments.
    ///
    /// # Errors
    /// [`Unsupported`](crate::Error::Unsupported) without
    /// [`OptionalFeature::OpacityMicromaps`](crate::OptionalFeature::OpacityMicromaps);
    /// [`LimitExceeded`](crate::Error::LimitExceeded) for levels beyond
    /// [`Limits::micromap`](crate::Limits::micromap); [`InvalidUsage`](crate::Error::InvalidUsage) for maps with
    /// another number of states than their level has, unknown states in maps of two states, and indices without a map.
    pub fn create_opacity_micromap(
        &self,
        desc: &OpacityMicromapDesc<'_>,
    ) -> Result<Holder<OpacityMicromapHandle>> {
        let shared = self.device_state();
        let what = format!("opacity micromap '{}'", desc.debug_name);
        shared.gpu.require(OptionalFeature::OpacityMicromaps, &what)?;
        let plan = MicromapPlan::new(desc, &shared.gpu.caps.limits.micromap)?;
        let micromap = Micromap::new(&shared.gpu, desc.debug_name, plan)?;
        let scratch = Arc::new(micromap.new_scratch()?);
        let handle = shared.store.micromaps.insert(micromap);
        let holder = Holder::new(self, handle, NO_SLOT);
        let micromap = shared.store.micromaps.get(handle)?;
        let recorded = self.record_in_prologue(|cmd| cmd.build_micromap(&micromap, &scratch));
        shared.free_later(DeferredObject::Buffer(scratch));
        recorded?;
        Ok(holder)
    }

    /// Returns the bytes of a micromap and of the scratch memory of its build (`vkGetMicromapBuildSizesEXT`), in this
    /// order.
    ///
    /// # Errors
    /// As [`create_opacity_micromap`](Self::create_opacity_micromap).
    pub fn opacity_micromap_sizes(&self, desc: &OpacityMicromapDesc<'_>) -> Result<[u64; 2]> {
        let gpu = &self.device_state().gpu;
        gpu.require(OptionalFeature::OpacityMicromaps, &format!("opacity micromap '{}'", desc.debug_name))?;
        let plan = MicromapPlan::new(desc, &gpu.caps.limits.micromap)?;
        query_sizes(gpu, &plan)
    }
}
