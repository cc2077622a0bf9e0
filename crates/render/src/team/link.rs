//! Messages between the processes of a team.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// How long a process waits for a message before it looks whether it has other work.
const PATIENCE: Duration = Duration::from_secs(1);

/// The connection of a process to the others.
pub(crate) trait TeamLink: Send + Sync {
    /// The number of this process, from 0.
    fn rank(&self) -> usize;
    /// The number of processes.
    fn size(&self) -> usize;
    /// Sends a message, without waiting until it is received.
    fn send(&self, to: usize, message: Vec<u8>);
    /// Waits for a message, at most for a time. Returns the sender with it.
    fn receive(&self, wait: Duration) -> Option<(usize, Vec<u8>)>;
}

/// The kind of a message, which is its first byte.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MessageKind {
    /// A message to all processes, which each process passes on.
    Broadcast = 0,
    /// A message to the receiving process only.
    Direct = 1,
}

/// A process among others that work on the same picture.
pub struct Team {
    link: Box<dyn TeamLink>,
    /// Messages that arrived while a message of the other kind was waited for.
    early: Mutex<VecDeque<(usize, Vec<u8>)>>,
}

impl Team {
    pub(crate) fn new(link: Box<dyn TeamLink>) -> Self {
        Self {
            link,
            early: Mutex::default(),
        }
    }

    /// The number of this process; 0 leads.
    pub fn rank(&self) -> usize {
        self.link.rank()
    }

    /// The number of processes.
    pub(crate) fn size(&self) -> usize {
        self.link.size()
    }

    /// Sends a value to another process.
    pub(crate) fn send(&self, to: usize, value: &impl Serialize) {
        self.link.send(to, encoded(MessageKind::Direct, value));
    }

    /// Waits for a value from any process, at most for a time. Returns the sender with it.
    pub(crate) fn receive<T: DeserializeOwned>(&self, wait: Duration) -> Option<(usize, T)> {
        let (from, bytes) = self.next(MessageKind::Direct, wait)?;
        Some((from, decoded(&bytes)?))
    }

    /// Sends a value from the first process to all, and returns it on each. Every process passes it
    /// on to at most log₂ of their number. The first process gives the value, the others `None`.
    pub fn broadcast<T: Serialize + DeserializeOwned>(&self, value: Option<T>) -> Option<T> {
        let bytes = match &value {
            Some(value) => encoded(MessageKind::Broadcast, value),
            None => loop {
                if let Some((_, bytes)) = self.next(MessageKind::Broadcast, PATIENCE) {
                    break bytes;
                }
            },
        };
        for child in children(self.rank(), self.size()) {
            self.link.send(child, bytes.clone());
        }
        value.or_else(|| decoded(&bytes))
    }

    /// Collects a value of every process at the first one, in the order of their numbers. Returns
    /// `None` on the others.
    pub fn gather<T: Serialize + DeserializeOwned>(&self, value: T) -> Option<Vec<T>> {
        if self.rank() > 0 {
            self.send(0, &value);
            return None;
        }
        let mut values: Vec<Option<T>> = (0..self.size()).map(|_| None).collect();
        values[0] = Some(value);
        while values.iter().any(Option::is_none) {
            if let Some((from, value)) = self.receive(PATIENCE) {
                values[from] = Some(value);
            }
        }
        values.into_iter().collect()
    }

    /// Returns the next message of a kind.
    fn next(&self, kind: MessageKind, wait: Duration) -> Option<(usize, Vec<u8>)> {
        let is_wanted = |message: &(usize, Vec<u8>)| message.1.first() == Some(&(kind as u8));
        let mut early = self.early.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = early.iter().position(is_wanted) {
            return early.remove(at);
        }
        let message = self.link.receive(wait)?;
        if is_wanted(&message) {
            return Some(message);
        }
        early.push_back(message);
        None
    }
}

/// The processes that a process passes a broadcast on to, in a binomial tree with the root 0.
fn children(rank: usize, size: usize) -> impl Iterator<Item = usize> {
    let steps = match rank {
        0 => usize::BITS - 1,
        _ => rank.trailing_zeros(),
    };
    let bits = (0..steps).rev().map(|k| 1 << k);
    bits.map(move |bit: usize| rank + bit)
        .filter(move |&child| child < size)
}

fn encoded(kind: MessageKind, value: &impl Serialize) -> Vec<u8> {
    // Writing to memory does not fail, and all values that are sent can be written.
    postcard::to_extend(value, vec![kind as u8]).unwrap_or_default()
}

/// Returns the value of a message, or `None` if it is not one of this program.
fn decoded<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    postcard::from_bytes(bytes.get(1..)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::team::threads;

    #[test]
    fn every_process_gets_a_broadcast_once() {
        for size in 1..40 {
            let mut reached = vec![0; size];
            let mut next = vec![0];
            while let Some(rank) = next.pop() {
                reached[rank] += 1;
                next.extend(children(rank, size));
            }
            assert_eq!(reached, vec![1; size]);
        }
    }

    #[test]
    fn values_go_to_all_and_come_back_in_order() {
        let sums = threads(5, |team| {
            let start: u64 = team.broadcast((team.rank() == 0).then_some(100)).unwrap();
            // A message to one process may overtake a broadcast that goes through others.
            if team.rank() == 0 {
                team.send(4, &7_u64);
            }
            let text: String = team
                .broadcast((team.rank() == 0).then(|| "all".to_owned()))
                .unwrap();
            let extra = match team.rank() {
                4 => loop {
                    if let Some((0, extra)) = team.receive::<u64>(PATIENCE) {
                        break extra;
                    }
                },
                _ => 0,
            };
            team.gather(format!("{text} {}", start + team.rank() as u64 + extra))
        });
        let expected = ["all 100", "all 101", "all 102", "all 103", "all 111"];
        assert_eq!(sums[0].as_deref().unwrap(), expected);
        assert!(sums[1..].iter().all(Option::is_none));
    }
}
