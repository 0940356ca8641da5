//! Builds by Embree 3 or 4 (Intel), from a library that `bench builds --embree` names.
//!
//! Names, numbers and layouts are those of Embree's C interface, `rtcore.h`.

use std::ffi::{CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr;
use std::time::{Duration, Instant};

use glam::Vec3;
use libloading::Library;
use lvk::test_hooks::{WideChild, WideLink, WideTree};

/// Embree cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum EmbreeError {
    #[error(
        "--embree {}: {reason}; Debian's package libembree-dev has libembree3.so.3",
        lvk::readable_name(path)
    )]
    Library { path: PathBuf, reason: libloading::Error },
    #[error("Embree failed with the error {0} of RTCError")]
    Failed(u32),
}

/// A build of one mesh by Embree.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EmbreeBuild {
    /// Time of `rtcCommitScene` with the quality `RTC_BUILD_QUALITY_MEDIUM`, the default: the whole build.
    pub(super) medium: Duration,
    /// The same with `RTC_BUILD_QUALITY_HIGH`, which splits triangles.
    pub(super) high: Duration,
    /// Time of `rtcBuildBVH` with medium quality, whose tree [`Embree::build`] returns.
    pub(super) bvh: Duration,
}

type Object = *mut c_void;

const TRIANGLES: u32 = 0; // RTC_GEOMETRY_TYPE_TRIANGLE
const INDICES: u32 = 0; // RTC_BUFFER_TYPE_INDEX
const VERTICES: u32 = 1; // RTC_BUFFER_TYPE_VERTEX
const UINT3: u32 = 0x5003; // RTC_FORMAT_UINT3
const FLOAT3: u32 = 0x9003; // RTC_FORMAT_FLOAT3
const MEDIUM: u32 = 1; // RTC_BUILD_QUALITY_MEDIUM
const HIGH: u32 = 2; // RTC_BUILD_QUALITY_HIGH

/// Children of a node.
const WIDTH: usize = 8;
/// Most primitives of a leaf, as in the library's trees.
const LEAF_SIZE: u32 = 3;
/// Cost of a primitive, for a cost of 1 of a node.
const PRIMITIVE_COST: f32 = 0.3;

/// `RTCBuildPrimitive`.
#[repr(C, align(32))]
#[derive(Debug, Clone, Copy)]
struct BuildPrimitive {
    lower: [f32; 3],
    geometry: u32,
    upper: [f32; 3],
    primitive: u32,
}

/// `RTCBounds`.
#[repr(C, align(16))]
struct RawBounds {
    lower: [f32; 4],
    upper: [f32; 4],
}

/// `RTCBuildArguments`.
#[repr(C)]
struct BuildArguments {
    byte_size: usize,
    quality: u32,
    flags: u32,
    max_branching_factor: u32,
    max_depth: u32,
    sah_block_size: u32,
    min_leaf_size: u32,
    max_leaf_size: u32,
    traversal_cost: f32,
    intersection_cost: f32,
    bvh: Object,
    primitives: *mut BuildPrimitive,
    primitive_count: usize,
    primitive_array_capacity: usize,
    create_node: unsafe extern "C" fn(Object, u32, Object) -> Object,
    set_node_children: unsafe extern "C" fn(Object, *const *const Node, u32, Object),
    set_node_bounds: unsafe extern "C" fn(Object, *const *const RawBounds, u32, Object),
    create_leaf: unsafe extern "C" fn(Object, *const BuildPrimitive, usize, Object) -> Object,
    split_primitive: Option<unsafe extern "C" fn()>,
    build_progress: Option<unsafe extern "C" fn()>,
    user: *const Functions,
}

/// A node or a leaf of the tree that the callbacks make.
#[repr(C, align(16))]
struct Node {
    /// Number of primitives; 0 for a node.
    primitive_count: u32,
    primitives: [u32; LEAF_SIZE as usize],
    child_count: u32,
    children: [*const Node; WIDTH],
    low: [Vec3; WIDTH],
    high: [Vec3; WIDTH],
}

