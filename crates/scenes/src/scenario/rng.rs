//! Random numbers, cube roots and powers from `+ - * /` and the square root alone.
//!
//! A scene must have the same bits on every platform. IEEE 754 fixes the results of those five operations, and not
//! those of `cbrt`, `powf` or `ln`, which differ between C libraries; so they are built from the five here.

use crate::random::Random;

/// The generator xoshiro256++ of Blackman and Vigna (<https://prng.di.unimi.it/xoshiro256plusplus.c>), public domain.
#[derive(Debug, Clone)]
pub(super) struct Rng([u64; 4]);

/// 2^-20: scales 21 bits to a span of two.
const UNIT_21: f32 = 1.0 / 1_048_576.0;

impl Rng {
    /// A generator whose state is filled by splitmix64, which is what [`Random`] is, as the authors of xoshiro
    /// advise.
    pub(super) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self([(); 4].map(|()| random.bits()))
    }

    /// Returns 64 random bits.
    #[inline]
    pub(super) fn bits(&mut self) -> u64 {
        let s = &mut self.0;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Three numbers, each uniform over -1 (included) to 1 (excluded) in steps of 2^-20, from one draw.
    #[inline]
    pub(super) fn signed3(&mut self) -> [f32; 3] {
        signed3(self.bits())
    }

    /// A place between walls, which stand at this distance on both sides of the origin on each axis.
    #[inline]
    pub(super) fn within(&mut self, walls: [f32; 3]) -> [f32; 3] {
        let u = self.signed3();
        [0, 1, 2].map(|a| u[a] * walls[a])
    }

    /// One number, uniform over 0 (included) to 1 (excluded) in steps of 2^-24.
    #[inline]
    pub(super) fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// A whole number from 0 (included) to `end` (excluded), uniform to parts in a billion: `end` is far below 2^64.
    #[inline]
    pub(super) fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    /// Three numbers of mean 0 and variance 1, each the sum of twelve uniform ones less six (Irwin and Hall).
    ///
    /// At most 6 from the mean; close to a Gaussian except in the tails beyond 3.
    pub(super) fn gauss3(&mut self) -> [f32; 3] {
        let mut sum = [0.0_f32; 3];
        for _ in 0..12 {
            let u = self.signed3();
            for a in 0..3 {
                sum[a] += u[a];
            }
        }
        sum.map(|s| s * 0.5)
    }
}

/// The three numbers of [`Rng::signed3`] from 63 of 64 random bits; the lowest bit is left over.
#[inline]
pub(super) fn signed3(bits: u64) -> [f32; 3] {
    [43, 22, 1].map(|shift| ((bits >> shift) & 0x1F_FFFF) as f32 * UNIT_21 - 1.0)
}

/// The cube root of a number that is finite and not negative, by Newton's iteration.
pub(super) fn cube_root(x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    // A third of the exponent, with the constant of FreeBSD's `cbrt`, is within 4 % of the root; four iterations
    // square that error down to rounding.
    let mut y = f64::from_bits(x.to_bits() / 3 + 0x2A9F_7893_0000_0000);
    for _ in 0..4 {
        y -= (y * y * y - x) / (3.0 * y * y);
    }
    y
}

/// Powers of one base with exponents from 0 to 1: products of its repeated square roots, one for each bit of the
/// exponent.
#[derive(Debug, Clone)]
pub(super) struct Powers {
    roots: [f64; 24],
    base: f64,
}

impl Powers {
    /// The powers of `base`, which is finite and at least 1.
    pub(super) fn new(base: f64) -> Self {
        let mut root = base;
        let roots = [(); 24].map(|()| {
            root = root.sqrt();
            root
        });
        Self { roots, base }
    }

    /// `base` to the power of `exponent`, which is cut to 24 bits and held within 0 to 1.
    pub(super) fn of(&self, exponent: f32) -> f64 {
        let bits = (exponent * 16_777_216.0) as u32;
        if bits >= 1 << 24 {
            return self.base;
        }
        // Chosen by arithmetic rather than by a branch, which random bits would mispredict; a factor of one changes
        // nothing.
        let factor = |(i, &root): (usize, &f64)| if bits >> (23 - i) & 1 == 1 { root } else { 1.0 };
        self.roots.iter().enumerate().map(factor).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_follows_the_reference_code() {
        // First outputs of the authors' C code for the state 1, 2, 3, 4.
        let mut rng = Rng([1, 2, 3, 4]);
        assert_eq!([rng.bits(), rng.bits(), rng.bits()], [41_943_041, 58_720_359, 3_588_806_011_781_223]);
        // splitmix64 from 0 begins with this word.
        assert_eq!(Rng::new(0).0[0], 0xE220_A839_7B1D_CDAF);
    }

    #[test]
    fn roots_and_powers_are_right_to_twelve_digits() {
        for x in [1e-9, 0.5, 1.0, 2.0, 10.0, 1e7, 8e12_f64] {
            assert!((cube_root(x) / x.cbrt() - 1.0).abs() < 1e-12, "{x}");
        }
        assert_eq!(cube_root(0.0), 0.0);
        let powers = Powers::new(1e6);
        for e in [0.0_f32, 0.25, 0.6, 1.0] {
            assert!((powers.of(e) / 1e6_f64.powf(f64::from(e)) - 1.0).abs() < 1e-5, "{e}");
        }
    }

    #[test]
    fn draws_have_the_mean_and_variance_they_claim() {
        let mut rng = Rng::new(7);
        let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
        for _ in 0..20_000 {
            for g in rng.gauss3() {
                sum += f64::from(g);
                squares += f64::from(g * g);
            }
            assert!(rng.signed3().iter().all(|u| (-1.0..1.0).contains(u)));
            assert!((0.0..1.0).contains(&rng.unit()));
        }
        assert!((sum / 60_000.0).abs() < 0.02);
        assert!((squares / 60_000.0 - 1.0).abs() < 0.03);
    }
}
