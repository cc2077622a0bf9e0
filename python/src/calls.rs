//! Calls of the library without the interpreter's lock.
//!
//! Two facts of Python shape this module. A process that was forked has no threads but its first
//! one, so each process makes its own pool: a pool of the parent would never answer. And a daemon
//! thread that asks for the lock of an interpreter that has ended is unwound through the frames of
//! this library, which aborts the process. [`end_calls`], which Python calls at its exit, therefore
//! cancels what can be canceled and waits until all calls have returned.
//!
//! The locks here are taken only by threads that hold the interpreter's lock, so none is held
//! during a fork.

use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ivcam_base::work::StopSignal;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The stack of a thread in bytes, which is that of a program's first thread on Linux.
pub(crate) const STACK: usize = 8 << 20;
/// The time between two checks whether the calls have returned.
const WAIT: Duration = Duration::from_millis(5);

/// The calls and the pool of a process.
struct CallTable {
    /// The process that the rest is for.
    process: u32,
    pool: Option<Arc<ThreadPool>>,
    /// The number of calls that run without the interpreter's lock.
    count: usize,
    /// The signals that end calls early, each with the number of its call.
    signals: Vec<(u64, StopSignal)>,
    /// The number of the next call.
    next: u64,
    /// Whether the interpreter ends.
    closed: bool,
}

static CALLS: Mutex<Option<CallTable>> = Mutex::new(None);

/// Returns the table of this process.
fn table<'a>(lock: &'a mut MutexGuard<'_, Option<CallTable>>) -> &'a mut CallTable {
    let process = process::id();
    if lock.as_ref().is_some_and(|calls| calls.process != process) {
        // The threads of the parent's pool do not exist here, and joining them would not end.
        if let Some(pool) = lock.take().and_then(|calls| calls.pool) {
            std::mem::forget(pool);
        }
    }
    lock.get_or_insert_with(|| CallTable {
        process,
        pool: None,
        count: 0,
        signals: Vec::new(),
        next: 0,
        closed: false,
    })
}

fn lock() -> MutexGuard<'static, Option<CallTable>> {
    CALLS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A call that runs without the interpreter's lock. It is made and dropped with the lock held.
pub(crate) struct Call(u64);

impl Call {
    /// Begins a call. A signal ends it early when the interpreter ends.
    ///
    /// # Errors
    /// Fails if the interpreter is ending.
    pub(crate) fn begin(_: Python<'_>, signal: Option<&StopSignal>) -> PyResult<Self> {
        let mut lock = lock();
        let calls = table(&mut lock);
        if calls.closed {
            return Err(PyRuntimeError::new_err("the interpreter is ending"));
        }
        let number = calls.next;
        calls.next += 1;
        calls.count += 1;
        calls
            .signals
            .extend(signal.map(|signal| (number, signal.clone())));
        Ok(Self(number))
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        let mut lock = lock();
        let calls = table(&mut lock);
        calls.count = calls.count.saturating_sub(1);
        calls.signals.retain(|(number, _)| *number != self.0);
    }
}

/// Returns this process's pool, which has a thread for each processor.
///
/// # Errors
/// Fails if the threads cannot be started.
fn pool(_: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut lock = lock();
    let calls = table(&mut lock);
    if let Some(pool) = &calls.pool {
        return Ok(pool.clone());
    }
    let made = ThreadPoolBuilder::new().stack_size(STACK).build();
    let made =
        made.map_err(|e| PyRuntimeError::new_err(format!("cannot start the threads: {e}")))?;
    Ok(calls.pool.insert(Arc::new(made)).clone())
}

/// Runs `work` without the interpreter's lock, on this process's pool.
///
/// # Errors
/// Fails if the interpreter is ending, or if the threads cannot be started.
pub(crate) fn on_pool<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    on_pool_with(py, || (), |()| work())
}

/// Runs `work` as [`on_pool`] does, with the lock that `hold` takes on this thread. No work on the
/// pool may take a lock that lasts: a thread there that waits for its part of a loop takes up other
/// calls, and one of them could wait for the lock that the call below it on the stack holds, behind
/// a thread that waits to write.
///
/// # Errors
/// Fails if the interpreter is ending, or if the threads cannot be started.
pub(crate) fn on_pool_with<L: Sync, T: Send>(
    py: Python<'_>,
    hold: impl FnOnce() -> L + Send,
    work: impl FnOnce(&L) -> T + Send,
) -> PyResult<T> {
    let pool = pool(py)?;
    let call = Call::begin(py, None)?;
    let done = py.detach(|| {
        let lock = hold();
        pool.install(|| work(&lock))
    });
    drop(call);
    Ok(done)
}

/// Runs `work`, which uses no pool, without the interpreter's lock on this thread.
///
/// # Errors
/// Fails if the interpreter is ending.
pub(crate) fn on_this_thread<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let call = Call::begin(py, None)?;
    let done = py.detach(work);
    drop(call);
    Ok(done)
}

/// Cancels the renders and fits, waits until all calls have returned, and refuses new ones. Python
/// calls it when the interpreter ends.
#[pyfunction]
pub(crate) fn end_calls(py: Python<'_>) {
    loop {
        let mut lock = lock();
        let calls = table(&mut lock);
        calls.closed = true;
        calls.signals.iter().for_each(|(_, signal)| signal.cancel());
        if calls.count == 0 {
            return;
        }
        drop(lock);
        py.detach(|| std::thread::sleep(WAIT));
    }
}
