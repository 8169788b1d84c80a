//! Bodies with handles.

use crate::arrays::{handle, handles, with_handle};
use crate::status::stale;
use crate::{
    Boxes, Failure, Guarded, SW_MEASURE, call, check, flat, guarded, put, read, save, slice, sw_body, sw_options,
    sw_status, text, value,
};
use sapwise::{Aabb, Body, Error, Handle, Space};
use std::ffi::c_char;
use std::ptr::{null, null_mut};

/// Bodies with handles, and the pairs of those that overlap. The lists of pairs show the last sw_space_update. So do
/// queries: they find bodies where they were then, and none that was inserted or removed since. sw_space_get,
/// sw_space_contains, sw_space_len and sw_space_handles show each call at once. A call that fails changes nothing,
/// except sw_space_update.
pub struct sw_space {
    space: Guarded<Space>,
}

impl sw_space {
    const NAME: &str = "space";

    fn new(space: Space) -> *mut Self {
        Box::into_raw(Box::new(Self { space: Guarded::new(space) }))
    }

    /// # Safety
    /// `this` is NULL or a space.
    #[inline]
    pub(crate) unsafe fn read<R>(
        this: *const Self,
        read: impl FnOnce(&Space) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        // SAFETY: of the caller.
        let this = unsafe { this.as_ref() }.ok_or_else(|| Failure::null(Self::NAME))?;
        this.space.read(Self::NAME, read)
    }

    /// # Safety
    /// As [`read`](Self::read).
    #[inline]
    unsafe fn change(this: *mut Self, change: impl FnOnce(&mut Space) -> Result<(), Failure>) -> sw_status {
        call(|| {
            // SAFETY: of the caller.
            let this = unsafe { this.as_ref() }.ok_or_else(|| Failure::null(Self::NAME))?;
            this.space.change(Self::NAME, change)
        })
    }
}

/// Makes an empty space with the usual costs, on all cores that the process may use. NULL on failure: SW_UNAVAILABLE
/// or SW_PANIC.
#[unsafe(no_mangle)]
pub extern "C-unwind" fn sw_space_new() -> *mut sw_space {
    value(null_mut(), || Ok(sw_space::new(Space::new())))
}

/// Makes an empty space with the costs of this machine: from a folder, else a background thread measures for two
/// seconds and usual costs decide meanwhile. NULL: sapwise in the user's cache folder. As sw_space_new_with with
/// SW_MEASURE.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_new_measured(cache_folder: *const c_char) -> *mut sw_space {
    let options = sw_options { flags: SW_MEASURE, cache_folder, ..sw_options::USUAL };
    // SAFETY: of the caller.
    unsafe { sw_space_new_with(&raw const options) }
}

/// Makes an empty space. NULL for options: as sw_space_new. NULL on failure: SW_INVALID_ARGUMENT, SW_UNAVAILABLE or
/// SW_PANIC. A cache that can't be read is no failure: sw_space_describe reports it.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_new_with(options: *const sw_options) -> *mut sw_space {
    value(null_mut(), || {
        // SAFETY: of the caller.
        let options = unsafe { options.as_ref() }.unwrap_or(&sw_options::USUAL);
        // SAFETY: of the caller.
        Ok(sw_space::new(Space::with(unsafe { options.adaptive(options.registry()) }?)))
    })
}

/// Frees a space. Its threads end soon after: don't unload the library right away. NULL is allowed. SW_BUSY, and
/// nothing is freed, if a query of it runs: don't free it in a callback.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_free(space: *mut sw_space) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe { guarded::free(space, |of| &of.space, sw_space::NAME) })
}

/// Makes a copy that continues as the original would: the same calls give the same lists. It runs on the same helper
/// threads, and learns by itself. NULL on failure: SW_NULL, SW_BUSY or SW_PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_clone(space: *const sw_space) -> *mut sw_space {
    // SAFETY: of the caller.
    value(null_mut(), || unsafe { sw_space::read(space, |space| Ok(sw_space::new(space.clone()))) })
}

/// Makes a space what another one is, as a game does that goes back to an earlier state. It keeps its threads and
/// what it has learned. Handles of bodies inserted meanwhile become stale, and the same calls give them out again.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_assign(space: *mut sw_space, from: *const sw_space) -> sw_status {
    let is_itself = from == space.cast_const();
    // SAFETY: of the caller.
    unsafe {
        sw_space::change(space, |space| {
            if is_itself {
                return Ok(());
            }
            sw_space::read(from, |from| {
                space.clone_from(from);
                Ok(())
            })
        })
    }
}

/// Sets the most pairs that an update may find, from the next one on. 0, the default: no limit. An update that would
/// find more is SW_TOO_MANY_PAIRS. Pairs with bodies that were not set for some updates do not count.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_set_limit(space: *mut sw_space, limit: usize) -> sw_status {
    let set = |space: &mut Space| {
        space.set_limit((limit > 0).then_some(limit));
        Ok(())
    };
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, set) }
}

