//! GNU parallel: one machine, or several by `--sshlogin`.

use super::division::{Division, JobFile, scripts};

/// The file in which GNU parallel notes which tasks have succeeded. That of another job would keep
/// the tasks of this one from starting.
pub(crate) const LOG: &str = "tasks.log";

pub(super) fn files(division: &Division) -> Vec<JobFile> {
    let cores = division.cores;
    let mut run = format!(
        "#!/bin/sh\n\
         # Runs the tasks and what follows them. Arguments are options of GNU parallel. The log says\n\
         # which tasks have succeeded; run again, only the others are started.\n\
         set -eu\n\
         cd -- \"$(dirname -- \"$0\")\"\n\
         jobs=$(($(getconf _NPROCESSORS_ONLN) / {cores}))\n\
         [ \"$jobs\" -gt 0 ] || jobs=1\n\
         parallel --joblog {LOG} --resume-failed --retries 3 --jobs \"$jobs\" \"$@\" \\\n  \
         sh ./task.sh {{}} :::: tasks.txt\n"
    );
    if division.last.is_some() {
        run += "exec sh ./last.sh\n";
    }
    let mut files = scripts(division);
    files.push(JobFile::new("run.sh", run));
    files
}