/// The functions of Embree that are used.
struct Functions {
    new_device: unsafe extern "C" fn(*const c_char) -> Object,
    release_device: unsafe extern "C" fn(Object),
    device_error: unsafe extern "C" fn(Object) -> u32,
    new_scene: unsafe extern "C" fn(Object) -> Object,
    release_scene: unsafe extern "C" fn(Object),
    set_quality: unsafe extern "C" fn(Object, u32),
    commit_scene: unsafe extern "C" fn(Object),
    new_geometry: unsafe extern "C" fn(Object, u32) -> Object,
    release_geometry: unsafe extern "C" fn(Object),
    set_shared_buffer: unsafe extern "C" fn(Object, u32, u32, u32, *const c_void, usize, usize, usize),
    commit_geometry: unsafe extern "C" fn(Object),
    attach_geometry: unsafe extern "C" fn(Object, Object) -> u32,
    new_bvh: unsafe extern "C" fn(Object) -> Object,
    build_bvh: unsafe extern "C" fn(*const BuildArguments) -> *const Node,
    release_bvh: unsafe extern "C" fn(Object),
    thread_local_alloc: unsafe extern "C" fn(Object, usize, usize) -> Object,
}

/// The opened library, which stays open: its threads may run until the process ends.
pub(super) struct Embree {
    functions: Functions,
}

impl Embree {
    /// Opens the library.
    pub(super) fn open(path: &Path) -> Result<Self, EmbreeError> {
        let failed = |reason| EmbreeError::Library { path: path.to_owned(), reason };
        // SAFETY: the user names Embree, whose initialisation has no requirements.
        let library = unsafe { Library::new(path) }.map_err(failed)?;
        // SAFETY: the types are those of Embree's header.
        let functions = unsafe { Functions::load(&library) }.map_err(failed)?;
        std::mem::forget(library);
        Ok(Self { functions })
    }

    /// Builds the mesh on `threads` threads, `runs` times. Returns the times, and the tree of the last `rtcBuildBVH`, with medium quality, eight
    /// children a node and the costs of the library's trees.
    pub(super) fn build(
        &self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        threads: usize,
        runs: u32,
    ) -> Result<(Vec<EmbreeBuild>, WideTree), EmbreeError> {
        let device = Device::new(&self.functions, threads)?;
        // Embree reads 16 bytes of the last vertex.
        let padded = [positions, &[[0.0; 3]]].concat();
        let vertices = &padded[..positions.len()];
        let (mut builds, mut last) = (Vec::new(), WideTree::default());
        for _ in 0..runs {
            let medium = device.commit(vertices, triangles, MEDIUM)?;
            let high = device.commit(vertices, triangles, HIGH)?;
            let (bvh, tree) = device.tree(positions, triangles)?;
            builds.push(EmbreeBuild { medium, high, bvh });
            last = tree;
        }
        Ok((builds, last))
    }
}

impl Functions {
    /// # Safety
    /// The library's functions have the types of Embree's header.
    unsafe fn load(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: see above.
        unsafe {
            Ok(Self {
                new_device: *library.get(b"rtcNewDevice")?,
                release_device: *library.get(b"rtcReleaseDevice")?,
                device_error: *library.get(b"rtcGetDeviceError")?,
                new_scene: *library.get(b"rtcNewScene")?,
                release_scene: *library.get(b"rtcReleaseScene")?,
                set_quality: *library.get(b"rtcSetSceneBuildQuality")?,
                commit_scene: *library.get(b"rtcCommitScene")?,
                new_geometry: *library.get(b"rtcNewGeometry")?,
                release_geometry: *library.get(b"rtcReleaseGeometry")?,
                set_shared_buffer: *library.get(b"rtcSetSharedGeometryBuffer")?,
                commit_geometry: *library.get(b"rtcCommitGeometry")?,
                attach_geometry: *library.get(b"rtcAttachGeometry")?,
                new_bvh: *library.get(b"rtcNewBVH")?,
                build_bvh: *library.get(b"rtcBuildBVH")?,
                release_bvh: *library.get(b"rtcReleaseBVH")?,
                thread_local_alloc: *library.get(b"rtcThreadLocalAlloc")?,
            })
        }
    }
}

