//! Pairs pictures by what they show: every new one is aligned with every old one.
//!
//! An alignment comes with a bound on the probability that unrelated pictures agree as well. The
//! best of many tries agrees better than one, so the bound is multiplied by the number of tries
//! (Bonferroni) before it is compared with the limit of a single alignment.

use std::collections::BTreeMap;

use ivcam_base::diag::{Diagnostic, Result};
use serde::{Deserialize, Serialize};

use super::entry::Stamp;
use super::files::PictureFile;
use super::pairing::{FilePair, PairedBy, Pairing};
use super::pictures::within;
use super::progress::ReportProgress;
use crate::archive::for_each;
use crate::compare::{CHANCE_LIMIT, Matching, Options, Plane, Plate, Registration, compare};

/// The longer side of the pictures that are aligned, in pixels. The bound on chance is computed at
/// 96 pixels and fewer, so twice that loses nothing of it.
const SIDE: usize = 192;

/// A picture for the search.
pub(super) struct SearchPicture {
    /// The number of the picture in its list.
    pub number: usize,
    name: String,
    stamp: Stamp,
    luma: Plane,
}

impl SearchPicture {
    /// Keeps the brightness of a small copy of a picture: at most 150 kB.
    pub(super) fn of(number: usize, file: &PictureFile, plate: &Plate) -> Self {
        Self {
            number,
            name: file.name.clone(),
            stamp: Stamp::of(&file.path),
            luma: within(plate, SIDE).luma(),
        }
    }

    fn plate(&self) -> Plate {
        Plate::from_planes([self.luma.clone(), self.luma.clone(), self.luma.clone()])
    }
}

/// What a search has tried and found. The next one does not try it again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SearchRecord {
    /// The new and the old pictures, with the state of their files.
    files: [Vec<(String, Stamp)>; 2],
    found: Vec<FoundPair>,
}

/// Two pictures that a single alignment takes to show the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct FoundPair {
    new: String,
    old: String,
    /// The bound on the probability of one try.
    chance: f64,
    agreement: f64,
}

impl SearchRecord {
    /// Returns the number of pairs that were tried.
    pub(super) fn tried(&self) -> usize {
        self.files[0].len() * self.files[1].len()
    }

    /// Returns whether a picture is one of the record, and has not changed.
    fn has(&self, side: usize, picture: &SearchPicture) -> bool {
        let is_it =
            |(name, stamp): &(String, Stamp)| *name == picture.name && *stamp == picture.stamp;
        self.files[side].iter().any(is_it)
    }

    /// Returns the pair of two pictures that the record has.
    fn pair(&self, new: &SearchPicture, old: &SearchPicture) -> Option<&FoundPair> {
        let mut found = self.found.iter();
        found.find(|pair| pair.new == new.name && pair.old == old.name)
    }
}

/// Two pictures that agree beyond chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Agreement {
    pub new: usize,
    pub old: usize,
    /// The bound on the probability, multiplied by the number of tries.
    pub chance: f64,
    /// The correlation of local contrast.
    pub agreement: f64,
}

/// Aligns all pairs of some new and old pictures, but for those that `last` has. Returns what was
/// tried by now, and the pairs that agree beyond chance, the best first.
///
/// # Errors
/// Returns an error if the threads cannot be started.
pub(super) fn agreements(
    [new, old]: [&[&SearchPicture]; 2],
    last: &SearchRecord,
    threads: usize,
    progress: &mut dyn ReportProgress,
) -> Result<(SearchRecord, Vec<Agreement>)> {
    let known = [(0, new), (1, old)].map(|(number, side)| -> Vec<bool> {
        let pictures = side.iter();
        pictures.map(|picture| last.has(number, picture)).collect()
    });
    let all = || (0..new.len()).flat_map(|i| (0..old.len()).map(move |j| (i, j)));
    let is_known = |&(i, j): &(usize, usize)| known[0][i] && known[1][j];
    let mut found: BTreeMap<(usize, usize), FoundPair> = BTreeMap::new();
    for (i, j) in all().filter(is_known) {
        let pair = last.pair(new[i], old[j]);
        found.extend(pair.map(|pair| ((i, j), pair.clone())));
    }
    let tries: Vec<(usize, usize)> = all().filter(|pair| !is_known(pair)).collect();
    progress.begin(tries.len());
    let work = |&(i, j): &(usize, usize)| aligned(new[i], old[j]);
    let mut done = |&pair: &(usize, usize), result: Result<FoundPair>| {
        progress.done("pairs by picture");
        // An error says that the two do not agree.
        found.extend(result.ok().map(|found| (pair, found)));
    };
    for_each(&tries, threads, &work, &mut done)?;
    let tried = (new.len() * old.len()) as f64;
    let mut agreements: Vec<Agreement> = found
        .iter()
        .map(|(&(i, j), pair)| Agreement {
            new: new[i].number,
            old: old[j].number,
            chance: pair.chance * tried,
            agreement: pair.agreement,
        })
        .collect();
    agreements.retain(|agreement| agreement.chance <= CHANCE_LIMIT);
    sort(&mut agreements);
    let files = |side: &[&SearchPicture]| {
        let pictures = side.iter();
        pictures.map(|p| (p.name.clone(), p.stamp)).collect()
    };
    let record = SearchRecord {
        files: [files(new), files(old)],
        found: found.into_values().collect(),
    };
    Ok((record, agreements))
}

