//! Claims: work in a shared folder that several processes divide among themselves.
//!
//! A claim is a file beside the result, `NAME.claim`, created exclusively (`O_EXCL`), so only one
//! process has it. It names its maker, and holds a number that grows while the maker lives. A claim
//! is abandoned in two cases:
//!
//! * Its maker ran under this very kernel and no longer holds the lock on the file. Locks end with
//!   their process, so this is known at once.
//! * Its content has not changed for the time that it states, by the clock of the process that
//!   waits. Clocks of different machines are never compared.
//!
//! An abandoned claim is not removed, since two processes could then remove each other's. Whoever
//! creates the file of the next number, `NAME.claim-1`, has the work; the highest number counts.
//! The claims of a result are removed after the result has its name. Whoever gets a claim therefore
//! looks for the result once more.
//!
//! A maker that was stopped for longer than the stated time, and then goes on, makes a result
//! twice. Results are written whole, so this costs time and nothing else.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use serde::Deserialize;

use crate::diag::{Diagnostic, Result};
use crate::platform::process_id;

/// The refreshes in the time after which a claim expires.
const BEATS: u32 = 6;
/// The longest time after which a claim expires, whatever its file says.
const LONGEST_EXPIRY: Duration = Duration::from_secs(3600);
/// The largest claim file that is read, in bytes.
const LARGEST: u64 = 4096;
/// The number of makers of one result that may die before it is reported as an error.
const MOST_MAKERS: u32 = 1000;

/// The maker that a claim names.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Maker {
    /// The name of the machine.
    pub host: String,
    /// The number of the process.
    pub pid: u32,
    /// When the claim was made, in seconds since 1970 by the maker's clock.
    pub started: u64,
    /// The running kernel; empty if it is unknown.
    kernel: String,
    /// Whether the maker holds a lock on the file.
    locked: bool,
    /// The seconds without a change after which the claim expires.
    expires: f64,
}

/// The claims on results in one folder, as one process sees them.
pub struct Claims {
    folder: PathBuf,
    expiry: Duration,
    /// The last content of each claim of others, with the time since which it is unchanged.
    seen: HashMap<PathBuf, (Vec<u8>, Duration)>,
}

/// A claim that this process holds. Dropping it gives the work back.
pub struct Claim {
    path: PathBuf,
    number: u32,
    stop: Option<Sender<()>>,
    refresh: Option<JoinHandle<()>>,
}

/// The claim on a result that another process holds.
#[derive(Debug)]
pub struct Held {
    /// The maker; `None` if the file cannot be read as a claim.
    pub maker: Option<Maker>,
    /// Whether the maker is known to be dead.
    pub is_dead: bool,
}

impl Claims {
    /// Returns the claims in a folder. Those of this process expire after `expiry` without a
    /// refresh.
    pub fn new(folder: &Path, expiry: Duration) -> Self {
        Self {
            folder: folder.to_path_buf(),
            expiry: expiry.min(LONGEST_EXPIRY),
            seen: HashMap::new(),
        }
    }

    /// Claims a result, or returns `None` if another process is making it. `now` is the time since
    /// any fixed moment.
    ///
    /// # Errors
    /// Fails if no file can be created in the folder.
    pub fn claim(&mut self, name: &str, now: Duration) -> Result<Option<Claim>> {
        let path = self.folder.join(format!("{name}.claim"));
        let number = match last(&path) {
            None => 0,
            Some(last) if self.is_abandoned(&numbered(&path, last), now) => last + 1,
            Some(_) => return Ok(None),
        };
        if number >= MOST_MAKERS {
            let text = format!("{MOST_MAKERS} processes died while they made `{name}`");
            return Err(Diagnostic::error(text).in_file(path.display().to_string()));
        }
        let file = numbered(&path, number);
        match OpenOptions::new().write(true).create_new(true).open(&file) {
            Ok(open) => Claim::new(path, number, open, self.expiry).map(Some),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(None),
            Err(e) => Err(Diagnostic::io(file.display(), &e)),
        }
    }

    /// Returns who is making a result.
    pub fn held(&self, name: &str) -> Option<Held> {
        let path = self.folder.join(format!("{name}.claim"));
        let path = numbered(&path, last(&path)?);
        let maker = read(&path).and_then(|content| parse(&content));
        let is_dead = maker.as_ref().is_some_and(|maker| has_died(maker, &path));
        Some(Held { maker, is_dead })
    }

    /// Removes the claims on a result that has its name.
    pub fn forget(&self, name: &str) {
        remove_all(&self.folder.join(format!("{name}.claim")));
    }

