//! Measures speed and writes the tables of docs/performance.md.
//!
//! `cargo run --release --example speed -- [--out FILE.md] [--large] [--only NAME]`; with
//! `--large` also a mesh of ten million triangles. Times are of the processor, not of the clock,
//! so that a machine that does other things too gives the same numbers, but for its caches.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use glam::DVec3;

use ivcam::camera::Aim;
use ivcam::film::Resolution;
use ivcam::lens::{Bundle, LANES, Lens, LensRay, PupilTarget, Toward};
use ivcam::math::lanes::Width;
use ivcam::plan::{Era, LensChoice, Optics, Plan, Session};
use ivcam::render::Stop;
use ivcam::sampling::{DiscMap, Sampler, SamplerKind};
use ivcam::scene::wide::Wide;
use ivcam::shade::Shading;

#[path = "shared/mesh.rs"]
mod mesh;

/// A part of the tables, by name.
type Part<'a> = (&'a str, &'a dyn Fn(&mut String));

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let large = words.iter().any(|w| w == "--large");
    let out = words
        .iter()
        .position(|w| w == "--out")
        .and_then(|i| words.get(i + 1));
    let mut report = String::from("# Performance\n\n");
    let _ = writeln!(
        report,
        "Written by `cargo run --release --example speed -- --out docs/performance.md`. {}.\n\
         Seconds are of one processor (user time) unless said otherwise; the machine did other\n\
         work at the same time, which slows memory and caches but not this clock.\n",
        machine()
    );
    let only = words
        .iter()
        .position(|w| w == "--only")
        .and_then(|i| words.get(i + 1));
    let parts: [Part; 5] = [
        ("lenses", &lenses),
        ("meshes", &|report| meshes(report, large)),
        ("pictures", &pictures),
        ("dispersion", &dispersion),
        ("growth", &growth),
    ];
    for (name, part) in parts {
        if only.is_none_or(|o| o == name) {
            part(&mut report);
        }
    }
    print!("{report}");
    if let Some(file) = out
        && let Err(error) = std::fs::write(Path::new(file), &report)
    {
        eprintln!("{file}: {error}");
    }
}

/// What the machine calls itself.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|l| l.strip_prefix("model name"));
    let name = name.map_or("unknown processor", |n| {
        n.trim_start_matches([' ', '\t', ':'])
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores, lanes {:?}", Width::detect())
}

/// Seconds that this thread has run, of the clock where the system does not tell.
fn thread_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.map_or_else(
        || {
            let since = std::time::SystemTime::UNIX_EPOCH.elapsed();
            since.unwrap_or_default().as_secs_f64()
        },
        |n| n * 1e-9,
    )
}

/// Seconds for one call: the least of several rounds of at least 20 ms.
fn time(mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = thread_seconds();
        let mut calls = 0;
        let clock = Instant::now();
        while clock.elapsed() < Duration::from_millis(20) {
            work();
            calls += 1;
        }
        best = best.min((thread_seconds() - start) / f64::from(calls));
    }
    best
}

fn lenses(report: &mut String) {
    report.push_str(
        "## Lenses\n\nNanoseconds a ray that gets through or not, 36x24 mm of film, focused at 5 m, \
         aimed at the exit pupil; 4096 rays. `pupil` is the set-up of its table.\n\n\
         | lens | surfaces | one by one | SSE2 | AVX2 | AVX-512 | through | pupil, ms |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for name in ivcam::lens::shipped_names() {
        let Ok(lens) = Lens::named(name) else {
            continue;
        };
        let method = ivcam::lens::FocusMethod::Film;
        let Ok(focus) = lens.focus(method, ivcam::math::Meters(5.0)) else {
            continue;
        };
        let pupil = |()| PupilTarget::exit_pupil(&lens, focus.film_z, 21.6);
        let start = thread_seconds();
        let target = pupil(());
        let set_up = thread_seconds() - start;
        let rays = rays_of(&lens, &target, focus.film_z);
        let through = rays
            .iter()
            .filter(|r| lens.trace_from_film(r).is_ok())
            .count();
        let single = time(|| {
            for ray in &rays {
                let _ = black_box(lens.trace_from_film(ray));
            }
        }) / rays.len() as f64;
        let _ = write!(
            report,
            "| {name} | {} | {:.1}",
            lens.prescription().surfaces.len(),
            1e9 * single
        );
        for width in widths() {
            let _ = write!(report, " | {:.1}", 1e9 * in_lanes(&lens, &rays, width));
        }
        let share = 100.0 * through as f64 / rays.len() as f64;
        let _ = writeln!(report, " | {share:.1}% | {:.1} |", 1e3 * set_up);
    }
    report.push('\n');
}

#[cfg(target_arch = "x86_64")]
fn widths() -> [Width; 3] {
    [Width::Plain, Width::Avx2, Width::Avx512]
}

