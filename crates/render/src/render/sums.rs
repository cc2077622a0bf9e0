//! The sums of a film's samples while it is exposed, and between two runs of the program.
//!
//! A render of all samples from the first has one film: the sums of whole units are folded when
//! they are finished. The unit in work has a film of its own if others are finished, so that its
//! samples are added one by one after an interruption too. A render of later samples keeps every
//! unit, because a fold has to begin with the first one.

use std::io::{Error, ErrorKind, Read, Write};
use std::sync::Arc;

use ivcam_optics::film::{Exposed, Film, Region, Resolution};
use serde::{Deserialize, Serialize};

use super::exposure::{Counts, Stopped};
use super::segment::{Segment, write_pixels};
use super::shares::SampleShares;
use super::stopwatch::Spent;
use super::tile::Tile;
use super::units::{border_after, border_before, is_border};

/// Looks after a render while it runs. Threads call it at the same time.
pub trait Keeper: Sync {
    /// Returns whether the render has to end.
    fn is_stopped(&self) -> bool;
    /// Returns whether the state has to be kept now. Of several threads that ask at the same time,
    /// one gets the answer true.
    fn is_due(&self) -> bool;
    /// Keeps the state.
    fn keep(&self, state: &StateView<'_, '_>);
}

/// Where a render is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PicturePlace {
    /// The size of the picture.
    pub picture: Resolution,
    /// The part of the picture that is rendered.
    pub region: Region,
    /// The number of the first sample of a pixel.
    pub first: u32,
    /// The number of the first sample that not all pixels have.
    pub done: u32,
    /// The number of the first sample that no pixel has.
    pub end: u32,
    /// The number of the first sample after the present pass.
    pub until: u32,
    /// The number of samples from which the next estimate of the error is worthwhile.
    pub next_estimate: u32,
}

impl PicturePlace {
    /// Returns whether all pixels have the same samples.
    pub fn is_even(&self) -> bool {
        self.done == self.end
    }
}

/// The sums of a film's samples.
#[derive(Clone, Debug)]
pub struct Sums {
    /// What is rendered, and which samples the pixels have.
    pub place: PicturePlace,
    /// The distribution of the samples over the pixels.
    pub(super) shares: Arc<SampleShares>,
    /// The films of finished units that are not folded into the last one, in order.
    earlier: Vec<Vec<Exposed>>,
    /// The film of the last unit, or the fold of all units from the first.
    pub(super) last: Vec<Exposed>,
    /// The numbers of the tiles that have the samples of `done..end` already.
    pub(super) finished: Vec<u64>,
    /// The rays that were traced.
    pub counts: Counts,
    /// The time that they took.
    pub spent: Spent,
}

impl Sums {
    /// Returns the sums of a film without samples, whose first will have a number.
    pub(super) fn new(
        picture: Resolution,
        region: Region,
        first: u32,
        shares: Arc<SampleShares>,
    ) -> Self {
        Self {
            place: PicturePlace {
                picture,
                region,
                first,
                done: first,
                end: first,
                until: first,
                next_estimate: 0,
            },
            shares,
            earlier: Vec::new(),
            last: vec![Exposed::default(); region.resolution().pixels()],
            finished: Vec::new(),
            counts: Counts::default(),
            spent: Spent::default(),
        }
    }

    /// Begins the next samples that are exposed together, at most those of the pass. They are
    /// those of whole units, or some of one unit.
    pub(super) fn begin(&mut self) {
        let PicturePlace {
            first, done, until, ..
        } = self.place;
        if !self.place.is_even() {
            return; // It was interrupted.
        }
        let folds = first == 0 && border_before(until) > done;
        self.place.end = match is_border(done) {
            true if folds => border_before(until),
            _ => border_after(done).min(until),
        };
        if is_border(done) && done > first && !folds {
            let empty = vec![Exposed::default(); self.last.len()];
            self.earlier.push(std::mem::replace(&mut self.last, empty));
        }
    }

    /// Ends the samples that [`Sums::begin`] has begun.
    pub(super) fn end(&mut self) {
        self.place.done = self.place.end;
        self.finished.clear();
        if self.place.first == 0 && is_border(self.place.done) {
            self.last = self.folded();
        }
    }

    /// Folds all units, and empties the sums.
    pub fn folded(&mut self) -> Vec<Exposed> {
        let mut units = std::mem::take(&mut self.earlier).into_iter();
        let last = std::mem::take(&mut self.last);
        let Some(mut sum) = units.next() else {
            return last;
        };
        for unit in units.chain([last]) {
            add(&mut sum, &unit);
        }
        sum
    }

    /// Adds later samples of the same pixels, which begin where these end, at a border of units.
    pub fn append(&mut self, next: Self) {
        let is_last_whole = is_border(next.place.done);
        let mut units = next.earlier.into_iter().chain([next.last]).peekable();
        while let Some(unit) = units.next() {
            let is_whole = is_last_whole || units.peek().is_some();
            if self.place.first == 0 && is_whole {
                add(&mut self.last, &unit);
            } else {
                self.earlier.push(std::mem::replace(&mut self.last, unit));
            }
        }
        let PicturePlace { done, .. } = next.place;
        (self.place.done, self.place.end, self.place.until) = (done, done, done);
        self.add_cost(&next.counts, next.spent);
    }

