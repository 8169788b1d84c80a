//! 32-bit multiply-adds in registers: what the vector units of one core and of all do at the SIMD level in use.

use std::hint::black_box;
use std::time::{Duration, Instant};

use super::{Options, foreign_load, pool, together};
use crate::SimdLevel;
use crate::hardware::{Parameter, ParameterId};

/// Rounds between two looks at the clock: 0.2 ms, against which the sum at the end takes a thousandth.
const ROUNDS: u32 = 1 << 16;

const NAMES: [ParameterId; 2] = [ParameterId::ArithmeticOneThreadGflopPerS, ParameterId::ArithmeticAllThreadsGflopPerS];

pub(super) fn measure(options: &Options) -> Vec<Parameter> {
    let threads = options.usable_cores();
    let pool = match pool(threads) {
        Ok(pool) => pool,
        Err(why) => return NAMES.map(|name| Parameter::missing(name, &why)).to_vec(),
    };
    let Some(kernel) = Kernel::of(SimdLevel::in_use()) else {
        return NAMES.map(|name| Parameter::missing(name, "no kernel is there for this architecture")).to_vec();
    };
    let time = Duration::from_millis(if options.brief { 1 } else { 4 });
    let rate = |threads| together(&pool, threads, || kernel.operations_per_ns(time));
    // The clock falls where wide vectors are used, and takes a moment for it.
    rate(threads);
    let figures = foreign_load::collect(options.plan(12, 450), || {
        let one = rate(1);
        // On one core the second figure is the first: there is nothing else to run it on.
        vec![one, if threads == 1 { one } else { rate(threads) }]
    });
    let methods = [1, threads].map(|threads| kernel.method(threads));
    foreign_load::into_parameters(figures, NAMES.into_iter().zip(methods))
}

/// Multiply-adds at one SIMD level.
struct Kernel {
    /// Runs this many rounds, each a multiply-add of every lane of every chain, and returns the sum of the lanes.
    run: fn(u32) -> f32,
    chains: u32,
    lanes: u32,
    what: &'static str,
}

/// One instruction for both.
const FUSED: &str = "fused multiply-adds";
/// One instruction for each.
#[cfg(target_arch = "x86_64")]
const SEPARATE: &str = "multiplications and additions";

impl Kernel {
    /// `None` on an architecture for which none was written. The level must be one that the CPU was detected to have.
    fn of(level: SimdLevel) -> Option<Self> {
        #[cfg(target_arch = "x86_64")]
        return Some(match level {
            SimdLevel::Avx512 => {
                // SAFETY: the CPU was detected to have the level.
                let run = |rounds| unsafe { x86::avx512(rounds) };
                Self { run, chains: 24, lanes: 16, what: FUSED }
            }
            SimdLevel::Avx2 if is_x86_feature_detected!("fma") => {
                // SAFETY: the CPU was detected to have the level and the feature.
                let run = |rounds| unsafe { x86::fma(rounds) };
                Self { run, chains: 12, lanes: 8, what: FUSED }
            }
            SimdLevel::Avx2 => {
                // SAFETY: the CPU was detected to have the level.
                let run = |rounds| unsafe { x86::avx2(rounds) };
                Self { run, chains: 12, lanes: 8, what: SEPARATE }
            }
            SimdLevel::Portable => {
                // SAFETY: every CPU of this architecture has SSE2.
                let run = |rounds| unsafe { x86::sse2(rounds) };
                Self { run, chains: 12, lanes: 4, what: SEPARATE }
            }
        });
        #[cfg(target_arch = "aarch64")]
        {
            let _ = level;
            // SAFETY: every CPU of this architecture has NEON.
            let run = |rounds| unsafe { aarch64::neon(rounds) };
            Some(Self { run, chains: 24, lanes: 4, what: FUSED })
        }
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        {
            let _ = level;
            None
        }
    }

    fn method(&self, threads: usize) -> String {
        let Self { chains, lanes, what, .. } = self;
        let plural = if threads == 1 { "" } else { "s" };
        format!(
            "{what} in {chains} independent chains of {lanes} lanes, in registers, on {threads} thread{plural}; each counted as two \
             operations"
        )
    }

    /// Operations a nanosecond, which are thousands of millions a second, over at least `time`.
    fn operations_per_ns(&self, time: Duration) -> f64 {
        let start = Instant::now();
        let mut rounds = 0_u64;
        loop {
            // What is not used would not be worked out.
            black_box((self.run)(ROUNDS));
            rounds += u64::from(ROUNDS);
            let elapsed = start.elapsed();
            if elapsed >= time {
                let operations = 2 * u64::from(self.chains * self.lanes) * rounds;
                return operations as f64 / elapsed.as_nanos() as f64;
            }
        }
    }
}

