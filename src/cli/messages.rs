//! Lines to stderr, and what the commands return.

use std::io::IsTerminal;

use crate::diag::{Diagnostic, Result, Severity, Sink};

/// A line to stderr. One that nobody reads any more is no error.
macro_rules! say {
    ($($part:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($part)*);
    }};
}
pub(crate) use say;

/// Exit code: what was asked for could not be done.
pub(crate) const ERROR: i32 = 2;

/// Prints a message to stderr as a compiler would.
pub(crate) fn tell(diagnostic: &Diagnostic) {
    let color = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    say!("{}", diagnostic.render(color));
}

/// Prints what reading or compiling had to say, notes left out.
pub(crate) fn tell_all(sink: &Sink) {
    sink.items()
        .iter()
        .filter(|d| d.severity >= Severity::Warning)
        .for_each(tell);
}

/// What writing to stdout came to: a reader that has gone away is no error.
pub(crate) fn written(result: std::io::Result<()>) -> Result<i32> {
    match result {
        Ok(()) => Ok(0),
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(0),
        Err(e) => Err(Diagnostic::io("standard output", &e)),
    }
}
