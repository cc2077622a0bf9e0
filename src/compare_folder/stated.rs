//! Reads the file of `--pair`, which states which pictures belong together.

use std::path::{Component, Path};

use ivcam_base::diag::{Diagnostic, Result, nearest};
use ivcam_base::files::{MAX_TEXT, read_file};

use super::files::PictureFile;
use super::pairing::{FilePair, PairedBy};
use crate::archive::csv::{self, CsvRow};

/// The columns of the two pictures.
const COLUMNS: [&str; 2] = ["new", "old"];

/// Returns the pairs that a file states, in columns `new` and `old` with the paths below the two
/// folders. Other columns are not read, so that the table of a report can be given. Files that are
/// there but have no ending of a picture are added to the lists.
///
/// # Errors
/// Returns an error if the file cannot be read, has not both columns, or has a row that names no
/// file or one of an earlier row.
pub(super) fn stated_pairs(
    file: &Path,
    folders: [&Path; 2],
    lists: [&mut Vec<PictureFile>; 2],
) -> Result<Vec<FilePair>> {
    let bytes = read_file(file, MAX_TEXT)?;
    let at = |line: usize| format!("{}:{line}", file.display());
    let text = String::from_utf8(bytes)
        .map_err(|_| Diagnostic::error(format!("`{}` is not text in UTF-8", file.display())))?;
    let mut rows = csv::rows(&text).into_iter();
    let head = rows.next().unwrap_or(CsvRow {
        line: 1,
        fields: Vec::new(),
    });
    let columns = columns(&head).map_err(|error| error.in_file(at(head.line)))?;
    let [new, old] = lists;
    let mut pairs: Vec<FilePair> = Vec::new();
    for row in rows {
        let one = |side: usize, list: &mut Vec<PictureFile>| {
            let field = row.fields.get(columns[side]).map(|f| f.trim());
            let found = number(field.unwrap_or_default(), side, folders[side], list);
            found.map_err(|error| error.in_file(at(row.line)))
        };
        let pair = FilePair {
            new: one(0, new)?,
            old: one(1, old)?,
            by: PairedBy::List,
            chance: None,
        };
        let twice = pairs.iter().find_map(|other| {
            let new = (other.new == pair.new).then(|| &new[pair.new].name);
            new.or_else(|| (other.old == pair.old).then(|| &old[pair.old].name))
        });
        if let Some(name) = twice {
            let text = format!("`{name}` is in an earlier row too");
            let help = "a picture has one partner: leave a row out";
            return Err(Diagnostic::error(text)
                .with_help(help)
                .in_file(at(row.line)));
        }
        pairs.push(pair);
    }
    Ok(pairs)
}

/// Returns the numbers of the columns.
fn columns(head: &CsvRow) -> Result<[usize; 2]> {
    let place = |name: &str| {
        let mut fields = head.fields.iter();
        fields.position(|field| field.trim().eq_ignore_ascii_case(name))
    };
    match COLUMNS.map(place) {
        [Some(new), Some(old)] => Ok([new, old]),
        _ => Err(
            Diagnostic::error("the first line does not name the columns `new` and `old`")
                .with_help("write `new,old` there, and below it a row for each pair"),
        ),
    }
}

/// Returns the number of a picture in the list of its folder. A file that the list does not have is
/// added to it.
fn number(name: &str, side: usize, folder: &Path, list: &mut Vec<PictureFile>) -> Result<usize> {
    let which = COLUMNS[side];
    if name.is_empty() {
        return Err(
            Diagnostic::error(format!("this row names no {which} picture")).with_help(
                "a row has the paths of a new and of an old picture below their folders",
            ),
        );
    }
    if let Some(number) = list.iter().position(|file| file.name == name) {
        return Ok(number);
    }
    let path = Path::new(name);
    let is_below = path.components().all(|c| matches!(c, Component::Normal(_)));
    if is_below && folder.join(path).is_file() {
        list.push(PictureFile::below(folder, folder.join(path)));
        return Ok(list.len() - 1);
    }
    let text = format!(
        "there is no {which} picture `{name}` below `{}`",
        folder.display()
    );
    let names = list.iter().map(|file| &*file.name);
    let help = nearest(name, names).map_or_else(
        || "paths are those below the folder, with `/` between their parts".to_owned(),
        |near| format!("did you mean `{near}`?"),
    );
    Err(Diagnostic::not_found(text).with_help(help))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a file of pairs over new pictures `a.png` and `b.png` and old ones `c.jpg` and
    /// `d.jpg`. Returns the pairs, or the place of the error and its text.
    fn read(text: &str) -> std::result::Result<Vec<(usize, usize)>, String> {
        use std::sync::atomic::{AtomicUsize, Ordering};
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("ivcam-stated-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("photo.001"), "").unwrap();
        let file = folder.join("pairs.csv");
        std::fs::write(&file, text).unwrap();
        let list = |names: [&str; 2]| -> Vec<PictureFile> {
            let paths = names.map(|name| folder.join(name));
            let files = paths.into_iter();
            files
                .map(|path| PictureFile::below(&folder, path))
                .collect()
        };
        let (mut new, mut old) = (list(["a.png", "b.png"]), list(["c.jpg", "d.jpg"]));
        let pairs = stated_pairs(&file, [&folder, &folder], [&mut new, &mut old]);
        std::fs::remove_dir_all(&folder).unwrap();
        let numbers = pairs.map(|pairs| pairs.iter().map(|p| (p.new, p.old)).collect());
        numbers.map_err(|e| {
            let place = e.file.as_deref().unwrap_or_default();
            let line = place.rsplit(':').next().unwrap_or_default();
            format!(
                "{line}: {}; {}",
                e.message,
                e.help.clone().unwrap_or_default()
            )
        })
    }

    #[test]
    fn pairs_are_read_from_the_columns_of_their_names() {
        let text = "old,more,New\nd.jpg,x,a.png\n\n\"c.jpg\",,b.png\n";
        assert_eq!(read(text).unwrap(), [(0, 1), (1, 0)]);
        assert_eq!(read("new,old\nphoto.001,c.jpg\n").unwrap(), [(2, 0)]);
        assert_eq!(read("new,old\n").unwrap(), []);
    }

    #[test]
    fn a_row_that_names_no_file_is_an_error_with_its_line() {
        for (text, parts) in [
            (
                "new,old\na.png,c.jpg\nx.png,d.jpg\n",
                "3: there is no new picture `x.png`",
            ),
            ("new,old\na.png,c.jpeg\n", "did you mean `c.jpg`"),
            ("new,old\na.png\n", "2: this row names no old picture"),
            (
                "new,old\na.png,../secret.jpg\n",
                "2: there is no old picture",
            ),
            (
                "a.png,c.jpg\n",
                "1: the first line does not name the columns",
            ),
            ("", "1: the first line does not name"),
            (
                "new,old\na.png,c.jpg\na.png,d.jpg\n",
                "3: `a.png` is in an earlier row",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(parts), "{text}: {error}");
        }
    }
}
