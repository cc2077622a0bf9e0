//! Curves of other programs for the convergence table, read from comma-separated values.

use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_TEXT, read_file};
use serde::Serialize;

/// One render of another program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Peer {
    /// The name of the curve.
    pub method: String,
    /// Samples per pixel, if the file has them.
    pub samples: Option<f64>,
    /// Seconds of the clock.
    pub seconds: Option<f64>,
    /// Seconds of processors.
    pub processor_seconds: Option<f64>,
    /// Root mean square error over the mean of the reference.
    pub rel_rmse: f64,
}

const COLUMNS: &str = "the columns are `method`, `rel_rmse` or `rel_mse`, and at least one of \
     `samples`, `seconds` and `processor_seconds`, named in the first line";
/// The largest number of rows.
const MOST: usize = 10_000;

impl Peer {
    /// Reads a file.
    ///
    /// # Errors
    /// Fails if the file cannot be read, or if a column is missing or a value is not a positive
    /// number.
    pub fn open(path: &Path) -> Result<Vec<Self>> {
        let text = read_file(path, MAX_TEXT)?;
        Self::parse(&String::from_utf8_lossy(&text))
            .map_err(|e| e.in_file(path.display().to_string()).with_help(COLUMNS))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// Returns the errors of [`Peer::open`] without the file's name.
    pub fn parse(text: &str) -> Result<Vec<Self>> {
        let mut lines = text.lines().enumerate();
        let head: Vec<&str> = lines
            .next()
            .map(|(_, line)| line.split(',').map(str::trim).collect())
            .unwrap_or_default();
        let column = |name: &str| head.iter().position(|h| *h == name);
        let missing = |what: &str| Diagnostic::error(format!("there is no column `{what}`"));
        let method = column("method").ok_or_else(|| missing("method"))?;
        let (error, is_square) = match (column("rel_rmse"), column("rel_mse")) {
            (Some(at), _) => (at, false),
            (None, Some(at)) => (at, true),
            (None, None) => return Err(missing("rel_rmse")),
        };
        let axes = ["samples", "seconds", "processor_seconds"].map(column);
        if axes == [None; 3] {
            return Err(missing("seconds"));
        }
        let mut all = Vec::new();
        for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
            let words: Vec<&str> = line.split(',').map(str::trim).collect();
            let value = |at: usize| {
                let word = words.get(at).copied().unwrap_or_default();
                let value = word.parse::<f64>().ok();
                let usable = value.filter(|v| v.is_finite() && *v > 0.0);
                usable.ok_or_else(|| {
                    let line = number + 1;
                    Diagnostic::error(format!("line {line}: `{word}` is not a positive number"))
                })
            };
            let optional = |at: Option<usize>| match at {
                Some(at) if words.get(at).is_some_and(|w| !w.is_empty()) => value(at).map(Some),
                _ => Ok(None),
            };
            let error = value(error)?;
            all.push(Self {
                method: words.get(method).copied().unwrap_or_default().to_owned(),
                samples: optional(axes[0])?,
                seconds: optional(axes[1])?,
                processor_seconds: optional(axes[2])?,
                rel_rmse: if is_square { error.sqrt() } else { error },
            });
            if all.len() > MOST {
                return Err(Diagnostic::error(format!("it has more than {MOST} rows")));
            }
        }
        if all.is_empty() {
            return Err(Diagnostic::error("it has no rows"));
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_a_square_gives_its_root() {
        let peers =
            Peer::parse("seconds,method,rel_mse\n2, other ,0.04\n\n8,other,0.01\n").unwrap();
        assert_eq!(peers.len(), 2);
        assert_eq!(peers[0].method, "other");
        assert_eq!((peers[0].seconds, peers[0].rel_rmse), (Some(2.0), 0.2));
        assert_eq!((peers[1].samples, peers[1].processor_seconds), (None, None));
        let own = "method,samples,seconds,rel_rmse,processor_seconds\na,4,1,0.5,\n";
        let peers = Peer::parse(own).unwrap();
        assert_eq!(
            (peers[0].samples, peers[0].processor_seconds),
            (Some(4.0), None)
        );
    }

    #[test]
    fn a_wrong_file_names_the_line_or_the_column() {
        for (text, part) in [
            ("", "`method`"),
            ("method,seconds\n", "`rel_rmse`"),
            ("method,rel_rmse\n", "`seconds`"),
            ("method,rel_rmse,seconds\n", "no rows"),
            ("method,rel_rmse,seconds\na,0,1\n", "line 2: `0`"),
            ("method,rel_rmse,seconds\na,0.1,soon\n", "line 2: `soon`"),
            ("method,rel_rmse,seconds\na,inf,1\n", "line 2: `inf`"),
        ] {
            let message = Peer::parse(text).unwrap_err().message.clone();
            assert!(message.contains(part), "{text:?}: {message}");
        }
    }
}
