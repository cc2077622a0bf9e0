use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Duration;

use ivcam_optics::film::{Exposed, Film, Region, Resolution};
use ivcam_optics::sampling::{Filter, FilterTable, Sampler, SamplerKind};

use crate::photo::{Era, LensChoice, Optics, Plan, Session};
use ivcam_render::render::*;
use ivcam_render::shade::{Shader, Work};

/// Opens a scene with a sphere, a cube and a cone, all specular, seen through a real lens.
fn session(era: Era, lens: &str) -> Session {
    let folder = std::env::temp_dir().join(format!("ivcam-render-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the scene");
    let scene = folder.join(format!("{}-{lens}.iv", era.name()));
    let text = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 focalDistance 4 }\n\
         PointLight { location 2 3 4 }\n\
         Material { specularColor .5 .5 .5 shininess .9 diffuseColor .8 .2 .1 }\n\
         Sphere { }\nTranslation { translation 1 .4 .5 } Cube { width .5 }\n\
         Translation { translation -2 -1 0 } Cone { }\n";
    std::fs::write(&scene, text).expect("the scene can be written");
    let mut plan = Plan::of_era(era, scene);
    plan.optics = Optics::Lens(LensChoice::named(lens));
    plan.resolution = Resolution::of(44, 27);
    plan.stop = Stop::after(5);
    Session::open(plan).expect("the scene is whole")
}

