//! Prints messages to stderr, and converts results to exit codes.

use std::cell::RefCell;
use std::ffi::OsString;
use std::io::{IsTerminal, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};

use ivcam_base::diag::{Diagnostic, Result, Severity, Sink, counted};

use super::vintage_help::as_typed;

/// Whether this process prints nothing, because another one prints the same.
static MUTE: AtomicBool = AtomicBool::new(false);

/// Prints nothing from now on, because another process prints the same.
pub(super) fn mute() {
    MUTE.store(true, Ordering::Relaxed);
}

/// Returns whether [`mute`] was called.
pub(crate) fn is_mute() -> bool {
    MUTE.load(Ordering::Relaxed)
}

/// Prints a line to stderr. A closed stderr is not an error.
macro_rules! status {
    ($($part:tt)*) => {
        $crate::cli::messages::say(format_args!($($part)*))
    };
}
pub(crate) use status;

thread_local! {
    /// The lines of this thread that a caller of the library gets instead of stderr.
    static HEARD: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

/// Prints a line to stderr, or keeps it for [`heard`].
pub(crate) fn say(line: std::fmt::Arguments<'_>) {
    let is_kept = HEARD.with_borrow_mut(|heard| match heard {
        Some(lines) => {
            lines.push(line.to_string());
            true
        }
        None => false,
    });
    if !is_kept && !is_mute() {
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}

/// Does some work of this thread, and returns the lines that it would have printed to stderr.
pub(super) fn heard<T>(work: impl FnOnce() -> T) -> (T, Vec<String>) {
    let before = HEARD.replace(Some(Vec::new()));
    let done = work();
    (done, HEARD.replace(before).unwrap_or_default())
}

/// The exit code for an error.
pub(crate) const ERROR: i32 = 2;

/// The longest line of [`print_wrapped`], in columns.
const COLUMNS: usize = 100;

/// Prints a list to stderr, broken after commas and double blanks into lines that fit a terminal.
pub(crate) fn print_wrapped(text: &str) {
    status!("{}", wrapped(text));
}

/// Breaks a list after commas and double blanks. Lines after the first are indented.
fn wrapped(text: &str) -> String {
    let mut lines = String::new();
    let mut column = 0;
    for item in text
        .split_inclusive(", ")
        .flat_map(|s| s.split_inclusive("  "))
    {
        let length = item.trim_end().chars().count();
        if column > 0 && column + length > COLUMNS {
            lines.truncate(lines.trim_end().len());
            lines += "\n  ";
            column = 2;
        }
        lines += item;
        column += item.chars().count();
    }
    lines
}

thread_local! {
    /// The arguments of the command that this thread runs, as they were typed.
    static TYPED: RefCell<Vec<OsString>> = const { RefCell::new(Vec::new()) };
}

/// Sets the arguments whose spellings of options the messages of this thread use.
pub(super) fn set_typed(words: &[OsString]) {
    TYPED.set(words.to_vec());
}

/// Prints a message to stderr as a compiler would, with options as they were typed.
pub(crate) fn print_diagnostic(diagnostic: &Diagnostic) {
    let is_kept = HEARD.with_borrow(Option::is_some);
    let is_terminal = !is_kept && std::io::stderr().is_terminal();
    let color = is_terminal && std::env::var_os("NO_COLOR").is_none();
    let mut diagnostic = diagnostic.clone();
    diagnostic.message = TYPED.with_borrow(|words| as_typed(&diagnostic.message, words));
    status!("{}", diagnostic.render(color));
}

/// The number of different messages about one scene that are printed.
const MOST_PRINTED: usize = 1000;

/// Prints messages, of thousands only the first.
pub(super) fn print_first<'a>(mut messages: impl Iterator<Item = &'a Diagnostic>) {
    let first = messages.by_ref().take(MOST_PRINTED);
    first.for_each(print_diagnostic);
    let rest = messages.count();
    if rest > 0 {
        status!("not shown: {}", counted(rest, "further message"));
    }
}

/// Prints the warnings and errors of a list, without its notes.
pub(crate) fn print_warnings(sink: &Sink) {
    let items = sink.items().iter();
    print_first(items.filter(|d| d.severity >= Severity::Warning));
}

/// Returns the exit code for the result of writing to stdout. A closed pipe is not an error.
///
/// # Errors
/// Returns an error if writing failed for another reason.
pub(crate) fn exit_code(result: std::io::Result<()>) -> Result<i32> {
    match result {
        Ok(()) => Ok(0),
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(0),
        Err(e) => Err(Diagnostic::io("standard output", &e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_thousands_of_messages_the_first_are_printed_and_the_rest_are_counted() {
        let mut sink = Sink::new();
        for i in 0..MOST_PRINTED + 20 {
            sink.add(*Diagnostic::warning(format!("number {i}")));
        }
        let ((), lines) = heard(|| print_warnings(&sink));
        assert_eq!(lines.len(), MOST_PRINTED + 1);
        assert_eq!(lines[MOST_PRINTED], "not shown: 20 further messages");
    }

    #[test]
    fn a_long_list_becomes_lines_that_keep_its_items() {
        let list: Vec<String> = (0..60).map(|i| format!("item {i}")).collect();
        let text = wrapped(&list.join(", "));
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS));
        assert!(text.lines().count() > 2);
        assert_eq!(text.replace("\n  ", " "), list.join(", "));
        assert_eq!(wrapped("one, two  three"), "one, two  three");
    }
}
