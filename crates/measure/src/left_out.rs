//! What leaving out saves: by the shading model that is chosen, and by what the scene lacks.

use std::fmt::Write as _;

use ivcam::photo::{Headlight, LensChoice, Optics, Plan, Session};
use ivcam_render::shade::Shading;

use super::shared::pictures::{
    ball_nodes, living_room, one_thread, opened, render, thread_seconds, written,
};

/// The rounds of a comparison, from which the medians are taken.
const ROUNDS: usize = 9;
/// The samples per pixel of a comparison.
const SAMPLES: u32 = 16;
/// The number of balls' triangles in a scene of a comparison.
const TRIANGLES: usize = 20_000;

/// Measures the time that simpler shading models save in the same picture.
pub(crate) fn by_shading(report: &mut String) {
    report.push_str(
        "## Leaving out\n\nThe living room at 360x240, 16 samples, one thread: what was not read, \
         built or traced (as `--report` has it), and seconds against everything (recursive, through \
         glass with dispersion).\n\n\
         | shading | optics | left out | compile | pupil | render | saved |\n|---|---|---|---|---|---|---|\n",
    );
    let glass = |dispersion: bool| {
        let mut plan = living_room();
        let mut lens = LensChoice::named("flektogon");
        lens.efl = Some(ivcam_base::math::Mm(20.0));
        (plan.optics, plan.dispersion) = (Optics::Lens(lens), dispersion);
        plan
    };
    let mut cases = vec![
        (glass(true), "glass"),
        (glass(false), "glass, one wavelength"),
    ];
    for shading in [
        Shading::Phong,
        Shading::Ambient,
        Shading::Normal,
        Shading::Flat,
    ] {
        let mut plan = glass(false);
        plan.shading = shading;
        cases.push((plan, "glass, one wavelength"));
    }
    let mut plan = glass(false);
    (plan.optics, plan.shading) = (Optics::Pinhole, Shading::Flat);
    cases.push((plan, "pinhole"));
    let mut everything = None;
    for (plan, optics) in cases {
        let shading = plan.shading.name();
        let session = match Session::open(plan) {
            Ok(session) => session,
            Err(error) => return eprintln!("{}", error.message),
        };
        let (seconds, made) = render(&session, 16);
        let own = session.seconds;
        let total = own.compile + own.pupil + seconds;
        let all = *everything.get_or_insert(total);
        let _ = writeln!(
            report,
            "| {shading} | {optics} | {} | {:.3} | {:.4} | {seconds:.2} | {:.0}% |",
            session.report(&made).left_out.join(", "),
            own.compile,
            own.pupil,
            100.0 * (1.0 - total / all)
        );
    }
    report.push('\n');
}

/// Something that the second of two scenes has and the first lacks. It changes the picture by less
/// than a thousandth.
struct Difference {
    left_out: &'static str,
    lacks: &'static str,
    has: &'static str,
}

/// A light on the spheres.
pub(crate) const LIT: &str = "PointLight { location 3 5 3 }";

const DIFFERENCES: [Difference; 8] = [
    Difference {
        left_out: "shadow rays (no lights)",
        lacks: "Material { emissiveColor .5 .5 .5 }",
        has: "Material { emissiveColor .5 .5 .5 } PointLight { location 3 5 3 intensity 1e-5 }",
    },
    Difference {
        left_out: "reflected rays (no mirrors)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } Material { specularColor .002 .002 .002 shininess 1 }",
    },
    Difference {
        left_out: "refracted rays (nothing transparent)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } Material { transparency .002 }",
    },
    Difference {
        left_out: "textures (none)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } Texture2 { image 1 1 3 0xffffff }",
    },
    Difference {
        left_out: "fog (none)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } Environment { fogType HAZE fogVisibility 1e9 }",
    },
    Difference {
        left_out: "visibility of hits (nothing clipped or culled)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } ClipPlane { plane 0 1 0 -9 }",
    },
    Difference {
        left_out: "fonts (no text)",
        lacks: LIT,
        has: "PointLight { location 3 5 3 } \
              Separator { Translation { translation 0 0 99 } Text3 { string \"a\" } }",
    },
    Difference {
        left_out: "1 shapes (not reached)",
        lacks: "PointLight { location 3 5 3 } Switch { USE Ball }",
        has: "PointLight { location 3 5 3 } \
              Separator { Translation { translation 0 0 99 } USE Ball }",
    },
];

