//! Processor time.

use rustix::time::{ClockId, clock_gettime};

/// Processor seconds of this process so far, of all its threads, to the nanosecond as far as the system counts them.
pub fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_less_than_a_tick() {
        let (start, mut sum) = (cpu_seconds(), 0u64);
        while cpu_seconds() == start {
            sum = std::hint::black_box(sum + 1);
        }
        // Others may share the processor, and other tests this process: but seldom for hundreds of looks in a row.
        assert!((0..1000).any(|_| {
            let before = cpu_seconds();
            (0.0..1e-3).contains(&(cpu_seconds() - before))
        }));
    }
}
