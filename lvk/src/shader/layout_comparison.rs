//! Comparison of a Rust struct with a block of a shader, member by member.

use super::shader_layout::{NestedLayout, StructLayout};
use super::spirv::blocks::{BlockMember, Blocks, MemberShape};
use crate::error::layout_difference::LayoutDifference;

/// Largest alignment of a struct: what a Rust type without known members may have behind the last member of its block.
const MAX_ALIGNMENT: u64 = 16;
/// Layouts that slangc appends to the name of a block.
const SLANG_SUFFIXES: [&str; 4] = ["_natural", "_scalar", "_std430", "_std140"];

/// The result of a comparison.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct LayoutComparison {
    /// Differences that no other block can mend.
    pub(crate) differences: Vec<LayoutDifference>,
    /// Members that the block lacks. Blocks of other stages may have them.
    pub(crate) missing: Vec<LayoutDifference>,
}

/// Compares a Rust struct with the block of type `ty`. A block whose only member is an array of structs without a length
/// is compared by the elements, unless the Rust struct has a member of the array's name.
///
/// # Errors
/// The reason why the members of the block cannot be told.
pub(crate) fn compare_layout(
    layout: &StructLayout,
    blocks: &Blocks,
    ty: u32,
) -> Result<LayoutComparison, String> {
    let mut comparison = LayoutComparison::default();
    if let [BlockMember { name, shape: MemberShape::Structs { ty, count: None, stride }, .. }] =
        blocks.members(ty)?
        && !layout.members.iter().any(|member| is_same_name(member.block_name, name))
    {
        let own = layout.size_bytes as u64;
        if own != *stride {
            comparison.differences.push(LayoutDifference::Stride {
                member: layout.name.to_owned(),
                block_member: name.clone(),
                stride: own,
                block_stride: *stride,
            });
        }
        compare_members(layout, blocks, *ty, &Paths::default(), &mut comparison)?;
    } else {
        compare_members(layout, blocks, ty, &Paths::default(), &mut comparison)?;
    }
    Ok(comparison)
}

/// True if a block with the name `own`, in SPIR-V, is the one that the application calls `wanted`.
pub(crate) fn is_block_name(own: &str, wanted: &str) -> bool {
    own == wanted || SLANG_SUFFIXES.iter().any(|suffix| own.strip_suffix(suffix) == Some(wanted))
}

/// Names of the structs around a struct, each with a dot behind it.
#[derive(Debug, Clone, Default)]
struct Paths {
    own: String,
    block: String,
}

/// A member of a Rust struct, or of a struct that is nested in it and flattened in the block.
#[derive(Debug, Clone)]
struct OwnMember {
    path: String,
    block_name: &'static str,
    is_padding: bool,
    offset: u64,
    bytes: u64,
    nested: Option<NestedLayout>,
}

/// Members of the same name.
struct Pair<'a> {
    own: &'a OwnMember,
    block: &'a BlockMember,
}

fn compare_members(
    layout: &StructLayout,
    blocks: &Blocks,
    ty: u32,
    paths: &Paths,
    comparison: &mut LayoutComparison,
) -> Result<(), String> {
    let members = blocks.members(ty)?;
    if members.iter().any(|member| member.name.is_empty()) {
        return Err("its SPIR-V has no names of members; compile it without stripping names".to_owned());
    }
    let own = own_members(layout, members);
    let mut pairs = Vec::new();
    for member in &own {
        let equal = members.iter().find(|block| member.block_name == block.name);
        let same =
            equal.or_else(|| members.iter().find(|block| is_same_name(member.block_name, &block.name)));
        match same {
            Some(block) => pairs.push(Pair { own: member, block }),
            None if member.is_padding => {}
            None => comparison.missing.push(LayoutDifference::OnlyInStruct {
                member: format!("{}{}", paths.own, member.path),
                offset: member.offset,
                bytes: member.bytes,
            }),
        }
    }
    compare_offsets(&pairs, paths, comparison);
    for pair in &pairs {
        compare_contents(pair, blocks, paths, comparison)?;
    }
    for block in members {
        let is_known = pairs.iter().any(|pair| std::ptr::eq(pair.block, block));
        if !is_known && !is_optional(block) {
            comparison.differences.push(LayoutDifference::OnlyInBlock {
                block_member: format!("{}{}", paths.block, block.name),
                offset: block.offset,
                bytes: block.bytes,
            });
        }
    }
    Ok(())
}

