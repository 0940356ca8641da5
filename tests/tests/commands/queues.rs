//! Several queues: results equal those of one command buffer after the other, on any queue, without validation
//! messages. No test records a barrier or waits before it reads. Every test runs with the device's own queues where
//! it has them, with emulated queues, and with one queue for all.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::ash::vk;
use lvk::glam::Vec3;
use lvk::{
    BlasDesc, BufferDesc, BuildFlags, BuildMode, ClearValue, ColorAttachment, Dependencies, Format, Holder,
    MemoryKind, Queue, QueueRequest, RawWait, RayQueryRequest, RenderPassDesc, RenderPipelineDesc,
    SubmitHandle, TextureDesc, TextureHandle, TextureKind, TextureRange, TextureRegion, TextureUsage,
    TlasDesc,
};
use lvk_tests::compute::{Evaluator, read_vec4, read_words, vec4_buffer, words_buffer};
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::queues::{WORDS, bare_step, for_each_queue_request, step, step_pipeline, stepped, submit_on};
use lvk_tests::random::Random;
use lvk_tests::raster::{COVER, PAINT, paint, pixels, render_pipeline};
use lvk_tests::ray_scene::{Layout, Part, RayScene, instances, upload_geometries};
use lvk_tests::ray_tracer::{How, Method, RayTracer};
use lvk_tests::rays::random_rays;
use lvk_tests::vertex_deform::{VertexDeformer, deformed};
use lvk_tests::{TestDevice, device_with};

#[test]
fn every_queue_exists_and_the_graphics_queue_has_hardware() {
    for_each_queue_request(|ctx| {
        let caps = ctx.capabilities();
        assert!(caps.queue(Queue::Graphics).own_hardware);
        for queue in Queue::ALL {
            let done = submit_on(ctx, queue, |_| {});
            ctx.wait(done).unwrap();
            assert!(ctx.is_done(done).unwrap());
            assert_eq!(caps.queue(queue).family, ctx.raw_queue_family_of(queue));
            ctx.with_raw_queue_of(queue, |_| {});
        }
        assert!(submit_on(ctx, Queue::Transfer, |_| {}) < submit_on(ctx, Queue::Graphics, |_| {}));
    });
}

/// Forty steps and copies on random queues through four buffers, none of which waits on the host.
#[test]
fn buffers_go_from_queue_to_queue() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let mut random = Random::new(7);
        let mut expected: Vec<Vec<u32>> =
            (0..4).map(|at| (0..WORDS as u32).map(|i| i * 7 + at).collect()).collect();
        let buffers: Vec<_> = expected.iter().map(|words| words_buffer(ctx, words)).collect();
        for number in 0..40 {
            let pick = |random: &mut Random, below: f32| random.between(0.0, below) as usize;
            let (from, away) = (pick(&mut random, 4.0), 1 + pick(&mut random, 3.0));
            let to = (from + away) % 4;
            let pair = [*buffers[from], *buffers[to]];
            let queue = Queue::ALL[pick(&mut random, 3.0)];
            submit_on(ctx, queue, |cmd| {
                if queue == Queue::Transfer || number % 5 == 4 {
                    cmd.copy_buffer(pair[0], 0, pair[1], 0, 4 * WORDS as u64).unwrap();
                } else {
                    step(ctx, cmd, *pipeline, pair, number);
                }
            });
            expected[to] = if queue == Queue::Transfer || number % 5 == 4 {
                expected[from].clone()
            } else {
                stepped(&expected[from], number)
            };
        }
        for (buffer, expected) in buffers.iter().zip(&expected) {
            assert_eq!(read_words(ctx, **buffer, WORDS), *expected);
        }
    });
}

