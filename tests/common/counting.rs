//! The system's allocator, counting calls and bytes. A test program with it has one test only, because the counters see
//! every thread of the process.
#![allow(dead_code, reason = "each test program reads some of the counters")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering::Relaxed};

struct Counting;

pub(crate) static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);
/// Allocations of at least [`LARGE_BYTES`].
pub(crate) static LARGE: AtomicUsize = AtomicUsize::new(0);
/// Bytes that are in use.
pub(crate) static LIVE: AtomicIsize = AtomicIsize::new(0);

/// Smallest allocation that is no job of rayon and no block of its queue.
const LARGE_BYTES: usize = 4096;

fn count(size: usize) {
    ALLOCATIONS.fetch_add(1, Relaxed);
    LARGE.fetch_add(usize::from(size >= LARGE_BYTES), Relaxed);
    LIVE.fetch_add(size as isize, Relaxed);
}

// SAFETY: every call is passed on unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size() as isize, Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        LIVE.fetch_sub(layout.size() as isize, Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;
