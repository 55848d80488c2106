//! How this process stands beside others that want the processor.

/// Sets the nice value, from 0 to 19, of the calling thread and of whatever threads and processes it starts: on Linux each thread has its own, so this is
/// to be called before there are others.
///
/// # Errors
/// What the system says: only who may do so makes it lower than it is.
pub fn set_nice(value: i32) -> Result<(), String> {
    rustix::process::setpriority_process(None, value).map_err(|error| error.to_string())
}
