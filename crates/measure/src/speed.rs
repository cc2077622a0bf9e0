//! Measures speed and writes the tables of docs/performance.md.
//!
//! `cargo run --release -p measure -- speed -- [--out FILE.md] [--only NAME]
//! [--large] [--room SCENE.iv] [--peer COMMAND] [--embree LIBRARY] [--tinybvh LIBRARY]`
//!
//! In FILE, the tables between lines `<!-- speed: NAME -->` and `<!-- end -->` are replaced.
//! `--large` adds a mesh of ten million triangles; `--room` replaces the room that is photographed
//! through real lenses and an ideal one (`shared/room_scene.rs`); `--peer` adds a program that does
//! the same (`shared/room.rs`, `shared/lights.rs`); `--embree` and `--tinybvh` the shared libraries
//! of Embree 4 and of `tinybvh_rays.cpp`, which trace the rays of `rays` too (`shared/rays.rs`).
//! Times are processor times, so other load on the machine affects them only through its caches.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use glam::DVec3;
use ivcam::photo::{LensChoice, Optics, Plan, Session};
use ivcam_base::math::lanes::Width;
use ivcam_optics::film::Resolution;
use ivcam_optics::lens::{Bundle, LANES, Lens, LensRay, PupilTarget, Toward};
use ivcam_optics::sampling::{DiscMap, Sampler, SamplerKind};
use ivcam_render::bvh::Bvh;
use ivcam_render::camera::Aim;
use ivcam_render::render::Stop;
use ivcam_render::shade::Shading;

use super::left_out::{self, LIT};
use super::shared::pictures::{
    ball_nodes, living_room, one_thread, remove_saved, render, thread_seconds, written,
};
use super::shared::{lights, mesh, rays, room, room_scene, sheets, slow, variants};

/// A measurement with the name of its table.
type Part<'a> = (&'a str, &'a dyn Fn(&mut String));