/// Halves each lane of each chain and adds a half, `rounds` times, from 0. The sum of all lanes.
///
/// Expanded for each level: a vector has another type in each, and only what stands in the function itself is compiled for
/// the level. Enough chains that each unit always has one whose last result is there; as many as registers allow.
macro_rules! chains {
    ($rounds:expr, $chains:literal, $lanes:literal, $splat:expr, $step:expr) => {{
        // The compiler must know neither these nor that all chains begin alike: it could merge them. No value becomes denormal,
        // which would be slower by a factor of its own.
        let (factor, summand) = ($splat(black_box(0.5_f32)), $splat(black_box(0.5_f32)));
        let mut chains = [$splat(0.0); $chains];
        for chain in &mut chains {
            *chain = $splat(black_box(0.0_f32));
        }
        for _ in 0..$rounds {
            for chain in &mut chains {
                *chain = $step(*chain, factor, summand);
            }
        }
        // SAFETY: both are this many floats one behind the other, and every pattern of bits is a float.
        let lanes: [f32; $chains * $lanes] = unsafe { std::mem::transmute(chains) };
        lanes.iter().sum()
    }};
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        _mm_add_ps, _mm_mul_ps, _mm_set1_ps, _mm256_add_ps, _mm256_fmadd_ps, _mm256_mul_ps, _mm256_set1_ps,
        _mm512_fmadd_ps, _mm512_set1_ps,
    };
    use std::hint::black_box;

    #[target_feature(enable = "avx512f")]
    pub(super) fn avx512(rounds: u32) -> f32 {
        chains!(rounds, 24, 16, _mm512_set1_ps, _mm512_fmadd_ps)
    }

    #[target_feature(enable = "avx2,fma")]
    pub(super) fn fma(rounds: u32) -> f32 {
        chains!(rounds, 12, 8, _mm256_set1_ps, _mm256_fmadd_ps)
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn avx2(rounds: u32) -> f32 {
        chains!(rounds, 12, 8, _mm256_set1_ps, |x, factor, summand| _mm256_add_ps(_mm256_mul_ps(x, factor), summand))
    }

    #[target_feature(enable = "sse2")]
    pub(super) fn sse2(rounds: u32) -> f32 {
        chains!(rounds, 12, 4, _mm_set1_ps, |x, factor, summand| _mm_add_ps(_mm_mul_ps(x, factor), summand))
    }
}

#[cfg(target_arch = "aarch64")]
mod aarch64 {
    use std::arch::aarch64::{vdupq_n_f32, vfmaq_f32};
    use std::hint::black_box;

    #[target_feature(enable = "neon")]
    pub(super) fn neon(rounds: u32) -> f32 {
        chains!(rounds, 24, 4, vdupq_n_f32, |x, factor, summand| vfmaq_f32(summand, x, factor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

    #[test]
    fn a_rate_counts_every_operation() {
        static CALLS: AtomicU32 = AtomicU32::new(0);
        let slow = |rounds| {
            assert_eq!(rounds, ROUNDS);
            CALLS.fetch_add(1, Relaxed);
            std::thread::sleep(Duration::from_millis(2));
            0.0
        };
        let kernel = Kernel { run: slow, chains: 3, lanes: 2, what: "" };
        let rate = kernel.operations_per_ns(Duration::from_millis(5));
        // Three sleeps of 2 ms or fewer longer ones.
        let calls = CALLS.load(Relaxed);
        assert!((1..=3).contains(&calls));
        assert!(rate > 0.0 && rate <= f64::from(2 * 3 * 2 * ROUNDS) / 2e6, "{rate}");
    }

    #[test]
    fn every_lane_of_every_chain_goes_through_every_round() {
        for level in SimdLevel::ALL.into_iter().filter(|&level| level <= SimdLevel::detected()) {
            let Some(Kernel { run, chains, lanes, .. }) = Kernel::of(level) else { return };
            // From 0, halved and raised by a half: 1/2, 3/4, 7/8.
            for (rounds, value) in [(0, 0.0), (1, 0.5), (2, 0.75), (3, 0.875), (100, 1.0)] {
                assert_eq!(run(rounds), value * (chains * lanes) as f32, "{level}");
            }
        }
        #[cfg(target_arch = "x86_64")]
        if SimdLevel::detected() >= SimdLevel::Avx2 {
            // SAFETY: the CPU was detected to have the level.
            assert_eq!(unsafe { x86::avx2(2) }, 0.75 * 96.0);
        }
    }
}
