//! A render by one process, or by all that `mpirun` or `srun` has started together.

use ivcam_base::diag::Result;

use super::render::OutputOptions;
#[cfg(feature = "mpi")]
use super::team_mpi;
use crate::photo::Session;

/// The variables in which the starters of processes state the number of each: Open MPI, PMIx
/// (Slurm and others), and PMI (MPICH).
const RANKS: [&str; 3] = ["OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"];

/// Whether this process was started as one of several and is not the first.
pub(super) fn is_assistant() -> bool {
    let rank = RANKS.iter().find_map(|name| std::env::var(name).ok());
    cfg!(feature = "mpi") && rank.is_some_and(|rank| rank != "0")
}

/// Returns this process's share of the cores that it sees: processes that were started together on
/// a machine share its cores. Slurm may have bound them to their shares already.
pub(super) fn share_of_cores(seen: usize) -> usize {
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let number = |name: &str| variable(name).parse().ok().filter(|&n: &usize| n > 0);
    let tasks = tasks_here(
        &variable("SLURM_STEP_TASKS_PER_NODE"),
        number("SLURM_NODEID").unwrap_or(0),
    );
    let share = match number("OMPI_COMM_WORLD_LOCAL_SIZE") {
        Some(processes) => seen / processes,
        None => match number("SLURM_CPUS_ON_NODE").zip(tasks) {
            Some((cores, tasks)) => seen.min(cores / tasks),
            None => seen,
        },
    };
    share.max(1)
}

/// Returns the number of tasks on a node by Slurm's list of the tasks on all nodes, such as
/// `4(x2),1`.
fn tasks_here(list: &str, node: usize) -> Option<usize> {
    let nodes = list.split(',').flat_map(|part| {
        let (tasks, times) = part.split_once("(x").unwrap_or((part, "1)"));
        let times = times.trim_end_matches(')').parse().unwrap_or(1);
        std::iter::repeat_n(tasks, times)
    });
    let tasks = nodes.skip(node).map(str::parse).next()?;
    tasks.ok().filter(|&n| n > 0)
}

/// Runs a render by all processes that were started together, or by this one if it is alone.
///
/// `open` reads the arguments and opens the scene; `finish` renders it and writes the picture.
///
/// # Errors
/// Returns the first error of any process, or an error if `mpirun` has started a program that was
/// built without MPI.
pub(super) fn run(
    open: impl FnOnce() -> Result<(OutputOptions, Session)>,
    finish: impl FnOnce(OutputOptions, Session) -> Result<i32>,
) -> Result<i32> {
    #[cfg(feature = "mpi")]
    if let Some(team) = ivcam_render::team::mpi::join() {
        return team_mpi::run(team, open, finish);
    }
    #[cfg(not(feature = "mpi"))]
    if std::env::var("OMPI_COMM_WORLD_SIZE").is_ok_and(|size| size != "1") {
        let error = "this program was built without MPI, so each process would make the picture";
        let help = "build it with `cargo build --release --features mpi`";
        return Err(ivcam_base::diag::Diagnostic::unsupported(error).with_help(help));
    }
    let (options, session) = open()?;
    finish(options, session)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tasks_of_a_node_are_found_in_slurms_list() {
        for (list, tasks) in [
            ("2", [Some(2), None, None, None]),
            ("4(x2),1", [Some(4), Some(4), Some(1), None]),
            ("1,3(x3)", [Some(1), Some(3), Some(3), Some(3)]),
            ("", [None; 4]),
        ] {
            let found = [0, 1, 2, 3].map(|node| tasks_here(list, node));
            assert_eq!(found, tasks, "{list}");
        }
    }
}