#[cfg(not(target_arch = "x86_64"))]
fn widths() -> [Width; 1] {
    [Width::Plain]
}

fn rays_of(lens: &Lens, target: &PupilTarget, film_z: f64) -> Vec<LensRay> {
    let sampler = Sampler {
        kind: SamplerKind::Sobol,
        samples: 4096,
        seed: 1,
    };
    (0..4096)
        .filter_map(|i| {
            let at = sampler.sample(0, i);
            let film = glam::DVec2::new(36.0 * (at.film[0] - 0.5), 24.0 * (at.film[1] - 0.5));
            // Where the film sees nothing no ray is sent.
            let window = target.window(film);
            let aim = (window.density() > 0.0).then(|| window.point(at.pupil[0], at.pupil[1]))?;
            let origin = film.extend(film_z);
            Some(LensRay {
                origin,
                direction: (aim.extend(lens.length()) - origin).normalize_or(DVec3::NEG_Z),
            })
        })
        .collect()
}

/// Seconds a ray, filling and reading the bundles not counted.
fn in_lanes(lens: &Lens, rays: &[LensRay], width: Width) -> f64 {
    let bundles: Vec<Bundle> = rays
        .chunks(LANES)
        .map(|rays| {
            let mut bundle = Bundle::default();
            let lanes = rays.iter().enumerate();
            lanes.for_each(|(lane, ray)| bundle.set(lane, ray));
            bundle
        })
        .collect();
    let copy = time(|| {
        for bundle in &bundles {
            black_box(bundle.clone());
        }
    });
    let both = time(|| {
        for bundle in &bundles {
            let mut bundle = bundle.clone();
            lens.trace_bundle(&mut bundle, Toward::Scene, width);
            black_box(&bundle);
        }
    });
    (both - copy) / rays.len() as f64
}

fn meshes(report: &mut String, large: bool) {
    report.push_str(
        "## Triangles\n\nA bumpy ball. Millions of rays a second, one thread, one by one / in packets of 16: \
         from a point outside (rows of a picture), from there to a light, and from points on the \
         ball in any direction. Memory is the tree's, with its triangles.\n\n\
         | triangles | build, s | primary | shadow | incoherent | MB |\n|---|---|---|---|---|---|\n",
    );
    let mut points = Vec::new();
    let sizes = [10_000, 100_000, 1_000_000, 10_000_000];
    for count in sizes.iter().take(if large { 4 } else { 3 }) {
        let triangles = mesh::ball(*count);
        let start = thread_seconds();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .use_current_thread();
        let tree = match &pool.build() {
            Ok(pool) => pool.install(|| mesh::tree(&triangles)),
            Err(_) => mesh::tree(&triangles),
        };
        let seconds = thread_seconds() - start;
        let sets = mesh::rays(&tree);
        let of = |name: &str| {
            let set = sets.iter().find(|set| set.name == name);
            set.map_or([f64::NAN; 2], |set| rates(&tree, set))
        };
        let [primary, shadow, incoherent] = ["primary", "shadow", "incoherent"].map(of);
        points.push(((triangles.len() as f64).ln(), -primary[1].ln()));
        let two = |[a, b]: [f64; 2]| format!("{:.2} / {:.2}", 1e-6 * a, 1e-6 * b);
        let _ = writeln!(
            report,
            "| {} | {seconds:.2} | {} | {} | {} | {:.0} |",
            triangles.len(),
            two(primary),
            two(shadow),
            two(incoherent),
            tree.bytes() as f64 / 1e6
        );
    }
    let _ = writeln!(
        report,
        "\nTime of a primary ray in packets grows as triangles^{:.2}.\n",
        slope(&points)
    );
}

/// Rays a second, one by one and in packets.
fn rates(tree: &Wide, rays: &mesh::Rays) -> [f64; 2] {
    let rate = |work: &dyn Fn() -> usize| {
        let mut found = 0;
        let seconds = time(|| found += work());
        black_box(found);
        rays.rays.len() as f64 / seconds
    };
    [
        rate(&|| mesh::one_by_one(tree, rays)),
        rate(&|| mesh::in_packets(tree, rays)),
    ]
}

fn living_room() -> Plan {
    let mut plan = Plan::of_era(Era::Modern, "scenes/livroom/livroom.iv");
    plan.camera = Some("camera/cam-1.dat".into());
    plan.focus = Some(ivcam::math::Meters(1.2));
    let mut lens = LensChoice::named("wide-angle");
    lens.efl = Some(ivcam::math::Mm(20.0));
    plan.optics = Optics::Lens(lens);
    plan.resolution = Resolution {
        width: 360,
        height: 240,
    };
    plan
}

