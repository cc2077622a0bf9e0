//! A picture that is being saved: how much of it is done, how long the rest takes, and its end.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use ivcam_base::work::StopSignal;

/// A picture that is being saved. The thread that makes it and the window share it.
#[derive(Debug)]
pub(crate) struct Saving {
    /// The file to write.
    pub path: PathBuf,
    /// Ends the work. Nothing is written then.
    stop: StopSignal,
    start: Instant,
    /// The part that is done, in millionths.
    done: AtomicU32,
}

/// The part from which the rest of the time is estimated, in millionths.
const ENOUGH: u32 = 10_000;
/// The number of characters of a file's name that are shown.
const LONGEST_NAME: usize = 24;
const WHOLE: u32 = 1_000_000;

impl Saving {
    /// Begins a picture.
    pub(crate) fn new(path: PathBuf) -> Self {
        Self {
            path,
            stop: StopSignal::default(),
            start: Instant::now(),
            done: AtomicU32::new(0),
        }
    }

    /// The signal that ends the work.
    pub(crate) fn stop(&self) -> &StopSignal {
        &self.stop
    }

    /// Ends the work.
    pub(crate) fn cancel(&self) {
        self.stop.cancel();
    }

    /// Notes the work that is done, of all the work.
    pub(crate) fn note(&self, done: u64, work: u64) {
        let part = done as f64 / work.max(1) as f64;
        let part = (part * f64::from(WHOLE)) as u32;
        self.done.store(part.min(WHOLE), Ordering::Relaxed);
    }

    /// Returns how far the work is, and how long the rest takes, once that can be estimated.
    pub(crate) fn progress(&self) -> String {
        let name = shortened(&self.path.file_name().unwrap_or_default().to_string_lossy());
        if self.stop.is_set() {
            return format!("{name}: ending");
        }
        let done = self.done.load(Ordering::Relaxed);
        match time_left(self.start.elapsed(), done) {
            None => format!("{name}: begun"),
            Some(left) => format!("{name}: {}%, {left}", 100 * done / WHOLE),
        }
    }
}

/// Shortens a name that would leave no room for what follows it.
fn shortened(name: &str) -> String {
    match name.char_indices().nth(LONGEST_NAME) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.to_owned(),
    }
}

/// Returns the time that the rest of some work takes, from the time and the millionths so far.
fn time_left(elapsed: Duration, done: u32) -> Option<String> {
    if done < ENOUGH {
        return None;
    }
    let seconds = elapsed.as_secs_f64() * f64::from(WHOLE - done) / f64::from(done);
    Some(match seconds {
        0.0..100.0 => format!("{seconds:.0} s left"),
        100.0..6000.0 => format!("{:.0} min left", seconds / 60.0),
        _ => format!("{:.1} h left", seconds / 3600.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_in_proportion_to_the_work_left() {
        let left = |seconds: u64, done: u32| time_left(Duration::from_secs(seconds), done);
        assert_eq!(left(10, 5_000), None);
        assert_eq!(left(10, 250_000).as_deref(), Some("30 s left"));
        assert_eq!(left(60, 100_000).as_deref(), Some("9 min left"));
        assert_eq!(left(7200, 500_000).as_deref(), Some("2.0 h left"));
        assert_eq!(left(5, WHOLE).as_deref(), Some("0 s left"));
    }
}