/// Aligns two pictures.
fn aligned(new: &SearchPicture, old: &SearchPicture) -> Result<FoundPair> {
    let options = Options {
        registration: Registration::Align,
        matching: Matching::None,
        ..Options::default()
    };
    let alignment = compare(&new.plate(), &old.plate(), &options)?.alignment;
    let none = || Diagnostic::error("no alignment");
    let alignment = alignment.ok_or_else(none)?;
    Ok(FoundPair {
        new: new.name.clone(),
        old: old.name.clone(),
        chance: alignment.chance,
        agreement: alignment.agreement,
    })
}

/// Sorts the least likely by chance to the front. Ties, such as probabilities that are too small
/// for a number, are decided by the agreement and then by the order of the pictures.
fn sort(found: &mut [Agreement]) {
    found.sort_by(|a, b| {
        let chance = a.chance.total_cmp(&b.chance);
        let agreement = b.agreement.total_cmp(&a.agreement);
        let order = (a.new, a.old).cmp(&(b.new, b.old));
        chance.then(agreement).then(order)
    });
}

/// Pairs pictures that agree, the best first. Returns the agreements of pictures whose partners
/// are taken.
pub(super) fn add_found(pairing: &mut Pairing, found: &[Agreement]) -> Vec<Agreement> {
    let mut rest = Vec::new();
    for agreement in found {
        if !pairing.is_free(agreement.new, agreement.old) {
            rest.push(*agreement);
            continue;
        }
        pairing.add(FilePair {
            new: agreement.new,
            old: agreement.old,
            by: PairedBy::Picture,
            chance: Some(agreement.chance),
        });
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A progress that counts what is done.
    #[derive(Default)]
    struct Count(usize);

    impl ReportProgress for Count {
        fn begin(&mut self, _: usize) {}
        fn done(&mut self, _: &str) {
            self.0 += 1;
        }
    }

    /// Returns a picture with boxes that depend on `seed`; `gamma` is that of its tones.
    fn boxes(seed: u64, gamma: f32) -> Plate {
        let mut state = seed;
        let mut next = |n: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) % n) as usize
        };
        let boxes: Vec<[usize; 5]> = (0..40)
            .map(|_| [next(120), next(80), 6 + next(30), 6 + next(20), next(256)])
            .collect();
        let plane = Plane::from_fn(120, 80, |x, y| {
            let inside = |b: &&[usize; 5]| {
                (b[0]..b[0] + b[2]).contains(&x) && (b[1]..b[1] + b[3]).contains(&y)
            };
            let level = boxes.iter().rev().find(inside).map_or(128, |b| b[4]);
            libm::powf(level as f32 / 255.0, gamma)
        });
        Plate::from_planes([plane.clone(), plane.clone(), plane])
    }

    /// Returns pictures with names and without files.
    fn side(seeds: &[u64], gamma: f32) -> Vec<SearchPicture> {
        let pictures = seeds.iter().enumerate();
        let named = |(i, seed): (usize, &u64)| {
            let path = Path::new("none").join(format!("{seed}.png"));
            let file = PictureFile::below(Path::new("none"), path);
            SearchPicture::of(i, &file, &boxes(*seed, gamma))
        };
        pictures.map(named).collect()
    }

    #[test]
    #[ignore = "a measurement of minutes, listed in docs/performance.md"]
    fn pictures_that_show_the_same_are_paired_and_others_are_not() {
        let (new, mut old) = (side(&[1], 1.0), side(&[3, 1], 1.6));
        let mut count = Count::default();
        let mut run = |old: &[SearchPicture], last: &SearchRecord| {
            let sides = [new.iter().collect::<Vec<_>>(), old.iter().collect()];
            let before = count.0;
            let found = agreements([&sides[0], &sides[1]], last, 2, &mut count).unwrap();
            (found, count.0 - before)
        };
        let (first, tries) = run(&old, &SearchRecord::default());
        assert_eq!((tries, first.0.tried()), (2, 2));
        assert_eq!(
            run(&old, &first.0),
            (first.clone(), 0),
            "nothing has changed"
        );
        let mut pairing = Pairing::of(1, 2);
        let rest = add_found(&mut pairing, &first.1);
        let pairs: Vec<_> = pairing.pairs.iter().map(|p| (p.new, p.old)).collect();
        assert_eq!(pairs, [(0, 1)]);
        assert_eq!((rest.len(), pairing.free()), (0, [vec![], vec![0]]));
        let one = first.0.found[0].chance;
        assert!(
            one > 0.0 && pairing.pairs[0].chance == Some(2.0 * one),
            "two tries"
        );
        old[1].stamp.bytes += 1;
        let (changed, tries) = run(&old, &first.0);
        assert_eq!((tries, changed.1), (1, first.1), "one file has changed");
    }

    #[test]
    fn the_better_of_two_partners_is_taken_and_the_other_is_returned() {
        let agreement = |new, old, chance, agreement| Agreement {
            new,
            old,
            chance,
            agreement,
        };
        let mut found = [
            agreement(0, 0, 1e-9, 0.9),
            agreement(1, 1, 0.0, 0.8),
            agreement(0, 1, 0.0, 0.95),
            agreement(1, 0, 1e-20, 0.9),
        ];
        sort(&mut found);
        let mut pairing = Pairing::of(2, 2);
        let rest = add_found(&mut pairing, &found);
        let pairs: Vec<_> = pairing.pairs.iter().map(|p| (p.new, p.old)).collect();
        assert_eq!(pairs, [(0, 1), (1, 0)]);
        let rest: Vec<_> = rest.iter().map(|a| (a.new, a.old)).collect();
        assert_eq!(rest, [(1, 1), (0, 0)]);
    }
}
