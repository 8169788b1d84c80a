//! The mixing behind fingerprints, seeds and draws.

/// Distance of two states of splitmix64: 2^64 over the golden ratio.
#[cfg(any(test, feature = "measure"))]
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// Advances a state and returns the next number of splitmix64 (Steele, Lea and Flood, 2014).
#[cfg(any(test, feature = "measure"))]
pub(crate) fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(STEP);
    mix(*state)
}

/// The finaliser of splitmix64: every input bit reaches every output bit.
pub(crate) fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
