//! The inner loops: one box against several at a time, at every SIMD level.
//!
//! Each loop is written once over a [`Level`], and compiled for each level inside a function that enables its
//! instructions. A closure is compiled by itself, without these instructions, unless the compiler inlines it: vectors
//! stand in small closures alone, elsewhere in functions that are always inlined.

pub(crate) mod bounds;
pub(crate) mod contain;
pub(crate) mod distance;
mod floats;
pub(crate) mod marks;
pub(crate) mod nearest_first;
pub(crate) mod node;
pub(crate) mod ray;
pub(crate) mod rows;
pub(crate) mod small;
pub(crate) mod triad;
pub(crate) mod walk;
#[cfg(target_arch = "x86_64")]
mod x86;

use crate::pairs::each_bit;
use crate::{Aabb, Pair};
use baseline::Four;
use contain::{BLOCK, within};
use floats::Floats;
use marks::{Marks, Wanted};
use nearest_first::Measure;
use node::{Group, LANES, Node};
use rows::View;

/// A SIMD level for which code is compiled. A value proves that this CPU has its instructions.
pub(crate) trait Level: Copy {
    /// Rows of columns that are tested together: at most 16.
    type Rows: Floats;
    /// The lanes of a node.
    type Lanes: Floats;

    /// Returns the rows of `hits` whose pair with the box this strip has to report: those for which both bits of the
    /// mask of [`StripGrid::each_strip`](crate::load::StripGrid::each_strip) are set in either box. Bit k of `hits` is
    /// row `at + k`.
    ///
    /// # Safety
    /// `at <= view.len`.
    #[inline(always)]
    unsafe fn owned(self, view: &View<'_>, at: usize, begins: u32, hits: u32) -> u32 {
        let mut owned = hits;
        // Most boxes stand in one strip: both bits are set, and those of the others don't matter.
        if begins != 3 {
            each_bit(hits, |bit| owned &= !(u32::from(begins | view.begins[at + bit] != 3) << bit));
        }
        owned
    }

    /// Writes the pairs of `id` with the rows of `hits` to the head of `room`, which holds a pair for each row that is
    /// tested. The rest of `room` is unspecified afterwards.
    ///
    /// # Safety
    /// `at <= view.len`.
    #[inline(always)]
    unsafe fn write_rows(self, view: &View<'_>, at: usize, id: u32, hits: u32, room: &mut [Pair]) {
        write_each(id, &view.ids[at..], hits, room);
    }

    /// Writes the pairs of a box with each of `others` whose bit is set to the head of `room`. The rest of `room` is
    /// unspecified afterwards.
    #[inline(always)]
    fn write(self, id: u32, others: &[u32; LANES], hits: u32, room: &mut [Pair; LANES]) {
        write_each(id, others, hits, room);
    }

    /// Returns whether all of these boxes are valid and lie within the others.
    #[inline(always)]
    fn all_within(self, boxes: &[Aabb; BLOCK], outer: &[Aabb; BLOCK]) -> bool {
        boxes.iter().zip(outer).fold(true, |all, (b, outer)| all & within(b, outer))
    }
}

/// The instructions that every CPU of the target has: SSE2 on x86-64, `simd128` on WebAssembly if the build has it,
/// elsewhere what the compiler makes of plain Rust.
#[derive(Clone, Copy)]
pub(crate) struct Baseline;

impl Level for Baseline {
    type Rows = baseline::Rows;
    type Lanes = baseline::Lanes;
}

