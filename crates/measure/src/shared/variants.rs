//! Measures what the properties of a real lens cost in a picture: blades, movements, bent film,
//! coatings, dispersion and cylinders.

use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use ivcam::photo::{LensChoice, Optics, Plan, Session};
use ivcam_optics::film::Film;
use ivcam_optics::lens::{Coating, Iris};
use ivcam_optics::sampling::Sampler;
use ivcam_render::render::Stop;

use super::room::{at_50_mm, plan, seconds_to};

/// The rounds, in each of which all pictures are taken with another seed.
const ROUNDS: u64 = 5;
/// The numbers of samples per pixel.
const SAMPLES: [u32; 2] = [16, 64];
/// The relative RMSE at which times are compared.
const ERROR: f64 = 0.03;

/// A lens with a property.
struct Variant {
    name: &'static str,
    lens: LensChoice,
    /// The number of the variant that this one is compared with.
    plain: usize,
    change: fn(&mut Plan),
}

impl Variant {
    fn opened(&self, scene: &Path) -> ivcam_base::diag::Result<Session> {
        let mut plan = plan(scene, Optics::Lens(self.lens.clone()));
        plan.dispersion = false;
        (self.change)(&mut plan);
        Session::open(plan)
    }
}

/// The place of the plain Flektogon among the variants.
const FLEKTOGON: usize = 9;

/// Returns the variants. The first is a round, still double Gauss without coatings.
fn variants() -> Vec<Variant> {
    let gauss = |name, change| Variant {
        name,
        lens: at_50_mm("double-gauss"),
        plain: 0,
        change,
    };
    let mut all = vec![
        gauss("double Gauss, f/2", |_| ()),
        gauss("six blades", |_| ()),
        gauss("six blades, f/8", |_| ()),
        gauss("tilt 8°", |plan| plan.movements.tilt = 8f64.to_radians()),
        gauss("tilt 4°, swing 3°, rise 3 mm, shift 2 mm", |plan| {
            let movements = &mut plan.movements;
            movements.tilt = 4f64.to_radians();
            movements.swing = 3f64.to_radians();
            (movements.rise, movements.shift) = (3.0, 2.0);
        }),
        gauss("film bent to 200 mm", |plan| {
            plan.movements.film_radius = Some(-200.0);
        }),
        gauss("uncoated", |_| ()),
        gauss("MgF₂, with wavelengths", |plan| plan.dispersion = true),
        gauss("anamorphic, film of 24x16 mm", |plan| {
            (plan.film.width, plan.film.height) = (24.0, 16.0);
        }),
        gauss("Flektogon, f/2.8", |_| ()),
        gauss("Flektogon, dispersion", |plan| plan.dispersion = true),
        gauss("Flektogon, dispersion, MgF₂", |plan| {
            plan.dispersion = true
        }),
        gauss("Flektogon, dispersion, MgF₂, six blades, f/4", |plan| {
            plan.dispersion = true;
        }),
    ];
    let blades = Iris::Blades {
        count: 6,
        rotation: 0.0,
    };
    all[1].lens.iris = blades.clone();
    (all[2].lens.iris, all[2].lens.f_number) = (blades.clone(), Some(8.0));
    all[6].lens.coating = Some(Coating::Bare);
    all[7].lens.coating = Some(Coating::MagnesiumFluoride);
    all[8].lens = LensChoice::named("anamorphic");
    for (k, variant) in all.iter_mut().enumerate().skip(FLEKTOGON) {
        (variant.lens, variant.plain) = (at_50_mm("flektogon"), FLEKTOGON);
        variant.lens.coating = (k > FLEKTOGON + 1).then_some(Coating::MagnesiumFluoride);
    }
    let last = &mut all[FLEKTOGON + 3].lens;
    (last.iris, last.f_number) = (blades, Some(4.0));
    all
}

/// The pictures of one variant with one number of samples and different seeds.
#[derive(Default)]
struct Pictures {
    seconds: Vec<f64>,
    /// The sum over pictures of each pixel.
    sums: Vec<DVec3>,
    /// The sum of squares over pictures, pixels and channels.
    squares: f64,
}

