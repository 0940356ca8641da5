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

/// Objects of an engine on its device: a buffer that the engine reads, and a timeline semaphore.
struct Engine {
    device: ash::Device,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    done: vk::Semaphore,
}

impl Engine {
    /// # Safety
    /// `types` are the memory types of the device.
    unsafe fn new(device: ash::Device, types: &[vk::MemoryType]) -> Result<Self, Box<dyn std::error::Error>> {
        let transfer = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let shader = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let info = vk::BufferCreateInfo::default().size(4 * COUNT as u64).usage(transfer | shader);
        let host = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let address = vk::MemoryAllocateFlags::DEVICE_ADDRESS;
        let mut address = vk::MemoryAllocateFlagsInfo::default().flags(address);
        let timeline = vk::SemaphoreType::TIMELINE;
        let mut timeline = vk::SemaphoreTypeCreateInfo::default().semaphore_type(timeline);
        // SAFETY: the descriptions are valid, and the memory is large enough and of a type that the buffer may have.
        unsafe {
            let buffer = device.create_buffer(&info, None)?;
            let needed = device.get_buffer_memory_requirements(buffer);
            let fits = |index: &usize| needed.memory_type_bits >> index & 1 == 1;
            let memory_type =
                (0..types.len()).filter(fits).find(|&index| types[index].property_flags.contains(host));
            let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).push_next(&mut address);
            let info = info.memory_type_index(memory_type.ok_or("no memory for the host")? as u32);
            let memory = device.allocate_memory(&info, None)?;
            device.bind_buffer_memory(buffer, memory, 0)?;
            let info = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
            let done = device.create_semaphore(&info, None)?;
            Ok(Self { device, buffer, memory, done })
        }
    }

    /// Waits for the semaphore, and returns the numbers.
    fn read(&self) -> Result<[u32; COUNT], vk::Result> {
        let info = vk::SemaphoreWaitInfo::default().semaphores(std::slice::from_ref(&self.done)).values(&[1]);
        // SAFETY: the memory has the size of the numbers, is mapped once, and nothing writes it any more.
        unsafe {
            self.device.wait_semaphores(&info, u64::MAX)?;
            let mapped =
                self.device.map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())?;
            Ok(*mapped.cast::<[u32; COUNT]>())
        }
    }
}

/// Writes with `lvk` what the engine reads.
fn write_as_guest(ctx: &Context, engine: &Engine) -> Result<()> {
    let (buffer, size_bytes, usage) = (engine.buffer, 4 * COUNT as u64, BufferUsage::STORAGE);
    let import = ImportedBuffer { buffer, size_bytes, usage, concurrent: false, debug_name: "numbers" };
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
    let version = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&version);
    let desc = ContextDesc::default();
    // SAFETY: the handles belong together, and are destroyed after the context and what it made.
    unsafe {
        let entry = ash::Entry::load()?;
        let instance = entry.create_instance(&info, None)?;
        let physical = *instance.enumerate_physical_devices()?.first().ok_or("no device")?;
        let needs = Context::requirements(&entry, &instance, &[], physical, &desc)?;
        let (queues, mut chain) = (needs.queue_create_infos(), needs.feature_chain());
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues);
        let device = instance.create_device(physical, &chain.merge_into(info)?, None)?;
        let memory = instance.get_physical_device_memory_properties(physical);
        let engine = Engine::new(device.clone(), memory.memory_types_as_slice())?;
        let ctx = Context::from_raw(needs.raw_context(device.clone(), needs.queues(&device)), &desc)?;
        write_as_guest(&ctx, &engine)?;
        println!("{:?}", engine.read()?);
        drop((ctx, needs));
        device.destroy_semaphore(engine.done, None);
        device.destroy_buffer(engine.buffer, None);
        device.free_memory(engine.memory, None);
        device.destroy_device(None);
        instance.destroy_instance(None);
    }
    Ok(())
}
