//! Textures that come and go, and what is shown in place of those that are not there.

use lvk::{Context, Format, Holder, TextureDesc, TextureHandle};

use super::loader::{LoadRequest, Loader};
use crate::scene::PAINTED;

/// Number of textures.
pub(super) const COUNT: usize = PAINTED.len();

/// The state of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Residency {
    /// Loaded; frames show the texture.
    Resident,
    /// Being loaded; frames show the placeholder.
    Loading,
    /// Not loaded; frames show the placeholder.
    Unloaded,
}

/// All textures, by their number.
pub(super) struct Streamed {
    loader: Loader,
    placeholder: Holder<TextureHandle>,
    slots: [Slot; COUNT],
    tickets: u64,
}

enum Slot {
    Resident(Holder<TextureHandle>),
    /// Being loaded, with the ticket of the request.
    Loading(u64),
    Unloaded,
}

impl Streamed {
    /// Creates the slots with no texture but the placeholder.
    pub(super) fn new(ctx: &Context) -> lvk::Result<Self> {
        let slots = [const { Slot::Unloaded }; COUNT];
        Ok(Self { loader: Loader::new(ctx)?, placeholder: placeholder(ctx)?, slots, tickets: 0 })
    }

    pub(super) fn residency(&self, number: usize) -> Residency {
        match self.slots.get(number) {
            Some(Slot::Resident(_)) => Residency::Resident,
            Some(Slot::Loading(_)) => Residency::Loading,
            Some(Slot::Unloaded) | None => Residency::Unloaded,
        }
    }

    /// Current bindless index of each texture.
    pub(super) fn indices(&self) -> [u32; COUNT] {
        std::array::from_fn(|number| match &self.slots[number] {
            Slot::Resident(texture) => texture.index(),
            Slot::Loading(_) | Slot::Unloaded => self.placeholder.index(),
        })
    }

    /// Unloads a texture at once. Frames in flight still sample it: the library destroys the texture after them, and
    /// reuses its index only then.
    pub(super) fn unload(&mut self, number: usize) {
        if let Some(slot) = self.slots.get_mut(number) {
            *slot = Slot::Unloaded;
        }
    }

    /// Requests an unloaded texture; a later frame shows it.
    pub(super) fn load(&mut self, number: usize) {
        if let Some(slot @ Slot::Unloaded) = self.slots.get_mut(number) {
            self.tickets += 1;
            *slot = Slot::Loading(self.tickets);
            self.loader.request(LoadRequest { number, ticket: self.tickets });
        }
    }

    /// Takes in what has been made since the last time.
    pub(super) fn take_in(&mut self) -> lvk::Result<()> {
        while let Some((request, texture)) = self.loader.poll() {
            self.install(request, texture)?;
        }
        Ok(())
    }

    /// Waits for everything that is coming.
    pub(super) fn wait(&mut self) -> lvk::Result<()> {
        while self.slots.iter().any(|slot| matches!(slot, Slot::Loading(_))) {
            let Some((request, texture)) = self.loader.wait() else { break };
            self.install(request, texture)?;
        }
        Ok(())
    }

    /// A texture that was given up meanwhile has another ticket, or none, and is dropped.
    fn install(
        &mut self,
        request: LoadRequest,
        texture: lvk::Result<Holder<TextureHandle>>,
    ) -> lvk::Result<()> {
        let slot = &mut self.slots[request.number];
        if matches!(slot, Slot::Loading(ticket) if *ticket == request.ticket) {
            *slot = Slot::Unloaded;
            *slot = Slot::Resident(texture?);
        }
        Ok(())
    }
}

/// Squares in two greys.
fn placeholder(ctx: &Context) -> lvk::Result<Holder<TextureHandle>> {
    const SIDE: u32 = 64;
    let is_dark = |texel: u32| (texel % SIDE / 8 + texel / SIDE / 8).is_multiple_of(2);
    let texels = (0..SIDE * SIDE)
        .flat_map(|texel| if is_dark(texel) { [70, 70, 78, 255] } else { [150, 150, 158, 255] });
    ctx.create_texture(&TextureDesc {
        format: Format::Rgba8Srgb,
        extent: [SIDE; 2],
        mips: 0,
        data: Some(&texels.collect::<Vec<_>>()),
        generate_mips: true,
        debug_name: "placeholder",
        ..TextureDesc::default()
    })
}