/// A device of Embree.
struct Device<'a> {
    functions: &'a Functions,
    raw: Object,
}

impl<'a> Device<'a> {
    fn new(functions: &'a Functions, threads: usize) -> Result<Self, EmbreeError> {
        let config = CString::new(format!("threads={threads},set_affinity=0")).unwrap_or_default();
        // SAFETY: the text ends with a zero.
        let raw = unsafe { (functions.new_device)(config.as_ptr()) };
        let device = Self { functions, raw };
        device.check()?;
        Ok(device)
    }

    fn check(&self) -> Result<(), EmbreeError> {
        // SAFETY: the device is alive, or null, which asks for the error of its creation.
        let error = unsafe { (self.functions.device_error)(self.raw) };
        if error == 0 { Ok(()) } else { Err(EmbreeError::Failed(error)) }
    }

    /// Returns the time of a build. 16 bytes must be readable at each vertex.
    fn commit(
        &self,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        quality: u32,
    ) -> Result<Duration, EmbreeError> {
        let f = self.functions;
        // SAFETY: the objects are alive until they are released, and the buffers outlive the scene.
        let time = unsafe {
            let scene = (f.new_scene)(self.raw);
            (f.set_quality)(scene, quality);
            let geometry = (f.new_geometry)(self.raw, TRIANGLES);
            let buffers = [
                (INDICES, UINT3, triangles.as_ptr().cast::<c_void>(), triangles.len()),
                (VERTICES, FLOAT3, vertices.as_ptr().cast(), vertices.len()),
            ];
            for (kind, format, data, count) in buffers {
                (f.set_shared_buffer)(geometry, kind, 0, format, data, 0, size_of::<[f32; 3]>(), count);
            }
            (f.commit_geometry)(geometry);
            (f.attach_geometry)(scene, geometry);
            (f.release_geometry)(geometry);
            let start = Instant::now();
            (f.commit_scene)(scene);
            let time = start.elapsed();
            (f.release_scene)(scene);
            time
        };
        self.check()?;
        Ok(time)
    }

    /// Returns the time of `rtcBuildBVH`, without that of making its primitives, and the tree.
    fn tree(
        &self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
    ) -> Result<(Duration, WideTree), EmbreeError> {
        let mut primitives: Vec<BuildPrimitive> =
            (0..).zip(triangles).map(|(number, triangle)| bounds_of(positions, triangle, number)).collect();
        // SAFETY: the device is alive.
        let bvh = unsafe { (self.functions.new_bvh)(self.raw) };
        let arguments = BuildArguments {
            byte_size: size_of::<BuildArguments>(),
            quality: MEDIUM,
            flags: 0,
            max_branching_factor: WIDTH as u32,
            max_depth: 64,
            sah_block_size: 1,
            min_leaf_size: 1,
            max_leaf_size: LEAF_SIZE,
            traversal_cost: 1.0,
            intersection_cost: PRIMITIVE_COST,
            bvh,
            primitives: primitives.as_mut_ptr(),
            primitive_count: primitives.len(),
            primitive_array_capacity: primitives.len(),
            create_node,
            set_node_children,
            set_node_bounds,
            create_leaf,
            split_primitive: None,
            build_progress: None,
            user: self.functions,
        };
        // SAFETY: the primitives and the functions outlive the call, and the nodes live as long as the BVH.
        let built = unsafe {
            let start = Instant::now();
            let root = (self.functions.build_bvh)(&raw const arguments);
            let time = start.elapsed();
            let tree = tree_below(root, |number| corners_of(positions, &triangles[number as usize]));
            (self.functions.release_bvh)(bvh);
            (time, tree)
        };
        self.check()?;
        Ok(built)
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.raw.is_null() {
            // SAFETY: nothing of the device is left.
            unsafe { (self.functions.release_device)(self.raw) };
        }
    }
}