/// Stored to on compute, drawn to and sampled on graphics, copied on transfer and back, all mips, several rounds: an image
/// that has one owner at a time.
#[test]
fn images_go_from_queue_to_queue() {
    for_each_queue_request(|ctx| {
        let usage = TextureUsage::SAMPLED | TextureUsage::STORAGE | TextureUsage::TARGET;
        let desc =
            TextureDesc { format: Format::R32Float, extent: [4, 4], usage, mips: 2, ..Default::default() };
        let [image, copy] = [(); 2].map(|()| ctx.create_texture(&desc).unwrap());
        let store =
            Evaluator::new(ctx, "vec4(1); imageStore(kImages2D[a], ivec2(i % 4, i / 4), vec4(b + i))");
        let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(i % 4, i / 4), 0)");
        let draw = RenderPipelineDesc { color: &[Format::R32Float.into()], ..Default::default() };
        let draw = render_pipeline(ctx, COVER, PAINT, &draw);
        let ones = vec4_buffer(ctx, 16);
        let results: Vec<_> = (0..4).map(|_| vec4_buffer(ctx, 16)).collect();
        for (round, result) in results.iter().enumerate() {
            let round = round as u32;
            let stores = Dependencies { storage_images: &[*image], ..Default::default() };
            submit_on(ctx, Queue::Compute, |cmd| {
                store.record(ctx, cmd, [image.index(), 100 * round, 0], (*ones, 16), &stores);
            });
            submit_on(ctx, Queue::Graphics, |cmd| {
                let color = [ColorAttachment { mip: 1, ..ColorAttachment::clear(*image, [0.0; 4]) }];
                let mut pass =
                    cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap();
                pass.bind_render_pipeline(*draw).unwrap();
                paint(&mut pass, [round as f32, 0.0, 0.0, 0.0], 0.0).unwrap();
            });
            submit_on(ctx, Queue::Transfer, |cmd| {
                for mip in 0..2 {
                    let region = TextureRegion { mip, ..Default::default() };
                    cmd.copy_texture(*image, &region, *copy, &region).unwrap();
                }
            });
            let samples = Dependencies { sampled_images: &[*copy], ..Default::default() };
            let queue = if round.is_multiple_of(2) { Queue::Compute } else { Queue::Graphics };
            submit_on(ctx, queue, |cmd| {
                fetch.record(ctx, cmd, [copy.index(), 0, 0], (**result, 16), &samples);
            });
        }
        for (round, result) in results.iter().enumerate() {
            let found: Vec<_> = read_vec4(ctx, **result, 16).iter().map(|texel| texel[0]).collect();
            let expected: Vec<_> = (0..16).map(|i| (100 * round + i) as f32).collect();
            assert_eq!(found, expected, "round {round}");
        }
        let mip = TextureRegion { mip: 1, ..Default::default() };
        let drawn: Vec<f32> = bytemuck::pod_collect_to_vec(&ctx.download_texture(*copy, &mip).unwrap());
        assert_eq!(drawn, [3.0; 4]);
    });
}

/// Parts of one image that other queues have written, in layouts of their own, arrive together.
#[test]
fn layers_in_different_layouts_move_together() {
    for_each_queue_request(|ctx| {
        let desc = TextureDesc {
            kind: TextureKind::D2Array { layers: 3 },
            format: Format::R32Float,
            extent: [2, 2],
            usage: TextureUsage::SAMPLED | TextureUsage::STORAGE | TextureUsage::TARGET,
            ..Default::default()
        };
        let image = ctx.create_texture(&desc).unwrap();
        let layer = |layer, layers| TextureRange { base_layer: layer, layers, ..Default::default() };
        submit_on(ctx, Queue::Compute, |cmd| {
            cmd.clear_texture(*image, ClearValue::Color([1.0; 4]), &layer(0, 2)).unwrap();
        });
        submit_on(ctx, Queue::Graphics, |cmd| {
            let color = [ColorAttachment { layer: 2, ..ColorAttachment::clear(*image, [3.0; 4]) }];
            drop(cmd.begin_rendering(&RenderPassDesc { color: &color, ..Default::default() }).unwrap());
        });
        submit_on(ctx, Queue::Transfer, |cmd| {
            let region = TextureRegion { layer: 1, ..Default::default() };
            cmd.update_texture(*image, &region, bytemuck::cast_slice(&[2.0_f32; 4])).unwrap();
        });
        submit_on(ctx, Queue::Compute, |cmd| {
            let [from, to] = [2, 0].map(|layer| TextureRegion { layer, ..Default::default() });
            cmd.copy_texture(*image, &from, *image, &to).unwrap();
        });
        for (layer, value) in [(0, 3.0_f32), (1, 2.0), (2, 3.0)] {
            let region = TextureRegion { layer, ..Default::default() };
            let bytes = ctx.download_texture(*image, &region).unwrap();
            assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes), [value; 4], "layer {layer}");
        }
    });
}