/// True if a Rust struct need not have a member: padding, or an array without a length.
fn is_optional(block: &BlockMember) -> bool {
    let is_unsized = matches!(block.shape, MemberShape::Unsized | MemberShape::Structs { count: None, .. });
    is_unsized || block.name.starts_with('_')
}

/// Returns the members of a struct. A nested struct that the block does not have by name, but some of whose members it
/// has, is replaced by its members.
fn own_members(layout: &StructLayout, block: &[BlockMember]) -> Vec<OwnMember> {
    let has = |name: &str| block.iter().any(|member| is_same_name(name, &member.name));
    let mut all = Vec::new();
    for member in layout.members {
        let flattened = member.nested.filter(|nested| nested.count == 1 && !has(member.block_name));
        let inner = flattened.map(|nested| own_members(nested.layout, block)).unwrap_or_default();
        if inner.iter().any(|inner| has(inner.block_name)) {
            all.extend(inner.into_iter().map(|inner| OwnMember {
                path: format!("{}.{}", member.name, inner.path),
                offset: inner.offset + member.offset as u64,
                ..inner
            }));
            continue;
        }
        all.push(OwnMember {
            path: member.name.to_owned(),
            block_name: member.block_name,
            is_padding: member.name.starts_with('_'),
            offset: member.offset as u64,
            bytes: member.size_bytes as u64,
            nested: member.nested,
        });
    }
    all
}

