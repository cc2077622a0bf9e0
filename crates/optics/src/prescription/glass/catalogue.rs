//! Glasses by name: the table that comes with the program, and catalogues read from `.agf` files.

use std::sync::{Arc, LazyLock, OnceLock};

use ivcam_base::diag::{Diagnostic, Result, Source, Span, nearest};
use ivcam_base::files::{MAX_TEXT, read_file};

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

/// The ends of the keys of Schott's glasses that transmit more light than the plain ones.
const TRANSMITS_MORE: [&str; 2] = ["HTULTRA", "HT"];

/// Glasses that a prescription can name.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// The glasses that are not in the table, with the keys of their names. Of several with one
    /// name, the one added last is first.
    added: Vec<(String, Medium)>,
    table: &'static GlassTable,
}

/// The table in `lenses/glasses.txt`.
#[derive(Debug)]
struct GlassTable {
    rows: Vec<GlassRow>,
    /// The keys of other names of glasses, with the keys of their names in the table.
    aliases: Vec<(String, String)>,
    /// The keys of glasses that are not in the table, with the keys of those that replace them.
    substitutes: Vec<(String, String)>,
}

/// A glass of the table. A lens needs few of its 1,700, so each is made when it is asked for.
#[derive(Debug)]
struct GlassRow {
    key: String,
    name: &'static str,
    line: &'static str,
    made: OnceLock<Option<Medium>>,
}

impl GlassRow {
    fn glass(&self) -> Option<&Medium> {
        self.made.get_or_init(|| glass(self.line)).as_ref()
    }
}

impl GlassTable {
    fn read() -> Self {
        let (mut rows, mut aliases, mut substitutes) = (Vec::new(), Vec::new(), Vec::new());
        for line in TABLE.lines().filter(|line| !line.starts_with('#')) {
            let mut words = line.split_whitespace().skip(1);
            let (Some(name), Some(word)) = (words.next(), words.next()) else {
                continue;
            };
            let mut pair = || Some((key(name), key(words.next()?)));
            match word {
                "is" => aliases.extend(pair()),
                "like" => substitutes.extend(pair()),
                _ => rows.push(GlassRow {
                    key: key(name),
                    name,
                    line,
                    made: OnceLock::new(),
                }),
            }
        }
        Self {
            rows,
            aliases,
            substitutes,
        }
    }
}

impl Default for Catalogue {
    fn default() -> Self {
        Self::builtin()
    }
}

impl Catalogue {
    /// The table in `lenses/glasses.txt`.
    pub fn builtin() -> Self {
        static READ: LazyLock<GlassTable> = LazyLock::new(GlassTable::read);
        Self {
            added: Vec::new(),
            table: &READ,
        }
    }

