//! What a call returns, and the message beside it.

use sapwise::Error;
use sapwise::error::Unavailable;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a function returns. 0 is success. After any other value, sw_last_error has the message.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sw_status {
    /// Success.
    SW_OK = 0,
    /// A pointer that must not be NULL is NULL.
    SW_NULL = 1,
    /// A stride, an alignment, a flag, a kind or a text that can't be used.
    SW_INVALID_ARGUMENT = 2,
    /// A box has a NaN, or a minimum above its maximum. The message has the index or the handle.
    SW_INVALID_BOX = 3,
    /// A ray, a motion or a point is not finite, or a direction is zero.
    SW_INVALID_RAY = 4,
    /// The handle names no body of this space, such as that of a removed one. One of another space may name a body.
    SW_STALE_HANDLE = 5,
    /// More boxes than 32 bits can number, or than fit into the address space.
    SW_TOO_MANY = 6,
    /// More pairs than the limit of the search or the space.
    SW_TOO_MANY_PAIRS = 7,
    /// The system refused memory.
    SW_OUT_OF_MEMORY = 8,
    /// No such algorithm, or it can't run here.
    SW_UNAVAILABLE = 9,
    /// Another call uses the object: on another thread, or a query whose callback this is.
    SW_BUSY = 10,
    /// The object was freed before. Only debug builds of the library know that.
    SW_FREED = 11,
    /// The cache can't be written, or there is none.
    SW_CACHE = 12,
    /// A fault of the library. The object of the call can only be freed.
    SW_PANIC = 13,
}

use sw_status::*;

/// Why a call failed.
pub(crate) struct Failure {
    pub(crate) status: sw_status,
    pub(crate) text: String,
}

impl Failure {
    #[cold]
    pub(crate) fn new(status: sw_status, text: impl fmt::Display) -> Self {
        Self { status, text: text.to_string() }
    }

    #[cold]
    pub(crate) fn null(what: &str) -> Self {
        Self::new(SW_NULL, format_args!("{what} is NULL"))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let status = match error {
            Error::InvalidBox { .. } | Error::InvalidBody { .. } => SW_INVALID_BOX,
            Error::InvalidRay { .. } => SW_INVALID_RAY,
            Error::StaleHandle { .. } => SW_STALE_HANDLE,
            Error::TooManyObjects { .. } => SW_TOO_MANY,
            Error::TooManyPairs { .. } => SW_TOO_MANY_PAIRS,
            Error::OutOfMemory { .. } => SW_OUT_OF_MEMORY,
            Error::Unavailable { .. } | Error::UnknownAlgorithm { .. } | Error::NoAlgorithm => SW_UNAVAILABLE,
            _ => SW_INVALID_ARGUMENT,
        };
        // Handles as numbers, and the names of this interface.
        let text = match &error {
            Error::StaleHandle { handle } => stale(handle.to_bits()),
            Error::InvalidBody { handle, defect } => {
                format!("the box for handle {} {defect}; the body keeps its previous box", handle.to_bits())
            }
            Error::Unavailable { algorithm, reason: Unavailable::TooFewCores { threads, most } } => {
                format!("{algorithm} needs {threads} threads, but {most} may run; raise `threads` of sw_options")
            }
            Error::TooManyPairs { limit } => {
                format!("more pairs than the limit of {limit}; raise it with sw_space_set_limit or sw_search_set_limit")
            }
            other => other.to_string(),
        };
        Self { status, text }
    }
}

pub(crate) fn stale(handle: u64) -> String {
    format!("handle {handle} names no body of this space; it was removed, or is of another space")
}

thread_local! {
    static LAST_ERROR: RefCell<(sw_status, CString)> = RefCell::new((SW_OK, CString::default()));
}

/// Runs the body of a function: a failure becomes a status and a message, and so does a panic.
pub(crate) fn call(run: impl FnOnce() -> Result<(), Failure>) -> sw_status {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => SW_OK,
        Ok(Err(failure)) => report(failure),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            report(Failure::new(SW_PANIC, format_args!("a fault of Sapwise, please report it: {text}")))
        }
    }
}

/// Runs the body of a function that returns a value: after a failure, `otherwise`.
pub(crate) fn value<T>(otherwise: T, run: impl FnOnce() -> Result<T, Failure>) -> T {
    let mut value = otherwise;
    call(|| {
        value = run()?;
        Ok(())
    });
    value
}

#[cold]
fn report(failure: Failure) -> sw_status {
    let text = CString::new(failure.text.replace('\0', " ")).unwrap_or_default();
    // While a thread ends there is no message any more.
    let _ = LAST_ERROR.try_with(|last| last.replace((failure.status, text)));
    failure.status
}

/// Returns the message of the last failed call of this thread, in UTF-8. "" if there was none. It is valid until the
/// next failed call of this thread, or the thread's end. Any thread may call this.
#[unsafe(no_mangle)]
pub extern "C-unwind" fn sw_last_error() -> *const c_char {
    LAST_ERROR.try_with(|last| last.borrow().1.as_ptr()).unwrap_or(c"".as_ptr())
}

/// Returns the status of the last failed call of this thread, for functions that return NULL or 0. SW_OK if there was
/// none. Any thread may call this.
#[unsafe(no_mangle)]
pub extern "C-unwind" fn sw_last_status() -> sw_status {
    LAST_ERROR.try_with(|last| last.borrow().0).unwrap_or(SW_PANIC)
}

/// Returns the version of the library, such as "0.1.0". It is never freed. Any thread may call this.
#[unsafe(no_mangle)]
pub extern "C-unwind" fn sw_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    #[test]
    fn panic_becomes_a_status() {
        assert_eq!(call(|| panic!("on {}", "purpose")), SW_PANIC);
        // SAFETY: no call of this thread fails meanwhile.
        let text = unsafe { CStr::from_ptr(sw_last_error()) }.to_str().unwrap();
        assert!(text.ends_with("on purpose"), "{text}");
        assert_eq!(value(7, || panic!("again")), 7);
    }
}
