//! TLAS builds on the GPU, from instance descriptors that name BLASes by address or by number.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use lvk::glam::{Affine3A, EulerRot, Mat3, Quat, Vec3};
use lvk::test_hooks::{CheckBounds, EMPTY, GpuStructure, build_tlas, check_structure, read};
use lvk::transform_rows;
use lvk_tests::gpu_built::{
    build, build_input_buffer, check_and_summarize, scattered_triangles, triangle_geometry,
};
use lvk_tests::random::Random;
use lvk_tests::{TestDevice, device};

/// A record as Vulkan has it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Record {
    rows: [f32; 12],
    custom_index_and_mask: u32,
    offset_and_flags: u32,
    structure: u64,
}

/// BLAS for a TLAS to reference, with their bounds.
struct TestBlases {
    structures: Vec<(GpuStructure, CheckBounds)>,
}

impl TestBlases {
    fn new(ctx: &TestDevice) -> Self {
        let one = |count: usize| {
            let vertices = build_input_buffer(ctx, &scattered_triangles(count, count as u64));
            let structure = build(ctx, &[triangle_geometry(*vertices, count)]);
            let bounds = check_and_summarize(ctx, &structure).bounds;
            (structure, bounds)
        };
        // The last is empty.
        Self { structures: [5, 100, 3000, 0].map(one).into_iter().collect() }
    }

    fn records(&self, count: usize, by_place: bool) -> Vec<Record> {
        let mut random = Random::new(count as u64);
        (0..count)
            .map(|i| {
                let place = i % self.structures.len();
                let spin = [(); 3].map(|()| random.between(-3.0, 3.0));
                let scale = [(); 3].map(|()| random.between(-2.0, 2.0));
                let shift = [(); 3].map(|()| random.between(-5000.0, 5000.0));
                let turn = Mat3::from_quat(Quat::from_euler(EulerRot::XYZ, spin[0], spin[1], spin[2]));
                let matrix = turn * Mat3::from_diagonal(Vec3::from(scale));
                let transform = Affine3A::from_mat3_translation(matrix, Vec3::from(shift));
                let address = self.structures[place].0.address;
                Record {
                    rows: transform_rows(&transform),
                    custom_index_and_mask: i as u32 | 0xff00_0000,
                    offset_and_flags: 3 | (i as u32 % 4) << 24,
                    structure: if by_place { place as u64 } else { address },
                }
            })
            .collect()
    }

    /// Returns the least bounds of an instance, in 64 bits.
    fn world(&self, record: &Record, place: usize) -> Option<CheckBounds> {
        let local = self.structures[place].1;
        let m = record.rows.map(f64::from);
        let determinant = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8])
            + m[2] * (m[4] * m[9] - m[5] * m[8]);
        let alive =
            record.custom_index_and_mask >> 24 != 0 && determinant != 0.0 && local[0][0] <= local[1][0];
        alive.then(|| {
            let mut bounds = EMPTY;
            for corner in 0..8 {
                let p: [f64; 3] = std::array::from_fn(|axis| f64::from(local[corner >> axis & 1][axis]));
                for row in 0..3 {
                    let r = &m[row * 4..row * 4 + 4];
                    let world = r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3];
                    bounds[0][row] = bounds[0][row].min(world as f32);
                    bounds[1][row] = bounds[1][row].max(world as f32);
                }
            }
            bounds
        })
    }

    fn check(&self, ctx: &TestDevice, tlas: &GpuStructure, records: &[Record]) {
        let words = read(ctx, tlas).unwrap();
        let place = |i: usize| i % self.structures.len();
        let worlds: Vec<_> =
            records.iter().enumerate().map(|(i, record)| self.world(record, place(i))).collect();
        let facts =
            check_structure(&words, &|i| worlds[i as usize].unwrap()).unwrap_or_else(|what| panic!("{what}"));
        let mut found: Vec<_> = facts.primitives.iter().map(|(_, number)| *number as usize).collect();
        found.sort_unstable();
        let expected: Vec<_> = (0..records.len()).filter(|i| worlds[*i].is_some()).collect();
        assert_eq!(found, expected);
        assert!(facts.height <= tlas.most_height);
        for i in found {
            self.check_instance(&words[words[5] as usize * 4 + i * 32..][..32], &records[i], place(i));
        }
    }

    fn check_instance(&self, kept: &[u32], record: &Record, place: usize) {
        let numbers: Vec<f32> = kept[..24].iter().map(|word| f32::from_bits(*word)).collect();
        assert_eq!(numbers[12..], record.rows);
        let affine = |rows: &[f32]| {
            let column = |k: usize| Vec3::new(rows[k], rows[4 + k], rows[8 + k]);
            Affine3A::from_mat3_translation(Mat3::from_cols(column(0), column(1), column(2)), column(3))
        };
        let expected = transform_rows(&affine(&numbers[12..]).inverse());
        for (axis, (found, expected)) in numbers[..12].iter().zip(expected).enumerate() {
            let row = &numbers[axis / 4 * 4..][..4];
            let largest = |list: &[f32]| list.iter().fold(0.0_f32, |most, number| most.max(number.abs()));
            let moved = largest(&row[..3]) * largest(&[numbers[15], numbers[19], numbers[23]]);
            assert!((found - expected).abs() <= 1e-4 * largest(row) + 1e-5 * moved, "{found} {expected}");
        }
        assert_eq!(u64::from(kept[24]) | u64::from(kept[25]) << 32, self.structures[place].0.address);
        assert_eq!(kept[26..28], [record.custom_index_and_mask, record.offset_and_flags]);
    }
}

