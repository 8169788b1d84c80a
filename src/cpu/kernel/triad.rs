//! The triad of STREAM. Here, because a program that is optimised for size still optimises this crate for speed.

use super::{Level, at_level};
use crate::cpu::{Simd, SimdLevel};
use std::hint::black_box;

/// Runs one pass of a = b + s * c with the widest vectors in use.
///
/// x86-64 defaults to 128-bit vectors: with them one thread reached 0.90 of the bandwidth of a C program that was
/// compiled for the machine, and 1.02 of it with 512-bit ones.
pub fn triad(a: &mut [f64], b: &[f64], c: &[f64]) {
    triad_at(Simd::at_most(SimdLevel::in_use()), a, b, c);
}

at_level! {
    fn triad_at[] [](a: &mut [f64], b: &[f64], c: &[f64]) = pass;
}

#[inline(always)]
fn pass<L: Level>(a: &mut [f64], b: &[f64], c: &[f64], _: L) {
    let scalar = black_box(3.0);
    // Indices would leave bounds checks in the loop, which would not be vectorised.
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        *a = b + scalar * c;
    }
    black_box(a);
}