    /// Moves sums of whole passes onto a larger region, whose other pixels have none.
    pub fn on(&self, region: Region) -> Self {
        let blank = || vec![Exposed::default(); region.resolution().pixels()];
        let mut whole = Self {
            place: PicturePlace {
                region,
                ..self.place.clone()
            },
            shares: self.shares.clone(),
            earlier: self.earlier.iter().map(|_| blank()).collect(),
            last: blank(),
            finished: Vec::new(),
            counts: Counts::default(),
            spent: Spent::default(),
        };
        whole.lay(self);
        whole
    }

    /// Replaces the pixels of a region by those of sums of the same samples.
    pub fn lay(&mut self, part: &Self) {
        let whole = self.place.region;
        let films = self.earlier.iter_mut().chain([&mut self.last]);
        for (film, own) in films.zip(part.earlier.iter().chain([&part.last])) {
            whole.paste(film, own, part.place.region);
        }
        self.add_cost(&part.counts, part.spent);
    }

    /// Returns the film of the samples, without ghosts and without an error. The sums are empty
    /// afterwards.
    pub fn film(&mut self) -> Film {
        Film::of_pixels(self.place.region.resolution(), self.folded())
    }

    /// Calls `look` with the film of the samples.
    pub(super) fn with_film<T>(&mut self, look: impl FnOnce(&Film) -> T) -> T {
        if !self.earlier.is_empty() {
            return look(&self.clone().film());
        }
        let film = self.film();
        let result = look(&film);
        self.last = film.pixels;
        result
    }

    /// Returns the work in the sums, as in [`Progress`](super::Progress).
    pub(super) fn work_done(&self) -> u64 {
        let PicturePlace {
            region,
            first,
            done,
            end,
            ..
        } = self.place;
        let finished = self.finished.len() as u64 * u64::from(end - done);
        u64::from(done - first) * Tile::count(region) + finished
    }

    /// Returns where the render was stopped, if some pixels have more samples than others.
    pub fn stopped(&self) -> Option<Stopped> {
        let PicturePlace {
            first, done, end, ..
        } = self.place;
        let tiles = Tile::count(self.place.region) as f64;
        (done < end).then(|| Stopped {
            samples: done - first,
            more: end - first,
            part: self.finished.len() as f64 / tiles,
        })
    }

    /// Adds rays and time.
    pub(super) fn add_cost(&mut self, counts: &Counts, spent: Spent) {
        self.counts.add(counts);
        self.spent = self.spent.plus(spent);
    }

    /// Calls `look` with the state between samples that are exposed together.
    pub fn show(&mut self, look: &mut dyn FnMut(&StateView<'_, '_>)) {
        let mut last = std::mem::take(&mut self.last);
        let done = self.place.done;
        let segment = Segment::new(self.place.region, done..done, &mut last, &self.finished);
        look(&self.snapshot(&segment, self.spent));
        drop(segment);
        self.last = last;
    }

    /// Returns the state of a render whose last film is in a segment. `spent` is the time of all
    /// runs.
    pub(super) fn snapshot<'s, 'p>(
        &'s self,
        segment: &'s Segment<'p>,
        spent: Spent,
    ) -> StateView<'s, 'p> {
        StateView {
            sums: self,
            segment,
            spent,
        }
    }
}

/// The state of a render while threads may be exposing its last film.
pub struct StateView<'s, 'p> {
    sums: &'s Sums,
    segment: &'s Segment<'p>,
    spent: Spent,
}

impl StateView<'_, '_> {
    /// Writes the state, which [`Sums::read`] reads.
    ///
    /// # Errors
    /// Returns the errors of writing.
    pub fn write(&self, to: &mut dyn Write) -> std::io::Result<()> {
        let sums = self.sums;
        let head = (&sums.place, &*sums.shares, sums.earlier.len() as u32);
        let head = postcard::to_allocvec(&head).map_err(Error::other)?;
        to.write_all(&(head.len() as u64).to_le_bytes())?;
        to.write_all(&head)?;
        for film in &sums.earlier {
            write_pixels(film, to)?;
        }
        let counts = self.segment.write(to)?.plus(&sums.counts);
        for count in counts.to_array() {
            to.write_all(&count.to_le_bytes())?;
        }
        let Spent {
            seconds,
            processor_seconds,
        } = self.spent;
        to.write_all(&seconds.to_le_bytes())?;
        to.write_all(&processor_seconds.unwrap_or(f64::NAN).to_le_bytes())
    }