fn with_render<T>(
    session: &Session,
    threads: usize,
    work: impl FnOnce(&Render<'_>) -> T + Send,
) -> T
where
    T: Send,
{
    let shader = Shader::new(
        &session.scene,
        session.plan.shading,
        ivcam_render::shade::ShadeOptions::default(),
    );
    let render = Render {
        shader: &shader,
        camera: &session.camera,
        sampler: session.plan.pixel_sampler(),
        resolution: session.plan.resolution,
        exposure: session.plan.exposure,
        stop: session.plan.stop,
        filter: &FilterTable::new(session.plan.filter),
        adaptive: session.plan.adaptive,
        team: None,
        lamps: None,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads start").install(|| work(&render))
}

#[test]
fn tiles_give_the_bits_of_one_ray_at_a_time_at_any_number_of_threads() {
    for (era, lens) in [
        (Era::Vintage, "wide-angle"),
        (Era::Modern, "wide-angle"),
        (Era::Modern, "tessar"),
    ] {
        let session = session(era, lens);
        assert_eq!(session.camera.is_spectral(), lens == "tessar");
        let plain: Vec<Exposed> = with_render(&session, 1, |render| {
            let mut work = Work::default();
            let pixel = |i: u32| {
                let mut sum = Exposed::default();
                for index in 0..5 {
                    sum.add(render.sample((i % 44, i / 44), index, &mut work));
                }
                sum
            };
            (0..44 * 27).map(pixel).collect()
        });
        for threads in [1, 3] {
            let made = with_render(&session, threads, |render| render.run(&|_| ()));
            assert!(made.film.mean() > 0.05, "a black picture tests nothing");
            assert_eq!(made.film.pixels, plain, "{threads} threads, {}", era.name());
            assert_eq!(made.counts.film_rays, 5 * 44 * 27);
            assert!(made.counts.shadow_rays > 0 && made.counts.error_rays > 0);
        }
    }
}

#[test]
fn a_region_has_the_bits_of_the_whole_picture_with_adaptive_sampling_too() {
    for adaptive in [false, true] {
        let mut session = session(Era::Modern, "wide-angle");
        session.plan.adaptive = adaptive;
        session.plan.stop = Stop::after(16);
        let region = Region::new([13, 5], [20, 17]);
        let whole = with_render(&session, 2, |render| render.run(&|_| ()));
        let part = with_render(&session, 2, |render| {
            render.run_inside(region, Task::default(), &|_| ())
        });
        assert_eq!(part.film.resolution, region.resolution());
        assert_eq!(
            part.film.pixels,
            region.cut(&whole.film.pixels, whole.film.resolution)
        );
        assert!(part.film.error().is_ok() && part.film.error() != whole.film.error());
        let counts: Vec<u32> = part.film.pixels.iter().map(|p| p.count).collect();
        assert_eq!(counts.iter().any(|n| *n != counts[0]), adaptive);
    }
}

fn render_of(session: &Session, seed: u64, samples: u32) -> Film {
    with_render(session, 2, |render| {
        Render {
            sampler: Sampler {
                samples,
                seed,
                ..render.sampler
            },
            stop: Stop::after(samples),
            ..*render
        }
        .run(&|_| ())
        .film
    })
}

/// Returns the mean and standard error, over pictures of 24 seeds, of the light on 16 parts of the
/// film.
fn parts(session: &Session, samples: u32) -> Vec<(f64, f64)> {
    let n = 24;
    let films: Vec<Film> = (0..n).map(|s| render_of(session, s, samples)).collect();
    let part = |film: &Film, i: usize| {
        let of = film.pixels.iter().skip(i).step_by(16);
        of.map(|p| p.mean.element_sum()).sum::<f64>()
    };
    (0..16)
        .map(|i| {
            let all: Vec<f64> = films.iter().map(|f| part(f, i)).collect();
            let mean = all.iter().sum::<f64>() / n as f64;
            let square: f64 = all.iter().map(|x| (x - mean) * (x - mean)).sum();
            (mean, (square / (n * (n - 1)) as f64).sqrt())
        })
        .collect()
}

/// Compares six methods with independent random samples of the same filter, on 16 parts of the
/// film. These are 96 t-tests with about 40 degrees of freedom. A correct program exceeds 4.6 in
/// one of 250 runs, and the seeds are fixed.
#[test]
fn every_sampler_filter_and_adaptive_sampling_give_the_light_of_plain_random_samples() {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.resolution = Resolution::of(32, 21);
    let mut plain = |filter| {
        session.plan.filter = filter;
        session.plan.adaptive = false;
        session.plan.sampler = SamplerKind::Random;
        parts(&session, 16)
    };
    let truths = [plain(Filter::Box), plain(Filter::Mitchell)];
    let cases = [
        (SamplerKind::Sobol, Filter::Box, false),
        (SamplerKind::Sobol, Filter::Box, true),
        (SamplerKind::Random, Filter::Box, true),
        (SamplerKind::Blue, Filter::Box, false),
        (SamplerKind::Golden, Filter::Box, false),
        (SamplerKind::Sobol, Filter::Mitchell, true),
    ];
    for (kind, filter, adaptive) in cases {
        session.plan.filter = filter;
        session.plan.adaptive = adaptive;
        session.plan.sampler = kind;
        let truth = &truths[usize::from(filter == Filter::Mitchell)];
        for ((a, ea), (b, eb)) in parts(&session, 16).into_iter().zip(truth) {
            let t = (a - b) / ea.hypot(*eb);
            assert!(t.abs() < 4.6, "{kind:?} {filter:?} {adaptive}: {a} {b} {t}");
        }
    }
}

#[test]
fn adaptive_sampling_has_the_same_bits_at_any_number_of_threads() {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.adaptive = true;
    let film = |threads| with_render(&session, threads, |r| r.run(&|_| ()).film);
    assert_eq!(film(1).pixels, film(3).pixels);
    let counts: Vec<u32> = film(1).pixels.iter().map(|p| p.count).collect();
    assert!(counts.iter().max() > counts.iter().min());
}

/// Passes of jittered samples end after a whole number of layouts.
#[test]
fn a_render_that_stops_early_has_whole_layouts() {
    let mut session = session(Era::Vintage, "wide-angle");
    session.plan.stop = Stop {
        samples: 9000,
        error: Some(1e6),
        time: None,
    };
    let made = with_render(&session, 2, |render| {
        let sampler = Sampler {
            samples: 9,
            ..render.sampler
        };
        Render { sampler, ..*render }.run(&|_| ())
    });
    assert_eq!(made.samples, 9);
}

/// With a limit on time the first pass has one sample, so that it reaches the whole picture early.
/// The passes do not change the bits.
#[test]
fn passes_with_a_limit_on_time_begin_with_one_sample() {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.stop = Stop::after(16);
    let plain = with_render(&session, 2, |render| render.run(&|_| ()));
    session.plan.stop.time = Some(Duration::from_secs(3600));
    let ends = Mutex::new(BTreeSet::new());
    let note = |progress: Progress| {
        ends.lock().unwrap().insert(progress.samples);
    };
    let timed = with_render(&session, 2, |render| render.run(&note));
    assert_eq!(ends.into_inner().unwrap(), [0, 1, 2, 4, 8].into());
    assert_eq!(timed.film.pixels, plain.film.pixels);
    let keeper = Interruption::after(3);
    let task = Task {
        keepers: &[&keeper],
        ..Task::default()
    };
    let cut = with_render(&session, 1, |render| {
        render.run_inside(whole(&session), task, &|_| ())
    });
    let Stopped { samples, more, .. } = cut.stopped.unwrap();
    assert_eq!((samples, more), (0, 1));
}

#[test]
fn the_work_that_is_expected_is_that_of_the_limit_which_ends_the_render() {
    let stop = Stop::after(20_000);
    let time = Some(Duration::from_millis(300));
    for (stop, resumed) in [
        (Stop::after(64), true),
        (Stop { time, ..stop }, false),
        (
            Stop {
                error: Some(0.01),
                ..stop
            },
            false,
        ),
    ] {
        let mut session = small_session(stop.samples, false);
        session.plan.stop = stop;
        let seen = Mutex::new(Vec::new());
        let note = |progress: Progress| seen.lock().unwrap().push(progress);
        let keeper = Interruption::after(9);
        let run = |task: Task<'_>| {
            with_render(&session, 2, |r| r.run_inside(whole(&session), task, &note))
        };
        let keepers: &[&dyn Keeper] = &[&keeper];
        let mut task = Task::default();
        if resumed {
            run(Task {
                keepers,
                ..Task::default()
            });
            seen.lock().unwrap().clear();
            task.sums = Some(keeper.sums());
        }
        run(task);
        let seen = seen.into_inner().unwrap();
        let last = seen.iter().max_by_key(|p| p.work_done).unwrap();
        assert_eq!(last.work_before > 0, resumed);
        assert_eq!(seen[0].work_is_known, stop.error.is_none());
        assert!((0.1..=1.0).contains(&last.part().unwrap()), "{last:?}");
        let left = last.seconds_left().unwrap();
        let limit = stop.time.map(|time| time.as_secs_f64());
        assert!(limit.is_none_or(|limit| left <= limit), "{last:?}");
    }
}

/// Compares the error estimates of 100 pictures of 4 samples per pixel with their errors against
/// one picture of 1,024. 95 of 100 have a standard error of 2.2.
#[test]
fn the_true_error_lies_in_the_stated_interval_in_90_to_99_percent_of_pictures() {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.resolution = Resolution::of(48, 32);
    let truth: Vec<[f64; 3]> = render_of(&session, 12345, 1024)
        .pixels
        .iter()
        .map(|p| p.mean.to_array())
        .collect();
    let (mut inside, mut known, mut sum) = (0, 0, 0.0);
    for seed in 0..100 {
        let film = render_of(&session, seed, 4);
        let Ok(error) = film.error() else { continue };
        let relative = crate::render::report::deviation::Deviation::of(&film, &truth)
            .rel_mse
            .sqrt();
        known += 1;
        inside += u32::from(error.low <= relative && relative <= error.high);
        sum += error.relative_rmse / relative;
    }
    let ratio = sum / f64::from(known);
    assert!(known >= 75, "{known} known");
    assert!(
        10 * inside >= 9 * known,
        "{inside} of {known}, ratio {ratio}"
    );
    assert!((ratio - 1.0).abs() < 0.07, "estimated over true is {ratio}");
}

/// The error of a picture that the target ended is known, and its interval is below the target.
#[test]
fn a_target_is_met_by_the_upper_end_of_the_interval() {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.stop = Stop {
        samples: 256,
        error: Some(0.2),
        time: None,
    };
    let made = with_render(&session, 2, |render| render.run(&|_| ()));
    assert!(made.samples < 256);
    assert!(made.film.error().is_ok_and(|e| e.high <= 0.2));
    assert_eq!(made.counts.film_rays, u64::from(made.samples) * 44 * 27);
}

/// Stops a render after a number of tiles, and keeps its state.
struct Interruption {
    left: AtomicU32,
    state: Mutex<Vec<u8>>,
}

impl Interruption {
    fn after(tiles: u32) -> Self {
        Self {
            left: AtomicU32::new(tiles),
            state: Mutex::default(),
        }
    }

    /// Returns the sums of the state.
    fn sums(&self) -> Sums {
        let state = self.state.lock().unwrap();
        Sums::read(&mut &state[..], state.len() as u64).unwrap()
    }
}

impl Keeper for Interruption {
    fn is_stopped(&self) -> bool {
        self.left.load(Ordering::Relaxed) == 0
    }

    fn is_due(&self) -> bool {
        let less = |left: u32| left.checked_sub(1);
        let _ = self
            .left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        false
    }

    fn keep(&self, snapshot: &StateView<'_, '_>) {
        let mut state = self.state.lock().unwrap();
        state.clear();
        snapshot.write(&mut *state).unwrap();
    }
}

/// Returns a session with a small picture, for many samples.
fn small_session(samples: u32, adaptive: bool) -> Session {
    let mut session = session(Era::Modern, "wide-angle");
    session.plan.resolution = Resolution::of(26, 17);
    session.plan.adaptive = adaptive;
    session.plan.stop = Stop::after(samples);
    session
}

fn whole(session: &Session) -> Region {
    Region::whole(session.plan.resolution)
}

#[test]
fn a_render_that_is_interrupted_has_the_bits_of_one_that_is_not() {
    for (adaptive, error) in [(false, None), (true, None), (false, Some(0.02))] {
        let mut session = small_session(150, adaptive);
        session.plan.stop.error = error;
        let once = with_render(&session, 2, |render| render.run(&|_| ()));
        let mut sums = None;
        let mut runs = 0;
        let again = loop {
            let keeper = Interruption::after(1 + 7 * runs);
            let task = Task {
                sums,
                keepers: &[&keeper],
                ..Task::default()
            };
            let made = with_render(&session, 1 + runs as usize % 3, |render| {
                render.run_inside(whole(&session), task, &|_| ())
            });
            runs += 1;
            if made.stopped.is_none() {
                assert_eq!(keeper.sums().place.done, made.samples);
                break made;
            }
            // No estimate is that of the samples that it has.
            let is_even = made.stopped.is_some_and(|stopped| stopped.part == 0.0);
            assert!(is_even || made.film.squared_error.is_none());
            sums = Some(keeper.sums());
        };
        assert!(runs > 2, "{runs} runs");
        assert_eq!(again.film.pixels, once.film.pixels, "{adaptive} {error:?}");
        assert_eq!(again.film.error(), once.film.error());
        let rays = |made: &Exposure| {
            let counts = made.counts;
            [
                counts.film_rays,
                counts.passed,
                counts.scene_rays,
                counts.shadow_rays,
            ]
        };
        assert_eq!(rays(&again), rays(&once));
        assert!(once.counts.passed <= once.counts.film_rays);
    }
}

/// The work is stopped as the last tile ends, before the error is estimated.
#[test]
fn a_render_that_is_interrupted_in_an_estimate_ends_where_one_that_is_not_does() {
    let mut session = small_session(256, false);
    session.plan.stop.error = Some(0.2);
    let work = AtomicU64::new(0);
    let note = |progress: Progress| work.store(progress.work_done, Ordering::Relaxed);
    let once = with_render(&session, 1, |render| render.run(&note));
    assert!(once.samples < 256);
    let keeper = Interruption::after(u32::MAX);
    let run = |session: &Session, sums, progress: &(dyn Fn(Progress) + Sync)| {
        let task = Task {
            sums,
            keepers: &[&keeper],
            ..Task::default()
        };
        with_render(session, 1, |render| {
            render.run_inside(whole(session), task, progress)
        })
    };
    let mut other = small_session(256, false);
    other.plan.stop = session.plan.stop;
    let made = run(&other, None, &|progress| {
        if progress.work_done == work.load(Ordering::Relaxed) {
            other.budget.stop().cancel();
        }
    });
    assert_eq!(made.stopped, Some(Stopped::between_passes(once.samples)));
    assert_eq!(made.film.squared_error, None);
    let again = run(&session, Some(keeper.sums()), &|_| ());
    assert_eq!(again.samples, once.samples);
    assert_eq!(again.film.pixels, once.film.pixels);
    assert_eq!(again.film.error(), once.film.error());
}

#[test]
fn samples_are_added_to_a_render_that_has_ended() {
    let keeper = Interruption::after(u32::MAX);
    for samples in [20, 100, 150] {
        let session = small_session(samples, false);
        let state = keeper.state.lock().unwrap().clone();
        let task = Task {
            sums: (!state.is_empty()).then(|| keeper.sums()),
            keepers: &[&keeper],
            ..Task::default()
        };
        let run = |task| {
            with_render(&session, 2, |r| {
                r.run_inside(whole(&session), task, &|_| ())
            })
        };
        let grown = run(task);
        assert_eq!(grown.samples, samples);
        assert_eq!(grown.film.pixels, run(Task::default()).film.pixels);
    }
}

#[test]
fn parts_of_the_samples_have_the_bits_of_one_render_when_they_are_folded() {
    for adaptive in [false, true] {
        let session = small_session(200, adaptive);
        let once = with_render(&session, 2, |render| render.run(&|_| ()));
        for cuts in [&[0, 64, 200][..], &[0, 128, 192, 200], &[0, 192, 200]] {
            let part = |cut: &[u32]| {
                let keeper = Interruption::after(u32::MAX);
                let task = Task {
                    samples: Some(cut[0]..cut[1]),
                    keepers: &[&keeper],
                    ..Task::default()
                };
                with_render(&session, 2, |r| {
                    r.run_inside(whole(&session), task, &|_| ())
                });
                keeper.sums()
            };
            let mut parts = cuts.windows(2).map(part);
            let mut sums = parts.next().unwrap();
            parts.for_each(|next| sums.append(next));
            assert_eq!(sums.place.done, 200);
            assert_eq!(sums.folded(), once.film.pixels, "{adaptive} {cuts:?}");
        }
    }
}

#[test]
fn the_rows_of_a_state_are_those_of_its_film() {
    struct Rows(Mutex<Vec<[f32; 3]>>, Interruption);
    impl Keeper for Rows {
        fn is_stopped(&self) -> bool {
            self.1.is_stopped()
        }
        fn is_due(&self) -> bool {
            self.1.is_due()
        }
        fn keep(&self, snapshot: &StateView<'_, '_>) {
            self.1.keep(snapshot);
            let mut rows = self.0.lock().unwrap();
            rows.clear();
            let look = |part: Region, levels: &[[f32; 3]]| {
                assert_eq!((part.left, part.top as usize * 13), (0, rows.len()));
                assert_eq!(part.resolution().pixels(), levels.len());
                rows.extend(levels);
                Ok(())
            };
            snapshot.for_each_row(look).unwrap();
        }
    }
    let session = small_session(300, false);
    let region = Region::new([5, 3], [13, 12]);
    // In the first unit, in the second one, and among units that are not folded.
    for (samples, tiles) in [(0..300, 4), (0..300, 9), (64..300, 16), (64..300, u32::MAX)] {
        let keeper = Rows(Mutex::default(), Interruption::after(tiles));
        let task = Task {
            samples: Some(samples),
            keepers: &[&keeper],
            ..Task::default()
        };
        with_render(&session, 2, |r| r.run_inside(region, task, &|_| ()));
        let film = keeper.1.sums().film();
        let rows = keeper.0.lock().unwrap();
        assert_eq!(*rows, film.levels());
        assert!(rows.iter().any(|level| level[0] > 0.0));
    }
}

#[test]
fn a_state_that_is_cut_short_or_contradicts_itself_is_refused() {
    let session = small_session(4, true);
    let keeper = Interruption::after(9);
    let task = Task {
        keepers: &[&keeper],
        ..Task::default()
    };
    with_render(&session, 1, |r| {
        r.run_inside(whole(&session), task, &|_| ())
    });
    let state = keeper.state.lock().unwrap().clone();
    for length in [0, 7, 8, 40, state.len() / 2, state.len() - 1] {
        let cut = &state[..length];
        assert!(
            Sums::read(&mut &cut[..], length as u64).is_err(),
            "{length}"
        );
    }
    let too_long = [&u64::MAX.to_le_bytes(), &state[8..]].concat();
    assert!(Sums::read(&mut &too_long[..], state.len() as u64).is_err());
    let mut wrong = keeper.sums();
    wrong.place.done = 5;
    assert!(wrong.place.end < 5);
    let keeper = Interruption::after(1);
    wrong.show(&mut |snapshot| keeper.keep(snapshot));
    let state = keeper.state.lock().unwrap();
    assert!(Sums::read(&mut &state[..], state.len() as u64).is_err());
}
