//! Who does which part of a numbered list of work items.

use std::ops::Range;

/// The least time that a piece of work should take, in seconds, so that messages and waiting cost
/// little beside it.
const LEAST_SECONDS: f64 = 0.1;
/// A piece is at most this part of what its worker would do of the rest if all went on as fast as
/// they do, so that the last pieces are small and all workers end together.
const PART: f64 = 0.25;
/// The part of a worker's speed that its last piece determines.
const FRESHNESS: f64 = 0.5;

/// Hands out the items `0..total` in pieces that suit the speeds of the workers (guided
/// self-scheduling: Polychronopoulos and Kuck, 1987, with weights for unequal workers).
///
/// It is a state machine that receives events. It has neither a clock nor messages.
#[derive(Debug)]
pub struct Schedule {
    total: u64,
    /// The first item that was never handed out.
    next: u64,
    /// The number of items that are not finished.
    left: u64,
    /// Pieces that workers left unfinished.
    returned: Vec<Range<u64>>,
    workers: Vec<Worker>,
}

#[derive(Clone, Debug, Default)]
struct Worker {
    /// Items in a second; `None` before the first piece is finished.
    speed: Option<f64>,
    /// The pieces that the worker has.
    pieces: Vec<Range<u64>>,
}

impl Schedule {
    /// Begins with nothing handed out.
    pub fn new(total: u64, workers: usize) -> Self {
        Self {
            total,
            next: 0,
            left: total,
            returned: Vec::new(),
            workers: vec![Worker::default(); workers],
        }
    }

    /// Returns the next piece for a worker, or `None` if everything is handed out.
    pub fn next(&mut self, worker: usize) -> Option<Range<u64>> {
        let piece = match self.returned.pop() {
            Some(piece) => piece,
            None if self.next < self.total => {
                let size = self.size_for(worker);
                let start = self.next;
                self.next += size;
                start..self.next
            }
            None => return None,
        };
        self.workers[worker].pieces.push(piece.clone());
        Some(piece)
    }

    /// Notes that a worker has finished a piece in a number of seconds. Returns false if the piece
    /// was not the worker's, as after [`Schedule::lost`].
    pub fn finished(&mut self, worker: usize, piece: &Range<u64>, seconds: f64) -> bool {
        let worker = &mut self.workers[worker];
        let Some(at) = worker.pieces.iter().position(|p| p == piece) else {
            return false;
        };
        worker.pieces.swap_remove(at);
        let items = piece.end - piece.start;
        self.left -= items;
        let speed = items as f64 / seconds.max(1e-6);
        let before = worker.speed.unwrap_or(speed);
        worker.speed = Some(before + FRESHNESS * (speed - before));
        true
    }

    /// Takes back the pieces of a worker that will not finish them.
    pub fn lost(&mut self, worker: usize) {
        let worker = std::mem::take(&mut self.workers[worker]);
        self.returned.extend(worker.pieces);
    }

    /// Hands out nothing more. What is handed out is still expected.
    pub(crate) fn abandon(&mut self) {
        let returned: u64 = self.returned.drain(..).map(|p| p.end - p.start).sum();
        self.left -= self.total - self.next + returned;
        self.total = self.next;
    }

    /// Whether all items are finished.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Returns the number of items of the next piece for a worker.
    fn size_for(&self, worker: usize) -> u64 {
        let rest = self.total - self.next;
        let Some(speed) = self.workers[worker].speed else {
            // The first piece finds the speed. There are enough for all if all are as fast.
            return (rest / (256 * self.workers.len() as u64)).clamp(1, rest);
        };
        let known = self.workers.iter().filter_map(|w| w.speed);
        let (count, sum) = known.fold((0, 0.0), |(n, sum), s| (n + 1, sum + s));
        let of_all = sum * self.workers.len() as f64 / f64::from(count.max(1));
        let share = PART * rest as f64 * speed / of_all;
        let size = share.max(LEAST_SECONDS * speed);
        (size as u64).clamp(1, rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs workers with these speeds, in items per second, that have two pieces at a time. Returns
    /// when each ends, and how often each item was finished.
    fn run(total: u64, speeds: &[f64]) -> (Vec<f64>, Vec<u32>) {
        let mut schedule = Schedule::new(total, speeds.len());
        let mut queues: Vec<Vec<Range<u64>>> = vec![Vec::new(); speeds.len()];
        let mut clocks = vec![0.0; speeds.len()];
        let mut finished = vec![0; total as usize];
        for (worker, queue) in queues.iter_mut().enumerate() {
            queue.extend(schedule.next(worker));
            queue.extend(schedule.next(worker));
        }
        while !schedule.is_done() {
            let busy = (0..speeds.len()).filter(|&w| !queues[w].is_empty());
            let end = |w: usize| {
                let first = &queues[w][0];
                clocks[w] + (first.end - first.start) as f64 / speeds[w]
            };
            let worker = busy.min_by(|&a, &b| end(a).total_cmp(&end(b))).unwrap();
            let now = end(worker);
            let piece = queues[worker].remove(0);
            piece.clone().for_each(|item| finished[item as usize] += 1);
            let seconds = now - clocks[worker];
            assert!(schedule.finished(worker, &piece, seconds));
            clocks[worker] = now;
            queues[worker].extend(schedule.next(worker));
        }
        (clocks, finished)
    }

    #[test]
    fn every_item_is_done_once_and_all_workers_end_together() {
        for (total, speeds) in [
            (1, vec![10.0; 3]),
            (20_000, vec![100.0; 4]),
            (50_000, vec![1000.0, 250.0, 1000.0, 250.0, 990.0]),
        ] {
            let (ends, finished) = run(total, &speeds);
            assert_eq!(finished, vec![1; total as usize]);
            let last = ends.iter().fold(0.0, |a: f64, &b| a.max(b));
            let ideal = total as f64 / speeds.iter().sum::<f64>();
            assert!(last < 1.02 * ideal + 2.0 * LEAST_SECONDS, "{last} {ideal}");
        }
    }

    #[test]
    fn a_lost_workers_pieces_are_handed_out_again() {
        let mut schedule = Schedule::new(1000, 2);
        let lost: Vec<Range<u64>> = (0..3).filter_map(|_| schedule.next(0)).collect();
        schedule.lost(0);
        assert!(!schedule.finished(0, &lost[0], 0.1));
        let mut items = vec![0; 1000];
        while let Some(piece) = schedule.next(1) {
            piece.clone().for_each(|item| items[item as usize] += 1);
            assert!(schedule.finished(1, &piece, 0.01));
        }
        assert_eq!(items, vec![1; 1000]);
        assert!(schedule.is_done());
    }

    #[test]
    fn abandoned_work_ends_with_what_is_handed_out() {
        let mut schedule = Schedule::new(1000, 2);
        let first = schedule.next(0).unwrap();
        schedule.next(1).unwrap();
        schedule.lost(1);
        schedule.abandon();
        assert_eq!(schedule.next(1), None);
        assert!(!schedule.is_done());
        assert!(schedule.finished(0, &first, 0.1));
        assert!(schedule.is_done());
    }
}