    /// Adds glasses. They take precedence over those of the same name.
    pub fn add(&mut self, glasses: impl IntoIterator<Item = Medium>) {
        let added = glasses.into_iter().map(|glass| (key(&glass.name), glass));
        self.added.splice(0..0, added.collect::<Vec<_>>());
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
    /// SILICA. So are `HT` and `HTultra` at the end, which Schott adds to glasses that transmit
    /// more light; their indices are the same.
    pub fn find(&self, name: &str) -> Option<&Medium> {
        let bare = || Some(name.rsplit_once('_')?.0).filter(|bare| !bare.is_empty());
        self.find_key(&key(name))
            .or_else(|| self.find_key(&key(bare()?)))
    }

    fn find_key(&self, key: &str) -> Option<&Medium> {
        let plain = TRANSMITS_MORE.iter().find_map(|end| key.strip_suffix(end));
        let alias = self.table.aliases.iter().find(|(from, _)| from == key);
        let keys = [Some(key), alias.map(|(_, to)| to.as_str()), plain];
        keys.into_iter().flatten().find_map(|key| self.of_key(key))
    }

    /// The glass whose name has exactly this key.
    fn of_key(&self, key: &str) -> Option<&Medium> {
        let added = self.added.iter().find(|(k, _)| k == key);
        let table = || self.table.rows.iter().find(|row| row.key == key)?.glass();
        added.map(|(_, glass)| glass).or_else(table)
    }

    /// The glass that takes the place of one that is not in the table: the one that the table
    /// names for it, Schott's lead-free glass of that name (BASF64 is N-BASF64), for Hikari's
    /// J and E series Schott's glass of the name behind the letter, or for a glass as it is after
    /// molding (D-ZLAF52LAM) the glass before.
    fn substitute(&self, name: &str) -> Option<Medium> {
        let wanted = key(name);
        let named = self
            .table
            .substitutes
            .iter()
            .find(|(from, _)| *from == wanted);
        let bare = wanted.strip_prefix(['J', 'E']).unwrap_or(&wanted);
        let keys = [
            named.map(|(_, to)| to.clone()),
            Some(format!("N{wanted}")),
            Some(bare.to_owned()),
            Some(format!("N{bare}")),
            wanted.strip_suffix('M').map(str::to_owned),
        ];
        let mut keys = keys.into_iter().flatten();
        let glass = keys.find_map(|key| self.of_key(&key))?;
        Some(Medium {
            stands_for: Some(name.into()),
            ..glass.clone()
        })
    }

    /// Finds a glass by name, or one that takes its place: its `stands_for` is then set.
    ///
    /// # Errors
    ///
    /// Returns an error at `span` that names the nearest glass.
    pub fn get(&self, name: &str, source: &Arc<Source>, span: Span) -> Result<Medium> {
        if let Some(glass) = self.find(name) {
            return Ok(glass.clone());
        }
        if let Some(glass) = self.substitute(name) {
            return Ok(glass);
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
        // The letters of a glass are its family: of SK17 the nearest is SK16, not SF1.
        let family = |name: &str| -> String {
            let name = name.trim_start_matches("N-");
            let letters = name.chars().take_while(char::is_ascii_alphabetic);
            letters.map(|c| c.to_ascii_uppercase()).collect()
        };
        let names = || {
            let added = self.added.iter().map(|(_, glass)| glass.name.as_str());
            added.chain(self.table.rows.iter().map(|row| row.name))
        };
        let own = family(bare);
        let plain = |name: &str| name.trim_start_matches("N-").to_owned();
        let relatives: Vec<&str> = names().filter(|name| family(name) == own).collect();
        let stripped: Vec<String> = relatives.iter().map(|name| plain(name)).collect();
        let wanted = plain(&bare.to_ascii_uppercase());
        let near = nearest(&wanted, stripped.iter().map(String::as_str));
        let own_series = |name: &&&str| name.starts_with("N-") == bare.starts_with("N-");
        let same = |near| relatives.iter().filter(move |name| plain(name) == near);
        // A glass of another family is another glass, however alike the names are.
        let relative = near.and_then(|near| same(near).find(own_series).or(same(near).next()));
        relative.copied()
    }

    /// All glasses.
    pub fn glasses(&self) -> impl Iterator<Item = &Medium> {
        let added = self.added.iter().map(|(_, glass)| glass);
        added.chain(self.table.rows.iter().filter_map(GlassRow::glass))
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

/// The glass of a line of the table.
fn glass(line: &str) -> Option<Medium> {
    let mut words = line.split_whitespace();
    let (_maker, name, formula) = (words.next()?, words.next()?, words.next()?);
    let mut k = [0.0; 10];
    for (slot, word) in k.iter_mut().zip(words) {
        *slot = word.parse().ok()?;
    }
    let glass = match formula {
        "sellmeier" => Medium::from_formula(Formula::Sellmeier1, k)?,
        "sellmeier3" => Medium::from_formula(Formula::Sellmeier3, k)?,
        "sellmeier5" => Medium::from_formula(Formula::Sellmeier5, k)?,
        "schott" => Medium::from_formula(Formula::Schott, k)?,
        "extended3" => Medium::from_formula(Formula::Extended3, k)?,
        "lines" => Medium::from_lines(k[0], k[1], k[2]),
        "abbe" => Medium::from_abbe(k[0], k[1]),
        _ => return None,
    };
    Some(glass.named(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE};

    #[test]
    fn every_row_of_the_table_is_a_glass() {
        let rows = TABLE
            .lines()
            .filter(|l| !l.starts_with('#') && !l.trim().is_empty())
            .filter(|l| !l.contains(" like ") && !l.contains(" is "));
        let table = Catalogue::builtin();
        assert_eq!(table.glasses().count(), rows.count());
        for glass in table.glasses() {
            let abbe = glass.abbe().unwrap();
            // Those for the infrared have no Abbe number, or one of the edge of their absorption.
            let is_infrared = glass.n_d > 2.25;
            assert!(
                is_infrared || (1.3..2.2).contains(&glass.n_d) && (15.0..110.0).contains(&abbe),
                "{glass:?}"
            );
        }
        let infrared = table.glasses().filter(|glass| glass.n_d > 2.25);
        assert!(infrared.count() < 25);
        let GlassTable {
            aliases,
            substitutes,
            ..
        } = table.table;
        for (from, to) in aliases.iter().chain(substitutes) {
            assert!(table.find(to).is_some(), "{from}: {to} is not in the table");
        }
    }

    /// Names in lens files of shops, with n_d and V_d of the makers' data sheets.
    #[test]
    fn stock_glasses_and_their_other_names_are_in_the_table() {
        let table = Catalogue::builtin();
        for (name, n_d, abbe) in [
            ("C79-80", 1.45847, 67.82),
            ("SiO2", 1.45847, 67.82),
            ("ACRYLIC", 1.4918, 57.44),
            ("N-SF6HT", 1.80518, 25.36),
            ("N-SF6HTultra", 1.80518, 25.36),
            ("FD10", 1.72825, 28.41),
            ("H-LAK54_MOLD", 1.73400, 51.49),
            ("D-ZLAF52LA_M", 1.80882, 40.93),
            ("N-SF56", 1.78470, 26.10),
            ("ZEONEX_K26R", 1.53504, 55.71),
            ("ZEONEX_K22R&K26R_2017", 1.53504, 55.71),
            ("NOA61", 1.55974, 42.40),
            ("ECO550", 1.60550, 50.28),
        ] {
            let glass = table.find(name).unwrap_or_else(|| panic!("{name}"));
            assert!((glass.n_d - n_d).abs() < 4e-3, "{name} {}", glass.n_d);
            let found = glass.abbe().unwrap();
            assert!((found - abbe).abs() < 0.25, "{name} {found}");
        }
        for name in ["GERMANIUM", "ZNSE", "ZNS_IR", "BD2", "IRG26", "AMTIR2"] {
            let n = table.find(name).unwrap().index(10_000.0);
            assert!((2.15..4.1).contains(&n), "{name} {n}");
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

    /// The letters are the family. A glass of Schott's old names that is not in the table is the
    /// lead-free one of that name.
    #[test]
    fn an_unknown_glass_is_replaced_by_its_namesake_or_named_by_its_family() {
        let table = Catalogue::builtin();
        let source = Arc::new(Source::new("a", Vec::new()));
        let get = |name: &str| table.get(name, &source, Span::at(0));
        for (name, other) in [
            ("BASF64_SCHOTT", "N-BASF64"),
            ("D-ZLAF52LAM", "D-ZLAF52LA"),
            ("D-ZK3M", "D-ZK3"),
        ] {
            let glass = get(name).unwrap();
            assert_eq!(
                (&*glass.name, glass.stands_for.as_deref()),
                (other, Some(name))
            );
        }
        assert_eq!(get("SK16").unwrap().stands_for, None);
        let error = get("SK27").unwrap_err();
        assert!(error.help.as_ref().unwrap().contains("SK2`"), "{error:?}");
    }

    /// Discontinued glasses with the n_d and V_d of the catalogues, and the lead-free glass that
    /// Schott made the nearest to them.
    #[test]
    fn the_classic_glasses_are_in_the_table() {
        let table = Catalogue::builtin();
        for (name, n_d, abbe) in [
            ("SK16", 1.62041, 60.33),
            ("SK2", 1.60738, 56.65),
            ("SK4", 1.61272, 58.63),
            ("K5", 1.52249, 59.48),
            ("LAF2", 1.74400, 44.72),
            ("LAK9", 1.69100, 54.71),
            ("BAK1", 1.57250, 57.55),
            ("F2", 1.62004, 36.37),
            ("N-LASF55", 1.95380, 30.56),
            ("J-LAK14", 1.69680, 55.52),
        ] {
            let glass = table.find(name).unwrap();
            assert!((glass.n_d - n_d).abs() < 6e-6, "{name} {}", glass.n_d);
            let found = glass.abbe().unwrap();
            assert!((found - abbe).abs() < 0.02, "{name} {found}");
        }
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
