//! One difference between the members of a Rust struct and those of a shader's block.

use std::fmt;

/// One difference between a Rust struct and a block, in an
/// [`Error::LayoutMismatch`](crate::Error::LayoutMismatch). Members of nested structs are paths, such as `camera.eye`.
/// Offsets are those in the innermost struct, in bytes.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LayoutDifference {
    /// Two members are each in the place of the other.
    Swapped {
        /// The members in the order of the Rust struct.
        members: [String; 2],
        /// Their names in the block, in the order of the block.
        block_members: [String; 2],
    },
    /// A member begins at another byte.
    Offset {
        /// Member of the Rust struct.
        member: String,
        /// Member of the block.
        block_member: String,
        /// Offset in the Rust struct.
        offset: u64,
        /// Offset in the block.
        block_offset: u64,
    },
    /// A member has another size.
    Size {
        /// Member of the Rust struct.
        member: String,
        /// Member of the block.
        block_member: String,
        /// Bytes in the Rust struct.
        bytes: u64,
        /// Bytes in the block.
        block_bytes: u64,
        /// Bytes from one element, column or row to the next, for arrays and matrices of the block.
        block_stride: Option<u64>,
    },
    /// An array of structs has another number of elements.
    Count {
        /// Member of the Rust struct.
        member: String,
        /// Member of the block.
        block_member: String,
        /// Elements in the Rust struct.
        count: u64,
        /// Elements in the block.
        block_count: u64,
    },
    /// The elements of an array of structs are another distance apart.
    Stride {
        /// Member of the Rust struct.
        member: String,
        /// Member of the block.
        block_member: String,
        /// Bytes from element to element in the Rust struct.
        stride: u64,
        /// Bytes from element to element in the block.
        block_stride: u64,
    },
    /// The block lacks a member of the Rust struct.
    OnlyInStruct {
        /// Member of the Rust struct.
        member: String,
        /// Offset of the member.
        offset: u64,
        /// Size of the member in bytes.
        bytes: u64,
    },
    /// The Rust struct lacks a member of the block.
    OnlyInBlock {
        /// Member of the block.
        block_member: String,
        /// Offset of the member.
        offset: u64,
        /// Size of the member in bytes.
        bytes: u64,
    },
}

impl fmt::Display for LayoutDifference {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Swapped { members: [first, second], block_members: [before, behind] } => write!(
                out,
                "'{first}' and '{second}' are swapped: in the block, '{before}' comes before '{behind}'"
            ),
            Self::Offset { member, block_member, offset, block_offset } => write!(
                out,
                "'{member}' is at byte {offset} of the struct, but '{block_member}' at byte {block_offset} of the block"
            ),
            Self::Size { member, block_member, bytes, block_bytes, block_stride } => {
                write!(
                    out,
                    "'{member}' has {bytes} bytes in the struct, but '{block_member}' has {block_bytes} in the block"
                )?;
                match block_stride {
                    Some(stride) => write!(out, ", as its elements are {stride} bytes apart"),
                    None => Ok(()),
                }
            }
            Self::Count { member, block_member, count, block_count } => write!(
                out,
                "'{member}' has {count} elements in the struct, but '{block_member}' has {block_count} in the block"
            ),
            Self::Stride { member, block_member, stride, block_stride } => write!(
                out,
                "the elements of '{member}' are {stride} bytes apart in the struct, but those of '{block_member}' \
                 {block_stride} bytes in the block"
            ),
            Self::OnlyInStruct { member, offset, bytes } => {
                write!(out, "the block lacks '{member}' ({bytes} bytes at byte {offset} of the struct)")
            }
            Self::OnlyInBlock { block_member, offset, bytes } => {
                write!(out, "the struct lacks '{block_member}' ({bytes} bytes at byte {offset} of the block)")
            }
        }
    }
}

/// Returns the differences as one text; of many, the first ones and the number of the others.
pub(super) fn differences_text(differences: &[LayoutDifference]) -> String {
    const MAX_LISTED: usize = 6;
    let listed: Vec<String> = differences.iter().take(MAX_LISTED).map(ToString::to_string).collect();
    match differences.len().saturating_sub(MAX_LISTED) {
        0 => listed.join("; "),
        rest => format!("{}; and {rest} more", listed.join("; ")),
    }
}
