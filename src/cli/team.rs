//! A render by one process, or by all that `mpirun` or `srun` has started together.

use super::render::OutputOptions;
#[cfg(feature = "mpi")]
use super::team_mpi;
use crate::diag::Result;
use crate::photo::Session;

/// The variables in which the starters of processes state the number of each: Open MPI, PMIx
/// (Slurm and others), and PMI (MPICH).
const RANKS: [&str; 3] = ["OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"];

/// Whether this process was started as one of several and is not the first.
pub(super) fn is_assistant() -> bool {
    let rank = RANKS.iter().find_map(|name| std::env::var(name).ok());
    cfg!(feature = "mpi") && rank.is_some_and(|rank| rank != "0")
}

/// Returns the number of processes on this machine that were started together, if it is known. They
/// share the cores.
pub(super) fn processes_here() -> usize {
    let number = std::env::var("OMPI_COMM_WORLD_LOCAL_SIZE").ok();
    let number = number.and_then(|word| word.parse().ok());
    number.filter(|&n| n > 0).unwrap_or(1)
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
    if let Some(team) = crate::team::mpi::join() {
        return team_mpi::run(team, open, finish);
    }
    #[cfg(not(feature = "mpi"))]
    if std::env::var("OMPI_COMM_WORLD_SIZE").is_ok_and(|size| size != "1") {
        let error = "this program was built without MPI, so each process would make the picture";
        let help = "build it with `cargo build --release --features mpi`";
        return Err(crate::diag::Diagnostic::unsupported(error).with_help(help));
    }
    let (options, session) = open()?;
    finish(options, session)
}
