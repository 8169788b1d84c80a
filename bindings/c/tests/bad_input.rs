//! Every mistake that a C program can make yields a status and a message. The examples compare the pairs themselves.

use sapwise_capi::sw_status::*;
use sapwise_capi::*;
use std::ffi::{CStr, c_int, c_void};
use std::ptr::{null, null_mut};

const CUBE: [f32; 6] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
const DEFAULT: sw_body = sw_body { groups: u32::MAX, masks: u32::MAX, owner: 0, kind: 0, user_data: 0 };

fn last_error() -> &'static str {
    // SAFETY: the tests read it before the next call.
    unsafe { CStr::from_ptr(sw_last_error()) }.to_str().unwrap()
}

#[track_caller]
fn fails(status: sw_status, expected: sw_status, text: &str) {
    assert_eq!((status, sw_last_status()), (expected, expected), "{}", last_error());
    assert!(last_error().contains(text), "{}", last_error());
}

/// A space with three cubes, two of which overlap.
fn space() -> (*mut sw_space, [u64; 3]) {
    let space = sw_space_new();
    let mut handles = [0; 3];
    for (k, handle) in handles.iter_mut().enumerate() {
        let bounds = CUBE.map(|v| v + [0.0, 0.5, 9.0][k]);
        // SAFETY: all pointers point to what they should.
        assert_eq!(unsafe { sw_space_insert(space, bounds.as_ptr(), null(), handle) }, SW_OK);
    }
    // SAFETY: as above.
    assert_eq!(unsafe { sw_space_update(space) }, SW_OK);
    (space, handles)
}

#[test]
fn null_is_a_status() {
    let (space, [handle, ..]) = space();
    let (mut count, mut out) = (7, 7);
    // SAFETY: NULL is what is tested.
    unsafe {
        fails(sw_space_update(null_mut()), SW_NULL, "space is NULL");
        fails(sw_space_set(space, handle, null()), SW_NULL, "bounds is NULL");
        fails(sw_space_insert(space, CUBE.as_ptr(), null(), null_mut()), SW_NULL, "handle is NULL");
        fails(sw_space_insert(space, null(), null(), &raw mut out), SW_NULL, "bounds is NULL");
        assert_eq!((out, sw_space_len(space)), (0, 3));
        out = 7;
        fails(sw_space_insert(null_mut(), CUBE.as_ptr(), null(), &raw mut out), SW_NULL, "space is NULL");
        let (from, along) = ([-1.0_f32, 0.5, 0.5], [1.0_f32, 0.0, 0.0]);
        let (from, along, mut hit) = (from.as_ptr(), along.as_ptr(), 7);
        let without_t = sw_space_first_hit(space, from, along, 9.0, null(), &raw mut hit, null_mut());
        fails(without_t, SW_NULL, "t is NULL");
        assert_eq!((out, hit), (0, 0));
        assert!(sw_space_pairs(null(), &raw mut count).is_null() && count == 0);
        assert!(sw_space_pairs(space, null_mut()).is_null());
        fails(sw_last_status(), SW_NULL, "count is NULL");
        fails(sw_space_query_box(space, CUBE.as_ptr(), null(), None, null_mut()), SW_NULL, "callback is NULL");
        fails(sw_space_set_many(space, null(), CUBE.as_ptr(), 1, 0, null()), SW_NULL, "handles is NULL");
        fails(sw_space_set_many(space, &raw const handle, null(), 1, 0, null()), SW_NULL, "boxes is NULL");
        assert_eq!(sw_space_set_many(space, null(), null(), 0, 0, null()), SW_OK);
        assert!(sw_find_pairs(CUBE.as_ptr(), 1, 0, null(), null_mut(), &raw mut count).is_null());
        fails(sw_last_status(), SW_NULL, "search is NULL");
        assert_eq!([sw_space_free(null_mut()), sw_search_free(null_mut()), sw_space_free(space)], [SW_OK; 3]);
    }
}

#[test]
fn wrong_arrays_are_found_before_they_are_read() {
    let (space, handles) = space();
    let boxes = [0.0_f32; 64].as_ptr();
    let insert = |boxes, n, stride, max| {
        // SAFETY: an array may be shorter than n boxes, but the call fails before it reads one.
        unsafe { sw_space_insert_many(space, boxes, n, stride, max, null(), handles.as_ptr().cast_mut()) }
    };
    for (stride, max, least) in [(23, null(), 24), (26, null(), 24), (8, boxes, 12), (usize::MAX, null(), 24)] {
        fails(insert(boxes, 1, stride, max), SW_INVALID_ARGUMENT, &format!("is {stride} bytes"));
        assert!(last_error().contains(&format!("at least {least}")));
    }
    fails(insert(boxes.wrapping_byte_add(2), 1, 0, null()), SW_INVALID_ARGUMENT, "align it to 4 bytes");
    fails(insert(boxes, 1, 0, boxes.wrapping_byte_add(1)), SW_INVALID_ARGUMENT, "max is at");
    for n in [1 << 32, usize::MAX, usize::MAX / 24] {
        fails(insert(boxes, n, 0, null()), SW_TOO_MANY, "32 bits");
    }
    fails(insert(boxes, 1000, 1 << 60, null()), SW_TOO_MANY, "fit no memory");
    let mut count = 7;
    // SAFETY: as above; the options may be NULL.
    unsafe {
        let search = sw_search_new(null());
        assert!(sw_find_pairs(boxes, 1 << 32, 0, null(), search, &raw mut count).is_null() && count == 0);
        fails(sw_last_status(), SW_TOO_MANY, "4294967296");
        assert_eq!([sw_space_len(space), sw_space_reserve(space, usize::MAX) as usize], [3, SW_TOO_MANY as usize]);
        assert_eq!([sw_search_free(search), sw_space_free(space)], [SW_OK; 2]);
    }
}

