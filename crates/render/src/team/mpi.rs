//! A team of MPI's processes, which `mpirun` or `srun` starts.
//!
//! One thread calls MPI and no other. It sends one message at a time, and receives meanwhile, so
//! that two processes that send to each other do not wait for each other. When there is nothing to
//! do it sleeps, because waiting inside MPI would keep a core busy.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use mpi::point_to_point::{Destination as _, MatchedReceiveVec as _, Source as _};
use mpi::topology::{Communicator as _, SimpleCommunicator};

use super::link::{Team, TeamLink};

/// How long the thread sleeps between looks for messages: first the shortest time, and after every
/// look in vain twice as long up to the longest. A look every 200 µs would take a tenth of a core.
/// A process has two pieces of work of a tenth of a second, so the longest time costs it nothing.
const NAPS: [Duration; 2] = [Duration::from_micros(100), Duration::from_millis(5)];
/// Variables of the environment that the starters of processes set: Open MPI's own, PMIx of Slurm
/// and others, and PMI of MPICH.
const SIGNS: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"];

/// The connection to MPI's other processes.
struct MpiLink {
    rank: usize,
    size: usize,
    outbox: Option<Sender<(usize, Vec<u8>)>>,
    inbox: Mutex<Receiver<(usize, Vec<u8>)>>,
    thread: Option<JoinHandle<()>>,
}

impl TeamLink for MpiLink {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn send(&self, to: usize, message: Vec<u8>) {
        if let Some(outbox) = &self.outbox {
            // The thread ends only after this connection.
            let _ = outbox.send((to, message));
        }
    }

    fn receive(&self, wait: Duration) -> Option<(usize, Vec<u8>)> {
        let inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        inbox.recv_timeout(wait).ok()
    }
}

impl Drop for MpiLink {
    /// Sends what is waiting, and leaves MPI together with the other processes.
    fn drop(&mut self) {
        self.outbox = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Joins the team of the processes that were started together. Returns `None` if this process was
/// started alone.
pub fn join() -> Option<Team> {
    if !SIGNS.iter().any(|sign| std::env::var_os(sign).is_some()) {
        return None;
    }
    let (outbox, to_send) = channel();
    let (received, inbox) = channel();
    let (hello, about) = channel();
    let thread = std::thread::spawn(move || {
        let started = mpi::initialize_with_threading(mpi::Threading::Funneled);
        if let Some((universe, _)) = started {
            let world = universe.world();
            let _ = hello.send((world.rank() as usize, world.size() as usize));
            carry(&world, &to_send, &received);
        }
    });
    let (rank, size) = about.recv().ok()?;
    Some(Team::new(Box::new(MpiLink {
        rank,
        size,
        outbox: Some(outbox),
        inbox: Mutex::new(inbox),
        thread: Some(thread),
    })))
}

/// Carries messages until no more can come from this process.
fn carry(
    world: &SimpleCommunicator,
    to_send: &Receiver<(usize, Vec<u8>)>,
    received: &Sender<(usize, Vec<u8>)>,
) {
    let [shortest, longest] = NAPS;
    let mut nap = shortest;
    loop {
        while receive(world, received) {
            nap = shortest;
        }
        match to_send.recv_timeout(nap) {
            Ok((to, message)) => {
                send(world, to, &message, received);
                nap = shortest;
            }
            Err(RecvTimeoutError::Timeout) => nap = longest.min(2 * nap),
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// Sends a message, and receives others until it has arrived.
fn send(
    world: &SimpleCommunicator,
    to: usize,
    message: &[u8],
    received: &Sender<(usize, Vec<u8>)>,
) {
    mpi::request::scope(|scope| {
        let process = world.process_at_rank(to as mpi::Rank);
        let mut request = process.immediate_send(scope, message);
        while let Err(unfinished) = request.test() {
            request = unfinished;
            if !receive(world, received) {
                std::thread::sleep(NAPS[0]);
            }
        }
    });
}

/// Receives a message if there is one.
fn receive(world: &SimpleCommunicator, received: &Sender<(usize, Vec<u8>)>) -> bool {
    let Some(probed) = world.any_process().immediate_matched_probe() else {
        return false;
    };
    let (message, status) = probed.matched_receive_vec::<u8>();
    // Nobody reads it any more only if this process ends.
    let _ = received.send((status.source_rank() as usize, message));
    true
}
