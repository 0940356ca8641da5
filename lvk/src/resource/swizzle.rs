//! Mapping of the channels of a texel to the channels that shaders read.

use ash::vk;

/// Source of a channel that a shader samples (`VkComponentSwizzle`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Always 0.
    Zero,
    /// Always 1.
    One,
    /// The first channel of the format.
    Red,
    /// The second channel of the format.
    Green,
    /// The third channel of the format.
    Blue,
    /// The fourth channel of the format.
    Alpha,
}

/// Sources of the four channels that a shader samples (`VkComponentMapping`). All but the
/// [identity](Self::IDENTITY) need [`OptionalFeature::ViewSwizzle`](crate::OptionalFeature::ViewSwizzle).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Swizzle {
    /// Source of the red channel. Default: [`Channel::Red`].
    pub red: Channel,
    /// Source of the green channel. Default: [`Channel::Green`].
    pub green: Channel,
    /// Source of the blue channel. Default: [`Channel::Blue`].
    pub blue: Channel,
    /// Source of the alpha channel. Default: [`Channel::Alpha`].
    pub alpha: Channel,
}

impl Swizzle {
    /// Every channel is mapped to itself.
    pub const IDENTITY: Self =
        Self { red: Channel::Red, green: Channel::Green, blue: Channel::Blue, alpha: Channel::Alpha };

    /// Returns the swizzle of a view with this swizzle of a view with the swizzle `first`.
    pub(crate) fn compose(self, first: Self) -> Self {
        let through = |channel| match channel {
            Channel::Zero | Channel::One => channel,
            Channel::Red => first.red,
            Channel::Green => first.green,
            Channel::Blue => first.blue,
            Channel::Alpha => first.alpha,
        };
        Self {
            red: through(self.red),
            green: through(self.green),
            blue: through(self.blue),
            alpha: through(self.alpha),
        }
    }

    pub(crate) fn raw(self) -> vk::ComponentMapping {
        vk::ComponentMapping {
            r: raw_channel(self.red),
            g: raw_channel(self.green),
            b: raw_channel(self.blue),
            a: raw_channel(self.alpha),
        }
    }
}

impl Default for Swizzle {
    fn default() -> Self {
        Self::IDENTITY
    }
}

fn raw_channel(channel: Channel) -> vk::ComponentSwizzle {
    match channel {
        Channel::Zero => vk::ComponentSwizzle::ZERO,
        Channel::One => vk::ComponentSwizzle::ONE,
        Channel::Red => vk::ComponentSwizzle::R,
        Channel::Green => vk::ComponentSwizzle::G,
        Channel::Blue => vk::ComponentSwizzle::B,
        Channel::Alpha => vk::ComponentSwizzle::A,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REVERSED: Swizzle =
        Swizzle { red: Channel::Alpha, green: Channel::Blue, blue: Channel::Green, alpha: Channel::Red };

    #[test]
    fn swizzles_are_taken_one_after_the_other() {
        let ones = Swizzle { red: Channel::One, green: Channel::Red, ..Swizzle::IDENTITY };
        assert_eq!(REVERSED.compose(REVERSED), Swizzle::IDENTITY);
        assert_eq!(ones.compose(Swizzle::IDENTITY), ones);
        let both =
            Swizzle { red: Channel::One, green: Channel::Alpha, blue: Channel::Green, alpha: Channel::Red };
        assert_eq!(ones.compose(REVERSED), both);
    }
}