    /// Returns whether the maker of a claim is dead, or has not refreshed it for the stated time.
    fn is_abandoned(&mut self, path: &Path, now: Duration) -> bool {
        let Some(content) = read(path) else {
            return false; // It was removed just now.
        };
        let maker = parse(&content);
        if maker.as_ref().is_some_and(|maker| has_died(maker, path)) {
            return true;
        }
        let stated = maker.and_then(|m| Duration::try_from_secs_f64(m.expires).ok());
        let expiry = stated.unwrap_or(self.expiry).min(LONGEST_EXPIRY);
        match self.seen.get(path) {
            Some((before, since)) if *before == content => now.saturating_sub(*since) >= expiry,
            _ => {
                self.seen.insert(path.to_path_buf(), (content, now));
                false
            }
        }
    }
}

impl Claim {
    /// Writes the content of a new claim and refreshes it from a thread.
    fn new(path: PathBuf, number: u32, mut file: File, expiry: Duration) -> Result<Self> {
        // On Windows others could not read a locked file.
        let locked = cfg!(unix) && file.try_lock().is_ok();
        let content = content(locked, expiry);
        let mut claim = Self {
            path,
            number,
            stop: None,
            refresh: None,
        };
        let mut write = move |beat: u32| {
            file.seek(SeekFrom::Start(0))?;
            // A number of fixed width, so that the file is as long as before.
            file.write_all(format!("{content}, \"beat\": {beat:>10}}}\n").as_bytes())?;
            file.sync_data()
        };
        write(0).map_err(|e| Diagnostic::io(claim.file().display(), &e))?;
        let (stop, stopped) = channel();
        let refresh = move || {
            let mut beat = 0_u32;
            while stopped.recv_timeout(expiry / BEATS) == Err(RecvTimeoutError::Timeout) {
                beat = beat.wrapping_add(1);
                // After a failed refresh the claim may expire, which costs time only.
                let _ = write(beat);
            }
        };
        let started = std::thread::Builder::new().spawn(refresh);
        claim.refresh = Some(started.map_err(|e| Diagnostic::io(claim.file().display(), &e))?);
        claim.stop = Some(stop);
        Ok(claim)
    }

    /// Returns whether a dead maker's work was taken over.
    pub fn is_taken_over(&self) -> bool {
        self.number > 0
    }

    /// Removes the claim of a result that has its name now, and those of dead makers.
    pub fn finish(self) {
        remove_all(&self.path);
    }

    fn file(&self) -> PathBuf {
        numbered(&self.path, self.number)
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.stop = None;
        // Another process that took the work over counts on this file.
        if !numbered(&self.path, self.number + 1).exists() {
            let _ = std::fs::remove_file(self.file());
        }
        if let Some(refresh) = self.refresh.take() {
            let _ = refresh.join();
        }
    }
}

/// Returns the name of this machine.
pub fn host_name() -> String {
    let of_kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = of_kernel
        .or_else(|| std::env::var("HOSTNAME").ok())
        .or_else(|| std::env::var("COMPUTERNAME").ok());
    let name = name.unwrap_or_default().trim().to_owned();
    if name.is_empty() {
        "unknown".into()
    } else {
        name
    }
}

/// Returns the identity of the running kernel, or nothing where the system does not say it. Locks
/// are reliable between processes under one kernel only: some network file systems keep them to
/// one machine.
fn kernel() -> String {
    let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
    id.unwrap_or_default().trim().to_owned()
}

/// Returns the beginning of a claim's content.
fn content(locked: bool, expiry: Duration) -> String {
    let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let json = serde_json::json!({
        "host": host_name(),
        "pid": process_id(),
        "started": since_1970.unwrap_or_default().as_secs(),
        "kernel": kernel(),
        "locked": locked,
        "expires": expiry.as_secs_f64(),
    });
    json.to_string().trim_end_matches('}').to_owned()
}

/// Returns whether a maker under this kernel has ended.
fn has_died(maker: &Maker, path: &Path) -> bool {
    // Shared locks of several processes that look at the same time do not disturb each other.
    let is_free = || File::open(path).is_ok_and(|file| file.try_lock_shared().is_ok());
    maker.locked && !maker.kernel.is_empty() && maker.kernel == kernel() && is_free()
}

/// Reads a claim file.
fn read(path: &Path) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    let file = File::open(path).ok()?;
    file.take(LARGEST).read_to_end(&mut content).ok()?;
    Some(content)
}

/// Parses a claim. `None` if it is not one, or is being written.
fn parse(content: &[u8]) -> Option<Maker> {
    serde_json::from_slice(content).ok()
}

/// Returns the file of a claim's number.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    if number > 0 {
        name.push(format!("-{number}"));
    }
    name.into()
}

/// Returns the highest number of a claim; `None` without a claim.
fn last(path: &Path) -> Option<u32> {
    let exists = |number: &u32| numbered(path, *number).exists();
    (0..MOST_MAKERS).take_while(exists).last()
}