/// Textures and buffers that the transfer queue brings are there for who names them, or names the submission.
#[test]
fn data_of_the_transfer_queue_is_named_or_waited_for() {
    for_each_queue_request(|ctx| {
        let fetch = Evaluator::new(ctx, "textureBindlessFetch2D(a, ivec2(i % 8, i / 8), 0)");
        for named in [true, false] {
            let desc = TextureDesc { format: Format::R32Float, extent: [8, 8], ..Default::default() };
            let texture = ctx.create_texture(&desc).unwrap();
            let texels: Vec<f32> = (0..64).map(|i| i as f32 * 0.5).collect();
            // It was made readable on the graphics queue before.
            let brought = submit_on(ctx, Queue::Transfer, |cmd| {
                let bytes = bytemuck::cast_slice(&texels);
                cmd.update_texture(*texture, &TextureRegion::default(), bytes).unwrap();
            });
            let result = vec4_buffer(ctx, 64);
            let (sampled, handle) = ([*texture], [brought]);
            let deps = match named {
                true => Dependencies { sampled_images: &sampled, ..Default::default() },
                false => Dependencies { wait_for: &handle, ..Default::default() },
            };
            submit_on(ctx, Queue::Graphics, |cmd| {
                fetch.record(ctx, cmd, [texture.index(), 0, 0], (*result, 64), &deps);
            });
            let found: Vec<_> = read_vec4(ctx, *result, 64).iter().map(|texel| texel[0]).collect();
            assert_eq!(found, texels, "named: {named}");
        }
        let pipeline = step_pipeline(ctx);
        let [from, to] = [(); 2].map(|()| words_buffer(ctx, &[0; WORDS]));
        let words: Vec<u32> = (0..WORDS as u32).collect();
        // More bytes than a command carries with it, and fewer.
        let large = vec![9_u8; 70_001];
        let desc = BufferDesc { size_bytes: 70_001, debug_name: "large", ..Default::default() };
        let target = ctx.create_buffer(&desc).unwrap();
        let brought = submit_on(ctx, Queue::Transfer, |cmd| {
            cmd.update_buffer(*from, 0, bytemuck::cast_slice(&words)).unwrap();
            cmd.update_buffer(*target, 0, &large).unwrap();
            cmd.fill_buffer(*target, 0, 4, 0).unwrap();
        });
        submit_on(ctx, Queue::Compute, |cmd| {
            let deps = Dependencies { buffers: &[*to], wait_for: &[brought], ..Default::default() };
            bare_step(ctx, cmd, *pipeline, [*from, *to], (5, &deps));
        });
        assert_eq!(read_words(ctx, *to, WORDS), stepped(&words, 5));
        let mut bytes = vec![1; 70_001];
        ctx.download_buffer(*target, 0, &mut bytes).unwrap();
        assert!(bytes[..4] == [0; 4] && bytes[4..] == large[4..]);
    });
}

/// Uploads go in front of whatever is submitted next, on whichever queue, and need not be named there.
#[test]
fn uploads_are_there_for_the_next_submission_on_any_queue() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let words: Vec<u32> = (0..WORDS as u32).map(|i| i * i).collect();
        for queue in [Queue::Compute, Queue::Graphics, Queue::Compute] {
            let [from, to] = [words_buffer(ctx, &words), words_buffer(ctx, &[1; WORDS])];
            submit_on(ctx, queue, |cmd| {
                let deps = Dependencies { buffers: &[*to], ..Default::default() };
                bare_step(ctx, cmd, *pipeline, [*from, *to], (3, &deps));
            });
            // Written again while the other queue may still read: who reads what changes names it.
            assert_eq!(read_words(ctx, *to, WORDS), stepped(&words, 3));
        }
        let [source, result] = [words_buffer(ctx, &words), words_buffer(ctx, &[0; WORDS])];
        let results: Vec<_> = (0..6).map(|_| words_buffer(ctx, &[0; WORDS])).collect();
        for (number, result) in (0..).zip(&results) {
            ctx.upload_buffer(*source, 0, bytemuck::cast_slice(&[number; WORDS])).unwrap();
            submit_on(ctx, Queue::Compute, |cmd| step(ctx, cmd, *pipeline, [*source, **result], 1));
        }
        for (number, result) in (0..).zip(&results) {
            assert_eq!(read_words(ctx, **result, WORDS), [3 * number + 1; WORDS]);
        }
        submit_on(ctx, Queue::Transfer, |cmd| cmd.copy_buffer(*source, 0, *result, 0, 256).unwrap());
        assert_eq!(read_words(ctx, *result, WORDS), [5; WORDS]);
    });
}

