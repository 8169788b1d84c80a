//! Which vector instructions the algorithms use.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// A set of vector instructions. A higher level needs everything that the lower ones need.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// What every CPU of the target has: SSE2 on x86-64, elsewhere what the compiler makes of plain Rust.
    Portable,
    /// 256-bit AVX2 of x86-64.
    Avx2,
    /// 512-bit AVX-512F of x86-64.
    Avx512,
}

impl SimdLevel {
    /// Every level, ascending.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The highest level that this CPU has.
    #[must_use]
    pub fn detected() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// The level in use: the detected one, or a lower one that the environment variable `SAPWISE_SIMD` names.
    ///
    /// Read once per process. A level that the CPU lacks falls back to the detected one, and a name that is no level is
    /// ignored: a library can't refuse to load. [`SimdLevel::requested`] is for programs that want to refuse.
    #[must_use]
    pub fn in_use() -> Self {
        static LEVEL: OnceLock<SimdLevel> = OnceLock::new();
        *LEVEL.get_or_init(|| match Self::requested() {
            Ok(Some(level)) => level.min(Self::detected()),
            Ok(None) | Err(_) => Self::detected(),
        })
    }

    /// What `SAPWISE_SIMD` asks for, if anything.
    ///
    /// # Errors
    /// A sentence, when the variable holds no level or one that this CPU lacks.
    pub fn requested() -> Result<Option<Self>, String> {
        match std::env::var("SAPWISE_SIMD") {
            Err(_) => Ok(None),
            Ok(text) if text.is_empty() => Ok(None),
            Ok(text) => {
                let level: Self = text.parse()?;
                if level > Self::detected() {
                    return Err(format!("SAPWISE_SIMD={level}: this CPU offers {} at most", Self::detected()));
                }
                Ok(Some(level))
            }
        }
    }

    /// 32-bit floats in one vector of this level.
    #[must_use]
    pub fn lanes(self) -> u32 {
        match self {
            Self::Portable => 4,
            Self::Avx2 => 8,
            Self::Avx512 => 16,
        }
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        })
    }
}

impl FromStr for SimdLevel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|level| level.to_string() == text)
            .ok_or_else(|| format!("SAPWISE_SIMD={text}: no such level; use portable, avx2 or avx512"))
    }
}
