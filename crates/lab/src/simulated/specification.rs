//! Published specifications of real CPUs and GPUs: `specifications/1`.

use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// A file of specifications, with where each was found.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Specifications {
    /// Always `specifications/1`.
    #[expect(dead_code, reason = "read to refuse other schemas")]
    schema: Schema,
    /// Day on which the file was last changed, as `yyyy-mm-dd`. The simulated reports bear it, so that they don't depend on the day
    /// on which they are made.
    pub date: String,
    /// The CPUs.
    pub cpus: Vec<Cpu>,
    /// The GPUs.
    pub gpus: Vec<Gpu>,
}

#[derive(Debug, Clone, Deserialize)]
enum Schema {
    #[serde(rename = "specifications/1")]
    First,
}

/// A CPU. Of several cores all are alike: those with two kinds of core are not in the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cpu {
    pub name: String,
    /// As in `cpuid`; on other architectures the designer of the cores.
    pub vendor: String,
    /// As in `std::env::consts::ARCH`.
    pub arch: String,
    pub form: Form,
    /// Year in which it came out.
    pub year: u32,
    pub cores: u32,
    /// Threads of all cores.
    pub threads: u32,
    pub base_ghz: f64,
    /// Highest clock of one core.
    pub boost_ghz: f64,
    pub simd: Simd,
    /// First-level data cache of one core.
    pub l1d_bytes: f64,
    /// Second-level cache that one core sees.
    pub l2_bytes: f64,
    /// Last-level cache; where it comes in parts that not all cores share, that of all parts, but of second-level caches one part.
    pub llc_bytes: f64,
    /// Of all memory channels.
    pub memory_gb_per_s: f64,
    /// Title of the page or list, and what follows from it.
    pub source: String,
}

/// A GPU: a card, or a part of a CPU.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gpu {
    pub name: String,
    /// PCI vendor.
    pub vendor: String,
    pub form: Form,
    /// Year in which it came out.
    pub year: u32,
    /// 32-bit multiply-adds that can start in one cycle.
    pub lanes: u32,
    /// Multiprocessors, compute units, execution units.
    pub processors: u32,
    /// The base clock of a card for a desktop, the highest of one for a server or within a CPU.
    pub clock_ghz: f64,
    /// What a card has of its own. `None` within a CPU.
    #[serde(default)]
    pub card: Option<Card>,
    /// The CPU that it is part of. `None` for a card.
    #[serde(default)]
    pub inside: Option<String>,
    /// As of a CPU.
    pub source: String,
}

/// Memory and bus of a card.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    pub memory_bytes: f64,
    pub memory_gb_per_s: f64,
    pub pcie_generation: u32,
    pub pcie_lanes: u32,
}

/// What a part is made for. Cards go into machines of their own form; those for desktops into servers too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    Laptop,
    Desktop,
    Server,
    /// A single-board computer, which takes no card.
    Board,
}

/// The widest vector instructions of a CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Simd {
    Sse2,
    Neon,
    Avx,
    Avx2,
    Avx512,
}

impl Simd {
    /// The level that our algorithms use, and its 32-bit lanes. AVX without AVX2 has no integer comparisons of its width.
    pub fn level(self) -> (sapwise::SimdLevel, u32) {
        match self {
            Self::Sse2 | Self::Neon | Self::Avx => (sapwise::SimdLevel::Portable, 4),
            Self::Avx2 => (sapwise::SimdLevel::Avx2, 8),
            Self::Avx512 => (sapwise::SimdLevel::Avx512, 16),
        }
    }
}

/// Most entries of either list: each costs a machine.
const MOST: usize = 10_000;

/// The file beside this one. It lies in the package and not in `datasets/`, so that an installed command has it.
const BUILT_IN: &str = include_str!("specifications.json");

/// The specifications that come with this command, `specifications.json`, whose card is `datasets/simulated/README.md`.
///
/// # Errors
/// As [`read`], which a test rules out.
pub fn built_in() -> Result<Specifications> {
    read(BUILT_IN).context("the built-in specifications can't be used; please report this")
}

/// Reads a file of specifications.
///
/// # Errors
/// The line and column, or the entry and what is wrong with it.
pub fn read(text: &str) -> Result<Specifications> {
    let read: Specifications = serde_json::from_str(text).context("no file of specifications/1")?;
    if read.cpus.is_empty() || read.cpus.len() > MOST || read.gpus.len() > MOST {
        bail!(
            "{} CPUs and {} GPUs: one CPU is needed, and {MOST} of each is the most",
            read.cpus.len(),
            read.gpus.len()
        );
    }
    let date = read.date.as_bytes();
    let digits = date.iter().enumerate().all(|(k, b)| if k == 4 || k == 7 { *b == b'-' } else { b.is_ascii_digit() });
    if date.len() != 10 || !digits {
        bail!("the date is {:?}; write it as yyyy-mm-dd", read.date);
    }
    for (k, cpu) in read.cpus.iter().enumerate() {
        let twice = read.cpus[..k].iter().any(|c| c.name == cpu.name);
        if let Some(why) = cpu.defect().or_else(|| twice.then(|| "stands there twice".to_owned())) {
            bail!("the CPU {:?}: {why}", cpu.name);
        }
    }
    for (k, gpu) in read.gpus.iter().enumerate() {
        let twice = read.gpus[..k].iter().any(|g| g.name == gpu.name);
        let stray = gpu.inside.as_ref().filter(|cpu| !read.cpus.iter().any(|c| c.name == **cpu));
        let stray = stray.map(|cpu| format!("it is inside {cpu:?}, which is not in the file"));
        if let Some(why) = gpu.defect().or(stray).or_else(|| twice.then(|| "stands there twice".to_owned())) {
            bail!("the GPU {:?}: {why}", gpu.name);
        }
    }
    Ok(read)
}

