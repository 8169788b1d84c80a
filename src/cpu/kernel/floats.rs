//! Vectors of floats, at every SIMD level.

/// Several floats. All levels round alike: their results are the same to the last bit.
///
/// Every function is unsafe: its caller must have the instructions of the implementing type enabled.
pub(crate) trait Floats: Copy {
    /// Number of floats.
    const COUNT: usize;
    /// Whether the truth values of a mask are made one by one, so that a branch that saves some of them pays.
    const SCALAR: bool;
    /// A truth value for each float.
    type Mask: Copy;
    /// Loads the float at this place and those behind it.
    unsafe fn load(from: *const f32) -> Self;
    /// Stores the floats at this place and behind it.
    unsafe fn store(self, to: *mut f32);
    unsafe fn splat(value: f32) -> Self;
    unsafe fn plus(self, other: Self) -> Self;
    unsafe fn minus(self, other: Self) -> Self;
    unsafe fn times(self, other: Self) -> Self;
    unsafe fn root(self) -> Self;
    /// Returns the larger of both, `other` if one is NaN or both are zero.
    unsafe fn or_more(self, other: Self) -> Self;
    /// Returns the lesser of both, `other` if one is NaN or both are zero.
    unsafe fn or_less(self, other: Self) -> Self;
    /// Returns which floats are at most those of `other`. NaN is not.
    unsafe fn at_most(self, other: Self) -> Self::Mask;
    unsafe fn and(one: Self::Mask, other: Self::Mask) -> Self::Mask;
    /// Returns the truth values, one bit each, the lowest bit the first.
    unsafe fn bits(mask: Self::Mask) -> u32;
}

macro_rules! floats {
    (
        $vector:ty, $count:literal, $mask:ty,
        load $load:expr, store $store:expr, splat $splat:expr, root $root:expr,
        at_most $at_most:expr, and $and:expr, bits $bits:expr,
        $($op:ident $of_parts:expr),*
    ) => {
        #[allow(unused_unsafe, reason = "plain Rust and the vectors that every CPU has need none")]
        impl<const N: usize> Floats for [$vector; N] {
            const COUNT: usize = $count * N;
            const SCALAR: bool = $count == 1;
            type Mask = [$mask; N];

            #[inline(always)]
            unsafe fn load(from: *const f32) -> Self {
                // SAFETY: the caller has the instructions enabled, here and below, and `COUNT` floats to read.
                std::array::from_fn(|k| unsafe { $load(from.add($count * k)) })
            }

            #[inline(always)]
            unsafe fn store(self, to: *mut f32) {
                for (k, part) in self.into_iter().enumerate() {
                    // SAFETY: as above; there is room for `COUNT` floats.
                    unsafe { $store(to.add($count * k), part) };
                }
            }

            #[inline(always)]
            unsafe fn splat(value: f32) -> Self {
                // SAFETY: as above.
                unsafe { [$splat(value); N] }
            }

            #[inline(always)]
            unsafe fn root(self) -> Self {
                // SAFETY: as above.
                self.map(|part| unsafe { $root(part) })
            }

            $(
                #[inline(always)]
                unsafe fn $op(self, other: Self) -> Self {
                    // SAFETY: as above.
                    std::array::from_fn(|k| unsafe { $of_parts(self[k], other[k]) })
                }
            )*

            #[inline(always)]
            unsafe fn at_most(self, other: Self) -> Self::Mask {
                // SAFETY: as above.
                std::array::from_fn(|k| unsafe { $at_most(self[k], other[k]) })
            }

            #[inline(always)]
            unsafe fn and(one: Self::Mask, other: Self::Mask) -> Self::Mask {
                // SAFETY: as above.
                std::array::from_fn(|k| unsafe { $and(one[k], other[k]) })
            }

            #[inline(always)]
            unsafe fn bits(mask: Self::Mask) -> u32 {
                // SAFETY: as above.
                (0..N).fold(0, |all, k| all | unsafe { $bits(mask[k]) } << ($count * k))
            }
        }
    };
}

// Plain Rust, which the compiler turns into the vectors of the target.
#[cfg(any(test, not(any(target_arch = "x86_64", all(target_arch = "wasm32", target_feature = "simd128")))))]
floats! {
    f32, 1, bool,
    load std::ptr::read, store std::ptr::write, splat std::convert::identity, root f32::sqrt,
    at_most |a: f32, b: f32| a <= b, and |a: bool, b: bool| a & b, bits u32::from,
    plus |a: f32, b: f32| a + b,
    minus |a: f32, b: f32| a - b,
    times |a: f32, b: f32| a * b,
    or_more |a: f32, b: f32| if a > b { a } else { b },
    or_less |a: f32, b: f32| if a < b { a } else { b }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Floats;
    use std::arch::x86_64::*;

    floats! {
        __m128, 4, __m128,
        load _mm_loadu_ps, store _mm_storeu_ps, splat _mm_set1_ps, root _mm_sqrt_ps,
        at_most _mm_cmple_ps, and _mm_and_ps, bits |mask| _mm_movemask_ps(mask) as u32,
        plus _mm_add_ps,
        minus _mm_sub_ps,
        times _mm_mul_ps,
        or_more _mm_max_ps,
        or_less _mm_min_ps
    }

    floats! {
        __m256, 8, __m256,
        load _mm256_loadu_ps, store _mm256_storeu_ps, splat _mm256_set1_ps, root _mm256_sqrt_ps,
        at_most _mm256_cmp_ps::<_CMP_LE_OQ>, and _mm256_and_ps, bits |mask| _mm256_movemask_ps(mask) as u32,
        plus _mm256_add_ps,
        minus _mm256_sub_ps,
        times _mm256_mul_ps,
        or_more _mm256_max_ps,
        or_less _mm256_min_ps
    }

    floats! {
        __m512, 16, __mmask16,
        load _mm512_loadu_ps, store _mm512_storeu_ps, splat _mm512_set1_ps, root _mm512_sqrt_ps,
        at_most _mm512_cmp_ps_mask::<_CMP_LE_OQ>, and |a: __mmask16, b: __mmask16| a & b, bits u32::from,
        plus _mm512_add_ps,
        minus _mm512_sub_ps,
        times _mm512_mul_ps,
        or_more _mm512_max_ps,
        or_less _mm512_min_ps
    }
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod wasm {
    use super::Floats;
    use std::arch::wasm32::*;

    floats! {
        v128, 4, v128,
        load |from: *const f32| v128_load(from.cast()), store |to: *mut f32, part| v128_store(to.cast(), part),
        splat f32x4_splat, root f32x4_sqrt,
        at_most f32x4_le, and v128_and, bits |mask| u32::from(i32x4_bitmask(mask)),
        plus f32x4_add,
        minus f32x4_sub,
        times f32x4_mul,
        // They return the first in doubt, not the other.
        or_more |a, b| f32x4_pmax(b, a),
        or_less |a, b| f32x4_pmin(b, a)
    }
}
