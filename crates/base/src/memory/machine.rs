//! How much memory the machine has, or the container in which the program runs.

use std::path::Path;
use std::sync::OnceLock;

/// The memory that is assumed where it cannot be found out, in bytes. Half of it is the default
/// limit, 4 GB.
const ASSUMED: u64 = 8 << 30;

/// Returns the memory of the machine in bytes: the least of its installed memory, the limits of the
/// control groups that the process is in, and its own limit on address space. It is read once.
pub(super) fn memory_of_machine() -> u64 {
    static MEMORY: OnceLock<u64> = OnceLock::new();
    *MEMORY.get_or_init(|| {
        let read = |path: &str| std::fs::read_to_string(path).ok();
        let installed = read("/proc/meminfo").and_then(|text| installed(&text));
        let groups = read("/proc/self/cgroup").unwrap_or_default();
        let groups = group_files(&groups)
            .into_iter()
            .filter_map(|path| read(&path));
        let own = read("/proc/self/limits").and_then(|text| address_space(&text));
        let limits = groups.filter_map(|text| text.trim().parse().ok());
        installed
            .into_iter()
            .chain(limits)
            .chain(own)
            .min()
            .unwrap_or(ASSUMED)
    })
}

/// Returns the installed memory that `/proc/meminfo` states.
fn installed(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// Returns the limit on address space that `/proc/self/limits` states, if there is one.
fn address_space(limits: &str) -> Option<u64> {
    let line = limits
        .lines()
        .find_map(|l| l.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Returns the files that state the memory limits of the control groups in `/proc/self/cgroup`. A
/// group is also limited by the groups around it. Inside a container the path may be that of the
/// host, and the group itself is at the root.
fn group_files(cgroup: &str) -> Vec<String> {
    let mut files = Vec::new();
    for line in cgroup.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else {
            continue;
        };
        let (root, file) = if controllers.is_empty() {
            ("/sys/fs/cgroup", "memory.max")
        } else if controllers.split(',').any(|c| c == "memory") {
            ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
        } else {
            continue;
        };
        for group in Path::new(path).ancestors() {
            let group = group.to_string_lossy();
            files.push(format!("{root}{}/{file}", group.trim_end_matches('/')));
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_is_read_from_the_files_of_the_system() {
        let meminfo = "MemTotal:       24606576 kB\nMemFree:        14882212 kB\n";
        assert_eq!(installed(meminfo), Some(24_606_576 * 1024));
        assert_eq!(installed("MemTotal: much\n"), None);
        let limits = "Limit  Soft Limit  Hard Limit  Units\n\
                      Max address space         7168000000           unlimited   bytes\n";
        assert_eq!(address_space(limits), Some(7_168_000_000));
        assert_eq!(
            address_space("Max address space  unlimited unlimited bytes"),
            None
        );
    }

    #[test]
    fn a_group_is_limited_by_the_groups_around_it() {
        let files = group_files("8:pids:/\n4:memory:/a/b\n0::/c\n");
        let expected = [
            "/sys/fs/cgroup/memory/a/b/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/a/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            "/sys/fs/cgroup/c/memory.max",
            "/sys/fs/cgroup/memory.max",
        ];
        assert_eq!(files, expected);
        assert_eq!(group_files("nonsense"), Vec::<String>::new());
    }
}
