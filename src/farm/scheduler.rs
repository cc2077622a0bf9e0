//! The schedulers that job files are written for.

use super::division::{Division, JobFile};
use super::{hyperqueue, openjd, parallel, slurm};

/// A program that runs the tasks of a farm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scheduler {
    /// Open Job Description 2023-09, for AWS Deadline Cloud and `openjd run`.
    OpenJd,
    /// Slurm job arrays.
    Slurm,
    /// HyperQueue's Python interface.
    HyperQueue,
    /// GNU parallel.
    Parallel,
}

impl Scheduler {
    /// The names on the command line.
    pub(crate) const NAMES: [(&'static str, Self); 4] = [
        ("openjd", Self::OpenJd),
        ("slurm", Self::Slurm),
        ("hq", Self::HyperQueue),
        ("parallel", Self::Parallel),
    ];

    /// Returns the largest number of tasks. Slurm numbers them below `MaxArraySize`, which is 1001
    /// unless it is configured, and OpenJD allows 1024.
    pub(crate) fn most_tasks(self) -> usize {
        match self {
            Self::OpenJd | Self::Slurm => 1000,
            Self::HyperQueue | Self::Parallel => 100_000,
        }
    }

    /// Returns the files for a division.
    pub(crate) fn files(self, division: &Division) -> Vec<JobFile> {
        match self {
            Self::OpenJd => openjd::files(division),
            Self::Slurm => slurm::files(division),
            Self::HyperQueue => hyperqueue::files(division),
            Self::Parallel => parallel::files(division),
        }
    }

    /// Returns the command that starts the tasks, in the folder of the files.
    pub(crate) fn start(self) -> &'static str {
        match self {
            Self::OpenJd => "openjd run job.json",
            Self::Slurm => "sh submit.sh",
            Self::HyperQueue => "python3 submit.py",
            Self::Parallel => "sh run.sh",
        }
    }

    /// Returns the name of the file that the command starts.
    pub(crate) fn start_file(self) -> &'static str {
        let start = self.start();
        start.rsplit(' ').next().unwrap_or(start)
    }
}
