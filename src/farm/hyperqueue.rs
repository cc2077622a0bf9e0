//! HyperQueue: a program for its Python interface.

use super::division::{Division, JobFile, scripts};

/// Submits the job and waits for it.
const SUBMIT: &str = r#""""Submits the tasks to HyperQueue and waits for them.

python3 submit.py            to the server of this account
python3 submit.py --local    to a server and a worker that live as long as this program
"""

import os
import sys

from hyperqueue import Client, Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest

FOLDER = os.path.dirname(os.path.abspath(__file__))
CORES = @CORES@
HAS_LAST = @LAST@


def job():
    with open(os.path.join(FOLDER, "tasks.txt"), encoding="utf-8") as lines:
        arguments = lines.read().split()
    job = Job(default_workdir=FOLDER, max_fails=None, name="ivcam")
    cores = ResourceRequest(cpus=CORES)
    # A task is started again if its worker dies, at most 3 times.
    tasks = [
        job.program(["sh", "./task.sh", a], name=a, resources=cores, crash_limit=4)
        for a in arguments
    ]
    if HAS_LAST:
        job.program(["sh", "./last.sh"], name="last", deps=tasks)
    return job


def run(client):
    client.wait_for_jobs([client.submit(job())])


if "--local" in sys.argv[1:]:
    with LocalCluster() as cluster:
        cluster.start_worker(WorkerConfig())
        run(cluster.client())
else:
    run(Client())
"#;

pub(super) fn files(division: &Division) -> Vec<JobFile> {
    let has_last = if division.last.is_some() {
        "True"
    } else {
        "False"
    };
    let submit = SUBMIT
        .replace("@CORES@", &division.cores.to_string())
        .replace("@LAST@", has_last);
    let mut files = scripts(division);
    files.push(JobFile::new("submit.py", submit));
    files
}