/// An upload goes out on the graphics queue, whichever queue the submission behind it is for: neither begins before the semaphore.
#[test]
fn foreign_semaphores_delay_uploads_on_every_queue() {
    for_each_queue_request(|ctx| {
        let device = ctx.raw_device();
        let words = words_buffer(ctx, &[1; WORDS]);
        for queue in Queue::ALL {
            submit_on(ctx, queue, |_| {});
            ctx.wait_idle().unwrap();
            let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
            let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
            // SAFETY: the device is alive, and timeline semaphores are turned on.
            let semaphore = unsafe { device.create_semaphore(&info, None) }.unwrap();
            ctx.upload_buffer(*words, 0, &[2; 4 * WORDS]).unwrap();
            let cmd = ctx.acquire_command_buffer_on(queue).unwrap();
            let wait = RawWait { semaphore, value: 1, stages: vk::PipelineStageFlags2::ALL_COMMANDS };
            // SAFETY: the semaphore is signalled below.
            let sent = unsafe { ctx.submit_with(cmd, &[wait], &[]) }.unwrap();
            let upload = ctx.flush().unwrap();
            std::thread::sleep(std::time::Duration::from_millis(50));
            let early = [upload, sent].map(|submission| ctx.is_done(submission).unwrap());
            // SAFETY: the value rises, and the GPU is done with the semaphore before it goes.
            unsafe {
                let info = vk::SemaphoreSignalInfo::default().semaphore(semaphore).value(1);
                device.signal_semaphore(&info).unwrap();
                ctx.wait_idle().unwrap();
                device.destroy_semaphore(semaphore, None);
            }
            assert_eq!(early, [false; 2], "{queue:?}");
            assert!(ctx.is_done(upload).unwrap() && ctx.is_done(sent).unwrap());
        }
    });
}

/// Structures are built on the compute queue and traced on the graphics queue, and on the compute queue again after they
/// were moved there.
fn check_structures(ctx: &TestDevice) -> lvk::Result<()> {
    let deformer = VertexDeformer::new(ctx)?;
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE;
    for method in Method::available(ctx) {
        let tracer = RayTracer::new(ctx, method)?;
        let mut scene = RayScene::single(Mesh::torus(8), Layout::Indexed16);
        let parts: &[Part] = &scene.models[0];
        let (buffers, geometries) = upload_geometries(ctx, parts)?;
        let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let (models, built) = ctx.create_blas_batch_on(Queue::Compute, std::slice::from_ref(&desc))?;
        let shown = instances(&scene.placed, &models);
        let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, flags, ..Default::default() })?;
        let rays = random_rays(5, 600, Vec3::splat(-1.5), Vec3::splat(1.5));
        let mut traces = Vec::new();
        for (number, (building, tracing)) in [
            (None, Queue::Graphics),
            (Some(Queue::Compute), Queue::Graphics),
            (Some(Queue::Graphics), Queue::Compute),
            (Some(Queue::Compute), Queue::Compute),
            (Some(Queue::Compute), Queue::Graphics),
        ]
        .into_iter()
        .enumerate()
        {
            if let Some(queue) = building {
                let (amount, mode) =
                    if number % 2 == 1 { (0.3, BuildMode::Refit) } else { (-0.2, BuildMode::Rebuild) };
                let mesh = scene.models[0][0].mesh.clone();
                let mut cmd = ctx.acquire_command_buffer_on(queue)?;
                deformer.record(&mut cmd, *buffers[0].vertices, &mesh, amount)?;
                cmd.build_blas(&[*models[0]], mode)?;
                // The top level on the other queue.
                ctx.submit(cmd)?;
                let mut cmd = ctx.acquire_command_buffer_on(tracing)?;
                cmd.update_tlas(*tlas, &shown, mode)?;
                ctx.submit(cmd)?;
                scene.models[0][0].mesh = deformed(&mesh, amount);
            }
            let trace_buffers = tracer.buffers(&rays)?;
            let mut cmd = ctx.acquire_command_buffer_on(tracing)?;
            tracer.record(&mut cmd, &tlas, &trace_buffers, How::default())?;
            ctx.submit(cmd)?;
            traces.push((trace_buffers, scene.clone()));
        }
        for (number, (trace_buffers, scene)) in traces.iter().enumerate() {
            let (records, reference) = (tracer.read(trace_buffers)?, scene.reference());
            let agreement = HitComparison::of_triangles(&rays, &records, |ray| reference.closest(ray, 0xff));
            agreement.assert(&format!("round {number} by {method:?}"));
        }
        assert!(ctx.is_done(built)?);
        assert_eq!(ctx.build_progress(&[*models[0]])?.built, 1);
    }
    Ok(())
}

