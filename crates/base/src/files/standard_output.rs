//! Whether the program was started with a standard output.
//!
//! The runtime of Rust opens `/dev/null` in the place of a closed one before `main`, so that all
//! output would be lost in silence. This looks before it does.
#![allow(unsafe_code)]

use std::sync::atomic::{AtomicBool, Ordering};

static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Returns whether standard output was closed when the program started. Known on Linux only.
pub fn is_output_closed() -> bool {
    IS_CLOSED.load(Ordering::Relaxed)
}

#[cfg(target_os = "linux")]
extern "C" fn look() {
    // SAFETY: the number is only asked about, and not used as an open file.
    let output = unsafe { std::os::fd::BorrowedFd::borrow_raw(1) };
    IS_CLOSED.store(rustix::io::fcntl_getfd(output).is_err(), Ordering::Relaxed);
}

// SAFETY: the section holds pointers to functions that the loader calls before `main`; this one
// uses nothing that has to be initialized.
#[cfg(target_os = "linux")]
#[used]
#[unsafe(link_section = ".init_array")]
static LOOK: extern "C" fn() = look;
