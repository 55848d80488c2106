//! How much memory is left, so that what does not fit is refused before it is asked for: an allocation that fails would end the
//! process, and on Linux one that does not fit succeeds and has the process killed later.

use std::sync::atomic::{AtomicU64, Ordering};

/// What the process may have resident; the largest number for no limit.
static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);

/// From now on the process is to have no more than so many bytes resident.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// What [`set_limit`] said, if it was called.
pub fn limit() -> Option<u64> {
    Some(LIMIT.load(Ordering::Relaxed)).filter(|&bytes| bytes < u64::MAX)
}

/// Bytes of this process in memory now, from `/proc`; 0 where that is missing.
pub fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status");
    status.ok().and_then(|text| kibibytes(&text, "VmRSS:")).unwrap_or(0)
}

/// Bytes that this process may still allocate, as far as Linux tells: the least of what the machine, the process's control
/// groups, its limit on address space and [`set_limit`] leave. `None` where nothing is known.
pub fn available() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let status = read("/proc/self/status");
    let machine = read("/proc/meminfo").and_then(|text| kibibytes(&text, "MemAvailable:"));
    let address_space = read("/proc/self/limits")
        .and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        })
        .zip(status.and_then(|text| kibibytes(&text, "VmSize:")))
        .map(|(limit, used)| limit.saturating_sub(used));
    let own = limit().map(|limit| limit.saturating_sub(resident()));
    [machine, address_space, group(&read), own].into_iter().flatten().min()
}

/// What the control groups (version 2, then version 1) leave.
fn group(read: &dyn Fn(&str) -> Option<String>) -> Option<u64> {
    let number = |path: String| read(&path)?.trim().parse::<u64>().ok();
    let groups = read("/proc/self/cgroup")?;
    let mut least = None;
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, mut path) = (fields.next()?, fields.next()?);
        let (root, limit, used) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            c if c.split(',').any(|c| c == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
            }
            _ => continue,
        };
        // A limit holds for all groups below the one that it is set on.
        loop {
            path = path.trim_end_matches('/');
            let file = |name: &str| format!("{root}{path}/{name}");
            if let (Some(limit), Some(used)) = (number(file(limit)), number(file(used))) {
                // Cached files count as used, but make way.
                let statistics = read(&file("memory.stat")).unwrap_or_default();
                let left = limit.saturating_sub(used.saturating_sub(cached(&statistics)));
                least = Some(least.map_or(left, |l: u64| l.min(left)));
            }
            match path.rfind('/') {
                Some(end) => path = &path[..end],
                None => break,
            }
        }
    }
    least
}

/// Bytes of files that a control group holds in memory: its own and its children's.
fn cached(statistics: &str) -> u64 {
    let of = |name: &str| {
        let line = statistics.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        line.and_then(|value| value.trim().parse::<u64>().ok())
    };
    let both = |kind: &str| of(&format!("total_{kind}")).or_else(|| of(kind)).unwrap_or(0);
    both("inactive_file") + both("active_file")
}

/// The value of a line such as `MemAvailable:  123 kB`, in bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// The largest resident memory of this process so far in bytes, from `/proc`; 0 where that is missing.
pub fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status");
    status.ok().and_then(|text| kibibytes(&text, "VmHWM:")).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_proc_are_read() {
        let text = "MemTotal:       100 kB\nMemAvailable:    7 kB\n";
        assert_eq!(kibibytes(text, "MemAvailable:"), Some(7 * 1024));
        assert_eq!(kibibytes(text, "VmSize:"), None);
    }

    #[test]
    fn the_least_of_a_group_and_its_parents_counts() {
        let files = |path: &str| {
            let text = match path {
                "/proc/self/cgroup" => "0::/a/b\n",
                "/sys/fs/cgroup/a/b/memory.max" => "max\n",
                "/sys/fs/cgroup/a/memory.max" => "1000\n",
                "/sys/fs/cgroup/a/memory.current" => "700\n",
                "/sys/fs/cgroup/a/memory.stat" => "anon 400\nactive_file 100\ninactive_file 200\n",
                _ => return None,
            };
            Some(text.to_owned())
        };
        assert_eq!(group(&files), Some(600));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_process_has_something_left_but_not_everything() {
        let left = available().expect("/proc is there");
        assert!(left > 1 << 20 && left < 1 << 50, "{left}");
    }
}
