//! Compilation of a ray tracing pipeline on all cores, by a deferred host operation of Vulkan.

use std::thread;

use ash::khr::deferred_host_operations::Device;
use ash::vk;

use super::pipeline_layout::PipelineBase;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::start::driver_workarounds::with_shared_device_lock;
use crate::parallel::run_on_threads;

/// Creates the pipeline `name` (`vkCreateRayTracingPipelinesKHR`). The number of threads is limited by the driver and by
/// `base.max_threads`.
///
/// # Safety
/// `info` is valid for the device, and `base` holds objects of the device.
pub(crate) unsafe fn compile(
    gpu: &Gpu,
    base: PipelineBase,
    name: &str,
    info: &vk::RayTracingPipelineCreateInfoKHR<'_>,
) -> Result<vk::Pipeline> {
    // NVIDIA's driver 580 crashes after a deferred creation that compiles no shader and only links libraries.
    let operation = if info.stage_count > 0 { Some(DeferredOperation::new(gpu, name)?) } else { None };
    let deferred = operation.as_ref().map_or(vk::DeferredOperationKHR::null(), |operation| operation.raw);
    let ext = gpu.ray_tracing_functions()?;
    let create = ext.fp().create_ray_tracing_pipelines_khr;
    let mut raw = vk::Pipeline::null();
    // SAFETY: the caller guarantees that the description is valid. The description and `raw` do not move until the
    // driver is done with them, since `finish` returns no sooner.
    let mut start =
        || unsafe { create(ext.device(), deferred, base.cache, 1, info, std::ptr::null(), &raw mut raw) };
    let result = with_shared_device_lock(gpu.caps.driver_id, || match (start(), &operation) {
        (vk::Result::OPERATION_DEFERRED_KHR, Some(operation)) => operation.finish(base.max_threads),
        (vk::Result::OPERATION_NOT_DEFERRED_KHR, _) => vk::Result::SUCCESS,
        (result, _) => result,
    });
    if let Err(error) = result.result() {
        // SAFETY: null, or a pipeline that was made before the operation failed, and that is used nowhere.
        unsafe { gpu.device.destroy_pipeline(raw, None) };
        return Err(Error::vulkan("vkCreateRayTracingPipelinesKHR", name)(error));
    }
    Ok(raw)
}

/// A deferred operation, destroyed on drop. The work deferred to it must be finished by then.
struct DeferredOperation {
    raw: vk::DeferredOperationKHR,
    ext: Device,
}

impl DeferredOperation {
    fn new(gpu: &Gpu, name: &str) -> Result<Self> {
        let ext = Device::new(&gpu.instance.raw, &gpu.device);
        // SAFETY: the extension is on wherever ray tracing is.
        let raw = unsafe { ext.create_deferred_operation(None) }
            .map_err(Error::vulkan("vkCreateDeferredOperationKHR", name))?;
        Ok(Self { raw, ext })
    }

    /// Executes the deferred work on at most `max_threads` threads, and returns its result.
    fn finish(&self, max_threads: usize) -> vk::Result {
        // SAFETY: the operation is alive until `self` is dropped.
        let useful = unsafe { self.ext.get_deferred_operation_max_concurrency(self.raw) };
        let join = || {
            // SAFETY: as above; any number of threads may join.
            result_code(unsafe { self.ext.deferred_operation_join(self.raw) })
        };
        let result = || {
            // SAFETY: as above.
            result_code(unsafe { self.ext.get_deferred_operation_result(self.raw) })
        };
        join_with_threads(max_threads.min(useful as usize), &join, &result)
    }
}

impl Drop for DeferredOperation {
    fn drop(&mut self) {
        // SAFETY: no work was deferred, or `finish` has waited for its end.
        unsafe { self.ext.destroy_deferred_operation(self.raw, None) };
    }
}

fn result_code(outcome: Result<(), vk::Result>) -> vk::Result {
    outcome.err().unwrap_or(vk::Result::SUCCESS)
}

/// Joins an operation from `threads` threads, the calling thread included, until `result` returns a final code.
///
/// A thread that cannot be started is left out. A join that fails for lack of memory is repeated: until the operation
/// ends, the driver still holds its parameters, so the creation cannot be aborted.
fn join_with_threads(
    threads: usize,
    join: &(impl Fn() -> vk::Result + Sync),
    result: &impl Fn() -> vk::Result,
) -> vk::Result {
    run_on_threads(threads, || join_until_done(join));
    loop {
        match result() {
            vk::Result::NOT_READY => join_until_done(join),
            result => return result,
        }
        thread::yield_now();
    }
}

/// Works on an operation until there is no work left for this thread.
fn join_until_done(join: &impl Fn() -> vk::Result) {
    while join() == vk::Result::THREAD_IDLE_KHR {
        thread::yield_now();
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_types, reason = "no lock of the library")]
mod tests {
    use std::collections::HashSet;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread::ThreadId;

    use super::*;

    /// A test double of a driver with `left` pieces of work. Each join executes one piece.
    struct Driver {
        left: AtomicUsize,
        done: AtomicUsize,
        all: usize,
        workers: Mutex<HashSet<ThreadId>>,
        outcome: vk::Result,
        /// Number of joins that fail before the first one succeeds.
        failures: AtomicUsize,
    }

    impl Driver {
        fn new(all: usize, outcome: vk::Result) -> Self {
            Self {
                left: all.into(),
                done: 0.into(),
                all,
                workers: Mutex::default(),
                outcome,
                failures: 0.into(),
            }
        }

        fn join(&self) -> vk::Result {
            let fewer = |count: usize| count.checked_sub(1);
            if self.failures.fetch_update(Ordering::SeqCst, Ordering::SeqCst, fewer).is_ok() {
                return vk::Result::ERROR_OUT_OF_HOST_MEMORY;
            }
            self.workers.lock().unwrap().insert(thread::current().id());
            let claimed = self.left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, fewer);
            if claimed.is_err() {
                let complete = self.done.load(Ordering::SeqCst) == self.all;
                return if complete { vk::Result::SUCCESS } else { vk::Result::THREAD_DONE_KHR };
            }
            self.done.fetch_add(1, Ordering::SeqCst);
            vk::Result::THREAD_IDLE_KHR
        }

        fn result(&self) -> vk::Result {
            if self.done.load(Ordering::SeqCst) < self.all { vk::Result::NOT_READY } else { self.outcome }
        }

        fn run(&self, threads: usize) -> vk::Result {
            join_with_threads(threads, &|| self.join(), &|| self.result())
        }
    }

    #[test]
    fn all_work_is_done_whatever_the_number_of_threads() {
        for threads in 0..6 {
            let driver = Driver::new(50, vk::Result::SUCCESS);
            assert_eq!(driver.run(threads), vk::Result::SUCCESS);
            assert_eq!(driver.done.load(Ordering::SeqCst), 50);
            assert_eq!(driver.workers.lock().unwrap().len(), threads.max(1));
        }
    }

    #[test]
    fn the_outcome_is_the_operations_own() {
        let lost = vk::Result::ERROR_DEVICE_LOST;
        assert_eq!(Driver::new(3, lost).run(2), lost);
        assert_eq!(Driver::new(0, vk::Result::SUCCESS).run(4), vk::Result::SUCCESS);
    }

    #[test]
    fn failed_joins_end_only_with_the_operation() {
        let mut driver = Driver::new(5, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        driver.failures = 20.into();
        assert_eq!(driver.run(3), vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        assert_eq!(driver.done.load(Ordering::SeqCst), 5);
    }
}
