//! The commands of a file.

use crate::prescription::text::{Word, lines, words};

/// A command: its name and its arguments.
pub(super) type Command<'a> = Vec<Word<'a>>;

/// The commands of a text.
pub(super) fn commands(text: &str) -> Vec<Command<'_>> {
    let mut commands = Vec::new();
    let mut open: Command<'_> = Vec::new();
    for (start, line) in lines(text) {
        let line = split_outside_quotes(line, '!')
            .next()
            .map_or("", |(_, l)| l);
        let (line, goes_on) = match line.trim_end().strip_suffix('&') {
            Some(line) => (line, true),
            None => (line, false),
        };
        let mut parts = split_outside_quotes(line, ';').peekable();
        while let Some((at, part)) = parts.next() {
            open.extend(words(part, start + at));
            if parts.peek().is_some() || !goes_on {
                commands.push(std::mem::take(&mut open));
            }
        }
    }
    commands.push(open);
    commands.retain(|c| !c.is_empty());
    commands
}

/// The parts of a line between separators, with the byte each begins at.
fn split_outside_quotes(line: &str, separator: char) -> impl Iterator<Item = (usize, &str)> {
    let mut quote = None;
    let mut start = 0;
    line.split(move |c: char| {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(open), c) if open == c => quote = None,
            _ => {}
        }
        c == separator && quote.is_none()
    })
    .map(move |part| {
        let at = start;
        start += part.len() + 1;
        (at, part)
    })
}

/// Removes the commands from PRV to END, and returns them.
pub(super) fn take_private(commands: Vec<Command<'_>>) -> (Vec<Command<'_>>, Vec<Command<'_>>) {
    let (mut rest, mut private) = (Vec::new(), Vec::new());
    let mut inside = false;
    for command in commands {
        inside |= command[0].is("PRV");
        let ends = command[0].is("END");
        if inside {
            private.push(command)
        } else {
            rest.push(command)
        }
        inside &= !ends;
    }
    (rest, private)
}
