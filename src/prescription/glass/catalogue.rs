//! Glasses by name: the table that comes with the program, and catalogues read from `.agf` files.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Source, Span, nearest};
use crate::files::{MAX_TEXT, read_file};

use crate::prescription::glass::agf;
use crate::prescription::glass::medium::{Formula, Medium};

const TABLE: &str = include_str!("../../../lenses/glasses.txt");

/// The makers' names that CODE V writes after an underscore, and Zemax on its GCAT line.
const MAKERS: [&str; 12] = [
    "SCHOTT",
    "OHARA",
    "HOYA",
    "HIKARI",
    "SUMITA",
    "CDGM",
    "CORNING",
    "NIKON",
    "LACROIX",
    "LIGHTPATH",
    "MISC",
    "INFRARED",
];

/// Glasses that a prescription can name.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// The glasses with the keys of their names. Of several with one name, the one added last is
    /// first.
    glasses: Vec<(String, Medium)>,
}

impl Default for Catalogue {
    fn default() -> Self {
        Self::builtin()
    }
}

impl Catalogue {
    /// The table in `lenses/glasses.txt`.
    pub fn builtin() -> Self {
        let rows = TABLE.lines().filter(|line| !line.starts_with('#'));
        Self {
            glasses: rows.filter_map(row).collect(),
        }
    }

    /// Adds glasses. They take precedence over those of the same name.
    pub fn add(&mut self, glasses: impl IntoIterator<Item = Medium>) {
        let added = glasses.into_iter().map(|glass| (key(&glass.name), glass));
        self.glasses.splice(0..0, added.collect::<Vec<_>>());
    }

    /// Reads an `.agf` file and adds its glasses.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read, or is not a glass catalogue.
    pub fn add_file(&mut self, path: impl AsRef<std::path::Path>) -> Result<()> {
        let path = path.as_ref();
        let bytes = read_file(path, MAX_TEXT)?;
        let source = Source::new(path.display().to_string(), bytes);
        self.add(agf::read(&Arc::new(source))?);
        Ok(())
    }

    /// Finds a glass by name. Case, dashes and the maker are ignored: `nbk7_SCHOTT` is N-BK7. A
    /// word after an underscore is also ignored if it is not a known maker: `SILICA_SPECIAL` is
    /// SILICA.
    pub fn find(&self, name: &str) -> Option<&Medium> {
        let find = |key: String| self.glasses.iter().find(|(k, _)| *k == key);
        let bare = || Some(name.rsplit_once('_')?.0).filter(|bare| !bare.is_empty());
        let found = find(key(name)).or_else(|| find(key(bare()?)));
        found.map(|(_, glass)| glass)
    }

    /// Finds a glass by name.
    ///
    /// # Errors
    ///
    /// Returns an error at `span` that names the nearest glass.
    pub fn get(&self, name: &str, source: &Arc<Source>, span: Span) -> Result<Medium> {
        if let Some(glass) = self.find(name) {
            return Ok(glass.clone());
        }
        let help = match self.nearest(name) {
            Some(near) => {
                format!("did you mean `{near}`? other glasses: --glass-catalogue FILE.agf")
            }
            None => "give its maker's catalogue: --glass-catalogue FILE.agf".to_owned(),
        };
        let message = format!("there is no glass named `{name}` in the table");
        Err(Diagnostic::not_found(message)
            .at(source, span)
            .with_help(help))
    }

    /// The name of the glass that is nearest to a misspelled one.
    pub fn nearest(&self, name: &str) -> Option<&str> {
        let bare = name.rsplit_once('_').map_or(
            name,
            |(glass, maker)| {
                if is_maker(maker) { glass } else { name }
            },
        );
        nearest(
            bare,
            self.glasses.iter().map(|(_, glass)| glass.name.as_str()),
        )
    }

    /// All glasses.
    pub fn glasses(&self) -> impl Iterator<Item = &Medium> {
        self.glasses.iter().map(|(_, glass)| glass)
    }
}

fn is_maker(word: &str) -> bool {
    MAKERS.iter().any(|maker| word.eq_ignore_ascii_case(maker))
}

/// The key of a name: its letters and digits in capitals, without the maker.
fn key(name: &str) -> String {
    let bare = match name.rsplit_once('_') {
        Some((glass, maker)) if is_maker(maker) => glass,
        _ => name,
    };
    let kept = bare.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|c| c.to_ascii_uppercase()).collect()
}

fn row(line: &str) -> Option<(String, Medium)> {
    let mut words = line.split_whitespace();
    let (_maker, name, formula) = (words.next()?, words.next()?, words.next()?);
    let mut k = [0.0; 10];
    for (slot, word) in k.iter_mut().zip(words) {
        *slot = word.parse().ok()?;
    }
    let glass = match formula {
        "sellmeier" => Medium::from_formula(Formula::Sellmeier1, k)?,
        "schott" => Medium::from_formula(Formula::Schott, k)?,
        "abbe" => Medium::from_abbe(k[0], k[1]),
        _ => return None,
    };
    Some((key(name), glass.named(name)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE};

    #[test]
    fn every_row_of_the_table_is_a_glass() {
        let rows = TABLE
            .lines()
            .filter(|l| !l.starts_with('#') && !l.trim().is_empty());
        let table = Catalogue::builtin();
        assert_eq!(table.glasses().count(), rows.count());
        for glass in table.glasses() {
            let abbe = glass.abbe().unwrap();
            assert!(
                (1.3..2.1).contains(&glass.n_d) && (15.0..100.0).contains(&abbe),
                "{glass:?}"
            );
        }
    }

    #[test]
    fn a_name_is_found_whatever_its_case_dashes_and_maker() {
        let table = Catalogue::builtin();
        for name in ["N-BK7", "nbk7", "NBK7_SCHOTT", "n-bk7_schott"] {
            assert_eq!(table.find(name).unwrap().name, "N-BK7");
        }
        assert!(table.find("F_SILICA").is_some());
        assert!(table.find("unobtainium").is_none());
        assert_eq!(table.nearest("N-BK77"), Some("N-BK7"));
    }

    /// Five places of n at F, d, C as the makers' data sheets print them.
    #[test]
    fn the_table_gives_the_published_indices() {
        let table = Catalogue::builtin();
        for (name, n) in [
            ("N-BK7", [1.52238, 1.51680, 1.51432]),
            ("SF6", [1.82775, 1.80518, 1.79609]),
            ("F2", [1.63208, 1.62004, 1.61503]),
            ("S-FPL51", [1.50123, 1.49700, 1.49514]),
        ] {
            let glass = table.find(name).unwrap();
            for (line, n) in [F_LINE, D_LINE, C_LINE].into_iter().zip(n) {
                assert!(
                    (glass.index(line) - n).abs() < 6e-6,
                    "{name} {}",
                    glass.index(line)
                );
            }
        }
    }
}
