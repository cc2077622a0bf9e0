//! Simulates a render by many processes with the scheduler of the real one: how much of the time
//! they work, at numbers of processes and pictures that no machine here has.
//!
//! The model: the first process serves messages one after another. Each costs a fixed time and the
//! time of its bytes on the network; every message travels for a latency. A process holds two
//! pieces of work at a time. Nothing is random, so a simulation gives the same numbers anywhere.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::ops::Range;
use std::process::ExitCode;

use ivcam_render::team::Schedule;

/// Pixels of a tile, as in `render`.
const TILE: f64 = 64.0;
/// The size of a pixel in a message, in bytes.
const PIXEL_BYTES: f64 = 56.0;
/// Rays from the film that one core traces in a second: livroom through the double Gauss, measured.
const RAYS: f64 = 1.38e6;
/// Bytes that the first process's network carries in a second: 10 Gbit/s.
const NETWORK: f64 = 1.25e9;
/// Seconds that a message costs the first process besides its bytes.
const MESSAGE: f64 = 20e-6;
/// The latency of a message in seconds.
const LATENCY: f64 = 50e-6;
/// Pieces that a process has at a time, as in `render`.
const PIECES: usize = 2;
/// Seconds after which the pieces of a dead process are handed out again.
const DETECTION: f64 = 10.0;
/// Bytes of the scene that every process gets, and the seconds to compile it.
const SCENE: (f64, f64) = (100e6, 5.0);

/// A farm and its work.
#[derive(Clone, Copy)]
struct Farm {
    ranks: usize,
    /// One of this many processes is four times slower; 0 for none.
    slow_every: usize,
    /// One of this many processes dies in the middle; 0 for none.
    dead_every: usize,
    pixels: f64,
    samples: f64,
    network: f64,
}

/// What a simulation finds.
struct Outcome {
    /// Seconds from the first piece to the last result.
    seconds: f64,
    /// The part of the time that the processes work.
    busy: f64,
    /// The part of the time that the first process serves messages.
    served: f64,
    messages: u64,
    /// The bytes of the largest message.
    largest: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Event {
    /// A piece reaches a process.
    Order(usize, Range<u64>),
    /// A process finishes its piece.
    Ends(usize),
    /// A result reaches the first process: the process, the piece and the seconds that it took.
    Result(usize, Range<u64>, f64),
    /// A process dies.
    Dies(usize),
    /// The first process notices the death.
    Lost(usize),
}

/// An event with its time in nanoseconds and its number, which decides between equal times.
type At = Reverse<(u64, u64)>;

struct Rank {
    /// Items per second.
    speed: f64,
    queue: VecDeque<Range<u64>>,
    /// The time at which the present piece began, if there is one.
    since: Option<f64>,
    worked: f64,
    is_dead: bool,
    /// Orders that the process has or that are on their way.
    has: usize,
}

struct Simulation {
    farm: Farm,
    schedule: Schedule,
    ranks: Vec<Rank>,
    heap: BinaryHeap<At>,
    events: Vec<Option<Event>>,
    free_at: f64,
    served: f64,
    messages: u64,
    largest: f64,
}

impl Farm {
    fn tiles(&self) -> u64 {
        (self.pixels / TILE).ceil() as u64
    }

    /// Simulates the work.
    fn run(self) -> Outcome {
        let speed = RAYS / (TILE * self.samples);
        let is_nth = |every: usize, rank: usize| every > 0 && rank % every == every - 1;
        let rank = |rank: usize| Rank {
            speed: if is_nth(self.slow_every, rank) {
                speed / 4.0
            } else {
                speed
            },
            queue: VecDeque::new(),
            since: None,
            worked: 0.0,
            is_dead: false,
            has: 0,
        };
        let mut simulation = Simulation {
            farm: self,
            schedule: Schedule::new(self.tiles(), self.ranks),
            ranks: (0..self.ranks).map(rank).collect(),
            heap: BinaryHeap::new(),
            events: Vec::new(),
            free_at: 0.0,
            served: 0.0,
            messages: 0,
            largest: 0.0,
        };
        let half = 0.5 * self.tiles() as f64 / speed / self.ranks as f64;
        for rank in (1..self.ranks).filter(|rank| is_nth(self.dead_every, *rank)) {
            simulation.add(half, Event::Dies(rank));
        }
        for _ in 0..PIECES {
            (0..self.ranks).for_each(|rank| simulation.give(rank, 0.0));
        }
        let mut seconds = 0.0;
        while let Some(Reverse((nanoseconds, number))) = simulation.heap.pop() {
            let now = nanoseconds as f64 * 1e-9;
            if let Some(event) = simulation.events[number as usize].take() {
                simulation.happens(now, event);
            }
            if simulation.schedule.is_done() {
                seconds = simulation.free_at.max(now);
                break;
            }
        }
        let worked: f64 = simulation.ranks.iter().map(|r| r.worked).sum();
        Outcome {
            seconds,
            busy: worked / (seconds * self.ranks as f64),
            served: simulation.served / seconds,
            messages: simulation.messages,
            largest: simulation.largest,
        }
    }
}

impl Simulation {
    fn add(&mut self, time: f64, event: Event) {
        let number = self.events.len() as u64;
        self.events.push(Some(event));
        self.heap
            .push(Reverse(((time * 1e9).round() as u64, number)));
    }

    /// Lets the first process serve a message. Returns when it is done.
    fn serve(&mut self, now: f64, bytes: f64) -> f64 {
        let cost = MESSAGE + bytes / self.farm.network;
        self.free_at = self.free_at.max(now) + cost;
        self.served += cost;
        self.messages += 1;
        self.largest = self.largest.max(bytes);
        self.free_at
    }