    /// Calls `look` with each row of tiles, as a part of the region that is rendered, and the
    /// linear exposure values of its pixels. A pixel without samples is black.
    ///
    /// # Errors
    /// Returns the first error of `look`.
    pub fn for_each_row(
        &self,
        mut look: impl FnMut(Region, &[[f32; 3]]) -> std::io::Result<()>,
    ) -> std::io::Result<()> {
        let Region { left, top, .. } = self.sums.place.region;
        let mut before = 0;
        for (rows, last) in self.segment.rows() {
            let level = |(i, last): (usize, &Exposed)| {
                let mut sum = Exposed::default();
                let earlier = self.sums.earlier.iter().map(|film| &film[before + i]);
                earlier.chain([last]).for_each(|unit| sum.join(unit));
                sum.mean.as_vec3().to_array()
            };
            let levels: Vec<[f32; 3]> = last.iter().enumerate().map(level).collect();
            before += last.len();
            let rows = Region {
                left: rows.left - left,
                top: rows.top - top,
                ..rows
            };
            look(rows, &levels)?;
        }
        Ok(())
    }
}

impl Sums {
    /// Reads a state that `Snapshot::write` has written, in a number of bytes.
    ///
    /// # Errors
    /// Returns the errors of reading, and an error if the bytes are not a state.
    pub fn read(from: &mut dyn Read, length: u64) -> std::io::Result<Self> {
        let head_length = u64::from_le_bytes(bytes(from)?);
        let left = length.checked_sub(8);
        let left = left.and_then(|left| left.checked_sub(head_length));
        let left = left.ok_or_else(cut_short)?;
        let mut head = vec![0; head_length as usize];
        from.read_exact(&mut head)?;
        let head: (PicturePlace, SampleShares, u32) =
            postcard::from_bytes(&head).map_err(|e| Error::new(ErrorKind::InvalidData, e))?;
        let (place, shares, films) = head;
        if !place.is_possible() || !shares.fit(place.picture) {
            return Err(Error::new(
                ErrorKind::InvalidData,
                "its numbers contradict each other",
            ));
        }
        let Region { width, .. } = place.region;
        let pixels = place.region.resolution().pixels();
        let bits = |row: Region| Tile::count(row).div_ceil(8);
        let all_bits: u64 = Tile::rows(place.region).map(bits).sum();
        let of_films = (u64::from(films) + 1).checked_mul((pixels * Exposed::BYTES) as u64);
        if of_films.and_then(|films| films.checked_add(all_bits + TAIL)) != Some(left) {
            return Err(cut_short());
        }
        let mut earlier = Vec::new();
        for _ in 0..films {
            let mut film = Vec::with_capacity(pixels);
            read_pixels(from, pixels, &mut film)?;
            earlier.push(film);
        }
        let mut last = Vec::with_capacity(pixels);
        let (mut finished, mut tiles) = (Vec::new(), 0);
        for row in Tile::rows(place.region) {
            let mut marks = vec![0; bits(row) as usize];
            from.read_exact(&mut marks)?;
            let count = Tile::count(row);
            let is_finished = |n: &u64| marks[(n / 8) as usize] >> (n % 8) & 1 == 1;
            finished.extend((0..count).filter(is_finished).map(|n| tiles + n));
            tiles += count;
            read_pixels(from, (row.height * width) as usize, &mut last)?;
        }
        let mut counts = [0; 5];
        for count in &mut counts {
            *count = u64::from_le_bytes(bytes(from)?);
        }
        let seconds = f64::from_le_bytes(bytes(from)?);
        let processor_seconds = Some(f64::from_le_bytes(bytes(from)?));
        Ok(Self {
            place,
            shares: Arc::new(shares),
            earlier,
            last,
            finished,
            counts: Counts::from_array(counts),
            spent: Spent {
                seconds,
                processor_seconds: processor_seconds.filter(|s| !s.is_nan()),
            },
        })
    }
}

/// The bytes after the pixels: the numbers of rays and the times.
const TAIL: u64 = 7 * 8;

impl PicturePlace {
    /// Returns whether the numbers do not contradict each other.
    fn is_possible(&self) -> bool {
        let Resolution { width, height } = self.picture;
        Resolution::new(width, height).is_ok()
            && self.region.check(self.picture).is_ok()
            && self.first <= self.done
            && self.done <= self.end
            && self.end <= self.until.max(self.done)
            && self.until <= 1 << 24
    }
}

fn bytes<const N: usize>(from: &mut dyn Read) -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    from.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn cut_short() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "it is cut short")
}

fn read_pixels(from: &mut dyn Read, count: usize, to: &mut Vec<Exposed>) -> std::io::Result<()> {
    for start in (0..count).step_by(1024) {
        let mut bytes = vec![0; (count - start).min(1024) * Exposed::BYTES];
        from.read_exact(&mut bytes)?;
        to.extend(bytes.as_chunks().0.iter().map(Exposed::from_bytes));
    }
    Ok(())
}

/// Folds the pixels of later samples into those of earlier ones.
fn add(sum: &mut [Exposed], later: &[Exposed]) {
    for (pixel, later) in sum.iter_mut().zip(later) {
        pixel.join(later);
    }
}
