//! The commands of CODE V's and OSLO's files: words on lines or between semicolons.

use crate::prescription::text::{Word, lines, words};

/// A command: its name and its arguments.
pub(super) type Command<'a> = Vec<Word<'a>>;

/// The commands of a text. `comment` begins a comment, and `&` at the end of a line continues it.
pub(super) fn commands<'a>(text: &'a str, comment: &str) -> Vec<Command<'a>> {
    let mut commands = Vec::new();
    let mut open: Command<'_> = Vec::new();
    for (start, line) in lines(text) {
        let (_, line) = parts(line, comment)[0];
        let (line, goes_on) = match line.trim_end().strip_suffix('&') {
            Some(line) => (line, true),
            None => (line, false),
        };
        let parts = parts(line, ";");
        for (i, (at, part)) in parts.iter().enumerate() {
            open.extend(words(part, start + at));
            if i + 1 < parts.len() || !goes_on {
                commands.push(std::mem::take(&mut open));
            }
        }
    }
    commands.push(open);
    commands.retain(|command| !command.is_empty());
    commands
}

/// The parts of a line between separators that are not in quotes, with the byte at which each
/// begins. There is at least one.
fn parts<'a>(line: &'a str, separator: &str) -> Vec<(usize, &'a str)> {
    let (mut parts, mut start, mut quote) = (Vec::new(), 0, None);
    for (at, c) in line.char_indices() {
        match quote {
            Some(open) if open == c => quote = None,
            None if c == '\'' || c == '"' => quote = Some(c),
            None if at >= start && line[at..].starts_with(separator) => {
                parts.push((start, &line[start..at]));
                start = at + separator.len();
            }
            _ => {}
        }
    }
    parts.push((start, &line[start..]));
    parts
}
