//! The fuzz target for command lines, and the functions by which tests read and print them.

use std::cell::RefCell;
use std::ffi::OsString;

use ivcam_base::diag::Sink;

use ivcam::cli::flags;
use ivcam::photo::options::all;
use ivcam::photo::{Era, Plan};

thread_local! {
    /// The command with the options of a photograph. Making it takes longer than reading a line.
    static COMMAND: RefCell<clap::Command> = RefCell::new(
        clap::Command::new("ivcam")
            .no_binary_name(true)
            .args_override_self(true)
            .args(flags::photograph())
            .arg(clap::Arg::new("scene")),
    );
}

/// Returns the plan of command-line arguments, or `None` if they are not valid.
pub(crate) fn read(words: &[String], era: Era) -> Option<Plan> {
    let words = flags::modernize(words.iter().map(OsString::from));
    let matches = COMMAND.with_borrow_mut(|command| command.try_get_matches_from_mut(words));
    let matches = matches.ok()?;
    let start = |era| Plan::of_era(era, "a.iv");
    let options = flags::given_options(&matches);
    Plan::from_options(&options, era, start, &mut Sink::new()).ok()
}

/// Prints a plan as a command line and parses it.
pub(crate) fn again(plan: &Plan) -> (Vec<String>, Option<Plan>) {
    let words = plan.to_args("a.png".as_ref());
    let rest = match words[1].as_str() {
        "render" => &words[2..],
        _ => &words[1..],
    };
    (words.clone(), read(rest, plan.era))
}

/// Reads a command line of both eras, with one word in a line, prints its plan and reads it again.
pub(super) fn options(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let words: Vec<String> = text.lines().map(str::to_owned).collect();
    for era in [Era::Vintage, Era::Modern] {
        if let Some(plan) = read(&words, era) {
            let (words, back) = again(&plan);
            assert_eq!(back, Some(plan), "{words:?}");
        }
    }
}

/// The examples of all options.
pub(super) fn examples() -> Vec<(String, Vec<u8>)> {
    let mut seeds = Vec::new();
    for option in all() {
        for (number, line) in option.examples.iter().enumerate() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let name = format!("{}-{number}", option.name);
            seeds.push((name, words.join("\n").into_bytes()));
        }
    }
    seeds
}

/// The spellings of all options, and values.
pub(super) fn spellings() -> Vec<String> {
    let values = "inf nan 1e308 1e-308 -1 0 1mm 2m 3cm f/8 on off 50% 4GB 99999x99999 1x1 = , :";
    let values = values.split_whitespace().map(str::to_owned);
    let names = all().map(|option| format!("--{}", option.name));
    values.chain(names).collect()
}
