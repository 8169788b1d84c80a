//! Texts of a report that name a person or a host.

use sapwise_lab::report::Report;

/// The beginnings of folders that are named after a user, in lower case.
const FOLDERS: [&str; 4] = ["/home/", "/root/", "/users/", "\\users\\"];

/// Shorter names of hosts may appear as ordinary words.
const SHORTEST_HOST: usize = 4;

/// Returns one sentence for each free text that names a folder of a user or this host. A host may be called like its
/// CPU, so the names of hardware are not searched.
pub(super) fn revealing(report: &Report) -> Vec<String> {
    let (hardware, host) = (&report.hardware, host());
    let of_gpus = hardware.gpus.iter().flat_map(|g| &g.parameters);
    let of_groups = hardware.gpu_groups.iter().flat_map(|g| &g.parameters);
    let sources = hardware.parameters.iter().chain(of_gpus).chain(of_groups).map(|p| &p.source);
    let errors = report.points.iter().flat_map(|p| &p.timings).filter_map(|t| t.error.as_ref());
    let texts = std::iter::once(&report.provenance.command).chain(&report.remarks).chain(sources).chain(errors);
    let sentence =
        |text: &String| Some(format!("{text:?} holds {}; take it out by hand", reveals(text, host.as_deref())?));
    texts.filter_map(sentence).collect()
}

/// Returns the name of this host in lower case, unless it is a word that every report may hold.
fn host() -> Option<String> {
    let name = sysinfo::System::host_name().ok()?.to_ascii_lowercase();
    let common = ["localhost", std::env::consts::OS, std::env::consts::ARCH];
    (name.len() >= SHORTEST_HOST && !common.contains(&name.as_str())).then_some(name)
}

fn reveals(text: &str, host: Option<&str>) -> Option<&'static str> {
    let text = text.to_ascii_lowercase();
    if FOLDERS.iter().any(|folder| text.contains(folder)) {
        return Some("the folder of a user");
    }
    let mut words = text.split(|c: char| !c.is_alphanumeric() && !"-._".contains(c));
    words.any(|word| host == Some(word.trim_matches('.'))).then_some("the name of this host")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_this_host_are_found_and_nothing_else() {
        let told = |text| reveals(text, Some("build-box7"));
        for text in ["--out=/home/x/r.json", "C:\\Users\\x", "see '/Users/x'", "/root/r.json"] {
            assert_eq!(told(text), Some("the folder of a user"), "{text}");
        }
        assert_eq!(told("made on Build-Box7."), Some("the name of this host"));
        for text in ["brute@cpu1 timed out.", "/sys/devices/system/cpu/cpu0/cache", "build-box70", "/rootless", ""] {
            assert_eq!(told(text), None, "{text}");
        }
    }
}
