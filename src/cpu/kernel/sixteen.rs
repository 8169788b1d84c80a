//! Sixteen floats, one for each lane of a node, at every SIMD level.

use super::node::LANES;

/// Sixteen floats. All levels round alike: their results are the same to the last bit.
///
/// Every function is unsafe: its caller must have the instructions of the implementing type enabled.
pub(crate) trait Sixteen: Copy {
    unsafe fn load(from: &[f32; LANES]) -> Self;
    unsafe fn splat(value: f32) -> Self;
    unsafe fn store(self, to: &mut [f32; LANES]);
    unsafe fn plus(self, other: Self) -> Self;
    unsafe fn minus(self, other: Self) -> Self;
    unsafe fn times(self, other: Self) -> Self;
    unsafe fn root(self) -> Self;
    /// Returns the larger of both, `other` if one is NaN or both are zero.
    unsafe fn or_more(self, other: Self) -> Self;
    /// Returns the lesser of both, `other` if one is NaN or both are zero.
    unsafe fn or_less(self, other: Self) -> Self;
    /// Returns a mask: bit k is set if lane k is at most that of `other`. NaN is not.
    unsafe fn at_most(self, other: Self) -> u32;
}

/// The same operation on the floats of two vectors, or on each part of them.
macro_rules! operations {
    ($($name:ident: |$a:ident, $b:ident| $of_parts:expr;)*) => {$(
        #[inline(always)]
        unsafe fn $name(self, other: Self) -> Self {
            std::array::from_fn(|k| {
                let ($a, $b) = (self[k], other[k]);
                // SAFETY: the caller has the instructions of these vectors enabled.
                #[allow(unused_unsafe, reason = "only vectors of a SIMD level need it")]
                unsafe { $of_parts }
            })
        }
    )*};
}

/// Plain Rust, which the compiler turns into the vectors of the target's baseline.
impl Sixteen for [f32; LANES] {
    operations! {
        plus: |a, b| a + b;
        minus: |a, b| a - b;
        times: |a, b| a * b;
        or_more: |a, b| if a > b { a } else { b };
        or_less: |a, b| if a < b { a } else { b };
    }

    #[inline(always)]
    unsafe fn load(from: &[f32; LANES]) -> Self {
        *from
    }

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        [value; LANES]
    }

    #[inline(always)]
    unsafe fn store(self, to: &mut [f32; LANES]) {
        *to = self;
    }

    #[inline(always)]
    unsafe fn root(self) -> Self {
        self.map(f32::sqrt)
    }

    #[inline(always)]
    unsafe fn at_most(self, other: Self) -> u32 {
        (0..LANES).fold(0, |mask, k| mask | u32::from(self[k] <= other[k]) << k)
    }
}

/// The vectors of AVX2 and AVX-512.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{LANES, Sixteen};
    use std::arch::x86_64::*;

    macro_rules! sixteen {
        (
            $vector:ty, $count:literal, $load:ident, $splat:ident, $store:ident, $root:ident, $at_most:expr, $($op:tt)*
        ) => {
            impl Sixteen for [$vector; $count] {
                operations! { $($op)* }

                #[inline(always)]
                unsafe fn load(from: &[f32; LANES]) -> Self {
                    // SAFETY: the caller has the instructions enabled; the parts are the 16 floats.
                    std::array::from_fn(|k| unsafe { $load(from.as_ptr().add(LANES / $count * k)) })
                }

                #[inline(always)]
                unsafe fn splat(value: f32) -> Self {
                    // SAFETY: the caller has the instructions enabled.
                    unsafe { [$splat(value); $count] }
                }

                #[inline(always)]
                unsafe fn store(self, to: &mut [f32; LANES]) {
                    for (k, part) in self.into_iter().enumerate() {
                        // SAFETY: as in `load`.
                        unsafe { $store(to.as_mut_ptr().add(LANES / $count * k), part) };
                    }
                }

                #[inline(always)]
                unsafe fn root(self) -> Self {
                    // SAFETY: the caller has the instructions enabled.
                    self.map(|part| unsafe { $root(part) })
                }

                #[inline(always)]
                unsafe fn at_most(self, other: Self) -> u32 {
                    // SAFETY: the caller has the instructions enabled.
                    let mask = |k: usize| unsafe { $at_most(self[k], other[k]) } << (LANES / $count * k);
                    (0..$count).fold(0, |all, k| all | mask(k))
                }
            }
        };
    }

    sixteen! {
        __m256, 2, _mm256_loadu_ps, _mm256_set1_ps, _mm256_storeu_ps, _mm256_sqrt_ps,
        |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32,
        plus: |a, b| _mm256_add_ps(a, b);
        minus: |a, b| _mm256_sub_ps(a, b);
        times: |a, b| _mm256_mul_ps(a, b);
        or_more: |a, b| _mm256_max_ps(a, b);
        or_less: |a, b| _mm256_min_ps(a, b);
    }

    sixteen! {
        __m512, 1, _mm512_loadu_ps, _mm512_set1_ps, _mm512_storeu_ps, _mm512_sqrt_ps,
        |a, b| u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b)),
        plus: |a, b| _mm512_add_ps(a, b);
        minus: |a, b| _mm512_sub_ps(a, b);
        times: |a, b| _mm512_mul_ps(a, b);
        or_more: |a, b| _mm512_max_ps(a, b);
        or_less: |a, b| _mm512_min_ps(a, b);
    }
}
