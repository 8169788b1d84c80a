//! Arrays of a caller, and lists for it.

use crate::{Failure, call, sw_status, sw_status::*};
use sapwise::Handle;

/// Borrows an array. NULL is an empty one.
///
/// # Safety
/// `first` points to `n` elements, or [`check`] refuses it.
pub(crate) unsafe fn slice<'a, T>(first: *const T, n: usize, what: &str) -> Result<&'a [T], Failure> {
    check(first, n, what)?;
    // SAFETY: of the caller; neither NULL nor misaligned nor beyond the address space.
    Ok(if n == 0 { &[] } else { unsafe { std::slice::from_raw_parts(first, n) } })
}

/// Returns an error if there can't be `n` elements at `first`.
#[inline]
pub(crate) fn check<T>(first: *const T, n: usize, what: &str) -> Result<(), Failure> {
    if n == 0 {
        Ok(())
    } else if first.is_null() {
        Err(Failure::null(what))
    } else if !first.is_aligned() {
        let text = format_args!("{what} is at {first:p}; align it to {} bytes", align_of::<T>());
        Err(Failure::new(SW_INVALID_ARGUMENT, text))
    } else if u32::try_from(n).is_err() || n.checked_mul(size_of::<T>()).is_none_or(|size| size > isize::MAX as usize) {
        Err(Failure::new(SW_TOO_MANY, format_args!("{what} has {n} elements; 32 bits must number them")))
    } else {
        Ok(())
    }
}

/// Writes to where a pointer points.
///
/// # Safety
/// `to` is NULL or points to memory for a value, aligned or not.
pub(crate) unsafe fn put<T>(to: *mut T, value: T, what: &str) -> Result<(), Failure> {
    if to.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: of the caller.
    unsafe { to.write_unaligned(value) };
    Ok(())
}

/// Runs a call that writes a handle if it succeeds. After every failure the handle is 0, also if the object is in use.
///
/// # Safety
/// As [`put`].
pub(crate) unsafe fn with_handle(handle: *mut u64, run: impl FnOnce() -> sw_status) -> sw_status {
    // SAFETY: of the caller.
    let unset = call(|| unsafe { put(handle, 0, "handle") });
    if unset == SW_OK { run() } else { unset }
}

/// Converts the handle of a caller.
pub(crate) fn handle(bits: u64) -> Result<Handle, Failure> {
    Handle::from_bits(bits).ok_or_else(|| Failure::new(SW_STALE_HANDLE, "0 is no handle; use one of sw_space_insert"))
}

/// Borrows an array of handles.
///
/// # Safety
/// As [`slice`].
pub(crate) unsafe fn handles<'a>(first: *const u64, n: usize) -> Result<&'a [Handle], Failure> {
    // SAFETY: of the caller.
    let bits = unsafe { slice(first, n, "handles") }?;
    if bits.contains(&0) {
        handle(0)?;
    }
    // SAFETY: a handle is a `NonZeroU64` without more, and none of the numbers is 0.
    Ok(unsafe { std::slice::from_raw_parts(bits.as_ptr().cast(), n) })
}

// The compiler orders the members of a tuple. It keeps the order of alike ones.
const _: () = assert!(size_of::<(Handle, Handle)>() == 16 && std::mem::offset_of!((Handle, Handle), 1) == 8);
const _: () = assert!(size_of::<(u32, u32)>() == 8 && std::mem::offset_of!((u32, u32), 1) == 4);

/// Returns a list of pairs as a caller sees them: two numbers for each.
pub(crate) fn flat<T, N>(pairs: &[(T, T)]) -> *const N {
    const { assert!(size_of::<T>() == size_of::<N>()) };
    pairs.as_ptr().cast()
}
