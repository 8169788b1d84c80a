//! Queries of a space.

use crate::arrays::with_handle;
use crate::{Boxes, Failure, call, put, read, sw_body, sw_space, sw_status};
use sapwise::{Handle, Ray, View};
use std::ffi::{c_int, c_void};

/// Gets a handle that a query found. Returns 0 for no more.
pub type sw_found = Option<unsafe extern "C-unwind" fn(user: *mut c_void, handle: u64) -> c_int>;

/// Gets a handle that sw_space_query_boxes found, and the index of the box. Returns 0 for no more.
pub type sw_found_in = Option<unsafe extern "C-unwind" fn(user: *mut c_void, index: usize, handle: u64) -> c_int>;

/// Gets a handle and its distance, nearest first. Returns 0 for no more.
pub type sw_near = Option<unsafe extern "C-unwind" fn(user: *mut c_void, handle: u64, distance: f32) -> c_int>;

/// Gets a body that a ray or a moved box meets, and the t of it, not in the order of t. Returns the new maximum
/// of t, which never rises: t itself to find the first hit, INFINITY to find all, -1 to stop.
pub type sw_hit = Option<unsafe extern "C-unwind" fn(user: *mut c_void, handle: u64, t: f32) -> f32>;

/// Runs a query on the bodies that `by` may meet, or on all.
///
/// # Safety
/// As [`sw_space::read`]; `by` is NULL or points to a body.
unsafe fn query(
    space: *const sw_space,
    by: *const sw_body,
    run: impl FnOnce(View<'_>) -> Result<(), Failure>,
) -> sw_status {
    call(|| {
        // SAFETY: of the caller.
        unsafe {
            let by = by.as_ref().map(sw_body::read).transpose()?;
            sw_space::read(space, |space| run(by.map_or_else(|| space.all(), |by| space.view(&by))))
        }
    })
}

fn given<T>(callback: Option<T>) -> Result<T, Failure> {
    callback.ok_or_else(|| Failure::null("the callback"))
}

/// Passes handles to a callback until it returns 0.
///
/// # Safety
/// The callback may be called with `user`.
unsafe fn each(found: sw_found, user: *mut c_void) -> Result<impl FnMut(Handle), Failure> {
    let (found, mut goes_on) = (given(found)?, true);
    // SAFETY: of the caller.
    Ok(move |handle: Handle| goes_on = goes_on && unsafe { found(user, handle.to_bits()) } != 0)
}

/// Calls `found` for each body whose box overlaps these bounds. After 0 there are no more calls. A query finds the
/// bodies that the body `by` may meet, and all if it is NULL. SW_INVALID_BOX, SW_INVALID_ARGUMENT, SW_OUT_OF_MEMORY.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_query_box(
    space: *const sw_space,
    bounds: *const f32,
    by: *const sw_body,
    found: sw_found,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let found = each(found, user)?;
            Ok(view.query_box(read(bounds, "bounds")?, found)?)
        })
    }
}

/// Calls `found` for each of n boxes and each body whose box overlaps it. The order is not that of the boxes. Boxes
/// that do not lie as in a float[n][6] are copied once. Otherwise as sw_space_query_box; an invalid box is found before
/// the first call.
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_query_boxes(
    space: *const sw_space,
    boxes: *const f32,
    n: usize,
    stride: usize,
    max: *const f32,
    by: *const sw_body,
    found: sw_found_in,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let (found, mut goes_on) = (given(found)?, true);
            let mut copy = Vec::new();
            let boxes = Boxes::new(boxes, n, stride, max)?.to_slice(&mut copy)?;
            Ok(view.query_boxes(boxes, |index, handle| {
                goes_on = goes_on && found(user, index, handle.to_bits()) != 0;
            })?)
        })
    }
}

/// Calls `found` for each body whose box contains a point. Otherwise as sw_space_query_box.
///
/// cbindgen:ptrs-as-arrays=[[point; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_query_point(
    space: *const sw_space,
    point: *const f32,
    by: *const sw_body,
    found: sw_found,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let found = each(found, user)?;
            Ok(view.query_point(*read(point, "point")?, found)?)
        })
    }
}

/// Calls `hit` for each body whose box meets the ray origin + t * direction, 0 <= t <= max, with the t at which the
/// ray enters the box: 0 if it begins there. max may be INFINITY; a ray with a negative one meets nothing.
/// SW_INVALID_RAY, SW_OUT_OF_MEMORY.
///
/// cbindgen:ptrs-as-arrays=[[origin; 3], [direction; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_cast_ray(
    space: *const sw_space,
    origin: *const f32,
    direction: *const f32,
    max: f32,
    by: *const sw_body,
    hit: sw_hit,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let (hit, ray) = (given(hit)?, ray(origin, direction, max)?);
            Ok(view.cast_ray(&ray, |handle, t| hit(user, handle.to_bits(), t))?)
        })
    }
}

/// # Safety
/// As [`read`].
unsafe fn ray(origin: *const f32, direction: *const f32, max: f32) -> Result<Ray, Failure> {
    // SAFETY: of the caller.
    let (origin, direction) = unsafe { (*read(origin, "origin")?, *read(direction, "direction")?) };
    Ok(Ray { max, ..Ray::new(origin, direction) })
}

/// Writes the body that a ray meets first and the t of it; of several at the same t the one with the lowest handle.
/// If there is none, handle 0 and the t max. Otherwise as sw_space_cast_ray.
///
/// cbindgen:ptrs-as-arrays=[[origin; 3], [direction; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_first_hit(
    space: *const sw_space,
    origin: *const f32,
    direction: *const f32,
    max: f32,
    by: *const sw_body,
    handle: *mut u64,
    t: *mut f32,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        with_handle(handle, || {
            query(space, by, |view| {
                let first = view.first_hit(&ray(origin, direction, max)?)?;
                put(t, first.map_or(max, |(_, t)| t), "t")?;
                put(handle, first.map_or(0, |(handle, _)| handle.to_bits()), "handle")
            })
        })
    }
}

/// Calls `hit` for each body whose box is met by a box that moves by `motion`, with the share of the motion after
/// which they touch: 0 if they overlap at the start. SW_INVALID_BOX, SW_INVALID_RAY, SW_OUT_OF_MEMORY.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6], [motion; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_cast_box(
    space: *const sw_space,
    bounds: *const f32,
    motion: *const f32,
    by: *const sw_body,
    hit: sw_hit,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let (hit, bounds, motion) = (given(hit)?, read(bounds, "bounds")?, *read(motion, "motion")?);
            Ok(view.cast_box(bounds, motion, |handle, t| hit(user, handle.to_bits(), t))?)
        })
    }
}

/// Calls `near` with the k bodies whose boxes are nearest to a point: 0 if it is inside. Of several at the same
/// distance, those with the lowest handles come first. SW_INVALID_RAY if the point is not finite, SW_OUT_OF_MEMORY.
///
/// cbindgen:ptrs-as-arrays=[[point; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_space_nearest(
    space: *const sw_space,
    point: *const f32,
    k: usize,
    by: *const sw_body,
    near: sw_near,
    user: *mut c_void,
) -> sw_status {
    // SAFETY: of the caller.
    unsafe {
        query(space, by, |view| {
            let near = given(near)?;
            let nearest = view.nearest(*read(point, "point")?, k)?;
            nearest.iter().take_while(|(handle, distance)| near(user, handle.to_bits(), *distance) != 0).for_each(drop);
            Ok(())
        })
    }
}