/// Makes room for more bodies, so that inserting them allocates little. SW_TOO_MANY, SW_OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_reserve(space: *mut sw_space, more: usize) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        sw_space::change(space, |space| {
            if u32::try_from(more).is_err() {
                return Err(Error::TooManyObjects { objects: more }.into());
            }
            Ok(space.reserve(more)?)
        })
    }
}

/// Inserts a body and writes its handle. body: NULL for the default. SW_INVALID_BOX, SW_INVALID_ARGUMENT,
/// SW_TOO_MANY, SW_OUT_OF_MEMORY.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_insert(
    space: *mut sw_space,
    bounds: *const f32,
    body: *const sw_body,
    handle: *mut u64,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        with_handle(handle, || {
            sw_space::change(space, |space| {
                let new = space.insert(*read(bounds, "bounds")?, sw_body::or_default(body)?)?;
                put(handle, new.to_bits(), "handle")
            })
        })
    }
}

/// Inserts a body like this one for each of n boxes, and writes n handles. Errors as sw_space_insert, with the index
/// of the first wrong box; then nothing is inserted. Boxes that do not lie as in a float[n][6] are copied once. For a
/// user_data each: sw_space_insert_bodies.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_insert_many(
    space: *mut sw_space,
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
    body: *const sw_body,
    handles: *mut u64,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        insert_boxes(space, (boxes, n, stride, max), handles, |space, boxes| {
            Ok(space.insert_all(boxes, sw_body::or_default(body)?)?)
        })
    }
}

/// Inserts n boxes with a body each. Otherwise as sw_space_insert_many.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_insert_bodies(
    space: *mut sw_space,
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
    bodies: *const sw_body,
    handles: *mut u64,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        insert_boxes(space, (boxes, n, stride, max), handles, |space, boxes| {
            let bodies = slice(bodies, n, "bodies")?;
            bodies.iter().try_for_each(|body| body.read().map(drop))?;
            let new = space.insert_all(boxes, Body::default())?;
            // All are valid.
            new.iter().zip(bodies).try_for_each(|(new, body)| Ok::<_, Failure>(space.set_body(*new, body.read()?)?))?;
            Ok(new)
        })
    }
}

/// Inserts boxes by `insert`, and writes their handles.
///
/// # Safety
/// As of [`sw_space_insert_many`].
unsafe fn insert_boxes(
    space: *mut sw_space,
    (boxes, n, stride, max): (*const f32, usize, usize, *const f32),
    handles: *mut u64,
    insert: impl FnOnce(&mut Space, &[Aabb]) -> Result<Vec<Handle>, Failure>,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        sw_space::change(space, |space| {
            let boxes = Boxes::new(boxes, n, stride, max)?;
            check(handles, n, "handles")?;
            let new = insert(space, boxes.to_slice(&mut Vec::new())?)?;
            new.iter().enumerate().for_each(|(k, new)| handles.add(k).write(new.to_bits()));
            Ok(())
        })
    }
}

/// Sets the box of a body. SW_STALE_HANDLE, SW_INVALID_BOX.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_set(space: *mut sw_space, handle: u64, bounds: *const f32) -> sw_status {
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, |space| Ok(space.set(self::handle(handle)?, *read(bounds, "bounds")?)?)) }
}

/// Sets the boxes of n bodies. Reads them where they lie. Errors as sw_space_set, for the first wrong one; then none
/// is set.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_set_many(
    space: *mut sw_space,
    handles: *const u64,
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        sw_space::change(space, |space| {
            let (handles, boxes) = (self::handles(handles, n)?, Boxes::new(boxes, n, stride, max)?);
            if let Some(boxes) = boxes.as_slice() {
                return Ok(space.set_all(handles, boxes)?);
            }
            let each = || handles.iter().copied().zip(boxes.iter());
            let wrong = |&(handle, aabb): &(Handle, Aabb)| !space.contains(handle) || aabb.defect().is_some();
            if let Some((handle, aabb)) = each().find(wrong) {
                // Returns its error.
                return Ok(space.set(handle, aabb)?);
            }
            Ok(each().try_for_each(|(handle, aabb)| space.set(handle, aabb))?)
        })
    }
}

/// Sets what a body may meet. Pairs begin and end by that too. SW_STALE_HANDLE, SW_INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_set_body(
    space: *mut sw_space,
    handle: u64,
    body: *const sw_body,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, |space| Ok(space.set_body(self::handle(handle)?, sw_body::or_default(body)?)?)) }
}

/// Removes a body. Its pairs end at the next update. SW_STALE_HANDLE.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_remove(space: *mut sw_space, handle: u64) -> sw_status {
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, |space| Ok(space.remove(self::handle(handle)?)?)) }
}

/// Removes n bodies. A handle may be given twice. SW_STALE_HANDLE for the first stale one; then none is removed.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_remove_many(space: *mut sw_space, handles: *const u64, n: usize) -> sw_status {
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, |space| Ok(space.remove_all(self::handles(handles, n)?)?)) }
}

