//! In which order the triangles go to the GPU.

/// Numbers of a scene's triangles as they are to be uploaded: the first `opaque_count` first, then the rest.
///
/// A scene is in an order that suits builders which do not sort. Where the builder sorts, the order of the
/// source (`source_triangles`, one number per triangle) is taken back: measured on a GPU, it rasterises faster,
/// and the tree is as good.
pub(super) fn upload_order(source_triangles: &[u32], opaque_count: u32, builder_sorts: bool) -> Vec<u32> {
    let mut order: Vec<u32> = (0..source_triangles.len() as u32).collect();
    if builder_sorts {
        let (opaque, refractive) = order.split_at_mut((opaque_count as usize).min(source_triangles.len()));
        for group in [opaque, refractive] {
            group.sort_unstable_by_key(|&triangle| (source_triangles[triangle as usize], triangle));
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_order_comes_back_within_each_group() {
        let source = [7, 3, 9, 1, 4, 2];
        assert_eq!(upload_order(&source, 4, false), [0, 1, 2, 3, 4, 5]);
        assert_eq!(upload_order(&source, 4, true), [3, 1, 0, 2, 5, 4]);
        assert_eq!(upload_order(&source, 9, true), [3, 5, 1, 4, 0, 2]);
    }
}
