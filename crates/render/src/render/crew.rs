//! A render by several processes: the first hands out tiles and pairs, and all expose them.
//!
//! A piece of work has everything that it depends on besides the scene, the camera and the options,
//! which every process has, so its result has the same bits wherever it is done. The first process
//! has the film. It works too: one of its threads hands out pieces, and the others expose them.

use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use ivcam_optics::film::{Exposed, Pair};
use ivcam_optics::sampling::Sampler;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::batch::Batch;
use super::exposure::Counts;
use super::pairs::{AT_ONCE, PairDraw};
use super::passes::Render;
use super::segment::Segment;
use super::shares::SampleShares;
use super::tile::Tile;
use crate::scene::RenderScene;
use crate::team::{Schedule, Team};

/// How many pieces a process has at a time, so that it need not wait for the next one.
const PIECES: usize = 2;
/// How long the first process waits for messages before it looks for results of its own threads.
const TURN: Duration = Duration::from_millis(5);

/// A part of a render that any process can do.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum CrewWork {
    /// Adds samples to the pixels of tiles, tile by tile and row by row.
    Tiles {
        sampler: Sampler,
        samples: Range<u32>,
        /// Whether the pixels have the shares of adaptive sampling.
        shared: bool,
        tiles: Vec<Tile>,
        /// The pixels' samples so far; empty if they have none.
        sums: Vec<Exposed>,
    },
    /// Exposes pairs of pixels for the error.
    Pairs(Vec<PairDraw>),
}

/// What a process sends to the others.
#[derive(Debug, Serialize, Deserialize)]
enum Order {
    /// The shares of adaptive sampling follow as a broadcast.
    Shares,
    /// A piece of work, and which items of the list it is.
    Work(Range<u64>, CrewWork),
    /// There is no more work.
    End,
}

/// The result of a piece of work.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum CrewOutcome {
    Tiles(Vec<Exposed>, Counts),
    Pairs(Vec<Pair>, Counts),
}

/// A finished piece.
#[derive(Debug, Serialize, Deserialize)]
struct Finished {
    piece: Range<u64>,
    outcome: CrewOutcome,
    /// The seconds that it took.
    seconds: f64,
}

/// A list of work items that is done in pieces.
trait CrewJob: Send {
    /// The number of items.
    fn items(&self) -> u64;
    /// Returns some of the items as work.
    fn work(&self, piece: Range<u64>) -> CrewWork;
    /// Receives the result of some items. Returns whether the job goes on.
    fn take(&mut self, piece: Range<u64>, outcome: CrewOutcome) -> bool;
}

impl Render<'_> {
    /// Does the pieces of work that the first process of the team sends, until it ends. Uses
    /// rayon's current pool.
    pub fn serve(&self, team: &Team) {
        let mut shares = SampleShares::EVEN;
        loop {
            match team.receive(Duration::from_secs(1)) {
                Some((0, Order::Work(piece, work))) => {
                    team.send(0, &self.finish(piece, work, &shares));
                }
                Some((0, Order::Shares)) => {
                    shares = team.broadcast(None).unwrap_or(SampleShares::EVEN);
                }
                Some((0, Order::End)) => return,
                _ => {}
            }
        }
    }

    /// Sends the shares of adaptive sampling to all processes.
    pub(super) fn send_shares(&self, shares: &SampleShares) {
        if let Some(team) = self.team {
            order_all(team, &Order::Shares);
            team.broadcast(Some(shares.clone()));
        }
    }

    /// Exposes the open tiles of a segment by all processes of a team. Returns false if `proceed`
    /// did, which receives the number of finished tiles.
    pub(super) fn fill_by_team(
        &self,
        team: &Team,
        segment: &Segment<'_>,
        shares: &SampleShares,
        proceed: &(dyn Fn(u64) -> bool + Sync),
    ) -> bool {
        let mut job = TileJob {
            sampler: self.sampler,
            shared: !shares.is_even(),
            tiles: segment.open_tiles().concat(),
            segment,
            scene: self.shader.scene(),
            proceed,
        };
        self.run_job(team, &mut job, shares)
    }

    /// Exposes the pairs of draws by all processes of a team.
    pub(super) fn pairs_of_team(&self, team: &Team, draws: &[PairDraw]) -> (Vec<Pair>, Counts) {
        let mut job = PairJob {
            draws,
            pairs: vec![Vec::new(); draws.len().div_ceil(AT_ONCE)],
            counts: Counts::default(),
        };
        self.run_job(team, &mut job, &SampleShares::EVEN);
        (job.pairs.concat(), job.counts)
    }

    /// Does a job by all processes. Returns whether it was not abandoned.
    fn run_job(&self, team: &Team, job: &mut dyn CrewJob, shares: &SampleShares) -> bool {
        let (to_own, own_work) = channel();
        let (own_results, from_own) = channel();
        std::thread::scope(|scope| {
            // If this thread panics the results end, and the leader does not wait for more.
            let own_results = own_results;
            let leader = scope.spawn(move || hand_out(team, job, &to_own, &from_own));
            // This thread belongs to rayon's pool, whose other threads help it.
            for (piece, work) in own_work {
                if own_results.send(self.finish(piece, work, shares)).is_err() {
                    break;
                }
            }
            leader.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    }

    /// Does a piece of work and measures how long it takes.
    fn finish(&self, piece: Range<u64>, work: CrewWork, shares: &SampleShares) -> Finished {
        let start = Instant::now();
        let outcome = self.do_work(work, shares);
        Finished {
            piece,
            outcome,
            seconds: start.elapsed().as_secs_f64(),
        }
    }

    /// Does a piece of work on the threads of rayon's current pool.
    fn do_work(&self, work: CrewWork, shares: &SampleShares) -> CrewOutcome {
        match work {
            CrewWork::Tiles {
                sampler,
                samples,
                shared,
                tiles,
                sums,
            } => {
                let render = Render { sampler, ..*self };
                let shares = if shared { shares } else { &SampleShares::EVEN };
                let mut rest = &sums[..];
                let starts = tiles.chunks(render.tiles_at_once(&samples)).map(|tiles| {
                    let pixels = tiles.iter().map(|tile| tile.pixels().count()).sum();
                    let (own, after) = rest.split_at(rest.len().min(pixels));
                    rest = after;
                    let mut own = own.to_vec();
                    own.resize(pixels, Exposed::default());
                    (tiles, own)
                });
                let starts: Vec<(&[Tile], Vec<Exposed>)> = starts.collect();
                let expose = |batch: &mut Batch<'_>, (tiles, mut own): (&[Tile], Vec<Exposed>)| {
                    let counts = batch.expose(tiles, &mut own, &samples, shares);
                    (own, counts)
                };
                let starts = starts.into_par_iter();
                let done: Vec<_> = starts.map_init(|| Batch::new(&render), expose).collect();
                let mut counts = Counts::default();
                let mut sums = Vec::new();
                for (own, more) in done {
                    sums.extend(own);
                    counts.add(&more);
                }
                CrewOutcome::Tiles(sums, counts)
            }
            CrewWork::Pairs(draws) => {
                let (pairs, counts) = self.expose_draws(&draws);
                CrewOutcome::Pairs(pairs, counts)
            }
        }
    }
}

