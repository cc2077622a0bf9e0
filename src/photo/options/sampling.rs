//! Options of sampling, and of when to stop.

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::sampling::{DiscMap, Filter, SamplerKind};
use ivcam_render::camera::Aim;

use super::given::GivenOptions;
use super::option::{Opt, OptionNeeds, Takes};
use super::values::{duration, if_any, set, share, switch, unless_default};
use crate::photo::plan::{Era, Optics, Plan, SAMPLE_LIMIT};

const DISC_MAPS: [(&str, DiscMap); 2] = [
    ("polar", DiscMap::Polar),
    ("concentric", DiscMap::Concentric),
];

pub(super) static OPTIONS: [Opt; 9] = [
    Opt::new(
        "samples",
        Takes::One("N"),
        "samples per pixel [1999: 1, now: 16]",
    )
    .vintage("j")
    .aliases(&["spp"])
    .plan(samples, |plan, _| {
        if plan.stop.samples == SAMPLE_LIMIT && has_other_end(plan) {
            return Vec::new();
        }
        vec![plan.stop.samples.to_string()]
    })
    .describe(|plan| {
        Some(match has_other_end(plan) {
            true => format!("up to {}", plan.stop.samples),
            false => plan.stop.samples.to_string(),
        })
    })
    .examples(&["-j 1", "--samples 16", "--samples 100"]),
    Opt::new(
        "sampler",
        Takes::One("jittered|random|sobol|blue|golden|center"),
        "where the samples of a pixel are; center: the middle of each pixel, with stepped edges [1999: jittered, now: sobol]",
    )
    .plan(
        |plan, words, _| {
            let kind = words.named("sampler", &SamplerKind::ALL)?;
            set(&mut plan.sampler, kind);
            Ok(())
        },
        |plan, usual| {
            unless_default(plan.sampler, usual.sampler, |k| k.name().into())
        },
    )
    .describe(|plan| Some(plan.sampler.name().to_owned()))
    .examples(&[
        "--sampler jittered",
        "--sampler sobol",
        "--sampler blue",
        "--sampler golden",
        "--sampler random",
        "--sampler center",
    ]),
    Opt::new("seed", Takes::One("N"), "seed of all random numbers [0]")
        .plan(
            |plan, words, _| {
                let seed = words.parsed("seed", "a whole number from 0 to 18446744073709551615", |w| w.parse().ok())?;
                set(&mut plan.seed, seed);
                Ok(())
            },
            |plan, usual| {
                unless_default(plan.seed, usual.seed, |n| n.to_string())
            },
        )
        .describe(|plan| Some(plan.seed.to_string()))
        .examples(&["--seed 1", "--seed 18446744073709551615"]),
    Opt::new(
        "pupil",
        Takes::One("rear|exit"),
        "where on the lens to aim: rear element or exit pupil [1999: rear, now: exit]",
    )
    .needs(OptionNeeds::Traced)
    .plan(
        |plan, words, _| {
            let rear = Aim::RearElement(disc_map_of(plan.era));
            let aims = [("rear", rear), ("exit", Aim::ExitPupil)];
            set(&mut plan.aim, words.named("pupil", &aims)?);
            Ok(())
        },
        |plan, usual| {
            let is_rear = |plan: &Plan| matches!(plan.aim, Aim::RearElement(_));
            unless_default(is_rear(plan), is_rear(usual), |rear| {
                if rear { "rear" } else { "exit" }.into()
            })
        },
    )
    .describe(|plan| match (&plan.optics, plan.aim) {
        (Optics::Pinhole, _) => None,
        // The paraxial disc of an ideal lens is its exit pupil, whatever was asked for.
        (Optics::Ideal(_), _) | (_, Aim::ExitPupil) => Some("exit pupil".into()),
        (_, Aim::RearElement(map)) => Some(rear_element(map)),
    })
    .examples(&["--pupil rear", "--pupil exit"]),
    Opt::new(
        "disc",
        Takes::One("polar|concentric"),
        "map from samples to the lens [1999: polar, now: concentric]",
    )
    .needs(OptionNeeds::Pupil)
    .plan(
        |plan, words, sink| {
            let map = words.named("disc", &DISC_MAPS)?;
            let has_lens = plan.lens().is_some();
            match &mut plan.aim {
                Aim::RearElement(present) => set(present, map),
                Aim::ExitPupil if map.is_some() && has_lens => {
                    let warning = Diagnostic::warning("at the exit pupil, `--disc` does nothing");
                    sink.add(*warning.with_help("leave it out, or give `--pupil rear`"));
                }
                Aim::ExitPupil => {}
            }
            Ok(())
        },
        |plan, _| match plan.aim {
            Aim::RearElement(map) => unless_default(map, disc_map_of(plan.era), |map| {
                let known = DISC_MAPS.iter().find(|(_, m)| *m == map);
                known.map_or(String::new(), |(name, _)| (*name).into())
            }),
            Aim::ExitPupil => Vec::new(),
        },
    )
    .examples(&[
        "--pupil rear --disc polar",
        "--pupil rear --disc concentric",
    ]),
    Opt::new(
        "filter",
        Takes::One("box|gaussian|blackman-harris|mitchell"),
        "how a pixel weighs the light around it; mitchell has more noise [box]",
    )
    .plan(
        |plan, words, _| {
            set(&mut plan.filter, words.named("filter", &Filter::ALL)?);
            Ok(())
        },
        |plan, usual| unless_default(plan.filter, usual.filter, |f| f.name().into()),
    )
    .describe(|plan| (plan.filter != Filter::Box).then(|| plan.filter.name().to_owned()))
    .examples(&[
        "--filter box",
        "--filter gaussian",
        "--filter blackman-harris",
        "--filter mitchell",
    ]),
    Opt::new(
        "adaptive",
        Takes::Nothing,
        "takes most samples where a first pass, with an eighth of them, finds noise; the picture stays unbiased",
    )
    .plan(
        |plan, words, _| {
            plan.adaptive = words.has("adaptive");
            if plan.adaptive {
                can_adapt(plan.sampler)?;
            }
            Ok(())
        },
        |plan, _| switch(plan.adaptive),
    )
    .describe(|plan| plan.adaptive.then(|| "yes".into()))
    .examples(&["--adaptive --sampler sobol"]),
    Opt::new(
        "target-error",
        Takes::One("SHARE"),
        "stops when the relative error is at most this with 97.5% confidence, such as 1%; --samples is then a limit [65536]",
    )
    .plan(
        |plan, words, _| {
            let expects = "a relative error such as 1% or 0.01";
            // A whole number without `%` is meant as percent.
            let error = |word: &str| share(word).filter(|e| *e < 1.0 || word.ends_with('%'));
            plan.stop.error = words.parsed("target-error", expects, error)?;
            limit_samples(plan, words);
            Ok(())
        },
        |plan, _| if_any(plan.stop.error, error_word),
    )
    .examples(&["--target-error 1%", "--target-error 0.03 --samples 64"]),
    Opt::new(
        "time",
        Takes::One("LENGTH"),
        "stops in time for this, such as 30s, reading included; whole passes, at least one if it ends within half a second more; --samples is then a limit [65536]",
    )
    .plan(
        |plan, words, _| {
            let expects = "a length of time such as 30s, 500ms or 2m";
            plan.stop.time = words.parsed("time", expects, duration)?;
            limit_samples(plan, words);
            Ok(())
        },
        |plan, _| if_any(plan.stop.time, |time| format!("{}s", time.as_secs_f64())),
    )
    .examples(&["--time 30s", "--time 1500ms --samples 8", "--time 2m"]),
];