/// Returns the corners of a triangle. Numbers of vertices beyond `positions` take the last of them.
fn corners_of(positions: &[[f32; 3]], triangle: &[u32; 3]) -> [Vec3; 3] {
    triangle.map(|index| {
        let nearest = positions.get(index as usize).or(positions.last()).copied();
        Vec3::from_array(nearest.unwrap_or_default())
    })
}

fn bounds_of(positions: &[[f32; 3]], triangle: &[u32; 3], primitive: u32) -> BuildPrimitive {
    let [a, b, c] = corners_of(positions, triangle);
    let (lower, upper) = (a.min(b).min(c).to_array(), a.max(b).max(c).to_array());
    BuildPrimitive { lower, geometry: 0, upper, primitive }
}

/// Converts a tree; `corners` returns those of a primitive. Empty without a root, and for a single leaf.
///
/// # Safety
/// The callbacks have written the node and those below it.
unsafe fn tree_below(root: *const Node, corners: impl Fn(u32) -> [Vec3; 3]) -> WideTree {
    let mut tree = WideTree::default();
    let mut open = vec![(root, 0)];
    tree.nodes.push([WideChild::NONE; WIDTH]);
    // SAFETY: see above.
    while let Some((node, number)) = open.pop().and_then(|(node, at)| Some((unsafe { node.as_ref() }?, at))) {
        for child in 0..(node.child_count as usize).min(WIDTH) {
            // SAFETY: see above.
            let Some(below) = (unsafe { node.children[child].as_ref() }) else { continue };
            let link = if below.primitive_count == 0 {
                open.push((node.children[child], tree.nodes.len()));
                tree.nodes.push([WideChild::NONE; WIDTH]);
                WideLink::Node(tree.nodes.len() as u32 - 1)
            } else {
                let (first, count) = (tree.triangles.len() as u32, below.primitive_count.min(LEAF_SIZE));
                tree.triangles.extend(below.primitives[..count as usize].iter().map(|one| corners(*one)));
                WideLink::Leaf { first, count }
            };
            tree.nodes[number][child] = WideChild { low: node.low[child], high: node.high[child], link };
        }
    }
    tree
}

/// Allocates a node, or a leaf of these primitives.
///
/// # Safety
/// `allocator` and `user` are those of the build.
unsafe fn allocate(allocator: Object, user: Object, primitives: &[BuildPrimitive]) -> Object {
    let mut made = Node {
        primitive_count: primitives.len() as u32,
        primitives: [0; LEAF_SIZE as usize],
        child_count: 0,
        children: [ptr::null(); WIDTH],
        low: [Vec3::ZERO; WIDTH],
        high: [Vec3::ZERO; WIDTH],
    };
    made.primitives.iter_mut().zip(primitives).for_each(|(to, from)| *to = from.primitive);
    // SAFETY: the user pointer is that of the build, and the memory is for one node.
    unsafe {
        let functions = &*user.cast::<Functions>();
        let node = (functions.thread_local_alloc)(allocator, size_of::<Node>(), align_of::<Node>());
        node.cast::<Node>().write(made);
        node
    }
}

/// `RTCCreateNodeFunction`.
unsafe extern "C" fn create_node(allocator: Object, _: u32, user: Object) -> Object {
    // SAFETY: Embree gives the allocator and the user pointer of the build.
    unsafe { allocate(allocator, user, &[]) }
}

