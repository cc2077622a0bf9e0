//! Slurm: an array of jobs, and a job that depends on the array.

use super::division::{Division, JobFile, scripts};

/// The job of one task. Slurm runs a copy of this file in the folder that it was submitted from. It
/// starts a task again after the failure of a node by itself (`--requeue`), but not after a signal.
const TASK: &str = r#"#!/bin/sh
# One task of the array. A task that a signal ended (a code above 128) is queued again, three times.
task=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" tasks.txt)
sh ./task.sh "$task"
code=$?
if [ "$code" -gt 128 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 3 ]; then
  # This ends the job.
  scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}" && sleep 60
fi
exit "$code"
"#;

const LAST: &str = "#!/bin/sh\n# Runs when all tasks have succeeded.\nexec sh ./last.sh\n";

pub(super) fn files(division: &Division) -> Vec<JobFile> {
    let last = division.arguments.len().saturating_sub(1);
    let cores = division.cores;
    let mut submit = format!(
        "#!/bin/sh\n\
         # Submits the tasks and what follows them. Arguments are options of sbatch.\n\
         set -eu\n\
         cd -- \"$(dirname -- \"$0\")\"\n\
         job=$(sbatch --parsable --job-name=ivcam --array=0-{last} --requeue --open-mode=append \\\n  \
         --cpus-per-task={cores} \"$@\" task.sbatch)\n\
         job=${{job%%;*}}\n\
         echo \"tasks: job $job\"\n"
    );
    let mut files = scripts(division);
    files.push(JobFile::new("task.sbatch", TASK));
    if division.last.is_some() {
        submit += "last=$(sbatch --parsable --job-name=ivcam-last --dependency=\"afterok:$job\" \\\n  \
                   --kill-on-invalid-dep=yes --requeue \"$@\" last.sbatch)\n\
                   echo \"after them: job ${last%%;*}\"\n";
        files.push(JobFile::new("last.sbatch", LAST));
    }
    files.push(JobFile::new("submit.sh", submit));
    files
}