#[test]
fn accel_structs_built_on_one_queue_are_traced_on_another() {
    for_each_queue_request(|ctx| check_structures(ctx).unwrap());
}

#[test]
fn accel_structs_of_software_are_built_on_one_queue_and_traced_on_another() {
    for queues in [QueueRequest::OwnHardware, QueueRequest::Emulated] {
        let software = device_with(|desc| {
            desc.queues = queues;
            desc.ray_query = RayQueryRequest::Software;
        });
        let Some(ctx) = software else { return };
        check_structures(&ctx).unwrap();
    }
}

/// Many structures, more than the scratch memory takes at once, built on both queues side by side, and compacted.
#[test]
fn batches_of_accel_structs_are_built_on_two_queues_at_once() {
    for_each_queue_request(|ctx| {
        let scene = RayScene::single(Mesh::sphere(6), Layout::Indexed16);
        let (_buffers, geometries) = upload_geometries(ctx, &scene.models[0]).unwrap();
        let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
        let desc = BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let descs = vec![desc; 24];
        let (async_models, built) = ctx.create_blas_batch_on(Queue::Compute, &descs).unwrap();
        let models = ctx.create_blas_batch(&descs).unwrap();
        let handles: Vec<_> = async_models.iter().chain(&models).map(|model| **model).collect();
        ctx.compact(&handles).unwrap();
        for _ in 0..4 {
            ctx.next_frame().unwrap();
            ctx.flush().unwrap();
        }
        ctx.wait(built).unwrap();
        ctx.wait_idle().unwrap();
        assert_eq!(ctx.build_progress(&handles).unwrap().built, 48);
    });
}

/// Three threads, a queue each, with buffers of their own, one that all read, and objects that come and go.
#[test]
fn threads_submit_to_several_queues_at_once() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let shared: Vec<u32> = (0..WORDS as u32).map(|i| i + 1).collect();
        let source = words_buffer(ctx, &shared);
        let run = |queue: Queue| {
            let own = words_buffer(ctx, &[0; WORDS]);
            let mut expected = vec![0; WORDS];
            for number in 0..12 {
                let passing = words_buffer(ctx, &[number; WORDS]);
                submit_on(ctx, queue, |cmd| {
                    if queue == Queue::Transfer {
                        cmd.copy_buffer(*source, 0, *passing, 0, 256).unwrap();
                        cmd.copy_buffer(*passing, 0, *own, 0, 256).unwrap();
                    } else {
                        step(ctx, cmd, *pipeline, [*source, *passing], number);
                        step(ctx, cmd, *pipeline, [*passing, *own], number);
                    }
                });
                expected = match queue {
                    Queue::Transfer => shared.clone(),
                    _ => stepped(&stepped(&shared, number), number),
                };
            }
            assert_eq!(read_words(ctx, *own, WORDS), expected, "{queue:?}");
        };
        std::thread::scope(|scope| {
            for queue in Queue::ALL {
                scope.spawn(move || run(queue));
            }
        });
        ctx.wait_idle().unwrap();
        assert_eq!(lvk::test_hooks::waiting_objects(ctx).unwrap(), 0, "garbage of some queue is kept");
    });
}

/// An object that one queue still uses stays alive although another queue is idle, and every object is freed in the
/// end.
#[test]
fn destroyed_objects_live_until_every_queue_is_done() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        for number in 0..20 {
            let [a, b, c] = [(); 3].map(|()| words_buffer(ctx, &[number; WORDS]));
            submit_on(ctx, Queue::Compute, |cmd| step(ctx, cmd, *pipeline, [*a, *b], 1));
            submit_on(ctx, Queue::Transfer, |cmd| cmd.copy_buffer(*b, 0, *c, 0, 256).unwrap());
            if number % 3 == 0 {
                ctx.wait(submit_on(ctx, Queue::Graphics, |_| {})).unwrap();
            }
        }
        ctx.wait_idle().unwrap();
        assert_eq!(lvk::test_hooks::waiting_objects(ctx).unwrap(), 0);
    });
}

