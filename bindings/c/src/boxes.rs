//! Boxes in the memory of a caller.

use crate::{Failure, call, check, put, sw_status, sw_status::*};
use sapwise::{Aabb, Error};
use std::marker::PhantomData;

/// Three floats of a caller.
type Corner = [f32; 3];

// An `Aabb` is six floats, minimum then maximum, and nothing else.
const _: () = assert!(size_of::<Aabb>() == 24 && align_of::<Aabb>() == 4 && std::mem::offset_of!(Aabb, max) == 12);

/// Borrows a box of a caller, whose six floats are its minimum, then its maximum; or a point or a vector.
///
/// # Safety
/// `numbers` is NULL, misaligned, or points to the numbers of which a `T` consists.
pub(crate) unsafe fn read<'a, N, T>(numbers: *const N, what: &str) -> Result<&'a T, Failure> {
    const { assert!(align_of::<N>() == align_of::<T>()) };
    check(numbers, 1, what)?;
    // SAFETY: of the caller. Every bit pattern is a number.
    Ok(unsafe { &*numbers.cast() })
}

/// Boxes that lie `stride` bytes apart: each with its maximum behind its minimum, or with the maxima in an array of
/// their own.
#[derive(Clone, Copy)]
pub(crate) struct Boxes<'a> {
    min: *const f32,
    max: *const f32,
    stride: usize,
    len: usize,
    memory: PhantomData<&'a f32>,
}

impl<'a> Boxes<'a> {
    /// # Safety
    /// `min`, `n`, `stride` and `max` describe memory as the head of the header says, or this function refuses them.
    #[inline]
    pub(crate) unsafe fn new(min: *const f32, n: usize, stride: usize, max: *const f32) -> Result<Self, Failure> {
        let least = if max.is_null() { size_of::<Aabb>() } else { size_of::<Corner>() };
        let stride = if stride == 0 { least } else { stride };
        if stride < least || !stride.is_multiple_of(align_of::<f32>()) {
            let text =
                format_args!("the stride of boxes is {stride} bytes; use a multiple of 4, at least {least}, or 0");
            return Err(Failure::new(SW_INVALID_ARGUMENT, text));
        }
        check(min, n, "boxes")?;
        check(max, if max.is_null() { 0 } else { n }, "max")?;
        if n.checked_mul(stride).is_none_or(|size| size > isize::MAX as usize) {
            let text = format_args!("{n} boxes with a stride of {stride} bytes fit no memory");
            return Err(Failure::new(SW_TOO_MANY, text));
        }
        // The three floats behind the minimum, or nothing at all.
        let max = if max.is_null() { min.wrapping_add(3) } else { max };
        Ok(Self { min, max, stride, len: n, memory: PhantomData })
    }

    /// Returns the boxes in the caller's memory, if their layout is that of the library.
    pub(crate) fn as_slice(&self) -> Option<&'a [Aabb]> {
        if self.len == 0 {
            return Some(&[]);
        }
        let lies = self.stride == size_of::<Aabb>() && self.max == self.min.wrapping_add(3);
        // SAFETY: there are `len` boxes, one right behind the other, as `new` was told.
        lies.then(|| unsafe { std::slice::from_raw_parts(self.min.cast(), self.len) })
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Aabb> + 'a {
        let Self { min, max, stride, .. } = *self;
        (0..self.len).map(move |k| {
            // SAFETY: `new` was told that there are such floats, and that they are aligned.
            let corner = |of: *const f32| unsafe { *of.byte_add(k * stride).cast::<Corner>() };
            Aabb::new(corner(min), corner(max))
        })
    }

    /// Returns the boxes in the layout of the library, copied if they have another one.
    pub(crate) fn to_slice<'b>(self, copy: &'b mut Vec<Aabb>) -> Result<&'b [Aabb], Failure>
    where
        'a: 'b,
    {
        if let Some(boxes) = self.as_slice() {
            return Ok(boxes);
        }
        copy.clear();
        copy.try_reserve(self.len).map_err(|_| Error::OutOfMemory { what: "boxes", elements: self.len })?;
        copy.extend(self.iter());
        Ok(copy)
    }
}

/// Rounds a box of doubles outward: the floats contain every point between them. Far from the origin floats are
/// coarse, 0.06 at a million: subtract an origin near the boxes first. SW_NULL.
///
/// cbindgen:ptrs-as-arrays=[[min; 3], [max; 3], [bounds; 6]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_box_from_doubles(min: *const f64, max: *const f64, bounds: *mut f32) -> sw_status {
    call(|| {
        // SAFETY: of the caller.
        unsafe { put(bounds.cast(), Aabb::from_f64(*read(min, "min")?, *read(max, "max")?), "bounds") }
    })
}

/// Grows a box so that it contains the whole motion. Rounded outward. SW_NULL.
///
/// cbindgen:ptrs-as-arrays=[[bounds; 6], [motion; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C-unwind" fn sw_box_sweep(bounds: *mut f32, motion: *const f32) -> sw_status {
    call(|| {
        // SAFETY: of the caller.
        unsafe {
            let swept = read::<_, Aabb>(bounds, "bounds")?.swept(*read(motion, "motion")?);
            put(bounds.cast(), swept, "bounds")
        }
    })
}
