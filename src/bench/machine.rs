//! What the numbers were measured on.

/// The processor's name and the number of threads that this process may use.
pub fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name =
        text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name.trim()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {threads} threads", name.unwrap_or("unknown processor"))
}

/// How many processes wanted to run, on average over the last minute, where the system tells: other work shows in wall-clock times.
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

/// Processor seconds of all processes that this one has started and waited for, and of those that they have, in clock ticks (100 a second); 0 where the
/// system does not tell.
pub fn children_cpu_seconds() -> f64 {
    // Fields 16 and 17 of /proc/self/stat: user and system time.
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace();
    fields.skip(13).take(2).filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}
