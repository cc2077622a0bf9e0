//! Pairs pictures of two folders by their names.

use std::collections::BTreeMap;

use ivcam_base::diag::{Diagnostic, Sink};
use serde::{Deserialize, Serialize};

use super::files::PictureFile;

/// What decided that two pictures belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum PairedBy {
    /// The file of `--pair`.
    List,
    Name,
    /// What they show.
    Picture,
}

/// Two pictures that belong together, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilePair {
    pub new: usize,
    pub old: usize,
    pub by: PairedBy,
    /// For a pair by picture, a bound on the probability that any of the tried pairs agrees as
    /// well although the pictures are unrelated.
    pub chance: Option<f64>,
}

/// The pairs, and the pictures that have no partner yet.
#[derive(Debug)]
pub(super) struct Pairing {
    pub pairs: Vec<FilePair>,
    is_paired: [Vec<bool>; 2],
}

/// Returns what has to be equal in the names of two pictures.
type Key = fn(&PictureFile) -> String;

/// What is compared, in this order. The last one ignores the folders.
const KEYS: [Key; 4] = [
    |file| file.name.clone(),
    |file| file.stem.clone(),
    |file| file.stem.to_lowercase(),
    |file| {
        let stem = file.stem.to_lowercase();
        stem.rsplit('/').next().unwrap_or_default().to_owned()
    },
];
/// The number of the key for which a warning says that several pictures have it. With the key
/// after it, equal names in different folders are usual.
const WARNED: usize = 2;

impl Pairing {
    /// Returns the pairing of so many new and old pictures without a pair.
    pub(super) fn of(new: usize, old: usize) -> Self {
        Self {
            pairs: Vec::new(),
            is_paired: [vec![false; new], vec![false; old]],
        }
    }

    pub(super) fn add(&mut self, pair: FilePair) {
        self.is_paired[0][pair.new] = true;
        self.is_paired[1][pair.old] = true;
        self.pairs.push(pair);
    }

    /// Returns the numbers of the new and of the old pictures without a partner.
    pub(super) fn free(&self) -> [Vec<usize>; 2] {
        [0, 1].map(|side| {
            let paired = self.is_paired[side].iter().enumerate();
            paired
                .filter(|(_, paired)| !**paired)
                .map(|(i, _)| i)
                .collect()
        })
    }

    /// Returns whether the pictures of a pair have no partner yet.
    pub(super) fn is_free(&self, new: usize, old: usize) -> bool {
        !self.is_paired[0][new] && !self.is_paired[1][old]
    }

    /// Pairs pictures of the same name: first those whose whole paths are equal, then without the
    /// ending, then in upper or lower case, then without the folders. Where several pictures have
    /// a name, none of them is paired; `sink` receives a warning.
    pub(super) fn add_by_name(
        &mut self,
        new: &[PictureFile],
        old: &[PictureFile],
        sink: &mut Sink,
    ) {
        for (number, key) in KEYS.iter().enumerate() {
            let mut named: BTreeMap<String, [Vec<usize>; 2]> = BTreeMap::new();
            for ((side, free), files) in self.free().into_iter().enumerate().zip([new, old]) {
                for i in free {
                    named.entry(key(&files[i])).or_default()[side].push(i);
                }
            }
            for (name, sides) in &named {
                match [&sides[0][..], &sides[1][..]] {
                    [&[new], &[old]] => self.add(FilePair {
                        new,
                        old,
                        by: PairedBy::Name,
                        chance: None,
                    }),
                    [[], _] | [_, []] => {}
                    several if number == WARNED => {
                        sink.add(*ambiguous(name, several, new, old));
                    }
                    _ => {}
                }
            }
        }
    }
}

/// Returns the warning about several pictures with one name.
fn ambiguous(
    name: &str,
    [a, b]: [&[usize]; 2],
    new: &[PictureFile],
    old: &[PictureFile],
) -> Box<Diagnostic> {
    let list = |numbers: &[usize], files: &[PictureFile]| {
        let names = numbers.iter().map(|i| format!("`{}`", files[*i].name));
        names.collect::<Vec<_>>().join(", ")
    };
    let text = format!(
        "several pictures have the name `{name}`: new {}; old {}",
        list(a, new),
        list(b, old)
    );
    Diagnostic::warning(text).with_help("`--pair FILE.csv` states which belong together")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::{Path, PathBuf};

    fn files(names: &[&str]) -> Vec<PictureFile> {
        let files = names.iter().map(|name| Path::new("f").join(name));
        files
            .map(|path: PathBuf| PictureFile::below(Path::new("f"), path))
            .collect()
    }

    /// Returns the pairs of two lists of names, the numbers of the rest, and the warnings.
    fn paired(new: &[&str], old: &[&str]) -> (Vec<String>, [Vec<usize>; 2], Vec<String>) {
        let (new, old) = (files(new), files(old));
        let mut sink = Sink::new();
        let mut pairing = Pairing::of(new.len(), old.len());
        pairing.add_by_name(&new, &old, &mut sink);
        let text = |pair: &FilePair| format!("{} {}", new[pair.new].name, old[pair.old].name);
        (
            pairing.pairs.iter().map(text).collect(),
            pairing.free(),
            sink.items().iter().map(|d| d.message.clone()).collect(),
        )
    }

    #[test]
    fn names_pair_by_path_then_ending_then_case_then_without_folders() {
        let (pairs, free, said) = paired(
            &["a.png", "b/a.png", "c.v2.png", "D.PNG", "e.png", "only.png"],
            &[
                "a.png",
                "b/a.jpg",
                "c.v2.rgb",
                "d.tif",
                "scans/1999/e.jpg",
                "other.png",
            ],
        );
        let expected = [
            "a.png a.png",
            "b/a.png b/a.jpg",
            "c.v2.png c.v2.rgb",
            "D.PNG d.tif",
            "e.png scans/1999/e.jpg",
        ];
        assert_eq!(pairs, expected);
        assert_eq!(free, [[5], [5]]);
        assert_eq!(said.len(), 0, "{said:?}");
    }

    #[test]
    fn an_equal_ending_decides_and_else_several_of_one_name_are_left() {
        let (pairs, free, said) =
            paired(&["a.png", "b.png"], &["a.jpg", "a.png", "b.gif", "b.jpg"]);
        assert_eq!(pairs, ["a.png a.png"]);
        assert_eq!(free, [vec![1], vec![0, 2, 3]]);
        assert_eq!(
            said,
            ["several pictures have the name `b`: new `b.png`; old `b.gif`, `b.jpg`"]
        );
        let (pairs, _, said) = paired(&["x/t.png", "y/t.png"], &["z/t.png"]);
        assert_eq!((pairs.len(), said.len()), (0, 0));
    }
}