/// Renders on this thread: seconds of rendering, rays, and the error.
fn render(session: &Session, samples: u32) -> (f64, ivcam::render::Exposure) {
    let sampler = Sampler {
        samples,
        ..session.plan.sampler
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread();
    let expose = || {
        let start = thread_seconds();
        let made = session.expose_with(sampler, Stop::after(samples), &|_| ());
        (thread_seconds() - start, made)
    };
    match pool.build() {
        Ok(pool) => pool.install(expose),
        Err(_) => expose(),
    }
}

fn pictures(report: &mut String) {
    report.push_str(
        "## Pictures\n\nThe living room at 360x240, 16 samples a pixel, one thread. Compile is \
         everything from the file's nodes to the tree; left out is what the shading did not \
         need.\n\n\
         | shading | optics | compile, s | render, s | film rays | scene rays | shadow rays | relRMSE | left out |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let mut cases: Vec<(Plan, &str)> = Vec::new();
    for shading in Shading::ALL {
        let mut plan = living_room();
        plan.shading = shading;
        cases.push((plan, "wide-angle"));
    }
    let mut plan = living_room();
    plan.optics = Optics::Pinhole;
    cases.push((plan, "pinhole"));
    let mut plan = living_room();
    plan.sampler.kind = SamplerKind::Jittered;
    plan.aim = Aim::RearElement(DiscMap::Polar);
    cases.push((plan, "wide-angle, 1999's samples and pupil"));
    for (plan, optics) in cases {
        let shading = plan.shading.name();
        let session = match Session::open(plan) {
            Ok(session) => session,
            Err(error) => {
                eprintln!("{}", error.message);
                return;
            }
        };
        let (seconds, made) = render(&session, 16);
        let c = made.counts;
        let _ = writeln!(
            report,
            "| {shading} | {optics} | {:.2} | {seconds:.2} | {} | {} | {} | {:.2e} | {} |",
            session.seconds.compile,
            c.film_rays,
            c.scene_rays,
            c.shadow_rays,
            made.film.relative_rmse().unwrap_or(f64::NAN),
            session.report(&made).left_out.join(", ")
        );
    }
    report.push('\n');
}

/// One wavelength against the wavelengths of a hero set: what a picture costs at the same number
/// of samples, and at the same error.
fn dispersion(report: &mut String) {
    report.push_str(
        "## Dispersion\n\nThe living room at 360x240 through a Flektogon of 20 mm, Phong and \
         recursive, one thread. Time to 3% is seconds times the square of the error over 3%.\n\n\
         | shading | dispersion | samples | render, s | film rays | scene rays | relRMSE | to 3%, s |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for shading in [Shading::Phong, Shading::Recursive] {
        for dispersion in [false, true] {
            let mut plan = living_room();
            let mut lens = LensChoice::named("flektogon");
            lens.efl = Some(ivcam::math::Mm(20.0));
            plan.optics = Optics::Lens(lens);
            (plan.shading, plan.dispersion) = (shading, dispersion);
            let session = match Session::open(plan) {
                Ok(session) => session,
                Err(error) => return eprintln!("{}", error.message),
            };
            for samples in [4, 16] {
                let (seconds, made) = render(&session, samples);
                let error = made.film.relative_rmse().unwrap_or(f64::NAN);
                let _ = writeln!(
                    report,
                    "| {} | {} | {samples} | {seconds:.2} | {} | {} | {error:.2e} | {:.1} |",
                    shading.name(),
                    if dispersion { "on" } else { "off" },
                    made.counts.film_rays,
                    made.counts.scene_rays,
                    seconds * (error / 0.03) * (error / 0.03)
                );
            }
        }
    }
    report.push('\n');
}

fn growth(report: &mut String) {
    report.push_str(
        "## Growth\n\nThe living room, Phong, one thread: slopes of log time over log number.\n\n",
    );
    let mut by_samples = Vec::new();
    let mut by_pixels = Vec::new();
    let mut plan = living_room();
    plan.shading = Shading::Phong;
    for (width, height) in [(90, 60), (180, 120), (360, 240)] {
        plan.resolution = Resolution { width, height };
        let Ok(session) = Session::open(plan.clone()) else {
            return;
        };
        let (seconds, _) = render(&session, 16);
        by_pixels.push((f64::from(width * height).ln(), seconds.ln()));
        if width == 180 {
            for samples in [4, 8, 16, 32, 64] {
                let (seconds, _) = render(&session, samples);
                by_samples.push((f64::from(samples).ln(), seconds.ln()));
            }
        }
    }
    let _ = writeln!(
        report,
        "* samples, 4 to 64: {:.2}\n* pixels, 90x60 to 360x240: {:.2}",
        slope(&by_samples),
        slope(&by_pixels)
    );
}

/// Least squares through (x, y).
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let over = mean(&|p| (p.0 - x) * (p.1 - y));
    over / mean(&|p| (p.0 - x) * (p.0 - x))
}
