//! Prints messages to stderr, and converts results to exit codes.

use std::io::IsTerminal;

use crate::diag::{Diagnostic, Result, Severity, Sink};

/// Prints a line to stderr. A closed stderr is not an error.
macro_rules! status {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($part)*);
    }};
}
pub(crate) use status;

/// The exit code for an error.
pub(crate) const ERROR: i32 = 2;

/// Prints a message to stderr as a compiler would.
pub(crate) fn print_diagnostic(diagnostic: &Diagnostic) {
    let color = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    status!("{}", diagnostic.render(color));
}

/// Prints the warnings and errors of a list, without its notes.
pub(crate) fn print_warnings(sink: &Sink) {
    sink.items()
        .iter()
        .filter(|d| d.severity >= Severity::Warning)
        .for_each(print_diagnostic);
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
