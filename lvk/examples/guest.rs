//! Uses `lvk` on a device that another engine has made: writes the engine's own buffer from a compute shader, signals
//! the engine's semaphore, and prints the numbers that the engine reads.
use lvk::ash::{self, vk};
use lvk::*;

const SHADER: &str = r"
    layout(local_size_x = 8) in;
    layout(buffer_reference, scalar) writeonly buffer Output { uint value[]; };
    layout(push_constant, scalar) uniform Push { Output result; };
    void main() { result.value[gl_LocalInvocationIndex] = 7 * gl_LocalInvocationIndex; }";
const COUNT: usize = 8;

/// An engine that made a device by itself, a buffer that it reads, and a timeline semaphore.
struct Engine {
    raw: RawContext<'static>,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    done: vk::Semaphore,
}

impl Engine {
    /// # Safety
    /// Every handle is of the instance and the device made here. Those of `lvk` are dropped before.
    unsafe fn new() -> Result<Self, Box<dyn std::error::Error>> {
        let version = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let info = vk::InstanceCreateInfo::default().application_info(&version);
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        // SAFETY: as above.
        unsafe {
            let entry = ash::Entry::load()?;
            let instance = entry.create_instance(&info, None)?;
            let physical = *instance.enumerate_physical_devices()?.first().ok_or("no device")?;
            // All that the device has; `Context::from_raw` lists what a context needs.
            instance.get_physical_device_features2(physical, &mut features);
            features.features.robust_buffer_access = vk::FALSE;
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features);
            let device = instance.create_device(physical, &info, None)?;
            let queue = device.get_device_queue(0, 0);
            let transfer = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
            let shader = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
            let info = vk::BufferCreateInfo::default().size(4 * COUNT as u64).usage(transfer | shader);
            let buffer = device.create_buffer(&info, None)?;
            let needed = device.get_buffer_memory_requirements(buffer);
            let types = instance.get_physical_device_memory_properties(physical).memory_types;
            let host = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let fits = |index: &u32| needed.memory_type_bits >> index & 1 == 1;
            let memory_type = (0..32).filter(fits).find(|&i| types[i as usize].property_flags.contains(host));
            let address = vk::MemoryAllocateFlags::DEVICE_ADDRESS;
            let mut address = vk::MemoryAllocateFlagsInfo::default().flags(address);
            let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).push_next(&mut address);
            let info = info.memory_type_index(memory_type.ok_or("no memory for the host")?);
            let memory = device.allocate_memory(&info, None)?;
            device.bind_buffer_memory(buffer, memory, 0)?;
            let timeline = vk::SemaphoreType::TIMELINE;
            let mut timeline = vk::SemaphoreTypeCreateInfo::default().semaphore_type(timeline);
            let info = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
            let done = device.create_semaphore(&info, None)?;
            let raw = RawContext {
                entry,
                instance,
                instance_extensions: &[],
                physical_device: physical,
                device,
                device_extensions: &[],
                features: FeatureSet::NONE,
                ray_tracing_pipeline: false,
                ray_query: false,
                mesh_shader: false,
                queue,
                queue_family: 0,
                compute_queue: None,
                transfer_queue: None,
            };
            Ok(Self { raw, buffer, memory, done })
        }
    }
}

/// Writes with `lvk` what the engine reads.
fn write_as_guest(engine: &Engine) -> Result<()> {
    let (buffer, size_bytes, usage) = (engine.buffer, 4 * COUNT as u64, BufferUsage::STORAGE);
    let import = ImportedBuffer { buffer, size_bytes, usage, concurrent: false, debug_name: "numbers" };
    // SAFETY: the engine's objects belong together and outlive the context, and every needed feature is on.
    let ctx = unsafe { Context::from_raw(engine.raw.clone(), &ContextDesc::default())? };
    // SAFETY: the buffer is as described, and the engine does not use it until its semaphore is signalled.
    let numbers = unsafe { ctx.import_buffer(&import)? };
    let (stage, source) = (ShaderStage::Compute, ShaderSource::Glsl(SHADER));
    let module = ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })?;
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc)?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*pipeline)?;
    cmd.push_constants(&numbers.address()?)?;
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*numbers], ..Default::default() })?;
    // SAFETY: the semaphore is of this device, and its value was 0.
    unsafe { ctx.submit_with(cmd, &[], &[RawSignal { semaphore: engine.done, value: 1 }]).map(|_| ()) }
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    // SAFETY: `write_as_guest` drops everything of `lvk`; the memory is read after the last write.
    unsafe {
        let engine = Engine::new()?;
        write_as_guest(&engine)?;
        let Engine { raw: RawContext { device, instance, .. }, buffer, memory, done } = &engine;
        let info = vk::SemaphoreWaitInfo::default().semaphores(std::slice::from_ref(done)).values(&[1]);
        device.wait_semaphores(&info, u64::MAX)?;
        let mapped = device.map_memory(*memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())?;
        println!("{:?}", *mapped.cast::<[u32; COUNT]>());
        device.destroy_semaphore(*done, None);
        device.destroy_buffer(*buffer, None);
        device.free_memory(*memory, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
        Ok(())
    }
}
