//! A picture by several processes, which `mpirun` or `srun` starts with the same arguments.
//!
//! The first process reads the files and sends their contents to the others. All open the scene,
//! and the first compares what they have: a process with another program, scene or lens would make
//! a mixture. Then it hands out the work. It alone prints and writes.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{Inputs, passed_on};
use ivcam_render::render::crew;
use ivcam_render::team::Team;

use super::render::OutputOptions;
use crate::photo::{Facts, Session};

/// The most bytes of files that are sent to the other processes. Beyond it they read them.
const MOST_CONTENTS: usize = 1 << 30;

/// Runs a render by the processes of a team.
///
/// # Errors
/// Returns the first error of any process.
pub(super) fn run(
    team: Team,
    open: impl FnOnce() -> Result<(OutputOptions, Session)>,
    finish: impl FnOnce(OutputOptions, Session) -> Result<i32>,
) -> Result<i32> {
    match team.rank() {
        0 => lead(&Arc::new(team), open, finish),
        _ => Ok(assist(&team, open)),
    }
}

/// Runs the first process.
fn lead(
    team: &Arc<Team>,
    open: impl FnOnce() -> Result<(OutputOptions, Session)>,
    finish: impl FnOnce(OutputOptions, Session) -> Result<i32>,
) -> Result<i32> {
    passed_on::keep_contents();
    let opened = open();
    let mut contents = passed_on::kept_contents();
    if contents.values().map(Vec::len).sum::<usize>() > MOST_CONTENTS {
        contents.clear();
    }
    team.broadcast(Some(opened.is_ok().then_some(contents)));
    let (options, mut session) = opened?;
    let all: Vec<std::result::Result<Facts, String>> =
        team.gather(Ok(facts(&session))).unwrap_or_default();
    let same = agree(all);
    team.broadcast(Some(same.is_ok()));
    same?;
    session.team = Some(team.clone());
    let result = finish(options, session);
    crew::end(team);
    result
}

/// Runs another process, and returns its exit code.
fn assist(team: &Team, open: impl FnOnce() -> Result<(OutputOptions, Session)>) -> i32 {
    let contents = team.broadcast::<Option<passed_on::Contents>>(None);
    let Some(contents) = contents.flatten() else {
        return 0; // the first process prints its error and fails
    };
    passed_on::take_contents(contents);
    let opened = open();
    team.gather(match &opened {
        Ok((_, session)) => Ok(facts(session)),
        Err(error) => Err(error.message.clone()),
    });
    let goes_on = team.broadcast::<bool>(None) == Some(true);
    match opened {
        Ok((options, session)) if goes_on => {
            match options.on_threads(|| session.serve(team)) {
                Ok(()) => 0,
                // The first process waits for this one, so the whole team has to end.
                Err(error) => std::panic::panic_any(error.message.clone()),
            }
        }
        _ => 0,
    }
}

/// Returns what has to be the same in all processes.
fn facts(session: &Session) -> Facts {
    let mut facts = session.facts(&Inputs::new());
    let mut say = |name: &str, value: String| facts.insert(name.to_owned(), value);
    say("samples", format!("{:?}", session.plan.pixel_sampler()));
    say("region", format!("{:?}", session.plan.region));
    facts
}

/// Checks that all processes have the same facts.
///
/// # Errors
/// Returns the error of the first process that has one, or else names what differs.
fn agree(all: Vec<std::result::Result<Facts, String>>) -> Result<()> {
    let mut first: Option<Facts> = None;
    for (rank, facts) in all.into_iter().enumerate() {
        let facts = facts.map_err(|message| {
            Diagnostic::error(format!("process {rank} cannot render: {message}"))
        })?;
        let Some(first) = &first else {
            first = Some(facts);
            continue;
        };
        let names = first.keys().chain(facts.keys());
        let differs = names
            .into_iter()
            .find(|&name| first.get(name) != facts.get(name));
        if let Some(name) = differs {
            let value = |facts: &Facts| facts.get(name).cloned().unwrap_or("nothing".into());
            let error = Diagnostic::error(format!(
                "process {rank} has another {name}: {}, and the first process has {}",
                value(&facts),
                value(first)
            ));
            return Err(match name.as_str() {
                "arithmetic" => error.with_help(
                    "`--arithmetic portable` makes the same bits on all processors of an \
                     architecture",
                ),
                _ => error.with_help("start the same program on the same files everywhere"),
            });
        }
    }
    Ok(())
}
