//! Rays a second through each shipped lens, on one thread: `cargo bench --bench lens`.
//!
//! Film points are even over the film, rays are aimed at the exit pupil, and go in bundles, as in
//! a picture. The share that gets through is in each name: "55 rays a second, of which half are
//! lost" is another lens than one that loses none.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use ivcam::lens::{Bundle, LANES, Lens, LensRay, PupilTarget, shipped_names};
use ivcam::sampling::{DiscMap, Sampler, SamplerKind};
use std::hint::black_box;
use std::time::Duration;

/// Bundles a round: enough to see the whole film.
const BUNDLES: u32 = 128;

/// Rays into a lens at full aperture, and the share of them that gets through.
fn rays(lens: &Lens) -> Option<(Vec<Bundle>, f64)> {
    let focal = lens.first_order().focal?;
    let film_z = lens
        .best_focus(f64::INFINITY)
        .unwrap_or(focal.rear_focal_point);
    let film_radius = lens
        .prescription()
        .image_height
        .unwrap_or(0.4 * focal.efl.abs());
    let target = PupilTarget::exit_pupil(lens, film_z, film_radius);
    let sampler = Sampler {
        kind: SamplerKind::Sobol,
        samples: BUNDLES * LANES as u32,
        seed: 1,
    };
    let ray = |index: u32| {
        let at = sampler.sample(0, index);
        let film = film_radius * DVec2::from_array(DiscMap::Concentric.point(at.film));
        let window = target.window(film);
        let aim = window.point(at.pupil[0], at.pupil[1]);
        let origin = film.extend(film_z);
        let direction = (aim.extend(lens.length()) - origin).normalize();
        (!window.is_closed()).then_some(LensRay { origin, direction })
    };
    let all: Vec<LensRay> = (0..BUNDLES * LANES as u32).filter_map(ray).collect();
    let passed = all.iter().filter(|ray| lens.trace_from_film(ray).is_ok());
    let share = passed.count() as f64 / all.len() as f64;
    let bundles = all.chunks_exact(LANES).map(|rays| {
        let mut bundle = Bundle::default();
        for (lane, ray) in rays.iter().enumerate() {
            bundle.set(lane, ray);
        }
        bundle
    });
    Some((bundles.collect(), share))
}

fn through_each_lens(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("rays");
    group.sample_size(10);
    group.warm_up_time(Duration::from_millis(100));
    group.measurement_time(Duration::from_millis(300));
    for name in shipped_names() {
        let lens = Lens::named(name).expect("it is shipped");
        let Some((bundles, share)) = rays(&lens) else {
            continue;
        };
        group.throughput(Throughput::Elements((bundles.len() * LANES) as u64));
        let surfaces = lens.prescription().surfaces.len();
        let title = format!("{name}, {surfaces} surfaces, {:.1} % pass", 100.0 * share);
        group.bench_function(title, |bencher| {
            bencher.iter(|| {
                for bundle in &bundles {
                    let mut bundle = bundle.clone();
                    lens.trace_bundle_from_film(&mut bundle);
                    black_box(&bundle);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, through_each_lens);
criterion_main!(benches);