#[test]
fn invalid_boxes_bodies_and_rays_are_named() {
    let (space, handles) = space();
    let (mut nan, mut inverted) = (CUBE, CUBE);
    (nan[4], inverted[0]) = (f32::NAN, 2.0);
    let mut out = [7; 2];
    // SAFETY: all pointers point to what they should.
    unsafe {
        fails(sw_space_set(space, handles[1], nan.as_ptr()), SW_INVALID_BOX, &format!("handle {}", handles[1]));
        fails(sw_space_insert(space, inverted.as_ptr(), null(), out.as_mut_ptr()), SW_INVALID_BOX, "inverted");
        let boxes = [CUBE, nan];
        let first = boxes.as_ptr().cast();
        fails(
            sw_space_insert_many(space, first, 2, 0, null(), null(), out.as_mut_ptr()),
            SW_INVALID_BOX,
            "box 1 has a bound that is not a number",
        );
        let boxes: [[f32; 6]; 2] = [CUBE, inverted];
        let first = boxes.as_ptr().cast::<f32>();
        // As they lie for the library, and as they lie for another reader.
        for max in [null(), first.add(3)] {
            let set = sw_space_set_many(space, handles.as_ptr(), first, 2, 24, max);
            fails(set, SW_INVALID_BOX, &format!("handle {}", handles[1]));
        }
        let (min, max) = ([[0.0_f32; 3]; 2], [[1.0_f32; 3], [-1.0; 3]]);
        let set = sw_space_set_many(space, handles.as_ptr(), min.as_ptr().cast(), 2, 0, max.as_ptr().cast());
        fails(set, SW_INVALID_BOX, &format!("handle {}", handles[1]));
        let body = sw_body { kind: 3, ..DEFAULT };
        fails(sw_space_set_body(space, handles[0], &raw const body), SW_INVALID_ARGUMENT, "kind of the body is 3");
        let (boxes, out): ([[f32; 6]; 2], _) = ([CUBE; 2], out.as_mut_ptr());
        for (first, bodies, status) in [
            (boxes.as_ptr(), [DEFAULT, body], SW_INVALID_ARGUMENT),
            ([CUBE, nan].as_ptr(), [DEFAULT; 2], SW_INVALID_BOX),
        ] {
            assert_eq!(sw_space_insert_bodies(space, first.cast(), 2, 0, null(), bodies.as_ptr(), out), status);
        }
        let (origin, zero) = ([f32::INFINITY; 3], [0.0; 3]);
        let hit = |space: *const sw_space, origin: &[f32; 3], direction: &[f32; 3]| {
            let (mut handle, mut t) = (7, 7.0);
            let (origin, direction) = (origin.as_ptr(), direction.as_ptr());
            let status = sw_space_first_hit(space, origin, direction, 1.0, null(), &raw mut handle, &raw mut t);
            assert_eq!(handle, 0);
            status
        };
        fails(hit(space, &origin, &zero), SW_INVALID_RAY, "not finite");
        fails(hit(space, &zero, &zero), SW_INVALID_RAY, "direction zero");
        fails(hit(null(), &zero, &zero), SW_NULL, "space is NULL");
        assert_eq!([sw_space_len(space), sw_space_free(space) as usize], [3, 0]);
    }
}

