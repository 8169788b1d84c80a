//! SIMD levels, and the proof that this CPU has one.

use crate::named;
use std::fmt;

/// The environment variable that [`SimdLevel::in_use`] reads.
const VARIABLE: &str = "SAPWISE_SIMD";

named! {
    /// A set of vector instructions. Each level includes the lower ones.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum SimdLevel("SIMD level") {
        /// The vectors that every CPU of the target has: SSE2 on x86-64, those of 128 bits on WebAssembly if it is
        /// built with `-C target-feature=+simd128`, elsewhere those that the compiler makes of plain Rust.
        Portable = "portable",
        /// 256-bit AVX2 of x86-64.
        Avx2 = "avx2",
        /// 512-bit AVX-512F of x86-64.
        Avx512 = "avx512",
    }
}

/// Why a SIMD level can't be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimdLevelError(String);

impl SimdLevel {
    /// Returns the highest level that this CPU has.
    pub fn detected() -> Self {
        Simd::at_most(Self::Avx512).level()
    }

    /// Returns the level in use: the detected one, or a lower one that the environment variable `SAPWISE_SIMD` names.
    ///
    /// Each new [`Registry`](crate::Registry) reads the variable once. A level that the CPU lacks and a name of no
    /// level are ignored, because a library can't refuse to load. Programs that want to refuse call
    /// [`SimdLevel::requested`].
    pub fn in_use() -> Self {
        Self::requested().ok().flatten().unwrap_or_else(Self::detected)
    }

    /// Returns the level that `SAPWISE_SIMD` names, if it is set.
    ///
    /// # Errors
    /// The variable names no level, or one that this CPU lacks.
    pub fn requested() -> Result<Option<Self>, SimdLevelError> {
        let Some(text) = std::env::var(VARIABLE).ok().filter(|text| !text.is_empty()) else { return Ok(None) };
        let (level, detected) = (text.parse::<Self>(), Self::detected());
        match level {
            Ok(level) if level <= detected => Ok(Some(level)),
            Ok(_) => Err(format!("this CPU has no level above {detected}; use that or a lower one")),
            Err(_) => Err("no such level; use portable, avx2 or avx512".to_owned()),
        }
        .map_err(|why| SimdLevelError(format!("{VARIABLE}={text}: {why}")))
    }

    /// Returns the number of 32-bit floats in a vector of this level.
    pub fn lanes(self) -> u32 {
        match self {
            Self::Portable => 4,
            Self::Avx2 => 8,
            Self::Avx512 => 16,
        }
    }
}

impl fmt::Display for SimdLevelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SimdLevelError {}

/// The level of a kernel. A level above the lowest proves that this CPU has its instructions: only [`Simd::at_most`],
/// which asks the CPU, makes one. The `unsafe` of the kernels rests on that.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) enum Simd {
    #[default]
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// Proves that this CPU has AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

/// Proves that this CPU has AVX-512F.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512(());

impl Simd {
    /// Returns the highest level that this CPU has, up to `level`.
    #[cfg_attr(not(target_arch = "x86_64"), expect(unused_variables, reason = "there is one level only"))]
    pub(crate) fn at_most(level: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if level >= SimdLevel::Avx512 && is_x86_feature_detected!("avx512f") {
                return Self::Avx512(Avx512(()));
            }
            if level >= SimdLevel::Avx2 && is_x86_feature_detected!("avx2") {
                return Self::Avx2(Avx2(()));
            }
        }
        Self::Portable
    }

    pub(crate) fn level(self) -> SimdLevel {
        match self {
            Self::Portable => SimdLevel::Portable,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => SimdLevel::Avx512,
        }
    }

    /// Returns every level that this CPU has, ascending.
    #[cfg(test)]
    pub(crate) fn every() -> impl Iterator<Item = Self> {
        SimdLevel::ALL.into_iter().filter(|&level| level <= SimdLevel::detected()).map(Self::at_most)
    }
}
