//! Reads and writes tables of comma-separated values (RFC 4180).

/// A row of a table, with the number of its first line from 1.
#[derive(Debug, PartialEq)]
pub(crate) struct CsvRow {
    pub line: usize,
    pub fields: Vec<String>,
}

/// Returns the rows of a table. Empty lines and a byte order mark are left out. Quotes inside a
/// field that does not begin with one stand for themselves.
pub(crate) fn rows(text: &str) -> Vec<CsvRow> {
    let mut rows = Vec::new();
    let (mut line, mut first) = (1, 1);
    let mut fields = vec![String::new()];
    let mut is_quoted = false;
    let mut chars = text.trim_start_matches('\u{feff}').chars().peekable();
    while let Some(c) = chars.next() {
        line += usize::from(c == '\n');
        let field = fields.last_mut().expect("a row has a field");
        match c {
            '"' if is_quoted && chars.peek() == Some(&'"') => field.extend(chars.next()),
            '"' if is_quoted => is_quoted = false,
            c if is_quoted => field.push(c),
            '"' if field.is_empty() => is_quoted = true,
            ',' => fields.push(String::new()),
            '\r' if chars.peek() == Some(&'\n') => {}
            '\n' => {
                add(&mut rows, first, &mut fields);
                first = line;
            }
            c => field.push(c),
        }
    }
    add(&mut rows, first, &mut fields);
    rows
}

/// Ends a row, unless its line is empty.
fn add(rows: &mut Vec<CsvRow>, line: usize, fields: &mut Vec<String>) {
    let fields = std::mem::replace(fields, vec![String::new()]);
    if fields.iter().any(|field| !field.trim().is_empty()) {
        rows.push(CsvRow { line, fields });
    }
}

/// Returns a row as text with its end. Fields are quoted where they have to be.
pub(crate) fn row<T: AsRef<str>>(fields: impl IntoIterator<Item = T>) -> String {
    let quoted = |field: T| {
        let text = field.as_ref();
        match text.contains([',', '"', '\n', '\r']) || text.trim() != text {
            true => format!("\"{}\"", text.replace('"', "\"\"")),
            false => text.to_owned(),
        }
    };
    let fields: Vec<String> = fields.into_iter().map(quoted).collect();
    fields.join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_is_written_is_read_with_its_lines() {
        let table = [
            vec!["new", "old"],
            vec!["a, \"b\".png", "two\nlines.jpg"],
            vec![" c.png", "c.jpg"],
        ];
        let text: String = table.iter().map(row).collect();
        let read = rows(&format!("\u{feff}{}", text.replace("old\n", "old\r\n\r\n")));
        let fields: Vec<_> = read.iter().map(|row| row.fields.clone()).collect();
        assert_eq!(fields, table);
        let lines: Vec<_> = read.iter().map(|row| row.line).collect();
        assert_eq!(lines, [1, 3, 5]);
        assert_eq!(rows("x\"y,\"z")[0].fields, ["x\"y", "z"]);
    }
}
