//! Typed handles of the objects a context owns.

use std::fmt;

mod sealed {
    pub trait Sealed {}
}

/// A handle: a typed, generational, 64-bit key. It is `Copy`. Use of a handle is always safe: if its object was
/// destroyed, the result is [`Error::StaleHandle`](crate::Error::StaleHandle), and if its object belongs to another
/// context, [`Error::ForeignHandle`](crate::Error::ForeignHandle).
pub trait Handle: sealed::Sealed + Copy + Eq + fmt::Debug + Send + Sync + 'static {
    /// Kind of the object, as error messages name it.
    const KIND: &'static str;

    #[doc(hidden)]
    fn from_bits(bits: u64) -> Self;

    #[doc(hidden)]
    fn bits(self) -> u64;
}

macro_rules! handles {
    ($($(#[$doc:meta])* $name:ident, $kind:literal;)*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
            pub struct $name(u64);

            impl sealed::Sealed for $name {}

            impl Handle for $name {
                const KIND: &'static str = $kind;

                fn from_bits(bits: u64) -> Self {
                    Self(bits)
                }

                fn bits(self) -> u64 {
                    self.0
                }
            }
        )*
    };
}

handles! {
    /// Names a buffer.
    BufferHandle, "buffer";
    /// Names a texture.
    TextureHandle, "texture";
    /// Names a sampler.
    SamplerHandle, "sampler";
    /// Names a shader module.
    ShaderModuleHandle, "shader module";
    /// Names a graphics pipeline.
    RenderPipelineHandle, "render pipeline";
    /// Names a compute pipeline.
    ComputePipelineHandle, "compute pipeline";
    /// Names a ray tracing pipeline with its shader binding table.
    RayTracingPipelineHandle, "ray tracing pipeline";
    /// Names a library of compiled ray tracing shaders.
    RayTracingLibraryHandle, "ray tracing library";
    /// Names a pool of queries.
    QueryPoolHandle, "query pool";
    /// Names the opacity of the triangles of a geometry.
    OpacityMicromapHandle, "opacity micromap";
    /// Names a bottom- or top-level acceleration structure.
    AccelStructHandle, "acceleration structure";
}

#[cfg(feature = "window")]
handles! {
    /// Names a swapchain.
    SwapchainHandle, "swapchain";
}