impl Cpu {
    fn defect(&self) -> Option<String> {
        let figures =
            [self.base_ghz, self.boost_ghz, self.l1d_bytes, self.l2_bytes, self.llc_bytes, self.memory_gb_per_s];
        if let Some(why) = common_defect(&self.name, &self.source, self.year, &figures) {
            return Some(why);
        }
        let counts = (1..=4096).contains(&self.cores) && (self.cores..=4096).contains(&self.threads);
        let wrong = !counts || self.boost_ghz < self.base_ghz || self.l1d_bytes > self.l2_bytes;
        wrong.then(|| {
            "no cores, fewer threads than cores, a boost below the base clock, or a first cache above the second"
                .to_owned()
        })
    }
}

impl Gpu {
    fn defect(&self) -> Option<String> {
        let card = self.card.as_ref();
        let figures = [self.clock_ghz, card.map_or(1.0, |c| c.memory_bytes), card.map_or(1.0, |c| c.memory_gb_per_s)];
        if let Some(why) = common_defect(&self.name, &self.source, self.year, &figures) {
            return Some(why);
        }
        if self.card.is_some() == self.inside.is_some() {
            return Some("it needs either `card` or `inside`".to_owned());
        }
        let bus = card.is_none_or(|c| (1..=7).contains(&c.pcie_generation) && [1, 2, 4, 8, 16].contains(&c.pcie_lanes));
        let counts = self.processors >= 1 && self.lanes >= self.processors;
        (!bus || !counts).then(|| "no lanes or processors, or a bus that there is not".to_owned())
    }
}

/// What is wrong with what CPUs and GPUs share, if anything.
fn common_defect(name: &str, source: &str, year: u32, figures: &[f64]) -> Option<String> {
    if name.trim().is_empty() || source.trim().is_empty() {
        return Some("it needs a name and a source".to_owned());
    }
    let sound = figures.iter().all(|f| f.is_finite() && *f > 0.0) && (1990..=2100).contains(&year);
    (!sound).then(|| format!("the year {year} or one of the figures {figures:?} can't be"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_file_is_sound_and_names_its_sources() {
        let specifications = built_in().unwrap();
        let cards = specifications.gpus.iter().filter(|g| g.card.is_some()).count();
        assert!(specifications.cpus.len() >= 28 && cards >= 20, "{} {cards}", specifications.cpus.len());
        let sources =
            specifications.cpus.iter().map(|c| &c.source).chain(specifications.gpus.iter().map(|g| &g.source));
        let titles = [
            "Wikipedia, ",
            "Intel ARK, ",
            "NVIDIA ",
            "AMD ",
            "Ampere ",
            "Raspberry Pi ",
            "Avril, Gouranton and Arnaldi",
        ];
        for source in sources {
            assert!(titles.iter().any(|t| source.starts_with(t)), "{source}");
        }
        let vendors = |name: &str| specifications.cpus.iter().filter(|c| c.vendor == name).count();
        assert!(["GenuineIntel", "AuthenticAMD", "ARM"].iter().all(|v| vendors(v) >= 5));
    }

    #[test]
    fn damaged_specifications_are_refused_with_the_entry() {
        let refused = |from: &str, to: &str| format!("{:#}", read(&BUILT_IN.replacen(from, to, 1)).unwrap_err());
        assert!(refused("specifications/1", "specifications/9").contains("specifications/9"));
        assert!(refused("\"cores\"", "\"kernels\"").contains("kernels"));
        assert!(refused("\"base_ghz\": 2.8", "\"base_ghz\": -2.8").contains("X7900"));
        assert!(refused("Xeon X5482", "Xeon X5472").contains("twice"));
        assert!(refused("\"inside\": \"Core i7-4770K\"", "\"inside\": \"none\"").contains("HD Graphics 4600"));
        assert!(refused("2026-11-21", "today").contains("yyyy-mm-dd"));
        let source = "Intel ARK, Intel Core2 Extreme Processor X7900; front side bus of 800 MT/s, 8 bytes wide";
        assert!(refused(source, " ").contains("source"));
    }
}
