//! Tests of the option table: every option is parsed to a plan, printed, and parsed to the same
//! plan.

use ivcam_base::diag::Sink;
use ivcam_optics::lens::shipped_names;
use ivcam_render::shade::Shading;

use crate::cli::flags;
use crate::fuzz::options::{again, read};
use crate::photo::options::{GivenOptions, Opt, Takes, all};
use crate::photo::{Era, Optics, Plan};

const ERAS: [Era; 2] = [Era::Vintage, Era::Modern];

fn of_line(line: &str, era: Era) -> Option<Plan> {
    let words = line.split_whitespace().map(str::to_owned);
    read(&words.chain(["a.iv".into()]).collect::<Vec<_>>(), era)
}

fn of_plans() -> impl Iterator<Item = &'static Opt> {
    all().filter(|option| option.plan.is_some())
}

#[test]
fn every_option_goes_to_a_plan_and_back() {
    for option in of_plans() {
        let least = if option.takes == Takes::Nothing { 1 } else { 2 };
        assert!(
            option.examples.len() >= least,
            "`--{}` has too few examples to be tested by",
            option.name
        );
        let mut plans = Vec::new();
        for era in ERAS {
            plans.push(Plan::of_era(era, "a.iv"));
            for line in option.examples {
                let plan = of_line(line, era).unwrap_or_else(|| panic!("`{line}` is refused"));
                let (words, back) = again(&plan);
                assert_eq!(back.as_ref(), Some(&plan), "{line}: {words:?}");
                plans.push(plan);
            }
        }
        let usual = |plan: &&Plan| **plan == Plan::of_era(plan.era, "a.iv");
        let changed = plans.iter().filter(|plan| !usual(plan)).count();
        assert!(
            changed > 0 || option.name == "era",
            "no example of `--{}` changes a plan",
            option.name
        );
    }
}

/// Options that change the same field of the plan must not hide each other.
#[test]
fn any_two_options_go_to_a_plan_and_back() {
    let lines: Vec<&str> = of_plans()
        .flat_map(|o| o.examples.iter().copied())
        .collect();
    let (mut made, mut refused) = (0, 0);
    for (i, first) in lines.iter().enumerate() {
        for second in &lines[i + 1..] {
            for era in ERAS {
                let line = format!("{first} {second}");
                let Some(plan) = of_line(&line, era) else {
                    refused += 1;
                    continue;
                };
                made += 1;
                let (words, back) = again(&plan);
                assert_eq!(back, Some(plan), "{line}: {words:?}");
            }
        }
    }
    // Jittered samples cannot adapt; this is the only conflict.
    assert!(refused * 50 < made, "{refused} of {made} are refused");
}

/// So the zoom of a movie passes 1 without a jump.
#[test]
fn zoom_scales_every_lens_from_the_size_that_it_has_without_it() {
    for (name, era) in shipped_names().flat_map(|name| ERAS.map(|era| (name, era))) {
        let efl = |options: &str| {
            let plan = of_line(&format!("--lens {name} {options}"), era).unwrap();
            let Optics::Lens(choice) = plan.optics else {
                panic!("{name} is no lens");
            };
            choice.open(&mut Sink::new()).unwrap().first_order().efl()
        };
        for factor in [0.5, 1.0001] {
            let ratio = efl(&format!("--zoom {factor}")) / efl("");
            // An afocal lens has an infinite focal length.
            assert!(
                !ratio.is_finite() || (ratio / factor - 1.0).abs() < 1e-9,
                "{name} {era:?}"
            );
        }
    }
}

/// An earlier version of the window's *Copy command* omitted these.
#[test]
fn the_copied_command_has_all_options() {
    for line in [
        "--filter mitchell",
        "--adaptive",
        "--shutter 1/60 --iso 400 --white 200",
        "--ghosts on",
        "--diffraction on",
        "--max-depth 3",
        "--solids",
        "--handles",
        "--scene-limit nodes=9",
    ] {
        let plan = of_line(line, Era::Modern).unwrap();
        let words = plan.to_args("a.png".as_ref()).join(" ");
        assert!(words.contains(line), "{line} is missing in {words}");
    }
}

#[test]
fn the_words_of_a_plan_for_its_lens_are_options_of_the_lens_alone() {
    let line = "--lens double-gauss --efl 50mm --shading path --lens tessar --aperture f/8";
    let words = of_line(line, Era::Modern).unwrap().to_lens_args();
    let joined = words.map(|words| words.join(" "));
    assert_eq!(joined.as_deref(), Some("tessar --efl 50mm --aperture 8"));
    let pinhole = of_line("--lens none", Era::Modern).unwrap();
    assert_eq!(pinhole.to_lens_args(), None);
}

#[test]
fn no_two_options_share_a_spelling() {
    let mut spellings: Vec<String> = flags::spellings().collect();
    let count = spellings.len();
    spellings.sort();
    spellings.dedup();
    assert_eq!(spellings.len(), count);
}

#[test]
fn the_error_of_a_shading_model_lists_the_models() {
    let mut words = GivenOptions::default();
    words.add("shading", vec!["q".into()]);
    let start = |era| Plan::of_era(era, "a.iv");
    let error = Plan::from_options(&words, Era::Modern, start, &mut Sink::new()).unwrap_err();
    for model in Shading::ALL {
        let letter = model.letter().to_string();
        let listed = error
            .message
            .split([' ', ',', '`'])
            .any(|word| word == letter);
        assert!(listed, "{error}");
    }
}

#[test]
fn the_help_and_the_examples_of_shading_name_every_model() {
    let option = all().find(|o| o.name == "shading").unwrap();
    for model in Shading::ALL {
        let (letter, name) = (model.letter(), model.name());
        let word = |text: &str| {
            text.split([' ', ',', '(', ')'])
                .any(|w| w == letter.to_string())
        };
        assert!(
            word(option.help),
            "the help of `--shading` lacks `{letter}`"
        );
        let shown = |line: &&str| line.ends_with(name) || line.ends_with(&format!(" {letter}"));
        assert!(option.examples.iter().any(shown), "no example of `{name}`");
    }
}
