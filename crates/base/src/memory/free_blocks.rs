//! Free blocks inside of the heap.
#![allow(unsafe_code)]

/// Gives the pages of free blocks back to the system.
///
/// The C library keeps blocks of up to 32 MB that are freed. Lists of that size which are made and
/// freed in turn, such as those of a large tree, leave gaps that later ones do not fit into.
pub fn release_free_blocks() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function may be called at any time, from any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}
