//! File names from the names of CPUs and GPUs.

use sapwise_tune::GpuIdentity;

/// Most characters of a name.
const LONGEST: usize = 48;

/// Words that carry no information in the name of a CPU.
const FILLERS: [&str; 2] = ["cpu", "processor"];

/// Returns the name of a machine: its CPU and its usable cores, such as `amd-ryzen-9-7950x-16c`.
pub(crate) fn machine(cpu: &str, cores: u32) -> String {
    // The nominal clock follows the sign.
    let words = slug(cpu.split('@').next().unwrap_or(""));
    format!("{}-{cores}c", if words.is_empty() { "unknown-cpu" } else { &words })
}

/// Returns the names of GPUs, in their order; the second GPU with the same name ends in `-2`.
pub(super) fn gpus(gpus: &[GpuIdentity]) -> Vec<String> {
    let slugs: Vec<String> = gpus.iter().map(|gpu| slug(&gpu.name)).collect();
    let name = |(k, slug): (usize, &String)| {
        let name = if slug.is_empty() { "gpu" } else { slug };
        match slugs[..k].iter().filter(|earlier| *earlier == slug).count() {
            0 => name.to_owned(),
            alike => format!("{name}-{}", alike + 1),
        }
    };
    slugs.iter().enumerate().map(name).collect()
}

/// Returns lower case letters and digits with a hyphen between words. Drops text in parentheses, and
/// repetitions of a word.
fn slug(text: &str) -> String {
    let mut depth = 0_u32;
    let plain = text.chars().map(|c| {
        depth = match c {
            '(' => depth + 1,
            ')' => depth.saturating_sub(1),
            _ => depth,
        };
        if depth == 0 && c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { ' ' }
    });
    let plain: String = plain.collect();
    let all: Vec<&str> = plain.split_ascii_whitespace().collect();
    let is_number = |word: &str| word.bytes().all(|b| b.is_ascii_digit());
    let mut words: Vec<&str> = Vec::new();
    for (k, word) in all.iter().enumerate() {
        // `16-Core`: the file name holds the number of usable cores already.
        let before_core = is_number(word) && all.get(k + 1) == Some(&"core");
        let of_number = *word == "core" && k > 0 && is_number(all[k - 1]);
        if !before_core && !of_number && !FILLERS.contains(word) && !words.contains(word) {
            words.push(word);
        }
    }
    while words.iter().map(|w| w.len() + 1).sum::<usize>() > LONGEST + 1 {
        words.pop();
    }
    words.join("-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_tune::GpuKind;

    #[test]
    fn cpus_have_short_names() {
        assert_eq!(machine("AMD EPYC", 2), "amd-epyc-2c");
        assert_eq!(machine("Intel(R) Core(TM) i7-8700K CPU @ 3.70GHz", 6), "intel-core-i7-8700k-6c");
        assert_eq!(machine("AMD Ryzen 9 7950X 16-Core Processor", 16), "amd-ryzen-9-7950x-16c");
    }

    #[test]
    fn every_file_system_takes_the_name() {
        for brand in ["", "  \t", "(R)", "@ 3 GHz", "東芝", "///", "CPU"] {
            assert_eq!(machine(brand, 1), "unknown-cpu-1c", "{brand:?}");
        }
        assert_eq!(slug("../\\ Ünïx: (a(b)c) *x?"), "n-x");
        let long = slug(&(0..100).map(|k| format!("word{k} ")).collect::<String>());
        assert!((LONGEST - 8..=LONGEST).contains(&long.len()) && !long.ends_with('-'), "{long}");
    }

    #[test]
    fn gpus_of_one_kind_are_counted() {
        let all = ["NVIDIA H200", "NVIDIA H200", "AMD Radeon RX 7900 XTX (RADV NAVI31)", "???"];
        let all: Vec<GpuIdentity> = all.into_iter().map(|name| GpuIdentity::new(0, name, GpuKind::Other)).collect();
        assert_eq!(gpus(&all), ["nvidia-h200", "nvidia-h200-2", "amd-radeon-rx-7900-xtx", "gpu"]);
    }
}