#[test]
fn every_instance_is_in_one_leaf() {
    let Some(ctx) = device() else { return };
    let blases = TestBlases::new(&ctx);
    let addresses: Vec<u64> = blases.structures.iter().map(|(structure, _)| structure.address).collect();
    let table = build_input_buffer(&ctx, &addresses);
    for (count, capacity) in
        [(0, 0), (0, 10), (1, 1), (2, 5), (3, 3), (100, 100), (2048, 2048), (2049, 4000), (10_000, 10_000)]
    {
        for by_place in [false, true] {
            let records = blases.records(count, by_place);
            let buffer = build_input_buffer(&ctx, &records);
            let table = by_place.then_some((*table, addresses.len() as u32));
            let tlas = build_tlas(&ctx, *buffer, count as u32, capacity, table).unwrap();
            blases.check(&ctx, &tlas, &records);
        }
    }
}

#[test]
fn instances_that_no_ray_meets_are_left_out() {
    let Some(ctx) = device() else { return };
    let blases = TestBlases::new(&ctx);
    for count in [40, 4000] {
        let mut records = blases.records(count, false);
        for (i, record) in records.iter_mut().enumerate() {
            match i % 7 {
                0 => record.custom_index_and_mask &= 0x00ff_ffff,
                1 => record.rows[8..11].fill(0.0),
                _ => {}
            }
        }
        let buffer = build_input_buffer(&ctx, &records);
        let tlas = build_tlas(&ctx, *buffer, count as u32, count as u32, None).unwrap();
        blases.check(&ctx, &tlas, &records);
    }
}

/// Areas of their unions exceed the largest float, and a side that is infinite times one that is 0 is no number.
#[test]
fn instances_that_are_farther_away_than_areas_have_numbers_are_each_in_one_leaf() {
    let Some(ctx) = device() else { return };
    let blases = TestBlases::new(&ctx);
    for count in [2, 3, 31, 32, 33, 100, 5000] {
        for every in [1, 2, 7] {
            let mut records = blases.records(count, false);
            for (i, record) in records.iter_mut().enumerate().filter(|(i, _)| i % every == 0) {
                let far = [1e17, 1e20, 1e30, 1e35][i / 4 % 4];
                for (row, share) in [(3, 1.0), (7, [1.0, -1.0][i % 2]), (11, [0.0, 1.0, -1.0][i % 3])] {
                    record.rows[row] = share * far;
                }
            }
            let buffer = build_input_buffer(&ctx, &records);
            let tlas = build_tlas(&ctx, *buffer, count as u32, count as u32, None).unwrap();
            let words = read(&ctx, &tlas).unwrap();
            let facts = check_structure(&words, &|_| EMPTY).unwrap_or_else(|what| panic!("{count}: {what}"));
            let mut found: Vec<_> = facts.primitives.iter().map(|(_, number)| *number as usize).collect();
            found.sort_unstable();
            let expected: Vec<_> = (0..count).filter(|i| i % blases.structures.len() != 3).collect();
            assert_eq!(found, expected, "{count} instances, one of {every} far away");
        }
    }
}

#[test]
fn blas_numbers_out_of_range_are_left_out() {
    let Some(ctx) = device() else { return };
    let blases = TestBlases::new(&ctx);
    let table = build_input_buffer(&ctx, &[blases.structures[0].0.address, 0]);
    let mut records = blases.records(1, true).repeat(5);
    for (record, place) in records.iter_mut().zip([2, 1, 0, u64::from(u32::MAX), 1 << 32]) {
        record.structure = place;
    }
    let buffer = build_input_buffer(&ctx, &records);
    let tlas = build_tlas(&ctx, *buffer, 5, 5, Some((*table, 2))).unwrap();
    let words = read(&ctx, &tlas).unwrap();
    assert_eq!((words[2], words[3]), (1 << 31 | 2, 1));
}

#[test]
fn a_tlas_of_nothing_is_empty() {
    let Some(ctx) = device() else { return };
    let blases = TestBlases::new(&ctx);
    let mut records = blases.records(3000, false);
    records.iter_mut().for_each(|record| record.structure = 0);
    let buffer = build_input_buffer(&ctx, &records);
    let words = read(&ctx, &build_tlas(&ctx, *buffer, 3000, 3000, None).unwrap()).unwrap();
    assert_eq!((words[2], words[3], words[8]), (u32::MAX, 0, 0));
    assert!(f32::from_bits(words[12]) > f32::from_bits(words[15]));
}