#[test]
fn stale_handles_change_nothing() {
    let (space, handles) = space();
    let mut count = 0;
    // SAFETY: all pointers point to what they should.
    unsafe {
        for wrong in [0, 99 << 32 | 1, u64::MAX, handles[0] + 1] {
            fails(sw_space_remove(space, wrong), SW_STALE_HANDLE, if wrong == 0 { "0 is no" } else { "names no body" });
            fails(sw_space_get(space, wrong, null_mut(), null_mut()), SW_STALE_HANDLE, "handle");
            assert_eq!(sw_space_contains(space, wrong), 0);
            let some = [handles[0], wrong];
            fails(sw_space_remove_many(space, some.as_ptr(), 2), SW_STALE_HANDLE, "handle");
            let boxes = [CUBE.map(|v| v + 50.0); 2];
            let (first, padded) = (boxes.as_ptr().cast(), [[1.0_f32; 8]; 2]);
            fails(sw_space_set_many(space, some.as_ptr(), first, 2, 0, null()), SW_STALE_HANDLE, "handle");
            fails(sw_space_set_many(space, some.as_ptr(), padded.as_ptr().cast(), 2, 32, null()), SW_STALE_HANDLE, "");
        }
        assert_eq!(sw_space_remove(space, handles[2]), SW_OK);
        fails(sw_space_remove(space, handles[2]), SW_STALE_HANDLE, "it was removed");
        assert_eq!(sw_space_update(space), SW_OK);
        let pairs = sw_space_pairs(space, &raw mut count);
        assert_eq!(std::slice::from_raw_parts(pairs, 2 * count), &handles[..2]);
        assert_eq!(sw_space_free(space), SW_OK);
    }
}

/// Everything that may not happen in a callback, and some that may.
unsafe extern "C-unwind" fn calls_back(user: *mut c_void, handle: u64) -> c_int {
    let space: *mut sw_space = user.cast();
    let mut out = 7;
    // SAFETY: `user` is the space of the query.
    unsafe {
        fails(sw_space_update(space), SW_BUSY, "not in a callback");
        fails(sw_space_set(space, handle, CUBE.as_ptr()), SW_BUSY, "query");
        fails(sw_space_remove(space, handle), SW_BUSY, "query");
        fails(sw_space_insert(space, CUBE.as_ptr(), null(), &raw mut out), SW_BUSY, "query");
        assert_eq!(out, 0);
        fails(sw_space_assign(space, space), SW_BUSY, "query");
        fails(sw_space_free(space), SW_BUSY, "query");
        let mut bounds = [0.0; 6];
        assert_eq!(sw_space_get(space, handle, bounds.as_mut_ptr(), null_mut()), SW_OK);
        assert_eq!(sw_space_query_box(space, bounds.as_ptr(), null(), Some(ends), null_mut()), SW_OK);
    }
    1
}

unsafe extern "C-unwind" fn ends(_: *mut c_void, _: u64) -> c_int {
    0
}

#[test]
fn callback_can_read_but_not_change() {
    let (space, _) = space();
    // SAFETY: all pointers point to what they should.
    unsafe {
        assert_eq!(sw_space_query_box(space, CUBE.as_ptr(), null(), Some(calls_back), space.cast()), SW_OK);
        assert_eq!(sw_space_assign(space, space), SW_OK);
        assert_eq!([sw_space_len(space), sw_space_update(space) as usize, sw_space_free(space) as usize], [3, 0, 0]);
    }
}

#[test]
fn freed_objects_are_known_in_debug_builds() {
    if cfg!(debug_assertions) {
        let ((space, handles), other) = (space(), sw_space_new());
        // SAFETY: a debug build keeps what these pointers point to.
        unsafe {
            assert_eq!(sw_space_free(space), SW_OK);
            fails(sw_space_free(space), SW_FREED, "this space was freed");
            fails(sw_space_update(space), SW_FREED, "freed");
            fails(sw_space_remove(space, handles[0]), SW_FREED, "freed");
            assert_ne!(other, sw_space_new());
            assert_eq!(sw_space_free(other), SW_OK);
        }
    }
}

#[test]
fn wrong_options_make_nothing() {
    let zero = sw_options { threads: 0, flags: 0, algorithm: null(), cache_folder: null() };
    // SAFETY: all texts end with a zero.
    unsafe {
        for (options, status, text) in [
            (sw_options { flags: 16, ..zero }, SW_INVALID_ARGUMENT, "0x10"),
            (sw_options { algorithm: c"sapp".as_ptr(), ..zero }, SW_UNAVAILABLE, "\"sapp\"; known here: brute@cpu1"),
            (sw_options { algorithm: c"\xff".as_ptr(), ..zero }, SW_INVALID_ARGUMENT, "not UTF-8"),
            (sw_options { algorithm: c"sap@cpu3".as_ptr(), threads: 2, ..zero }, SW_UNAVAILABLE, "but 2 may run"),
            (sw_options { algorithm: c"sap@cpu1".as_ptr(), flags: SW_MEASURE, ..zero }, SW_INVALID_ARGUMENT, "drop"),
        ] {
            assert!(sw_space_new_with(&raw const options).is_null());
            fails(sw_last_status(), status, text);
            assert!(sw_search_new(&raw const options).is_null());
        }
        let space = sw_space_new_with(&raw const zero);
        fails(sw_space_save(space), SW_CACHE, "SW_MEASURE");
        let mut text = [1_i8; 8];
        assert!(sw_space_describe(space, text.as_mut_ptr().cast(), 8) > 20 && text[7] == 0 && text[6] != 0);
        assert_eq!(sw_space_free(space), SW_OK);
    }
}