    /// Sends the next piece to a process, if there is one.
    fn give(&mut self, rank: usize, now: f64) {
        if self.ranks[rank].is_dead || self.ranks[rank].has >= PIECES {
            return;
        }
        let Some(piece) = self.schedule.next(rank) else {
            return;
        };
        self.ranks[rank].has += 1;
        // An order for pixels without samples has only the numbers of its tiles.
        let bytes = 8.0 * (piece.end - piece.start) as f64;
        let sent = if rank == 0 {
            now
        } else {
            self.serve(now, bytes) + LATENCY
        };
        self.add(sent, Event::Order(rank, piece));
    }

    fn begin(&mut self, rank: usize, now: f64) {
        let this = &mut self.ranks[rank];
        if this.since.is_none()
            && let Some(piece) = this.queue.front()
        {
            this.since = Some(now);
            let seconds = (piece.end - piece.start) as f64 / this.speed;
            self.add(now + seconds, Event::Ends(rank));
        }
    }

    fn happens(&mut self, now: f64, event: Event) {
        match event {
            Event::Order(rank, piece) => {
                self.ranks[rank].queue.push_back(piece);
                self.begin(rank, now);
            }
            Event::Ends(rank) if !self.ranks[rank].is_dead => {
                let this = &mut self.ranks[rank];
                let (Some(piece), Some(since)) = (this.queue.pop_front(), this.since.take()) else {
                    return;
                };
                this.worked += now - since;
                let there = if rank == 0 { now } else { now + LATENCY };
                self.add(there, Event::Result(rank, piece, now - since));
                self.begin(rank, now);
            }
            Event::Result(rank, piece, seconds) => {
                let bytes = TILE * PIXEL_BYTES * (piece.end - piece.start) as f64;
                let done = if rank == 0 {
                    now
                } else {
                    self.serve(now, bytes)
                };
                if self.schedule.finished(rank, &piece, seconds) {
                    self.ranks[rank].has -= 1;
                    self.give(rank, done);
                }
            }
            Event::Dies(rank) => {
                self.ranks[rank].is_dead = true;
                self.add(now + DETECTION, Event::Lost(rank));
            }
            Event::Lost(rank) => {
                self.schedule.lost(rank);
                // Processes that had nothing more to do are needed again.
                (0..self.farm.ranks).for_each(|rank| self.give(rank, now));
            }
            Event::Ends(_) => {}
        }
    }
}

/// Prints one row of the table.
fn row(name: &str, farm: Farm) {
    let outcome = farm.run();
    println!(
        "| {name} | {} | {} | {:.0} s | {:.1}% | {:.1}% | {} | {:.1} MB |",
        farm.ranks,
        farm.samples,
        outcome.seconds,
        100.0 * outcome.busy,
        100.0 * outcome.served,
        outcome.messages,
        outcome.largest / 1e6
    );
}

/// Prints tables of simulated renders.
pub(super) fn run(arguments: Vec<String>) -> ExitCode {
    if !arguments.is_empty() {
        return crate::usage("scaling");
    }
    let farm = Farm {
        ranks: 1024,
        slow_every: 0,
        dead_every: 0,
        pixels: 65_536.0 * 43_690.0,
        samples: 256.0,
        network: NETWORK,
    };
    let slow = Farm {
        slow_every: 10,
        ..farm
    };
    println!("| farm | processes | samples | time | busy | first serves | messages | largest |");
    println!("|---|---|---|---|---|---|---|---|");
    row("all alike", farm);
    row("a tenth four times slower", slow);
    row(
        "and one in 100 dies",
        Farm {
            dead_every: 100,
            ..slow
        },
    );
    for samples in [16.0, 32.0, 64.0, 128.0] {
        row("fewer samples", Farm { samples, ..slow });
    }
    for ranks in [256, 2048, 4096, 8192] {
        row("other numbers", Farm { ranks, ..slow });
    }
    row(
        "100 Gbit/s",
        Farm {
            network: 10.0 * NETWORK,
            ranks: 8192,
            ..slow
        },
    );
    row(
        "36,000 x 24,000",
        Farm {
            pixels: 36_000.0 * 24_000.0,
            ..slow
        },
    );
    row(
        "3,600 x 2,400",
        Farm {
            pixels: 3_600.0 * 2_400.0,
            ..slow
        },
    );
    let steps = f64::from(usize::BITS - (farm.ranks - 1).leading_zeros());
    let start = steps * SCENE.0 / NETWORK + SCENE.1;
    println!("\nstart-up of 1,024: {steps} steps of a broadcast, {start:.1} s with compiling");
    ExitCode::SUCCESS
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The goal of the scheduler, at a hundredth of the pixels with the samples of a long render.
    #[test]
    fn a_thousand_processes_are_busy_though_a_tenth_is_four_times_slower() {
        let farm = Farm {
            ranks: 1024,
            slow_every: 10,
            dead_every: 0,
            pixels: 65_536.0 * 437.0,
            samples: 16_384.0,
            network: NETWORK,
        };
        let outcome = farm.run();
        assert!(outcome.busy > 0.9, "{}", outcome.busy);
        // All the work is done: the speeds say how long it takes at least.
        let speed = RAYS / (TILE * farm.samples) * (922.0 + 102.0 / 4.0);
        let least = farm.tiles() as f64 / speed;
        assert!(outcome.seconds >= least && outcome.seconds < 1.1 * least);
        let dead = Farm {
            dead_every: 100,
            ..farm
        }
        .run();
        assert!(dead.seconds < 1.1 * least, "{} {least}", dead.seconds);
        // A network that carries less than the results breaks it.
        let narrow = Farm {
            samples: 4.0,
            ..farm
        }
        .run();
        assert!(narrow.busy < 0.5 && narrow.served > 0.9, "{}", narrow.busy);
    }
}
