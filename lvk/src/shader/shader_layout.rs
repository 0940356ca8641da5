//! Layouts of Rust structs that shaders read: the offsets of their members, as data.

use std::marker::PhantomData;

/// A Rust type that knows the offsets of its members, so that they can be compared with the block of a shader
/// ([`BlockLayout`](crate::BlockLayout), [`ShaderRecord::new`](crate::ShaderRecord::new)).
///
/// [`shader_struct!`](crate::shader_struct) implements the trait. Arrays of such structs implement it too.
pub trait ShaderLayout: Sized {
    /// The layout of the struct; of an array, that of its elements.
    const LAYOUT: StructLayout;
    /// Number of structs, one after the other: 1, or the number of elements of an array.
    const COUNT: usize = 1;
}

impl<T: ShaderLayout, const N: usize> ShaderLayout for [T; N] {
    const LAYOUT: StructLayout = T::LAYOUT;
    const COUNT: usize = N * T::COUNT;
}

/// Size and members of a Rust struct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StructLayout {
    /// Name of the struct.
    pub name: &'static str,
    /// Size of the struct in bytes, and the distance between the elements of an array.
    pub size_bytes: usize,
    /// The members.
    pub members: &'static [StructMember],
}

/// A member of a Rust struct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StructMember {
    /// Name in Rust. A name that begins with `_` is padding.
    pub name: &'static str,
    /// Name in the block. Case and underscores make no difference: `sun_color` is `sunColor`.
    pub block_name: &'static str,
    /// Offset in the struct in bytes.
    pub offset: usize,
    /// Size in bytes.
    pub size_bytes: usize,
    /// Layout of the member, if it is a [`ShaderLayout`] itself. Other members are compared by offset and size.
    pub nested: Option<NestedLayout>,
}

/// Layout of a member that is a struct or an array of structs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NestedLayout {
    /// The struct.
    pub layout: &'static StructLayout,
    /// Number of structs, one after the other.
    pub count: usize,
}

/// Looks up the nested layout of a member's type, for [`shader_struct!`](crate::shader_struct).
///
/// The constant of the inherent `impl` exists only for types that implement [`ShaderLayout`]. For all others the compiler
/// finds the constant of the trait [`PlainMember`]. The macro names concrete types, for which that choice is certain.
#[doc(hidden)]
pub struct MemberProbe<T>(PhantomData<T>);

impl<T: ShaderLayout> MemberProbe<T> {
    pub const NESTED: Option<NestedLayout> =
        Some(NestedLayout { layout: &<T as ShaderLayout>::LAYOUT, count: <T as ShaderLayout>::COUNT });
}

/// Members without a layout of their own; see [`MemberProbe`].
#[doc(hidden)]
pub trait PlainMember {
    const NESTED: Option<NestedLayout> = None;
}

impl<T> PlainMember for MemberProbe<T> {}

/// Defines structs that shaders read, and implements [`ShaderLayout`] for them.
///
/// The macro changes nothing in the structs. Each needs `#[repr(C)]` and the `bytemuck` traits of the calls that take it.
/// A member whose name differs from that in the block names the latter by `as`. Members that the block lacks have names
/// with a leading underscore.
///
/// ```
/// use lvk::ShaderLayout;
///
/// lvk::shader_struct! {
///     /// `layout(push_constant, scalar) uniform Push { Frame frame; vec3 sunColor; uint smp; };`
///     #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
///     #[repr(C)]
///     pub struct Push {
///         frame: u64,
///         sun_color: [f32; 3],
///         sampler as smp: u32,
///     }
/// }
/// assert_eq!(Push::LAYOUT.members[1].offset, 8);
/// assert_eq!(Push::LAYOUT.members[2].block_name, "smp");
/// ```
#[macro_export]
macro_rules! shader_struct {
    () => {};
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $name:ident {
            $(
                $(#[$member_attribute:meta])*
                $member_visibility:vis $member:ident $(as $block_member:ident)? : $member_type:ty
            ),* $(,)?
        }
        $($rest:tt)*
    ) => {
        $(#[$attribute])*
        $visibility struct $name {
            $($(#[$member_attribute])* $member_visibility $member: $member_type,)*
        }

        impl $crate::ShaderLayout for $name {
            const LAYOUT: $crate::StructLayout = $crate::StructLayout {
                name: ::core::stringify!($name),
                size_bytes: ::core::mem::size_of::<$name>(),
                members: &[$($crate::StructMember {
                    name: ::core::stringify!($member),
                    block_name: $crate::shader_struct!(@block_name $member $($block_member)?),
                    offset: ::core::mem::offset_of!($name, $member),
                    size_bytes: ::core::mem::size_of::<$member_type>(),
                    nested: {
                        #[allow(unused_imports)]
                        use $crate::PlainMember as _;
                        <$crate::MemberProbe<$member_type>>::NESTED
                    },
                }),*],
            };
        }

        $crate::shader_struct!($($rest)*);
    };
    (@block_name $member:ident) => { ::core::stringify!($member) };
    (@block_name $member:ident $block_member:ident) => { ::core::stringify!($block_member) };
}
