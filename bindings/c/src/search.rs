//! Pairs of boxes in arrays.

use crate::{
    Boxes, Failure, Guarded, call, flat, guarded, put, save, slice, sw_body, sw_options, sw_status, text, value,
};
use sapwise::{Aabb, Adaptive, Between, BroadPhase, Error, Filter, PairOrder, Pairs};
use std::ffi::c_char;
use std::ptr::{null, null_mut};

/// Finds the pairs of boxes in arrays, one array after the other: those of a frame after those of the previous one.
pub struct sw_search {
    search: Guarded<Search>,
}

struct Search {
    adaptive: Adaptive,
    between: Between,
    pairs: Pairs,
    /// Copies of boxes with another layout than that of the library.
    copies: [Vec<Aabb>; 2],
}

impl sw_search {
    const NAME: &str = "search";

    /// # Safety
    /// `this` is NULL or a search.
    unsafe fn change<R>(this: *mut Self, change: impl FnOnce(&mut Search) -> Result<R, Failure>) -> Result<R, Failure> {
        // SAFETY: of the caller.
        let this = unsafe { this.as_ref() }.ok_or_else(|| Failure::null(Self::NAME))?;
        this.search.change(Self::NAME, change)
    }

    /// # Safety
    /// As [`change`](Self::change).
    unsafe fn read<R>(this: *const Self, read: impl FnOnce(&Search) -> Result<R, Failure>) -> Result<R, Failure> {
        // SAFETY: of the caller.
        let this = unsafe { this.as_ref() }.ok_or_else(|| Failure::null(Self::NAME))?;
        this.search.read(Self::NAME, read)
    }
}

/// Makes a search. NULL for options: the usual costs, on all cores that the process may use. NULL on failure:
/// SW_INVALID_ARGUMENT, SW_UNAVAILABLE or SW_PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_new(options: *const sw_options) -> *mut sw_search {
    value(null_mut(), || {
        // SAFETY: of the caller.
        let options = unsafe { options.as_ref() }.unwrap_or(&sw_options::USUAL);
        let registry = options.registry();
        let between = Between::new(&registry);
        // SAFETY: of the caller.
        let adaptive = unsafe { options.adaptive(registry) }?;
        let search = Search { adaptive, between, pairs: Pairs::new(), copies: Default::default() };
        Ok(Box::into_raw(Box::new(sw_search { search: Guarded::new(search) })))
    })
}

/// Frees a search and its list of pairs. Otherwise as sw_space_free.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_free(search: *mut sw_search) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe { guarded::free(search, |of| &of.search, sw_search::NAME) })
}

/// Sets the most pairs, 8 bytes each, from the next call on. 0, the default: no limit. A call that would find more is
/// SW_TOO_MANY_PAIRS.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_set_limit(search: *mut sw_search, limit: usize) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe {
        sw_search::change(search, |search| {
            search.pairs.set_limit((limit > 0).then_some(limit));
            Ok(())
        })
    })
}

/// Sets whether pairs are sorted, by the first member, then by the second: 1 or 0, from the next call on. Sorted
/// lists are the same on every machine. Default: 0, which is faster.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_set_sorted(search: *mut sw_search, sorted: i32) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe {
        sw_search::change(search, |search| {
            let of = &search.pairs;
            let mut pairs = Pairs::with_order(if sorted == 0 { PairOrder::Any } else { PairOrder::Canonical });
            pairs.set_limit(of.limit());
            pairs.set_filter(of.filter().cloned());
            search.pairs = pairs;
            Ok(())
        })
    })
}

/// Sets what the boxes of the next calls may meet, n of them; boxes beyond may meet all. The bodies are copied, their
/// user_data is not used. n = 0: all boxes may meet all. SW_INVALID_ARGUMENT, SW_TOO_MANY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_set_bodies(
    search: *mut sw_search,
    bodies: *const sw_body,
    n: usize,
) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe {
        sw_search::change(search, |search| {
            let bodies = slice(bodies, n, "bodies")?;
            let mut memberships = Vec::new();
            let refused = |_| Error::OutOfMemory { what: "bodies", elements: n };
            memberships.try_reserve_exact(n).map_err(refused)?;
            for body in bodies {
                memberships.push(*body.read()?.membership());
            }
            search.pairs.set_filter((n > 0).then(|| Filter::new(memberships)));
            Ok(())
        })
    })
}

/// Finds and returns pairs.
///
/// # Safety
/// As [`sw_search::change`]; and `count` is NULL or points to a number.
unsafe fn find(
    search: *mut sw_search,
    count: *mut usize,
    find: impl FnOnce(&mut Search) -> Result<(), Failure>,
) -> *const u32 {
    value(null(), || {
        // SAFETY: of the caller.
        unsafe {
            put(count, 0, "count")?;
            sw_search::change(search, |search| {
                find(search)?;
                put(count, search.pairs.len(), "count")?;
                Ok(flat(search.pairs.as_slice()))
            })
        }
    })
}

/// Returns the pairs of n boxes that overlap and may meet, and writes their number: 2 * count indices, of each pair
/// the lower one first, each pair once. Touching boxes overlap. The list is the search's, and valid until its next
/// call. Boxes that do not lie as in a float[n][6] are copied once.
///
/// NULL on failure, with count 0: SW_NULL, SW_INVALID_ARGUMENT, SW_INVALID_BOX with the index, SW_TOO_MANY,
/// SW_TOO_MANY_PAIRS, SW_OUT_OF_MEMORY, SW_UNAVAILABLE, SW_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_find_pairs(
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
    search: *mut sw_search,
    count: *mut usize,
) -> *const u32 {
    // SAFETY: of the caller.
    unsafe {
        find(search, count, |search| {
            let Search { adaptive, pairs, copies: [copy, _], .. } = search;
            Ok(adaptive.find_pairs(Boxes::new(boxes, n, stride, max)?.to_slice(copy)?, pairs)?)
        })
    }
}

/// Returns the pairs of a box of one array and a box of another. Indices run through the first array, then continue
/// through the second: its first box has the index n. So do those of sw_search_set_bodies and of messages. Otherwise
/// as sw_find_pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_find_pairs_between(
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
    other_boxes: *const f32,
    other_n: usize,
    other_stride: usize,
    other_max: *const f32,
    search: *mut sw_search,
    count: *mut usize,
) -> *const u32 {
    // SAFETY: of the caller.
    unsafe {
        find(search, count, |search| {
            let Search { between, pairs, copies: [copy, other_copy], .. } = search;
            let boxes = Boxes::new(boxes, n, stride, max)?.to_slice(copy)?;
            let others = Boxes::new(other_boxes, other_n, other_stride, other_max)?.to_slice(other_copy)?;
            Ok(between.find_pairs(boxes, others, pairs)?)
        })
    }
}

/// As sw_space_save.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_save(search: *const sw_search) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe { sw_search::read(search, |search| save(&search.adaptive)) })
}

/// As sw_space_describe, of sw_find_pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_search_describe(search: *const sw_search, text: *mut c_char, size: usize) -> usize {
    // SAFETY: of the caller.
    value(0, || unsafe { sw_search::read(search, |search| text::write(&text::describe(&search.adaptive), text, size)) })
}