impl Pictures {
    fn add(&mut self, seconds: f64, film: &Film) {
        self.seconds.push(seconds);
        self.sums.resize(film.pixels.len(), DVec3::ZERO);
        for (sum, pixel) in self.sums.iter_mut().zip(&film.pixels) {
            *sum += pixel.mean;
            self.squares += pixel.mean.length_squared();
        }
    }

    fn seconds(&self) -> f64 {
        let mut seconds = self.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        seconds[seconds.len() / 2]
    }

    /// Returns the relative RMSE of one picture, which is the scatter of pictures about their mean.
    fn error(&self) -> f64 {
        let pictures = self.seconds.len() as f64;
        let values = 3.0 * self.sums.len() as f64;
        let of_means: f64 = self.sums.iter().map(|s| s.length_squared()).sum::<f64>() / pictures;
        let variance = (self.squares - of_means) / (pictures - 1.0) / values;
        let total: f64 = self.sums.iter().map(|s| s.element_sum()).sum();
        variance.sqrt() / (total / pictures / values)
    }
}

/// Takes a picture, and returns its seconds and its film.
fn taken(session: &Session, samples: u32, seed: u64, clock: &dyn Fn() -> f64) -> (f64, Film) {
    let sampler = Sampler {
        samples,
        seed,
        ..session.plan.pixel_sampler()
    };
    let start = clock();
    let made = session.expose_with(sampler, Stop::after(samples), &|_| ());
    (clock() - start, made.film)
}

/// Writes the table of a scene. `clock` returns the seconds that the calling thread has worked.
pub(in super::super) fn table(report: &mut String, scene: &Path, clock: &dyn Fn() -> f64) {
    let variants = variants();
    let sessions: Vec<Session> = match variants.iter().map(|v| v.opened(scene)).collect() {
        Ok(sessions) => sessions,
        Err(error) => return eprintln!("{}", error.message),
    };
    let mut all: Vec<[Pictures; 2]> = sessions.iter().map(|_| Default::default()).collect();
    // The first picture measures the parts of the pupil that the second finds ready.
    let set_ups = sessions.iter().map(|session| {
        let [first, second] = [0; 2].map(|seed| taken(session, 1, seed, clock).0);
        session.seconds.pupil + (first - second).max(0.0)
    });
    let set_ups: Vec<f64> = set_ups.collect();
    for seed in 0..ROUNDS {
        for (session, all) in sessions.iter().zip(&mut all) {
            for (samples, pictures) in SAMPLES.into_iter().zip(all) {
                let (seconds, film) = taken(session, samples, seed, clock);
                pictures.add(seconds, &film);
            }
        }
    }
    let _ = writeln!(
        report,
        "## What a real lens costs\n\nThe room through a lens of 50 mm at full aperture (the \
         anamorphic has 60 mm), 360x240, one thread. *Plain* is the double Gauss, or the Flektogon \
         in the rows that name it. Seconds of rendering are medians of {ROUNDS} rounds in which all \
         pictures are taken in turn. Relative RMSE is from the scatter \
         of the rounds' pictures, which have different seeds. Set-up is what the measurement of the \
         pupil adds to a first picture. The time to an error of {ERROR} is on the line through both \
         numbers of samples in logarithms.\n\n\
         | | set-up, s | s, 16 samples | s, 64 samples | relRMSE, 16 | relRMSE, 64 | s to {ERROR} \
         | 64 samples, times plain | to {ERROR}, times plain |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    let to_error = |both: &[Pictures; 2]| {
        let points = [0, 1].map(|k| [both[k].error(), both[k].seconds()]);
        seconds_to(ERROR, &points)
    };
    for ((variant, own), set_up) in variants.iter().zip(&all).zip(set_ups) {
        let plain = &all[variant.plain];
        let _ = writeln!(
            report,
            "| {} | {set_up:.3} | {:.3} | {:.3} | {:.4} | {:.4} | {:.2} | {:.2} | {:.2} |",
            variant.name,
            own[0].seconds(),
            own[1].seconds(),
            own[0].error(),
            own[1].error(),
            to_error(own),
            own[1].seconds() / plain[1].seconds(),
            to_error(own) / to_error(plain)
        );
    }
    report.push('\n');
}