/// Adds the pairs that are swapped, and the others whose offsets differ.
fn compare_offsets(pairs: &[Pair<'_>], paths: &Paths, comparison: &mut LayoutComparison) {
    let mut by_block: Vec<usize> = (0..pairs.len()).collect();
    by_block.sort_by_key(|index| pairs[*index].block.offset);
    let mut by_own: Vec<usize> = (0..pairs.len()).collect();
    by_own.sort_by_key(|index| pairs[*index].own.offset);
    let moved = |index: usize| pairs[index].own.offset != pairs[index].block.offset;
    // The two orders, place by place: a swap puts two members into each other's place.
    let mut swapped = vec![false; pairs.len()];
    for place in 0..pairs.len() {
        let (first, second) = (by_own[place], by_block[place]);
        let back = by_own.iter().position(|index| *index == second);
        let is_swap = first != second && back.is_some_and(|back| back > place && by_block[back] == first);
        if is_swap && moved(first) && moved(second) {
            (swapped[first], swapped[second]) = (true, true);
            let own = [first, second].map(|index| format!("{}{}", paths.own, pairs[index].own.path));
            let block = [second, first].map(|index| format!("{}{}", paths.block, pairs[index].block.name));
            comparison.differences.push(LayoutDifference::Swapped { members: own, block_members: block });
        }
    }
    for index in by_own.into_iter().filter(|index| moved(*index) && !swapped[*index]) {
        let Pair { own, block } = &pairs[index];
        comparison.differences.push(LayoutDifference::Offset {
            member: format!("{}{}", paths.own, own.path),
            block_member: format!("{}{}", paths.block, block.name),
            offset: own.offset,
            block_offset: block.offset,
        });
    }
}

/// Compares the sizes of two members, or the members of two structs.
fn compare_contents(
    pair: &Pair<'_>,
    blocks: &Blocks,
    paths: &Paths,
    comparison: &mut LayoutComparison,
) -> Result<(), String> {
    let Pair { own, block } = pair;
    let member = format!("{}{}", paths.own, own.path);
    let block_member = format!("{}{}", paths.block, block.name);
    let (bytes, block_bytes) = (own.bytes, block.bytes);
    let (fits, block_stride) = match (block.shape, own.nested) {
        (MemberShape::Structs { ty, count, stride }, Some(NestedLayout { layout, count: own_count })) => {
            let (own_count, own_stride) = (own_count as u64, layout.size_bytes as u64);
            if let Some(block_count) = count.filter(|count| *count != own_count) {
                let (member, block_member) = (member.clone(), block_member.clone());
                let difference =
                    LayoutDifference::Count { member, block_member, count: own_count, block_count };
                comparison.differences.push(difference);
            }
            if stride != 0 && stride != own_stride {
                let (member, block_member) = (member.clone(), block_member.clone());
                comparison.differences.push(LayoutDifference::Stride {
                    member,
                    block_member,
                    stride: own_stride,
                    block_stride: stride,
                });
            }
            let paths = Paths { own: format!("{member}."), block: format!("{block_member}.") };
            return compare_members(layout, blocks, ty, &paths, comparison);
        }
        (MemberShape::Structs { count: None, stride, .. }, None) => {
            (stride != 0 && bytes.is_multiple_of(stride), Some(stride))
        }
        (MemberShape::Structs { stride, .. }, None) => {
            let most = block_bytes.checked_next_multiple_of(MAX_ALIGNMENT).unwrap_or(block_bytes);
            ((block_bytes..=most).contains(&bytes), Some(stride).filter(|stride| *stride != 0))
        }
        (MemberShape::Plain { stride }, _) => (bytes == block_bytes, stride),
        (MemberShape::Unsized, _) => (true, None),
    };
    if !fits {
        let difference = LayoutDifference::Size { member, block_member, bytes, block_bytes, block_stride };
        comparison.differences.push(difference);
    }
    Ok(())
}

/// True if two names differ by case and underscores at most.
fn is_same_name(own: &str, block: &str) -> bool {
    let letters = |name: &str| name.replace('_', "").to_lowercase();
    letters(own) == letters(block)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::shader_layout::StructMember;
    use super::*;

    const TYPE: u32 = 7;

    /// A struct of `sizes`, whose members are called `member_0` and so on; lives as long as the tests.
    fn layout(sizes: &[u64]) -> StructLayout {
        let mut offset = 0;
        let mut members = Vec::new();
        for (number, size) in sizes.iter().enumerate() {
            let name: &'static str = Box::leak(format!("member_{number}").into_boxed_str());
            let size_bytes = *size as usize;
            members.push(StructMember { name, block_name: name, offset, size_bytes, nested: None });
            offset += size_bytes;
        }
        StructLayout { name: "Struct", size_bytes: offset, members: Box::leak(members.into_boxed_slice()) }
    }

    /// The block with the same members, in the words of GLSL.
    fn block(layout: &StructLayout) -> Vec<BlockMember> {
        let member = |member: &StructMember| BlockMember {
            name: member.name.replace("member_", "memBer"),
            offset: member.offset as u64,
            bytes: member.size_bytes as u64,
            shape: MemberShape::Plain { stride: None },
        };
        layout.members.iter().map(member).collect()
    }

    fn compared(layout: &StructLayout, members: Vec<BlockMember>) -> LayoutComparison {
        compare_layout(layout, &Blocks::from_structs([(TYPE, members)]), TYPE).unwrap()
    }

    /// The members that a difference names, as numbers.
    fn named(difference: &LayoutDifference) -> Vec<usize> {
        let text = difference.to_string();
        let parts = text.split('\'').skip(1).step_by(2);
        let mut numbers: Vec<usize> = parts
            .filter_map(|name| name.trim_start_matches(|letter: char| !letter.is_ascii_digit()).parse().ok())
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    fn sizes() -> impl Strategy<Value = Vec<u64>> {
        prop::collection::vec(prop::sample::select(vec![4_u64, 8, 12, 16, 64]), 2..12)
    }

    proptest! {
        #[test]
        fn equal_layouts_do_not_differ(sizes in sizes()) {
            let layout = layout(&sizes);
            prop_assert_eq!(compared(&layout, block(&layout)), LayoutComparison::default());
        }

        /// Members in another order are named, and no member that is where it was.
        #[test]
        fn members_in_another_order_are_named(sizes in sizes(), order in any::<prop::sample::Index>(), turn in any::<prop::sample::Index>()) {
            let own = layout(&sizes);
            let mut members = block(&own);
            let (first, second) = (order.index(sizes.len()), turn.index(sizes.len()));
            members.swap(first, second);
            let mut offset = 0;
            for member in &mut members {
                member.offset = offset;
                offset += member.bytes;
            }
            let found = compared(&own, members.clone());
            let moved = |number: &usize| {
                let name = format!("memBer{number}");
                members.iter().any(|member| member.name == name && member.offset != own.members[*number].offset as u64)
            };
            let expected: Vec<usize> = (0..sizes.len()).filter(moved).collect();
            let mut names: Vec<usize> = found.differences.iter().flat_map(named).collect();
            names.sort_unstable();
            prop_assert_eq!(names, expected);
            let swapped = found.differences.iter().any(|one| matches!(one, LayoutDifference::Swapped { .. }));
            prop_assert_eq!(swapped, first != second);
        }

        #[test]
        fn one_member_more_less_moved_or_resized_is_named(
            sizes in sizes(), which in any::<prop::sample::Index>(), change in 0..4_u8, by in 1..40_u64
        ) {
            let own = layout(&sizes);
            let mut members = block(&own);
            let number = which.index(sizes.len());
            match change {
                0 => drop(members.remove(number)),
                1 => members[number].name = "other".to_owned(),
                2 => members[number].offset += by,
                _ => members[number].bytes += by,
            }
            let found = compared(&own, members);
            let all: Vec<_> = found.differences.iter().chain(&found.missing).collect();
            prop_assert!(!all.is_empty());
            let names: Vec<usize> = all.iter().flat_map(|one| named(one)).collect();
            prop_assert!(names.contains(&number), "{:?}", all);
            prop_assert_eq!(found.missing.len(), usize::from(change < 2));
        }
    }

    #[test]
    fn names_differ_by_case_and_underscores_only() {
        for (own, block) in [("sun_color", "sunColor"), ("_padding", "padding"), ("a1", "A_1")] {
            assert!(is_same_name(own, block), "{own} {block}");
        }
        assert!(!is_same_name("sun_color", "sunColors"));
        assert!(is_block_name("Push_natural", "Push") && is_block_name("Push", "Push"));
        assert!(!is_block_name("Pushes", "Push"));
    }

    #[test]
    fn blocks_without_names_cannot_be_compared() {
        let own = layout(&[4, 4]);
        let mut members = block(&own);
        members[1].name = String::new();
        let blocks = Blocks::from_structs([(TYPE, members)]);
        assert!(compare_layout(&own, &blocks, TYPE).unwrap_err().contains("no names of members"));
        assert!(compare_layout(&own, &blocks, TYPE + 1).unwrap_err().contains("no struct"));
    }

    #[test]
    fn padding_may_be_missing_on_either_side() {
        const MEMBERS: &[StructMember] = &[
            StructMember { name: "a", block_name: "a", offset: 0, size_bytes: 4, nested: None },
            StructMember { name: "_gap", block_name: "_gap", offset: 4, size_bytes: 12, nested: None },
            StructMember { name: "b", block_name: "b", offset: 16, size_bytes: 4, nested: None },
        ];
        let own = StructLayout { name: "S", size_bytes: 20, members: MEMBERS };
        let member = |name: &str, offset| BlockMember {
            name: name.to_owned(),
            offset,
            bytes: 4,
            shape: MemberShape::Plain { stride: None },
        };
        let found = compared(&own, vec![member("a", 0), member("_unused", 8), member("b", 16)]);
        assert_eq!(found, LayoutComparison::default());
    }
}