/// Hands out the pieces of a job, and takes the results. Returns whether it was not abandoned.
fn hand_out(
    team: &Team,
    job: &mut dyn CrewJob,
    to_own: &Sender<(Range<u64>, CrewWork)>,
    from_own: &Receiver<Finished>,
) -> bool {
    let mut schedule = Schedule::new(job.items(), team.size());
    let give = |schedule: &mut Schedule, job: &dyn CrewJob, rank: usize| {
        let Some(piece) = schedule.next(rank) else {
            return;
        };
        let work = job.work(piece.clone());
        match rank {
            // Nobody receives it only if this process's thread has panicked.
            0 => drop(to_own.send((piece, work))),
            _ => team.send(rank, &Order::Work(piece, work)),
        }
    };
    for _ in 0..PIECES {
        (0..team.size()).for_each(|rank| give(&mut schedule, job, rank));
    }
    let mut goes_on = true;
    while !schedule.is_done() {
        let message = match from_own.try_recv() {
            Ok(finished) => Some((0, finished)),
            Err(TryRecvError::Disconnected) => return false,
            Err(TryRecvError::Empty) => team.receive(TURN),
        };
        let Some((
            rank,
            Finished {
                piece,
                outcome,
                seconds,
            },
        )) = message
        else {
            continue;
        };
        if !schedule.finished(rank, &piece, seconds) {
            continue;
        }
        if goes_on && !job.take(piece, outcome) {
            goes_on = false;
            schedule.abandon();
        }
        give(&mut schedule, job, rank);
    }
    goes_on
}

/// The tiles of a film that get samples.
struct TileJob<'a, 'p> {
    sampler: Sampler,
    shared: bool,
    tiles: Vec<Tile>,
    segment: &'a Segment<'p>,
    scene: &'a RenderScene,
    proceed: &'a (dyn Fn(u64) -> bool + Sync),
}

impl TileJob<'_, '_> {
    /// Returns some of the tiles.
    fn some(&self, piece: &Range<u64>) -> &[Tile] {
        &self.tiles[piece.start as usize..piece.end as usize]
    }
}

impl CrewJob for TileJob<'_, '_> {
    fn items(&self) -> u64 {
        self.tiles.len() as u64
    }

    fn work(&self, piece: Range<u64>) -> CrewWork {
        let tiles = self.some(&piece).to_vec();
        let samples = self.segment.samples.clone();
        let sums = match samples.start {
            0 => Vec::new(),
            _ => tiles.iter().flat_map(|t| self.segment.pixels(*t)).collect(),
        };
        CrewWork::Tiles {
            sampler: self.sampler,
            samples,
            shared: self.shared,
            tiles,
            sums,
        }
    }

    fn take(&mut self, piece: Range<u64>, outcome: CrewOutcome) -> bool {
        let CrewOutcome::Tiles(sums, counts) = outcome else {
            return false;
        };
        if self.scene.is_stopped() {
            return false; // Rays may have been abandoned.
        }
        let tiles = self.some(&piece);
        (self.proceed)(self.segment.finish(tiles, &sums, &counts))
    }
}

/// The pairs of a film's error, in the chunks that a thread exposes at once.
struct PairJob<'a> {
    draws: &'a [PairDraw],
    pairs: Vec<Vec<Pair>>,
    counts: Counts,
}

impl CrewJob for PairJob<'_> {
    fn items(&self) -> u64 {
        self.pairs.len() as u64
    }

    fn work(&self, piece: Range<u64>) -> CrewWork {
        let end = (piece.end as usize * AT_ONCE).min(self.draws.len());
        CrewWork::Pairs(self.draws[piece.start as usize * AT_ONCE..end].to_vec())
    }

    fn take(&mut self, piece: Range<u64>, outcome: CrewOutcome) -> bool {
        let CrewOutcome::Pairs(pairs, counts) = outcome else {
            return false;
        };
        self.pairs[piece.start as usize] = pairs;
        self.counts.add(&counts);
        true
    }
}

/// Ends the work of the other processes.
pub fn end(team: &Team) {
    order_all(team, &Order::End);
}

/// Sends an order to all other processes.
fn order_all(team: &Team, order: &Order) {
    (1..team.size()).for_each(|rank| team.send(rank, order));
}
