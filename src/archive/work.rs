//! Runs the work on many scenes on threads.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use ivcam_base::diag::{Diagnostic, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The stack of a thread, in bytes: that of a program's first thread on Linux.
const STACK: usize = 8 << 20;

/// Runs `work` on each item, several at a time, and calls `done` on this thread with each result in
/// the order in which they are ready. If there are fewer items than threads, each item gets several
/// threads. A panic in `work` becomes an error of its item.
///
/// # Errors
/// Returns an error if the threads cannot be started.
pub(crate) fn for_each<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    work: &(dyn Fn(&T) -> Result<R> + Sync),
    done: &mut dyn FnMut(&T, Result<R>),
) -> Result<()> {
    let workers = threads.clamp(1, items.len().max(1));
    let each = (threads / workers).max(1);
    let pools = (0..workers)
        .map(|_| {
            ThreadPoolBuilder::new()
                .num_threads(each)
                .stack_size(STACK)
                .build()
        })
        .collect::<std::result::Result<Vec<ThreadPool>, _>>();
    let pools =
        pools.map_err(|e| Diagnostic::error(format!("cannot start {threads} threads: {e}")))?;
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        for pool in &pools {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                while let Some((i, item)) = take(next, items) {
                    let attempt = || pool.install(|| work(item));
                    let result = catch_unwind(AssertUnwindSafe(attempt));
                    let result = result.unwrap_or_else(|panic| Err(internal_error(&*panic)));
                    if send.send((i, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(send);
        for (i, result) in receive {
            done(&items[i], result);
        }
    });
    Ok(())
}

/// Returns the next item that no thread has taken.
fn take<'t, T>(next: &AtomicUsize, items: &'t [T]) -> Option<(usize, &'t T)> {
    let i = next.fetch_add(1, Ordering::Relaxed);
    items.get(i).map(|item| (i, item))
}

/// Returns the error for a panic, which is a mistake in this program and not in the scene.
fn internal_error(panic: &(dyn Any + Send)) -> Box<Diagnostic> {
    let text = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no reason is known");
    Diagnostic::error(format!("the program failed on this scene: {text}"))
        .with_help("this is a mistake in ivcam; please report it with the scene")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once_and_a_panic_stops_no_other() {
        let items: Vec<u32> = (0..50).collect();
        let work = |n: &u32| match n {
            7 => panic!("seven"),
            9 => Err(Diagnostic::error("nine")),
            n => Ok(n * n),
        };
        for threads in [1, 3, 100] {
            let mut results = Vec::new();
            let mut done = |n: &u32, result: Result<u32>| results.push((*n, result));
            for_each(&items, threads, &work, &mut done).unwrap();
            results.sort_by_key(|(n, _)| *n);
            assert_eq!(results.len(), 50);
            for (n, result) in results {
                match result {
                    Ok(square) => assert_eq!(square, n * n),
                    Err(error) if n == 7 => assert!(error.message.ends_with("scene: seven")),
                    Err(error) => assert_eq!((n, &*error.message), (9, "nine")),
                }
            }
        }
        let no_items: [u32; 0] = [];
        for_each(&no_items, 2, &work, &mut |_, _| unreachable!()).unwrap();
    }
}
