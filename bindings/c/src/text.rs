//! Texts of a caller, and for it.

use crate::{Failure, put, sw_status::*};
use sapwise::Adaptive;
use sapwise_tune::Origin;
use std::ffi::{CStr, c_char};

/// Borrows a text of a caller; `None` for NULL.
///
/// # Safety
/// `text` is NULL or ends with a zero.
pub(crate) unsafe fn read<'a>(text: *const c_char, what: &str) -> Result<Option<&'a str>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: of the caller.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(Some).map_err(|_| Failure::new(SW_INVALID_ARGUMENT, format_args!("{what} is not UTF-8")))
}

/// Writes as much of a text as fits, with a zero at the end. Returns the length of the whole.
///
/// # Safety
/// There are `size` bytes at `to`, or it is NULL.
pub(crate) unsafe fn write(text: &str, to: *mut c_char, size: usize) -> Result<usize, Failure> {
    if size > 0 {
        let fits = text.floor_char_boundary(size - 1);
        // Refuses NULL.
        // SAFETY: of the caller.
        unsafe { put(to, 0, "text") }?;
        // SAFETY: `fits` bytes and the zero are at most `size`.
        unsafe {
            to.copy_from_nonoverlapping(text.as_ptr().cast(), fits);
            to.add(fits).write(0);
        }
    }
    Ok(text.len())
}

/// Describes how pairs were found, in sentences.
pub(crate) fn describe(search: &Adaptive) -> String {
    let decision = search.last_decision().map_or_else(|| "nothing was searched yet".to_owned(), |d| d.to_string());
    let setup = search.setup();
    let origin = match setup.origin {
        Origin::Given => "usual",
        Origin::Awaited => "usual until the measurement ends",
        Origin::Cached => "from the cache",
        Origin::Probed => "measured",
        _ => "usual, since nothing could be measured",
    };
    let remarks: String = setup.remarks.iter().map(|remark| format!("; {remark}")).collect();
    format!("{decision}; costs: {origin}{remarks}")
}
