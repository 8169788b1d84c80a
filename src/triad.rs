//! The triad of STREAM. Here, because a program that is optimised for size still optimises this crate for speed.

#[cfg(target_arch = "x86_64")]
use crate::algorithm::SimdLevel;
use std::hint::black_box;

/// One pass of a = b + s * c with the widest vectors in use.
///
/// x86-64 defaults to 128-bit vectors: with them one thread reached 0.90 of the bandwidth of a C program that was
/// compiled for the machine, and 1.02 of it with 512-bit ones.
pub fn triad(a: &mut [f64], b: &[f64], c: &[f64]) {
    #[cfg(target_arch = "x86_64")]
    match SimdLevel::in_use() {
        // SAFETY: the level in use is one that the CPU was detected to have.
        SimdLevel::Avx512 => return unsafe { triad_avx512(a, b, c) },
        // SAFETY: the same.
        SimdLevel::Avx2 => return unsafe { triad_avx2(a, b, c) },
        _ => {}
    }
    triad_portable(a, b, c);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn triad_avx512(a: &mut [f64], b: &[f64], c: &[f64]) {
    triad_portable(a, b, c);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn triad_avx2(a: &mut [f64], b: &[f64], c: &[f64]) {
    triad_portable(a, b, c);
}

/// Always inlined, so that it is compiled for the vectors of its caller.
#[inline(always)]
fn triad_portable(a: &mut [f64], b: &[f64], c: &[f64]) {
    let scalar = black_box(3.0);
    // Indices would leave bounds checks in the loop, which would not be vectorised.
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        *a = b + scalar * c;
    }
    black_box(a);
}