/// Returns an argument after a flag.
fn after<'a>(words: &'a [String], flag: &str, number: usize) -> Option<&'a str> {
    let at = words.iter().position(|w| w == flag)?;
    words.get(at + number).map(String::as_str)
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    if words.first().is_some_and(|w| w == "--slow-case") {
        return slow::one(&words[1..]);
    }
    let large = words.iter().any(|w| w == "--large");
    let only = after(&words, "--only", 1);
    let scene =
        || after(&words, "--room", 1).map_or_else(room_scene::write, |f| Some(PathBuf::from(f)));
    let in_room = |table: &mut (dyn FnMut(&Path) + Send)| match scene() {
        Some(scene) => one_thread(|| table(&scene)),
        None => eprintln!("cannot write to the temporary folder"),
    };
    let peer = after(&words, "--peer", 1);
    let parts: [Part; 15] = [
        ("lenses", &lenses),
        ("sheets", &|report| {
            one_thread(|| sheets::table(report, &thread_seconds));
        }),
        ("meshes", &|report| meshes(report, large)),
        ("rays", &|report| {
            let libraries = ["--embree", "--tinybvh"].map(|flag| after(&words, flag, 1));
            in_room(&mut |scene| {
                if let Err(error) = rays::tables(report, scene, libraries, large, &thread_seconds) {
                    eprintln!("{error}");
                }
            });
        }),
        ("room", &|report| {
            in_room(&mut |scene| room::table(report, scene, peer, &thread_seconds));
        }),
        ("pinhole", &|report| {
            let Some(peer) = peer else { return };
            in_room(&mut |scene| {
                if room::pinholes(report, scene, peer, &thread_seconds).is_none() {
                    eprintln!("{peer}: no pictures of a pinhole");
                }
            });
        }),
        ("variants", &|report| {
            in_room(&mut |scene| variants::table(report, scene, &thread_seconds));
        }),
        ("slow", &slow::table),
        ("lights", &|report| {
            one_thread(|| lights::table(report, peer, &thread_seconds));
        }),
        ("pictures", &pictures),
        ("left-out", &left_out::by_shading),
        ("not-needed", &left_out::by_scene),
        ("dispersion", &dispersion),
        ("growth", &growth),
        ("threads", &threads),
    ];
    let mut tables = Vec::new();
    for (name, part) in parts {
        if only.is_none_or(|o| o == name) {
            let mut table = String::new();
            part(&mut table);
            print!("{table}");
            if !table.is_empty() {
                tables.push((name, format!("{}.\n\n{table}", machine())));
            }
        }
    }
    remove_saved();
    if let Some(file) = after(&words, "--out", 1)
        && let Err(error) = write(Path::new(file), &tables)
    {
        eprintln!("{file}: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Writes tables between their marks in a file, or at its end.
fn write(file: &Path, tables: &[(&str, String)]) -> std::io::Result<()> {
    let mut text = std::fs::read_to_string(file).unwrap_or_else(|_| "# Performance\n".to_owned());
    for (name, table) in tables {
        let (start, end) = (format!("<!-- speed: {name} -->\n"), "<!-- end -->");
        let body = format!("{start}{}\n{end}", table.trim_end());
        let place = text.find(&start).and_then(|from| {
            let length = text[from..].find(end)? + end.len();
            Some(from..from + length)
        });
        match place {
            Some(place) => text.replace_range(place, &body),
            None => text.push_str(&format!("\n{body}\n")),
        }
    }
    std::fs::write(file, text)
}

/// Returns the machine's description of its processor.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|l| l.strip_prefix("model name"));
    let name = name.map_or("unknown processor", |n| {
        n.trim_start_matches([' ', '\t', ':'])
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores, lanes {:?}", Width::detect())
}

/// The shortest round; the processor clock has steps of 4 ms on some systems.
const ROUND: Duration = Duration::from_millis(200);

/// Returns the seconds of one call: the smallest of three rounds of at least [`ROUND`].
fn time(mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = thread_seconds();
        let mut calls = 0;
        let clock = Instant::now();
        while clock.elapsed() < ROUND {
            work();
            calls += 1;
        }
        best = best.min((thread_seconds() - start) / f64::from(calls));
    }
    best
}

fn lenses(report: &mut String) {
    report.push_str(
        "## Lenses\n\nNanoseconds per ray, lost or not, focused at 100 times its focal \
         length, on film as large as the lens is made for (`radius`, mm), aimed at the exit pupil; \
         4096 rays. `pupil` is the set-up of its table; of a lens without rotational symmetry the \
         table itself is measured as film points ask for it, in parts: behind the plus, all of it.\n\n\
         | lens | surfaces | radius | one by one | SSE2 | AVX2 | AVX-512 | through | pupil, ms |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for name in ivcam_optics::lens::shipped_names() {
        let Ok(lens) = Lens::named(name) else {
            continue;
        };
        let method = ivcam_optics::lens::FocusMethod::Film;
        let away = ivcam_base::math::Meters(0.1 * lens.first_order().efl().abs());
        let Ok(focus) = lens.focus(method, away) else {
            continue;
        };
        let own = lens.prescription().image_height;
        let radius = own.unwrap_or(0.43 * lens.first_order().efl().abs());
        let pupil = || PupilTarget::exit_pupil(&lens, focus.film_z, radius);
        let set_up = time(|| {
            black_box(pupil());
        });
        // The points are in one quarter of the film, which represents all by symmetry.
        let asked = || {
            let target = pupil();
            for k in 0..1600 {
                let point = glam::DVec2::new(f64::from(k % 40), f64::from(k / 40)) / 39.0;
                black_box(target.window(0.707 * radius * point).is_closed());
            }
        };
        let more = match lens.prescription().is_rotational() {
            true => String::new(),
            false => format!(" + {:.1}", 1e3 * (time(asked) - set_up)),
        };
        let target = pupil();
        let rays = rays_of(&lens, &target, focus.film_z, radius);
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
            "| {name} | {} | {radius:.1} | {:.1}",
            lens.prescription().surfaces.len(),
            1e9 * single
        );
        for width in widths() {
            let _ = write!(report, " | {:.1}", 1e9 * in_lanes(&lens, &rays, width));
        }
        let share = 100.0 * through as f64 / rays.len() as f64;
        let _ = writeln!(report, " | {share:.1}% | {:.1}{more} |", 1e3 * set_up);
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

/// Returns rays from a film of aspect 3:2 within the radius.
fn rays_of(lens: &Lens, target: &PupilTarget, film_z: f64, radius: f64) -> Vec<LensRay> {
    let sampler = Sampler::new(SamplerKind::Sobol, 4096, 1);
    (0..4096)
        .filter_map(|i| {
            let at = sampler.pixel(0, [0, 0]).sample(i);
            let [x, y] = at
                .film
                .map(|f| radius / 1.8_f64.hypot(1.2) * 1.2 * 2.0 * (f - 0.5));
            let film = glam::DVec2::new(1.5 * x, y);
            // No ray is sent from a film point that receives no light.
            let window = target.window(film);
            let aim = (!window.is_closed()).then(|| window.point(at.pupil[0], at.pupil[1]))?;
            let origin = film.extend(film_z);
            Some(LensRay::new(
                origin,
                (aim.extend(lens.length()) - origin).normalize_or(DVec3::NEG_Z),
            ))
        })
        .collect()
}

/// Returns seconds per ray, without filling and reading the bundles.
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
        "## Triangles\n\nA bumpy sphere. Millions of rays per second, one thread, one by one / in packets of 32: \
         from a point outside (rows of a picture), from there to a light, and from points on the \
         sphere in any direction. Memory is the tree's, with its triangles.\n\n\
         | triangles | build, s | primary | shadow | incoherent | MB |\n|---|---|---|---|---|---|\n",
    );
    let mut points = Vec::new();
    let sizes = [10_000, 100_000, 1_000_000, 10_000_000];
    for count in sizes.iter().take(if large { 4 } else { 3 }) {
        let triangles = mesh::ball(*count);
        let start = thread_seconds();
        let tree = one_thread(|| mesh::tree(&triangles));
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

/// Returns rays per second, one by one and in packets.
fn rates(tree: &Bvh, rays: &mesh::Rays) -> [f64; 2] {
    let mut distances = vec![0.0; rays.rays.len()];
    [mesh::one_by_one, mesh::in_packets].map(|trace| {
        let seconds = time(|| trace(tree, rays, black_box(&mut distances)));
        rays.rays.len() as f64 / seconds
    })
}

fn pictures(report: &mut String) {
    report.push_str(
        "## Pictures\n\nThe living room at 360x240, 16 samples per pixel, one thread. Compile is \
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
    plan.sampler = SamplerKind::Jittered;
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

/// Compares one wavelength with the wavelengths of a hero set, in turn: the cost of a picture with
/// as many samples, and to the same error.
fn dispersion(report: &mut String) {
    const ROUNDS: usize = 7;
    let _ = writeln!(
        report,
        "## Dispersion\n\nThe living room at 360x240 through a Flektogon of 20 mm, Phong and \
         recursive, one thread. Seconds are medians of {ROUNDS} rounds in which pictures without and \
         with dispersion take turns. To the same error, dispersion takes the ratio of the times \
         multiplied by the squared ratio of the errors: the median, and the least and the greatest \
         of a round.\n\n\
         | shading | samples | s, without | s, with | relRMSE, without | relRMSE, with | times the \
         time | to the same error |\n|---|---|---|---|---|---|---|---|"
    );
    for shading in [Shading::Phong, Shading::Recursive] {
        let sessions = [false, true].map(|dispersion| {
            let mut plan = living_room();
            let mut lens = LensChoice::named("flektogon");
            lens.efl = Some(ivcam_base::math::Mm(20.0));
            plan.optics = Optics::Lens(lens);
            (plan.shading, plan.dispersion) = (shading, dispersion);
            Session::open(plan)
        });
        let [Ok(without), Ok(with)] = &sessions else {
            let messages = sessions.iter().filter_map(|session| session.as_ref().err());
            messages.for_each(|error| eprintln!("{}", error.message));
            return;
        };
        for samples in [4, 16] {
            let (mut seconds, mut errors) = ([Vec::new(), Vec::new()], [0.0; 2]);
            for _ in 0..ROUNDS {
                for (k, session) in [without, with].into_iter().enumerate() {
                    let (time, made) = render(session, samples);
                    seconds[k].push(time);
                    errors[k] = made.film.relative_rmse().unwrap_or(f64::NAN);
                }
            }
            let [off, on] = &seconds;
            let noise = (errors[1] / errors[0]) * (errors[1] / errors[0]);
            let to_error: Vec<f64> = on.iter().map(|s| s * noise).collect();
            let _ = writeln!(
                report,
                "| {} | {samples} | {:.2} | {:.2} | {:.2e} | {:.2e} | {} | {} |",
                shading.name(),
                rays::median(off),
                rays::median(on),
                errors[0],
                errors[1],
                rays::ratio(on, off),
                rays::ratio(&to_error, off)
            );
        }
    }
    report.push('\n');
}

/// Returns the slope of the logarithm of rendering time over that of a number.
fn slope_of(plans: impl Iterator<Item = (f64, Plan)>, samples: u32) -> f64 {
    let point = |(number, plan): (f64, Plan)| {
        let session = Session::open(plan).ok()?;
        let least = (0..3).map(|_| render(&session, samples).0);
        Some((number.ln(), least.fold(f64::INFINITY, f64::min).ln()))
    };
    slope(&plans.filter_map(point).collect::<Vec<_>>())
}

fn growth(report: &mut String) {
    report.push_str(
        "## Growth\n\nSlopes of log time of rendering over log number, one thread; 1 is linear. \
         The living room by samples and pixels; elsewhere a sphere with the lights and triangles \
         in question, 180x120 pixels.\n\n",
    );
    let mut plan = living_room();
    plan.shading = Shading::Phong;
    let sized = |(width, height): (u32, u32)| {
        let mut plan = plan.clone();
        plan.resolution = Resolution { width, height };
        (f64::from(width * height), plan)
    };
    let sizes = [(90, 60), (180, 120), (360, 240), (720, 480)];
    let by_pixels = slope_of(sizes.into_iter().map(sized), 4);
    let mut by_samples = Vec::new();
    if let Ok(session) = Session::open(sized((180, 120)).1) {
        for samples in [4, 8, 16, 32, 64] {
            let (seconds, _) = render(&session, samples);
            by_samples.push((f64::from(samples).ln(), seconds.ln()));
        }
    }
    let lit = |count: usize| {
        let light = |i: usize| {
            let turn = i as f64 * 2.4;
            let (sin, cos) = libm::sincos(turn);
            format!(
                "PointLight {{ intensity .1 location {:.3} 3 {:.3} }}\n",
                4.0 * cos,
                4.0 * sin
            )
        };
        let lights: String = (0..count).map(light).collect();
        let nodes = format!(
            "{lights}Sphere {{ }} Translation {{ translation 0 -1 0 }} Cube {{ width 9 depth 9 height .1 }}"
        );
        Some((
            count as f64,
            written(&format!("lights-{count}.iv"), &nodes)?,
        ))
    };
    let by_lights = slope_of([4, 16, 64].into_iter().filter_map(lit), 16);
    let meshed = |count: usize| {
        let nodes = format!("{LIT}\n{}", ball_nodes(count));
        Some((count as f64, written(&format!("ball-{count}.iv"), &nodes)?))
    };
    let by_triangles = slope_of(
        [10_000, 100_000, 1_000_000].into_iter().filter_map(meshed),
        16,
    );
    let _ = writeln!(
        report,
        "* samples, 4 to 64: {:.2}\n* pixels, 90x60 to 720x480: {by_pixels:.2}\n\
         * lights, 4 to 64: {by_lights:.2}\n* triangles, 10,000 to 1,000,000: {by_triangles:.2}\n\
         * surfaces of a lens, as rays in lanes (all shipped of spheres): {:.2}\n",
        slope(&by_samples),
        by_surfaces()
    );
}

/// Returns the slope of the time of a ray in lanes over the number of surfaces.
fn by_surfaces() -> f64 {
    let mut points = Vec::new();
    for name in ivcam_optics::lens::shipped_names() {
        let Ok(lens) = Lens::named(name) else {
            continue;
        };
        let surfaces = &lens.prescription().surfaces;
        let spheres = surfaces
            .iter()
            .all(|s| s.shape == ivcam_optics::lens::Shape::Sphere);
        let Some(focal) = lens.first_order().focal.filter(|_| spheres) else {
            continue;
        };
        let radius = 0.4 * focal.efl.abs();
        let target = PupilTarget::exit_pupil(&lens, focal.rear_focal_point, radius);
        let rays = rays_of(&lens, &target, focal.rear_focal_point, radius);
        let seconds = in_lanes(&lens, &rays, Width::detect());
        points.push(((surfaces.len() as f64).ln(), seconds.ln()));
    }
    slope(&points)
}

/// Measures clock time on one thread and on two.
fn threads(report: &mut String) {
    let Ok(session) = Session::open(living_room()) else {
        return;
    };
    let clock = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let Ok(pool) = pool else { return f64::NAN };
        let once = || {
            let start = Instant::now();
            let sampler = session.plan.pixel_sampler();
            pool.install(|| black_box(session.expose_with(sampler, Stop::after(16), &|_| ())));
            start.elapsed().as_secs_f64()
        };
        (0..5).map(|_| once()).fold(f64::INFINITY, f64::min)
    };
    let (one, two) = (clock(1), clock(2));
    let _ = writeln!(
        report,
        "## Threads\n\nThe living room at 360x240, 16 samples, seconds of the clock: {one:.2} on one \
         thread, {two:.2} on two: {:.2} times as fast. Only a machine without other work shows this.\n",
        one / two
    );
}

/// Returns the slope of the least-squares line through points (x, y).
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let over = mean(&|p| (p.0 - x) * (p.1 - y));
    over / mean(&|p| (p.0 - x) * (p.0 - x))
}