/// Returns the word for a relative error. One of 1 or more is read as percent only.
fn error_word(share: f64) -> String {
    if share < 1.0 {
        return share.to_string();
    }
    let percent = 100.0 * share;
    // The product is rounded, so the percent that was read may be beside it.
    let near = [percent, percent.next_up(), percent.next_down()];
    let read = near.into_iter().find(|percent| percent / 100.0 == share);
    format!("{}%", read.unwrap_or(percent))
}

/// Describes rays that are aimed at the rear element.
pub(crate) fn rear_element(map: DiscMap) -> String {
    match map {
        DiscMap::Polar => "rear element, polar map".into(),
        DiscMap::Concentric => "rear element, concentric map".into(),
    }
}

fn samples(plan: &mut Plan, words: &GivenOptions, _: &mut ivcam_base::diag::Sink) -> Result<()> {
    let count = |w: &str| w.parse().ok().filter(|n| (1..=1 << 24).contains(n));
    if let Some(count) = words.parsed("samples", "a number from 1 to 2^24", count)? {
        plan.stop.samples = count;
    }
    Ok(())
}

/// Raises the number of samples to [`SAMPLE_LIMIT`] if `--samples` is not given and the error or
/// the time ends the render.
fn limit_samples(plan: &mut Plan, words: &GivenOptions) {
    if has_other_end(plan) && !words.has("samples") {
        plan.stop.samples = SAMPLE_LIMIT;
    }
}

/// Returns whether the error or the time ends the render.
fn has_other_end(plan: &Plan) -> bool {
    plan.stop.error.is_some() || plan.stop.time.is_some()
}

/// Returns an era's default of `--disc`.
fn disc_map_of(era: Era) -> DiscMap {
    match era {
        Era::Vintage => DiscMap::Polar,
        Era::Modern => DiscMap::Concentric,
    }
}

/// Returns an error for the jittered sampler. It cannot be used adaptively, because only a complete
/// set of its samples covers the pixel and the pupil.
pub(crate) fn can_adapt(sampler: SamplerKind) -> Result<()> {
    if sampler != SamplerKind::Jittered {
        return Ok(());
    }
    let name = sampler.name();
    Err(Diagnostic::error(format!(
        "`--adaptive` cannot be used with the sampler `{name}`"
    ))
    .with_help("use `--sampler sobol`, of which any first samples are evenly distributed"))
}