/// Measures what scenes save that lack something, against scenes that have it.
pub(crate) fn by_scene(report: &mut String) {
    report.push_str(
        "## What a scene does not need\n\nA bumpy sphere of 20,000 triangles at 180x120, 16 \
         samples, one thread, through a lens, recursive. Each row compares it with a scene that has \
         what it lacks, almost without effect on the picture (the largest difference of a channel is \
         in the last column). Processor seconds from reading to the last sample; medians of nine \
         rounds in turn, and the median of the differences with their quartiles.\n\n\
         | left out | seconds | with it | saved | quartiles | pictures differ by |\n\
         |---|---|---|---|---|---|\n",
    );
    let ball = format!(
        "Separator {{ DEF Ball Separator {{ {} }} }}",
        ball_nodes(TRIANGLES)
    );
    for row in DIFFERENCES {
        let scene = |name: &str, part: &str| {
            // `USE` needs the node in front of it.
            let text = match part.contains("USE Ball") {
                true => format!("{LIT}\n{ball}\n{}", part.trim_start_matches(LIT)),
                false => format!("{part}\n{ball}"),
            };
            written(name, &text)
        };
        let plans = scene("lean.iv", row.lacks).zip(scene("full.iv", row.has));
        let Some((lean, full)) = plans else {
            return eprintln!("cannot write to the temporary folder");
        };
        compare(report, row.left_out, lean, full);
    }
    let empty = written("lean.iv", LIT).zip(written(
        "full.iv",
        "Translation { translation 0 0 99 } Cube { }",
    ));
    if let Some((lean, full)) = empty {
        compare(report, "all rays (nothing to see)", lean, full);
    }
    report.push('\n');
}

/// Adds a row about two pictures that are made in turn.
fn compare(report: &mut String, left_out: &str, lean: Plan, full: Plan) {
    let mut seconds = [Vec::new(), Vec::new()];
    let mut films = Vec::new();
    for _ in 0..ROUNDS {
        films.clear();
        for (plan, seconds) in [&lean, &full].into_iter().zip(&mut seconds) {
            let mut plan = plan.clone();
            (plan.shading, plan.headlight) = (Shading::Recursive, Headlight::Set(false));
            // Every surface with highlights is a mirror.
            plan.mirrors = Some(0.0);
            let start = thread_seconds();
            let made = one_thread(|| opened(plan).map(|session| render(&session, SAMPLES).1));
            seconds.push(thread_seconds() - start);
            match made {
                Ok(exposure) => films.push(exposure.film),
                Err(error) => return eprintln!("{}", error.message),
            }
        }
    }
    let pixels = (0..films[0].resolution.pixels()).map(|i| films[0].level(i) - films[1].level(i));
    let largest = pixels.fold(0.0, |most, d| d.abs().max_element().max(most));
    let [lean, full] = seconds;
    let saved: Vec<f64> = full
        .iter()
        .zip(&lean)
        .map(|(full, lean)| full - lean)
        .collect();
    let [low, saved, high] = quartiles(saved);
    let _ = writeln!(
        report,
        "| {left_out} | {:.3} | {:.3} | {saved:.3} | {low:.3} to {high:.3} | {largest:.1e} |",
        quartiles(lean)[1],
        quartiles(full)[1],
    );
}

/// Returns the quartiles of numbers.
fn quartiles(mut numbers: Vec<f64>) -> [f64; 3] {
    numbers.sort_by(f64::total_cmp);
    let at = |share: usize| numbers[(numbers.len() - 1) * share / 4];
    [at(1), at(2), at(3)]
}
