//! Words for file names, out of what CPUs and GPUs call themselves.

use crate::restriction::is_lavapipe;
use sapwise::GpuIdentity;

/// Longer names help nobody.
const LONGEST: usize = 48;

/// Words that every second CPU has in its name.
const FILLERS: [&str; 2] = ["cpu", "processor"];

/// The name of a CPU: `amd-ryzen-9-7950x`. `unknown-cpu` where its brand text holds no letter and no digit.
pub(super) fn cpu(brand: &str) -> String {
    // Behind the sign stands the nominal clock.
    let words = slug(brand.split('@').next().unwrap_or(""));
    if words.is_empty() { "unknown-cpu".to_owned() } else { words }
}

/// The names of GPUs, in their order; several of one kind are counted.
pub(super) fn gpus(gpus: &[GpuIdentity]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for gpu in gpus {
        let name = match slug(&gpu.name) {
            _ if is_lavapipe(gpu) => "lavapipe".to_owned(),
            name if name.starts_with("swiftshader") => "swiftshader".to_owned(),
            name if name.is_empty() => "gpu".to_owned(),
            name => name,
        };
        names.push(unused(name, &names));
    }
    names
}

/// The name itself, or with the first number from 2 up that makes it differ from all of these.
pub(super) fn unused(name: String, used: &[String]) -> String {
    if !used.contains(&name) {
        return name;
    }
    (2..).map(|k| format!("{name}-{k}")).find(|name| !used.contains(name)).unwrap_or(name)
}

/// Lower case letters and digits, with a hyphen between words. What stands in brackets is left out, and every word comes once.
fn slug(text: &str) -> String {
    let mut depth = 0_u32;
    let mut plain = String::new();
    for c in text.chars() {
        match c {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ if depth == 0 && c.is_ascii_alphanumeric() => {
                plain.push(c.to_ascii_lowercase());
                continue;
            }
            _ => {}
        }
        plain.push(' ');
    }
    let all: Vec<&str> = plain.split_ascii_whitespace().collect();
    let is_number = |word: &str| word.bytes().all(|b| b.is_ascii_digit());
    let mut words: Vec<&str> = Vec::new();
    for (k, word) in all.iter().enumerate() {
        // `16-Core`: the file name tells the number of usable cores already.
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
    use sapwise::GpuKind;

    #[test]
    fn cpus_have_short_names() {
        assert_eq!(cpu("AMD EPYC"), "amd-epyc");
        assert_eq!(cpu("Intel(R) Core(TM) i7-8700K CPU @ 3.70GHz"), "intel-core-i7-8700k");
        assert_eq!(cpu("AMD Ryzen 9 7950X 16-Core Processor"), "amd-ryzen-9-7950x");
        assert_eq!(cpu("Apple M2 Pro"), "apple-m2-pro");
        assert_eq!(cpu("QEMU QEMU Virtual CPU"), "qemu-virtual");
    }

    #[test]
    fn odd_and_empty_texts_give_a_name_that_every_file_system_takes() {
        for brand in ["", "  \t", "(R)", "@ 3 GHz", "東芝", "///", "CPU"] {
            assert_eq!(cpu(brand), "unknown-cpu", "{brand:?}");
        }
        assert_eq!(cpu("../\\ Ünïx: (a(b)c) *x?"), "n-x");
        let long = cpu(&(0..100).map(|k| format!("word{k} ")).collect::<String>());
        assert!((LONGEST - 8..=LONGEST).contains(&long.len()) && !long.ends_with('-'), "{long}");
    }

    #[test]
    fn gpus_of_one_kind_are_counted() {
        let gpu = |name: &str| GpuIdentity::new(0, name, GpuKind::Other);
        let all = ["NVIDIA H200", "NVIDIA H200", "AMD Radeon RX 7900 XTX (RADV NAVI31)", "???"];
        let programs = ["llvmpipe (LLVM 15.0.6, 256 bits)", "SwiftShader Device (Subzero)"];
        let all: Vec<GpuIdentity> = all.into_iter().chain(programs).map(gpu).collect();
        let names = ["nvidia-h200", "nvidia-h200-2", "amd-radeon-rx-7900-xtx", "gpu", "lavapipe", "swiftshader"];
        assert_eq!(gpus(&all), names);
    }
}