#[test]
fn frames_wait_for_all_queues_but_not_for_the_background() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let [a, b] = [(); 2].map(|()| words_buffer(ctx, &[2; WORDS]));
        let mut frames: Vec<SubmitHandle> = Vec::new();
        for number in 0..6_usize {
            ctx.next_frame().unwrap();
            if number >= ctx.frames_in_flight() {
                assert!(ctx.is_done(frames[number - ctx.frames_in_flight()]).unwrap());
            }
            frames.push(submit_on(ctx, Queue::Compute, |cmd| step(ctx, cmd, *pipeline, [*a, *b], 1)));
            let mut cmd = ctx.acquire_command_buffer_on(Queue::Transfer).unwrap();
            cmd.fill_buffer(*a, 0, 256, number as u32).unwrap();
            ctx.submit_in_background(cmd).unwrap();
        }
        assert_eq!(read_words(ctx, *a, WORDS), [5; WORDS]);
        assert_eq!(read_words(ctx, *b, WORDS), [3 * 4 + 1; WORDS]);
    });
}

/// Readbacks come after what other queues have written, and mapped memory shows it.
#[test]
fn the_host_reads_what_any_queue_wrote() {
    for_each_queue_request(|ctx| {
        let pipeline = step_pipeline(ctx);
        let source = words_buffer(ctx, &[4; WORDS]);
        for memory in [MemoryKind::Device, MemoryKind::Readback, MemoryKind::HostVisible] {
            let target = BufferDesc { size_bytes: 256, memory, ..Default::default() };
            let target = ctx.create_buffer(&target).unwrap();
            let done = submit_on(ctx, Queue::Compute, |cmd| step(ctx, cmd, *pipeline, [*source, *target], 2));
            let later = ctx.read_buffer_later(*target, 0..256).unwrap();
            assert!(later.submission() > done);
            submit_on(ctx, Queue::Compute, |cmd| step(ctx, cmd, *pipeline, [*source, *target], 3));
            assert_eq!(later.wait().unwrap(), bytemuck::cast_slice::<u32, u8>(&[14; WORDS]));
            assert!(ctx.is_done(done).unwrap());
            assert_eq!(read_words(ctx, *target, WORDS), [15; WORDS], "{memory:?}");
        }
    });
}

/// A frame loop as programs have it: compute prepares the next image while graphics draws the last.
#[test]
fn a_loop_of_frames_alternates_between_two_images() {
    for_each_queue_request(|ctx| {
        let usage = TextureUsage::STORAGE | TextureUsage::SAMPLED;
        let desc = TextureDesc { format: Format::R32Float, extent: [4, 4], usage, ..Default::default() };
        let prepared: [Holder<TextureHandle>; 2] = [(); 2].map(|()| ctx.create_texture(&desc).unwrap());
        let target = TextureDesc { usage: TextureUsage::TARGET | TextureUsage::SAMPLED, ..desc };
        let target = ctx.create_texture(&target).unwrap();
        let store = Evaluator::new(ctx, "vec4(1); imageStore(kImages2D[a], ivec2(i % 4, i / 4), vec4(b))");
        let ones = vec4_buffer(ctx, 16);
        let show = "
            layout(push_constant, scalar) uniform Push { vec4 color; float depth; };
            layout(location = 0) out vec4 result;
            void main() { result = color + textureBindlessFetch2D(floatBitsToUint(depth), ivec2(gl_FragCoord.xy), 0); }";
        let draw = RenderPipelineDesc { color: &[Format::R32Float.into()], ..Default::default() };
        let cover = COVER.replace("corner * 4.0 - 1.0, depth, 1.0", "corner * 4.0 - 1.0, 0.0, 1.0");
        let draw = render_pipeline(ctx, &cover, show, &draw);
        for number in 0..8_u32 {
            ctx.next_frame().unwrap();
            let image = &prepared[number as usize % 2];
            let deps = Dependencies { storage_images: &[**image], ..Default::default() };
            submit_on(ctx, Queue::Compute, |cmd| {
                store.record(ctx, cmd, [image.index(), number * 10, 0], (*ones, 16), &deps);
            });
            submit_on(ctx, Queue::Graphics, |cmd| {
                let color = [ColorAttachment::clear(*target, [0.0; 4])];
                let dependencies = Dependencies { sampled_images: &[**image], ..Default::default() };
                let desc = RenderPassDesc { color: &color, dependencies, ..Default::default() };
                let mut pass = cmd.begin_rendering(&desc).unwrap();
                pass.bind_render_pipeline(*draw).unwrap();
                paint(&mut pass, [1.0, 0.0, 0.0, 0.0], f32::from_bits(image.index())).unwrap();
            });
            if number % 3 == 1 {
                assert_eq!(pixels::<f32>(ctx, *target), [number as f32 * 10.0 + 1.0; 16]);
            }
        }
        assert_eq!(pixels::<f32>(ctx, *target), [71.0; 16]);
    });
}