#[cfg(target_arch = "x86_64")]
mod baseline {
    use std::arch::x86_64::__m128;
    pub(super) type Four = [__m128; 1];
    pub(super) type Rows = [__m128; 2];
    pub(super) type Lanes = [__m128; 4];
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod baseline {
    use std::arch::wasm32::v128;
    pub(super) type Four = [v128; 1];
    pub(super) type Rows = [v128; 2];
    pub(super) type Lanes = [v128; 4];
}

#[cfg(not(any(target_arch = "x86_64", all(target_arch = "wasm32", target_feature = "simd128"))))]
mod baseline {
    pub(super) type Four = [f32; 4];
    pub(super) type Rows = [f32; 4];
    pub(super) type Lanes = [f32; 16];
}

/// Defines functions, each of which calls a kernel in a function that enables the instructions of a SIMD level. The
/// kernel is inlined there, and takes the [`Level`] behind its other arguments. In brackets: generic parameters of the
/// kernel before that of the level, then their names.
macro_rules! at_level {
    ($(
        $(#[$meta:meta])*
        $seen:vis fn $name:ident [$($generic:tt)*] [$($given:ident)*] ($($arg:ident: $of:ty),* $(,)?) $(-> $out:ty)?
            = $($kernel:ident)::+;
    )+) => {$(
        $(#[$meta])*
        $seen fn $name<$($generic)*>(simd: $crate::cpu::Simd, $($arg: $of),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f")]
            fn avx512<$($generic)*>($($arg: $of,)* level: $crate::cpu::level::Avx512) $(-> $out)? {
                $($kernel)::+::<$($given,)* _>($($arg,)* level)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2<$($generic)*>($($arg: $of,)* level: $crate::cpu::level::Avx2) $(-> $out)? {
                $($kernel)::+::<$($given,)* _>($($arg,)* level)
            }
            match simd {
                // SAFETY: the level proves that this CPU has the instructions.
                #[cfg(target_arch = "x86_64")]
                $crate::cpu::Simd::Avx512(level) => unsafe { avx512::<$($given,)*>($($arg,)* level) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                $crate::cpu::Simd::Avx2(level) => unsafe { avx2::<$($given,)*>($($arg,)* level) },
                $crate::cpu::Simd::Portable => {
                    $($kernel)::+::<$($given,)* _>($($arg,)* $crate::cpu::kernel::Baseline)
                }
            }
        }
    )+};
}
use at_level;

/// Returns the lower and the upper bounds of a box, in lanes 0 to 2. Lane 3 is unspecified.
#[inline(always)]
pub(crate) fn corners(b: &Aabb) -> [Four; 2] {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        let at = std::ptr::from_ref(b).cast::<f32>();
        // SAFETY: SSE2 is part of x86-64. The loads read floats 0 to 3 and 2 to 5 of an `Aabb`, which is `repr(C)`.
        unsafe {
            let high = _mm_srli_si128::<4>(_mm_castps_si128(_mm_loadu_ps(at.add(2))));
            [[_mm_loadu_ps(at)], [_mm_castsi128_ps(high)]]
        }
    }
    // SAFETY: every CPU of the target has the instructions of `Four`; there are four floats to read.
    #[cfg(not(target_arch = "x86_64"))]
    [b.min, b.max].map(|[x, y, z]| unsafe { Four::load([x, y, z, 0.0].as_ptr()) })
}

/// Writes the pairs of a box with each of the others whose bit is set to the head of `room`.
#[inline(always)]
fn write_each(id: u32, others: &[u32], hits: u32, room: &mut [Pair]) {
    let mut room = room.iter_mut();
    each_bit(hits, |bit| {
        let other = others[bit];
        if let Some(pair) = room.next() {
            *pair = (id.min(other), id.max(other));
        }
    });
}

/// Returns whether two boxes overlap, without the branches of [`Aabb::overlaps`]: no CPU predicts them if every other
/// pair is a hit.
#[inline(always)]
pub(crate) fn overlap(a: &Aabb, b: &Aabb) -> bool {
    let ([low_a, high_a], [low_b, high_b]) = (corners(a), corners(b));
    // SAFETY: every CPU has the instructions of `Four`.
    unsafe { Four::bits(Four::and(low_a.at_most(high_b), low_b.at_most(high_a))) & 7 == 7 }
}

/// Prefetches a value that is needed soon; does nothing on targets without such an instruction.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let at = std::ptr::from_ref(value).cast::<i8>();
        for byte in (0..size_of::<T>()).step_by(64) {
            // SAFETY: SSE is part of x86-64, and the address lies within the value.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(at.add(byte)) };
        }
        // A value that need not begin a cache line may end in one more: of boxes, one in four does.
        if const { align_of::<T>() < 64 } {
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(at.add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
