//! The device: Embree's error reports and memory counts, made into Rust values.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use embree4_sys as sys;

/// What Embree said went wrong.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Error {
    /// There is not enough memory.
    #[error("Embree: {0}")]
    Memory(String),
    /// Anything else.
    #[error("Embree: {0}")]
    Other(String),
}

impl Error {
    fn new(code: sys::RTCError, text: String) -> Self {
        if code == sys::RTC_ERROR_OUT_OF_MEMORY { Self::Memory(text) } else { Self::Other(text) }
    }
}

/// What Embree's callbacks write to. It has a place of its own so that its address stays.
#[derive(Debug)]
struct Monitor {
    /// The first error since the last [`Device::check`].
    error: Mutex<Option<Error>>,
    /// Bytes that Embree has allocated and not freed.
    bytes: AtomicI64,
    /// How many of them there may be.
    limit: AtomicI64,
}

/// Embree's library, configured.
#[derive(Debug)]
pub struct Device {
    raw: sys::RTCDevice,
    monitor: Arc<Monitor>,
}

// SAFETY: Embree's device functions are thread safe, and the monitor is made of a mutex and an atomic.
unsafe impl Send for Device {}
// SAFETY: as for Send.
unsafe impl Sync for Device {}

impl Device {
    /// Starts Embree with at most `threads` threads for building (at least one).
    pub fn new(threads: usize) -> Result<Arc<Self>, Error> {
        let configuration = CString::new(format!("threads={},set_affinity=0", threads.max(1))).expect("no NUL in it");
        // SAFETY: the string is NUL-terminated and lives through the call.
        let raw = unsafe { sys::rtcNewDevice(configuration.as_ptr()) };
        if raw.is_null() {
            // SAFETY: null is how the API asks for the error of a device that was not made.
            let code = unsafe { sys::rtcGetDeviceError(std::ptr::null_mut()) };
            return Err(Error::new(code, format!("no device: {}", code_name(code))));
        }
        let (bytes, limit) = (AtomicI64::new(0), AtomicI64::new(i64::MAX));
        let monitor = Arc::new(Monitor { error: Mutex::new(None), bytes, limit });
        let user = Arc::as_ptr(&monitor).cast_mut().cast::<c_void>();
        // SAFETY: `user` points into the Arc that the device keeps until after rtcReleaseDevice (see Drop), and the callbacks
        // only share what it points to.
        unsafe {
            sys::rtcSetDeviceErrorFunction(raw, Some(on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(raw, Some(on_memory), user);
        }
        let device = Arc::new(Self { raw, monitor });
        device.check()?;
        Ok(device)
    }

    /// Bytes that Embree holds for this device's scenes (its own allocations, not shared buffers).
    pub fn memory(&self) -> usize {
        usize::try_from(self.monitor.bytes.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// From now on no more than so many bytes are allocated for this device's scenes: what needs more is refused as being out of memory.
    pub fn limit_memory(&self, bytes: usize) {
        self.monitor.limit.store(i64::try_from(bytes).unwrap_or(i64::MAX), Ordering::Relaxed);
    }

    /// The first error reported since the last time this was asked.
    pub(crate) fn check(&self) -> Result<(), Error> {
        match self.monitor.error.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    pub(crate) fn raw(&self) -> sys::RTCDevice {
        self.raw
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: `raw` came from rtcNewDevice and is released once. The monitor is dropped after this body.
        unsafe { sys::rtcReleaseDevice(self.raw) };
    }
}

fn code_name(code: sys::RTCError) -> &'static str {
    match code {
        sys::RTC_ERROR_INVALID_ARGUMENT => "invalid argument",
        sys::RTC_ERROR_INVALID_OPERATION => "invalid operation",
        sys::RTC_ERROR_OUT_OF_MEMORY => "out of memory",
        sys::RTC_ERROR_UNSUPPORTED_CPU => "this CPU is not supported",
        sys::RTC_ERROR_CANCELLED => "cancelled",
        _ => "unknown error",
    }
}

unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError, text: *const c_char) {
    // SAFETY: `user` is the monitor given to rtcSetDeviceErrorFunction, which outlives the device.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let text = if text.is_null() {
        String::new()
    } else {
        // SAFETY: Embree passes a NUL-terminated string that lives through the callback.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    };
    let mut error = monitor.error.lock().unwrap_or_else(PoisonError::into_inner);
    error.get_or_insert_with(|| Error::new(code, format!("{}: {text}", code_name(code))));
}

unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, post: bool) -> bool {
    // SAFETY: as in on_error.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    let bytes = bytes as i64;
    let sum = monitor.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
    // Embree gives up what it has not allocated yet; of what it has allocated (`post`) it would lose track.
    let is_refused = bytes > 0 && !post && sum > monitor.limit.load(Ordering::Relaxed);
    if is_refused {
        monitor.bytes.fetch_sub(bytes, Ordering::Relaxed);
    }
    !is_refused
}
