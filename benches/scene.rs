//! Trees of triangles and whole pictures: `cargo bench --bench scene`.
//!
//! Meshes of ten thousand and a million triangles; with `IVCAM_BENCH_LARGE=1` ten million too.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ivcam::film::Resolution;
use ivcam::photo::{CameraChoice, Era, LensChoice, Optics, Plan, Session};
use ivcam::sampling::Sampler;

#[path = "../examples/shared/mesh.rs"]
mod mesh;

fn sizes() -> Vec<usize> {
    let large = std::env::var_os("IVCAM_BENCH_LARGE").is_some();
    let mut sizes = vec![10_000, 1_000_000];
    sizes.extend(large.then_some(10_000_000));
    sizes
}

fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for size in sizes() {
        let triangles = mesh::ball(size);
        group.throughput(Throughput::Elements(triangles.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(size), |b| {
            b.iter(|| black_box(mesh::tree(&triangles)));
        });
    }
}

fn rays(c: &mut Criterion) {
    let mut group = c.benchmark_group("rays");
    group.sample_size(20);
    for size in sizes() {
        let tree = mesh::tree(&mesh::ball(size));
        for rays in mesh::rays(&tree) {
            group.throughput(Throughput::Elements(rays.rays.len() as u64));
            let name = |how: &str| BenchmarkId::new(format!("{} {how}", rays.name), size);
            group.bench_function(name("single"), |b| {
                b.iter(|| black_box(mesh::one_by_one(&tree, &rays)));
            });
            group.bench_function(name("packets"), |b| {
                b.iter(|| black_box(mesh::in_packets(&tree, &rays)));
            });
        }
    }
}

/// The living room at 90x60, 4 samples a pixel, on the threads that rayon takes.
fn picture(c: &mut Criterion) {
    let mut plan = Plan::of_era(Era::Modern, "scenes/livroom/livroom.iv");
    plan.camera = Some(CameraChoice::File("camera/cam-1.dat".into()));
    let mut lens = LensChoice::named("wide-angle");
    lens.efl = Some(ivcam::math::Mm(20.0));
    plan.optics = Optics::Lens(lens);
    plan.resolution = Resolution {
        width: 90,
        height: 60,
    };
    plan.sampler = Sampler {
        samples: 4,
        ..plan.sampler
    };
    plan.stop = ivcam::render::Stop::after(4);
    let session = match Session::open(plan) {
        Ok(session) => session,
        Err(error) => return eprintln!("{}", error.message),
    };
    let mut group = c.benchmark_group("picture");
    group.sample_size(10);
    group.throughput(Throughput::Elements(90 * 60 * 4));
    group.bench_function("living room", |b| {
        b.iter(|| black_box(session.expose(&|_| ())));
    });
}

criterion_group!(benches, build, rays, picture);
criterion_main!(benches);