/// Finds all pairs, and which began and ended since the previous update. SW_TOO_MANY_PAIRS, SW_OUT_OF_MEMORY,
/// SW_UNAVAILABLE: then no pair has begun or ended, pairs are missing, and the next update compares with the last one
/// that succeeded.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_update(space: *mut sw_space) -> sw_status {
    // SAFETY: of the caller.
    unsafe { sw_space::change(space, |space| Ok(space.update()?)) }
}

/// Returns a list of pairs.
///
/// # Safety
/// As [`sw_space::read`]; and `count` is NULL or points to a number.
unsafe fn list(
    space: *const sw_space,
    count: *mut usize,
    of: impl FnOnce(&Space) -> &[(Handle, Handle)],
) -> *const u64 {
    value(null(), || {
        // SAFETY: of the caller.
        unsafe {
            put(count, 0, "count")?;
            sw_space::read(space, |space| {
                let pairs = of(space);
                put(count, pairs.len(), "count")?;
                Ok(flat(pairs))
            })
        }
    })
}

/// Returns the pairs of bodies that overlap and may meet, and writes their number: 2 * count handles, of each pair
/// the lower one first, each pair once. Touching bodies overlap. The order depends on the calls alone, not on threads
/// or time. The list is the space's, and valid until its next update, sw_space_assign or sw_space_free. NULL on
/// failure, with count 0: SW_NULL, SW_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_pairs(space: *const sw_space, count: *mut usize) -> *const u64 {
    // SAFETY: of the caller.
    unsafe { list(space, count, Space::pairs) }
}

/// Returns the pairs that the previous update did not have, ascending. Otherwise as sw_space_pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_begun(space: *const sw_space, count: *mut usize) -> *const u64 {
    // SAFETY: of the caller.
    unsafe { list(space, count, Space::begun) }
}

/// Returns the pairs that only the previous update had. Otherwise as sw_space_begun. Those of removed bodies are among
/// them: sw_space_get fails for these, but no other body has their slot before the next sw_space_insert.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_ended(space: *const sw_space, count: *mut usize) -> *const u64 {
    // SAFETY: of the caller.
    unsafe { list(space, count, Space::ended) }
}

/// Returns the number of bodies. 0 on failure: SW_NULL, SW_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_len(space: *const sw_space) -> usize {
    // SAFETY: of the caller.
    value(0, || unsafe { sw_space::read(space, |space| Ok(space.len())) })
}

/// Returns whether there is a body with this handle: 1 or 0. 0 on failure, also beside an update: SW_NULL, SW_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_contains(space: *const sw_space, handle: u64) -> i32 {
    let has = |space: &Space| Handle::from_bits(handle).is_some_and(|handle| space.contains(handle));
    // SAFETY: of the caller.
    value(0, || unsafe { sw_space::read(space, |space| Ok(has(space).into())) })
}

/// Writes the box and the body of a handle, as set last. Either may be NULL. SW_STALE_HANDLE.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_get(
    space: *const sw_space,
    handle: u64,
    bounds: *mut f32,
    body: *mut sw_body,
) -> sw_status {
    let get = |space: &Space| {
        let found = space.get(self::handle(handle)?);
        let (aabb, known) = found.ok_or_else(|| Failure::new(sw_status::SW_STALE_HANDLE, stale(handle)))?;
        if !bounds.is_null() {
            // SAFETY: of the caller.
            unsafe { put(bounds.cast(), *aabb, "bounds") }?;
        }
        // SAFETY: of the caller.
        if body.is_null() { Ok(()) } else { unsafe { put(body, sw_body::from(known), "body") } }
    };
    // SAFETY: of the caller.
    call(|| unsafe { sw_space::read(space, get) })
}

/// Writes the handles of all bodies, ascending, at most n. SW_INVALID_ARGUMENT if there are more than n.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_handles(space: *const sw_space, handles: *mut u64, n: usize) -> sw_status {
    let write = |space: &Space| {
        if space.len() > n {
            let text = format_args!("there are {} bodies; give room for as many handles, not {n}", space.len());
            return Err(Failure::new(sw_status::SW_INVALID_ARGUMENT, text));
        }
        check(handles, space.len(), "handles")?;
        // SAFETY: there is room for `n`, says the caller.
        space.handles().enumerate().for_each(|(k, handle)| unsafe { handles.add(k).write(handle.to_bits()) });
        Ok(())
    };
    // SAFETY: of the caller.
    call(|| unsafe { sw_space::read(space, write) })
}

/// Saves the costs that the space has learned, for the next start on this machine. SW_CACHE if there is no cache, it
/// can't be written, the measurement has not ended, or it had an implausible value.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_save(space: *const sw_space) -> sw_status {
    // SAFETY: of the caller.
    call(|| unsafe { sw_space::read(space, |space| save(space.search())) })
}

/// Writes which algorithm ran last and why, where the costs came from, and what went wrong at the start: a text for
/// people. At most size bytes, with a zero at the end. Returns the length of the whole text. 0 on failure: SW_NULL,
/// SW_BUSY.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_describe(space: *const sw_space, text: *mut c_char, size: usize) -> usize {
    // SAFETY: of the caller.
    value(0, || unsafe { sw_space::read(space, |space| text::write(&text::describe(space.search()), text, size)) })
}
