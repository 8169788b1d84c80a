//! A value to which a caller holds a pointer: used by one call that changes it, or by several that read it.

use crate::{Failure, sw_status::*};
use std::cell::UnsafeCell;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// A call changes the value. Lower numbers: that many calls read it.
const CHANGING: u32 = u32::MAX;
/// A call that changed the value has panicked.
const BROKEN: u32 = u32::MAX - 1;
const FREED: u32 = u32::MAX - 2;
const MOST_READERS: u32 = u32::MAX - 3;

/// A value with the number of calls that use it now. Where a lock would wait, a call fails.
pub(crate) struct Guarded<T> {
    users: AtomicU32,
    value: UnsafeCell<ManuallyDrop<T>>,
}

// SAFETY: `users` lets either one call change the value or several read it.
unsafe impl<T: Send + Sync> Sync for Guarded<T> {}

/// Ends a use of a value.
struct Use<'a> {
    users: &'a AtomicU32,
    changed: bool,
}

impl Drop for Use<'_> {
    fn drop(&mut self) {
        if !self.changed {
            self.users.fetch_sub(1, Ordering::Release);
        } else {
            let next = if std::thread::panicking() { BROKEN } else { 0 };
            self.users.store(next, Ordering::Release);
        }
    }
}

impl<T> Guarded<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { users: AtomicU32::new(0), value: UnsafeCell::new(ManuallyDrop::new(value)) }
    }

    /// Lets `read` use the value beside other readers. `what` names it in errors.
    #[inline]
    pub(crate) fn read<R>(&self, what: &str, read: impl FnOnce(&T) -> Result<R, Failure>) -> Result<R, Failure> {
        let more = |users: u32| (users < MOST_READERS).then(|| users + 1);
        self.users.fetch_update(Ordering::Acquire, Ordering::Relaxed, more).map_err(|users| refused(what, users))?;
        let _use = Use { users: &self.users, changed: false };
        // SAFETY: while there are readers, no call changes or frees the value.
        read(unsafe { &*self.value.get() })
    }

    /// Lets `change` use the value alone.
    #[inline]
    pub(crate) fn change<R>(
        &self,
        what: &str,
        change: impl FnOnce(&mut T) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let alone = self.users.compare_exchange(0, CHANGING, Ordering::Acquire, Ordering::Relaxed);
        alone.map_err(|users| refused(what, users))?;
        let _use = Use { users: &self.users, changed: true };
        // SAFETY: meanwhile every other call fails.
        change(unsafe { &mut *self.value.get() })
    }

    /// Frees the value, also after a panic. Every later call fails.
    fn free(&self, what: &str) -> Result<(), Failure> {
        let free = |users: u32| (users == 0 || users == BROKEN).then_some(FREED);
        self.users.fetch_update(Ordering::Acquire, Ordering::Relaxed, free).map_err(|users| refused(what, users))?;
        // SAFETY: nobody uses the value now, and nobody will, since the state is final.
        unsafe { ManuallyDrop::drop(&mut *self.value.get()) };
        Ok(())
    }
}

/// Frees what a caller holds a pointer to. NULL is nothing to free. In a debug build a few bytes stay, so that later
/// uses are found.
///
/// # Safety
/// `this` is NULL or was a box, and nobody has freed it; in a debug build that may be.
pub(crate) unsafe fn free<T, V>(
    this: *mut T,
    value: impl FnOnce(&T) -> &Guarded<V>,
    what: &str,
) -> Result<(), Failure> {
    // SAFETY: of the caller.
    let Some(of) = (unsafe { this.as_ref() }) else { return Ok(()) };
    value(of).free(what)?;
    if cfg!(debug_assertions) {
        // Keeps the address, so that tools which look for leaks find it.
        static REMAINS: Mutex<Vec<usize>> = Mutex::new(Vec::new());
        REMAINS.lock().unwrap_or_else(PoisonError::into_inner).push(this.expose_provenance());
    } else {
        // SAFETY: of the caller.
        drop(unsafe { Box::from_raw(this) });
    }
    Ok(())
}

#[cold]
fn refused(what: &str, users: u32) -> Failure {
    let after = "change it after the query, not in a callback or on another thread";
    let (status, text) = match users {
        BROKEN => (SW_PANIC, format!("a call with this {what} has failed in the middle; free it")),
        FREED => (SW_FREED, format!("this {what} was freed; set pointers to NULL after freeing")),
        CHANGING => (SW_BUSY, format!("another thread changes this {what}; call after it")),
        _ => (SW_BUSY, format!("a query of this {what} runs; {after}")),
    };
    Failure { status, text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::call;

    #[test]
    fn broken_value_can_only_be_freed() {
        let list = Guarded::new(vec![1]);
        let change = || {
            call(|| {
                list.change("list", |list| {
                    list.push(list[7]);
                    Ok(())
                })
            })
        };
        let read = || call(|| list.read("list", |_| Ok(())));
        assert_eq!([read(), change(), change(), read()], [SW_OK, SW_PANIC, SW_PANIC, SW_PANIC]);
        let free = || call(|| list.free("list"));
        assert_eq!([free(), free(), read()], [SW_OK, SW_FREED, SW_FREED]);
    }

    #[test]
    fn reader_that_panics_breaks_nothing() {
        let number = Guarded::new(1);
        assert_eq!(call(|| number.read("number", |_| panic!("on purpose"))), SW_PANIC);
        assert_eq!(call(|| number.change("number", |_| Ok(()))), SW_OK);
    }

    #[test]
    fn value_that_is_changed_is_not_read() {
        let number = Guarded::new(1);
        let nested = number.change("number", |_| Ok(call(|| number.read("number", |_| Ok(())))));
        assert_eq!(nested.ok(), Some(SW_BUSY));
    }
}
