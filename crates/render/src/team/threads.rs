//! A team of threads in one process, which tests use.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::link::{Team, TeamLink};

/// The connection of a thread to the others.
struct ThreadLink {
    rank: usize,
    to: Vec<Sender<(usize, Vec<u8>)>>,
    inbox: Mutex<Receiver<(usize, Vec<u8>)>>,
}

impl TeamLink for ThreadLink {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.to.len()
    }

    fn send(&self, to: usize, message: Vec<u8>) {
        // A thread that has ended needs no more messages.
        let _ = self.to[to].send((self.rank, message));
    }

    fn receive(&self, wait: Duration) -> Option<(usize, Vec<u8>)> {
        let inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        inbox.recv_timeout(wait).ok()
    }
}

/// Runs `work` on each of a number of threads that are a team. Returns what each returned.
pub fn threads<T: Send>(size: usize, work: impl Fn(Team) -> T + Sync) -> Vec<T> {
    let (to, inboxes): (Vec<_>, Vec<_>) = (0..size).map(|_| channel()).unzip();
    let work = &work;
    std::thread::scope(|scope| {
        let start = |(rank, inbox)| {
            let to = to.clone();
            let inbox = Mutex::new(inbox);
            let link = ThreadLink { rank, to, inbox };
            scope.spawn(move || work(Team::new(Box::new(link))))
        };
        let running: Vec<_> = inboxes.into_iter().enumerate().map(start).collect();
        running
            .into_iter()
            .map(|thread| thread.join().expect("a thread of the team panicked"))
            .collect()
    })
}