/// `RTCCreateLeafFunction`.
unsafe extern "C" fn create_leaf(
    allocator: Object,
    primitives: *const BuildPrimitive,
    count: usize,
    user: Object,
) -> Object {
    // SAFETY: as above, and there are `count` primitives.
    unsafe { allocate(allocator, user, std::slice::from_raw_parts(primitives, count)) }
}

/// `RTCSetNodeChildrenFunction`.
unsafe extern "C" fn set_node_children(node: Object, children: *const *const Node, count: u32, _: Object) {
    // SAFETY: the node is one of `create_node`, and there are `count` children.
    unsafe {
        let node = &mut *node.cast::<Node>();
        node.child_count = count;
        let children = std::slice::from_raw_parts(children, count as usize);
        node.children.iter_mut().zip(children).for_each(|(to, from)| *to = *from);
    }
}

/// `RTCSetNodeBoundsFunction`.
unsafe extern "C" fn set_node_bounds(node: Object, bounds: *const *const RawBounds, count: u32, _: Object) {
    // SAFETY: the node is one of `create_node`, and there are `count` bounds.
    unsafe {
        let node = &mut *node.cast::<Node>();
        let bounds = std::slice::from_raw_parts(bounds, count as usize);
        for (child, from) in bounds.iter().enumerate().take(WIDTH) {
            let ([a, b, c, _], [d, e, f, _]) = ((**from).lower, (**from).upper);
            (node.low[child], node.high[child]) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(primitives: &[u32], children: &[(*const Node, f32)]) -> Node {
        let mut node = Node {
            primitive_count: primitives.len() as u32,
            primitives: [0; LEAF_SIZE as usize],
            child_count: children.len() as u32,
            children: [ptr::null(); WIDTH],
            low: [Vec3::ZERO; WIDTH],
            high: [Vec3::ZERO; WIDTH],
        };
        node.primitives[..primitives.len()].copy_from_slice(primitives);
        for (place, (child, size)) in children.iter().enumerate() {
            (node.children[place], node.high[place]) = (*child, Vec3::splat(*size));
        }
        node
    }

    /// Leaves `a` of two and `b` of three primitives below a node, which lies below the root beside leaf `c` of one.
    #[test]
    fn a_tree_has_the_nodes_and_the_triangles_of_its_leaves() {
        let [a, b, c] = [node(&[4, 2], &[]), node(&[0, 5, 1], &[]), node(&[3], &[])];
        let inner = node(&[], &[(&raw const a, 4.0), (&raw const b, 2.0)]);
        let root = node(&[], &[(&raw const inner, 8.0), (&raw const c, 10.0)]);
        // SAFETY: all nodes are alive.
        let tree = unsafe { tree_below(&raw const root, |number| [Vec3::splat(number as f32); 3]) };
        let links: Vec<Vec<WideLink>> =
            tree.nodes.iter().map(|node| node[..2].iter().map(|child| child.link).collect()).collect();
        let leaf = |first, count| WideLink::Leaf { first, count };
        assert_eq!(links, [vec![WideLink::Node(1), leaf(0, 1)], vec![leaf(1, 2), leaf(3, 3)]]);
        assert_eq!(tree.nodes[0][1].high, Vec3::splat(10.0));
        assert_eq!(tree.nodes[0][2], WideChild::NONE);
        let numbers: Vec<f32> = tree.triangles.iter().map(|triangle| triangle[0].x).collect();
        assert_eq!(numbers, [3.0, 4.0, 2.0, 0.0, 5.0, 1.0]);
    }

    #[test]
    fn bounds_enclose_a_triangle_and_wrong_indices_take_the_last_vertex() {
        let positions = [[0.0, 5.0, 1.0], [2.0, -1.0, 1.0], [1.0, 1.0, 4.0]];
        let found = bounds_of(&positions, &[0, 1, 900], 7);
        assert_eq!((found.lower, found.upper, found.primitive), ([0.0, -1.0, 1.0], [2.0, 5.0, 4.0], 7));
    }
}