/// Removes all files of a claim, from the highest number.
fn remove_all(path: &Path) {
    for number in (0..=last(path).unwrap_or(0)).rev() {
        let _ = std::fs::remove_file(numbered(path, number));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::Folder;

    const EXPIRY: Duration = Duration::from_secs(60);

    impl Folder {
        fn claims(&self) -> Claims {
            Claims::new(&self.0, EXPIRY)
        }

        /// Writes a claim of a maker on another machine.
        fn foreign(&self, name: &str, beat: u32) {
            let content = format!(
                r#"{{"host":"a","pid":1,"started":0,"kernel":"other","locked":true,"expires":60.0,
                "beat":{beat}}}"#
            );
            std::fs::write(self.0.join(name), content).unwrap();
        }
    }

    fn seconds(s: u64) -> Duration {
        Duration::from_secs(s)
    }

    #[test]
    fn work_has_one_maker_and_is_free_again_when_it_is_dropped_or_finished() {
        let folder = Folder::new("claim-one");
        let (mut a, mut b) = (folder.claims(), folder.claims());
        let claim = a.claim("7", seconds(0)).unwrap().unwrap();
        // A locked file of a living maker never expires before its time, however often it is tried.
        assert!(b.claim("7", seconds(0)).unwrap().is_none());
        assert!(b.claim("7", seconds(1)).unwrap().is_none());
        let held = b.held("7").unwrap();
        assert_eq!(held.maker.unwrap().pid, std::process::id());
        assert!(!held.is_dead);
        assert!(b.claim("8", seconds(1)).unwrap().is_some(), "other work");
        drop(claim);
        assert!(b.held("7").is_none());
        b.claim("7", seconds(2)).unwrap().unwrap().finish();
        assert!(folder.names().is_empty());
    }

    #[test]
    fn a_claim_of_another_machine_expires_by_the_clock_of_the_one_who_waits() {
        let folder = Folder::new("claim-expiry");
        let mut claims = folder.claims();
        folder.foreign("7.claim", 1);
        assert!(claims.claim("7", seconds(1000)).unwrap().is_none());
        assert!(claims.claim("7", seconds(1059)).unwrap().is_none());
        folder.foreign("7.claim", 2);
        assert!(claims.claim("7", seconds(1060)).unwrap().is_none(), "alive");
        assert!(claims.claim("7", seconds(1119)).unwrap().is_none());
        let claim = claims.claim("7", seconds(1120)).unwrap().unwrap();
        assert!(claim.is_taken_over());
        assert_eq!(folder.names(), ["7.claim", "7.claim-1"]);
        // The first maker was only slow. It does not disturb the second.
        folder.foreign("7.claim", 3);
        assert!(folder.claims().claim("7", seconds(0)).unwrap().is_none());
        claim.finish();
        assert!(folder.names().is_empty());
    }

    #[test]
    fn only_one_of_two_who_wait_takes_a_dead_claim_over() {
        let folder = Folder::new("claim-two");
        let (mut a, mut b) = (folder.claims(), folder.claims());
        folder.foreign("7.claim", 1);
        for claims in [&mut a, &mut b] {
            assert!(claims.claim("7", seconds(0)).unwrap().is_none());
        }
        let claim = a.claim("7", seconds(60)).unwrap().unwrap();
        assert!(b.claim("7", seconds(60)).unwrap().is_none());
        // The work is given back, and the dead claim below it is still a dead one.
        drop(claim);
        assert!(b.claim("7", seconds(61)).unwrap().is_some());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_maker_that_died_under_this_kernel_is_known_at_once() {
        let folder = Folder::new("claim-dead");
        // The content is that of this process, and the lock ended with its file.
        let text = format!("{}, \"beat\": 0}}", content(true, EXPIRY));
        std::fs::write(folder.0.join("7.claim"), text).unwrap();
        assert!(folder.claims().held("7").unwrap().is_dead);
        let claim = folder.claims().claim("7", seconds(0)).unwrap().unwrap();
        assert!(claim.is_taken_over());
    }

    #[test]
    fn a_file_that_is_no_claim_expires_too() {
        let folder = Folder::new("claim-garbage");
        for (name, text) in [
            ("a.claim", ""),
            ("b.claim", "{\"host\":"),
            ("c.claim", "\u{0}\u{1}"),
        ] {
            std::fs::write(folder.0.join(name), text).unwrap();
            let mut claims = folder.claims();
            let name = name.trim_end_matches(".claim");
            assert!(claims.held(name).unwrap().maker.is_none());
            assert!(claims.claim(name, seconds(0)).unwrap().is_none());
            assert!(claims.claim(name, seconds(60)).unwrap().is_some(), "{text}");
        }
    }
}
