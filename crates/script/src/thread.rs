//! Plays a scene with scripts in a thread of its own.

use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use ivcam_base::diag::{Diagnostic, Severity};
use ivcam_base::thread_context::ThreadContext;
use ivcam_base::work::{Budget, StopSignal};
use ivcam_inventor::events::Played;
use ivcam_inventor::iv::Document;

/// The size of the stack in bytes. The engine parses a program by recursion, and `guard` allows
/// programs that nest so deep that they need up to 100 MB. Only what is used is ever allocated.
const STACK: usize = 512 << 20;

/// The longest time that a scene's scripts may take. The other limits do not depend on the machine
/// and end every program that was tried within seconds; this one is for what they do not foresee.
const DEADLINE: Duration = Duration::from_secs(60);

/// Returns the document that `play` makes of a copy. If `play` fails or takes too long, the
/// document is returned as it was, with a warning.
///
/// A thread is also the boundary at which a panic of the engine ends. Nothing of it is seen again:
/// the engine's objects never leave the thread.
pub(crate) fn in_own_thread(
    document: &Document,
    play: impl FnOnce(Document) -> Played + Send + 'static,
) -> Played {
    let copy = document.clone();
    let context = ThreadContext::current();
    let stop = Budget::current().stop().clone();
    let (send, receive) = channel();
    let thread = Builder::new()
        .name("scripts".into())
        .stack_size(STACK)
        .spawn(move || {
            // The receiver is gone if the deadline has passed.
            let _ = send.send(context.during(|| play(copy)));
        });
    let reason = match thread {
        Err(error) => format!("no thread could be started: {error}"),
        Ok(_) => match wait(&receive, &stop) {
            Ok(played) => return played,
            Err(RecvTimeoutError::Timeout) if stop.is_set() => "the work has to end".into(),
            Err(RecvTimeoutError::Timeout) => {
                format!("they take more than {} seconds", DEADLINE.as_secs())
            }
            Err(RecvTimeoutError::Disconnected) => "the engine that runs them failed".into(),
        },
    };
    let mut document = document.clone();
    let message = format!("the scene's scripts were not run: {reason}");
    let warning = Diagnostic::beyond_limit(message).at_most(Severity::Warning);
    document.sink.add(*warning);
    Played {
        document,
        bound: None,
        sent: Vec::new(),
    }
}

/// Waits for the thread, until the deadline or until the work has to end.
fn wait(receive: &Receiver<Played>, stop: &StopSignal) -> Result<Played, RecvTimeoutError> {
    const TURN: Duration = Duration::from_millis(20);
    let start = Instant::now();
    loop {
        match receive.recv_timeout(TURN) {
            Err(RecvTimeoutError::Timeout) if !stop.is_set() && start.elapsed() < DEADLINE => {}
            result => return result,
        }
    }
}
