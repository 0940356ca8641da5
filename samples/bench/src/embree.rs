//! Builds by Embree 3 or 4 (Intel), from a library that `bench builds --embree` names.
//!
//! Names, numbers and layouts are those of Embree's C interface, `rtcore.h`.

use std::ffi::{CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr;
use std::time::{Duration, Instant};

use libloading::Library;

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EmbreeBuild {
    /// Time of `rtcCommitScene` with the quality `RTC_BUILD_QUALITY_MEDIUM`, the default: the whole build.
    pub(super) medium: Duration,
    /// The same with `RTC_BUILD_QUALITY_HIGH`, which splits triangles.
    pub(super) high: Duration,
    /// Cost of the tree of `rtcBuildBVH` with eight children a node, as the cost of the library's trees.
    pub(super) sah_cost: f64,
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
    primitives: u32,
    child_count: u32,
    children: [*const Node; WIDTH],
    half_areas: [f32; WIDTH],
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

    /// Builds the mesh on `threads` threads, `runs` times.
    pub(super) fn build(
        &self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        threads: usize,
        runs: u32,
    ) -> Result<Vec<EmbreeBuild>, EmbreeError> {
        let device = Device::new(&self.functions, threads)?;
        let sah_cost = device.tree_cost(positions, triangles)?;
        // Embree reads 16 bytes of the last vertex.
        let padded = [positions, &[[0.0; 3]]].concat();
        let vertices = &padded[..positions.len()];
        let once = |_| {
            let medium = device.commit(vertices, triangles, MEDIUM)?;
            let high = device.commit(vertices, triangles, HIGH)?;
            Ok(EmbreeBuild { medium, high, sah_cost })
        };
        (0..runs).map(once).collect()
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

    /// Returns the cost of a tree of the triangles.
    fn tree_cost(&self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<f64, EmbreeError> {
        let mut primitives: Vec<BuildPrimitive> =
            (0..).zip(triangles).map(|(number, triangle)| bounds_of(positions, triangle, number)).collect();
        let whole = primitives.iter().fold(([f32::MAX; 3], [f32::MIN; 3]), |(lower, upper), one| {
            (least(lower, one.lower), most(upper, one.upper))
        });
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
        let cost = unsafe {
            let root = (self.functions.build_bvh)(&raw const arguments);
            let sum = cost_below(root);
            (self.functions.release_bvh)(bvh);
            1.0 + sum / f64::from(half_area(whole.0, whole.1))
        };
        self.check()?;
        Ok(cost)
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

fn least(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| a[axis].min(b[axis]))
}

fn most(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| a[axis].max(b[axis]))
}

fn half_area(lower: [f32; 3], upper: [f32; 3]) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|axis| upper[axis] - lower[axis]);
    x * y + y * z + z * x
}

/// Returns the bounds of a triangle. Numbers of vertices beyond `positions` take the last of them.
fn bounds_of(positions: &[[f32; 3]], triangle: &[u32; 3], number: u32) -> BuildPrimitive {
    let corners =
        triangle.map(|index| positions.get(index as usize).or(positions.last()).copied().unwrap_or_default());
    let [a, b, c] = corners;
    BuildPrimitive {
        lower: least(least(a, b), c),
        geometry: 0,
        upper: most(most(a, b), c),
        primitive: number,
    }
}

/// Returns the costs of all children below a node, each times the half of its area.
///
/// # Safety
/// The callbacks have written the node and those below it.
unsafe fn cost_below(root: *const Node) -> f64 {
    let mut open = vec![root];
    let mut sum = 0.0;
    // SAFETY: see above.
    while let Some(node) = open.pop().and_then(|node| unsafe { node.as_ref() }) {
        for child in 0..(node.child_count as usize).min(WIDTH) {
            // SAFETY: see above.
            let Some(below) = (unsafe { node.children[child].as_ref() }) else { continue };
            let is_node = below.primitives == 0;
            let cost = if is_node { 1.0 } else { PRIMITIVE_COST * below.primitives as f32 };
            sum += f64::from(node.half_areas[child] * cost);
            open.push(below);
        }
    }
    sum
}

/// Allocates a node.
///
/// # Safety
/// `allocator` and `user` are those of the build.
unsafe fn allocate(allocator: Object, user: Object, primitives: u32) -> Object {
    let empty = Node { primitives, child_count: 0, children: [ptr::null(); WIDTH], half_areas: [0.0; WIDTH] };
    // SAFETY: the user pointer is that of the build, and the memory is for one node.
    unsafe {
        let functions = &*user.cast::<Functions>();
        let node = (functions.thread_local_alloc)(allocator, size_of::<Node>(), align_of::<Node>());
        node.cast::<Node>().write(empty);
        node
    }
}

/// `RTCCreateNodeFunction`.
unsafe extern "C" fn create_node(allocator: Object, _: u32, user: Object) -> Object {
    // SAFETY: Embree gives the allocator and the user pointer of the build.
    unsafe { allocate(allocator, user, 0) }
}

/// `RTCCreateLeafFunction`.
unsafe extern "C" fn create_leaf(
    allocator: Object,
    _: *const BuildPrimitive,
    count: usize,
    user: Object,
) -> Object {
    // SAFETY: as above.
    unsafe { allocate(allocator, user, count as u32) }
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
        for (to, from) in node.half_areas.iter_mut().zip(bounds) {
            let ([a, b, c, _], [d, e, f, _]) = ((**from).lower, (**from).upper);
            *to = half_area([a, b, c], [d, e, f]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves `a` of two and `b` of three primitives below a node, which lies below the root beside leaf `c` of one.
    #[test]
    fn the_cost_counts_nodes_and_primitives_by_their_areas() {
        let node = |primitives, children: &[(*const Node, f32)]| {
            let mut node = Node {
                primitives,
                child_count: children.len() as u32,
                children: [ptr::null(); WIDTH],
                half_areas: [0.0; WIDTH],
            };
            for (place, (child, area)) in children.iter().enumerate() {
                (node.children[place], node.half_areas[place]) = (*child, *area);
            }
            node
        };
        let [a, b, c] = [2, 3, 1].map(|primitives| node(primitives, &[]));
        let inner = node(0, &[(&raw const a, 4.0), (&raw const b, 2.0)]);
        let root = node(0, &[(&raw const inner, 8.0), (&raw const c, 10.0)]);
        // SAFETY: all nodes are alive.
        let cost = unsafe { cost_below(&raw const root) };
        assert!((cost - (8.0 + 0.3 * (10.0 + 4.0 * 2.0 + 2.0 * 3.0))).abs() < 1e-6, "{cost}");
    }

    #[test]
    fn bounds_enclose_a_triangle_and_wrong_indices_take_the_last_vertex() {
        let positions = [[0.0, 5.0, 1.0], [2.0, -1.0, 1.0], [1.0, 1.0, 4.0]];
        let found = bounds_of(&positions, &[0, 1, 900], 7);
        assert_eq!((found.lower, found.upper, found.primitive), ([0.0, -1.0, 1.0], [2.0, 5.0, 4.0], 7));
        assert_eq!(half_area(found.lower, found.upper), 2.0 * 6.0 + 6.0 * 3.0 + 3.0 * 2.0);
    }
}
