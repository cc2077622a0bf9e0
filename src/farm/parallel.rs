//! GNU parallel: one machine, or several by `--sshlogin`.

use super::division::{Division, JobFile, scripts};

pub(super) fn files(division: &Division) -> Vec<JobFile> {
    let mut run = format!(
        "#!/bin/sh\n\
         # Runs the tasks and what follows them. Arguments are options of GNU parallel. The log says\n\
         # which tasks have succeeded; run again, only the others are started.\n\
         set -eu\n\
         cd -- \"$(dirname -- \"$0\")\"\n\
         jobs=$(($(getconf _NPROCESSORS_ONLN) / {}))\n\
         [ \"$jobs\" -gt 0 ] || jobs=1\n\
         parallel --joblog tasks.log --resume-failed --retries 3 --jobs \"$jobs\" \"$@\" \\\n  \
         sh ./task.sh {{}} :::: tasks.txt\n",
        division.cores
    );
    if division.last.is_some() {
        run += "exec sh ./last.sh\n";
    }
    let mut files = scripts(division);
    files.push(JobFile::new("run.sh", run));
    files
}
