//! Texts of a report that name a person or a host.

use sapwise_lab::report::Report;
use serde_json::Value;

/// The beginnings of folders that are named after whoever works in them.
const FOLDERS: [&str; 3] = ["/home/", "/root/", "/users/"];

/// The same on Windows, after any drive.
const WINDOWS_FOLDER: &str = "\\users\\";

/// Shorter names of hosts are words that stand anywhere.
const SHORTEST_HOST: usize = 4;

/// Keys with names of hardware and scenarios: a host may be called `intel` or `uniform` too.
const HARDWARE: [&str; 7] = ["cpu", "vendor", "name", "device", "driver", "api", "scenario"];

/// Returns one sentence for each text that names a folder of a user, an address of e-mail or this host.
pub(super) fn revealing(report: &Report) -> Vec<String> {
    let Ok(value) = serde_json::to_value(report) else { return Vec::new() };
    let mut found = Vec::new();
    walk(&value, "", host().as_deref(), &mut found);
    found
}

/// The name of this host, where it is not a word that every report may hold.
fn host() -> Option<String> {
    let name = sysinfo::System::host_name().ok()?;
    let common = ["localhost", std::env::consts::OS, std::env::consts::ARCH];
    (name.len() >= SHORTEST_HOST && !common.contains(&name.to_ascii_lowercase().as_str())).then_some(name)
}

fn walk(value: &Value, field: &str, host: Option<&str>, found: &mut Vec<String>) {
    match value {
        Value::String(text) => {
            found
                .extend(reveals(text, host).map(|what| format!("{field} holds {what}: {text:?}; take it out by hand")));
        }
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, v)| walk(v, &format!("{field}[{k}]"), host, found));
        }
        Value::Object(map) => {
            let dot = if field.is_empty() { "" } else { "." };
            for (key, v) in map {
                let host = host.filter(|_| !HARDWARE.contains(&key.as_str()));
                walk(v, &format!("{field}{dot}{key}"), host, found);
            }
        }
        _ => {}
    }
}

fn reveals(text: &str, host: Option<&str>) -> Option<&'static str> {
    let lower = text.to_ascii_lowercase();
    // Behind something else, as in https://example.org/home/, it is no folder of this machine.
    let paths = lower.split(|c: char| c.is_whitespace() || "\"'`=:,;<>()[]{}|@".contains(c));
    // What is left of file:///home/ has two slashes more.
    let mut paths = paths.map(|path| path.strip_prefix("//").unwrap_or(path));
    if paths.any(|path| FOLDERS.iter().any(|folder| path.starts_with(folder))) || lower.contains(WINDOWS_FOLDER) {
        return Some("the folder of a user");
    }
    if lower.split_ascii_whitespace().any(is_address) {
        return Some("an address of e-mail");
    }
    host.is_some_and(|host| holds_host(text, host)).then_some("the name of this host")
}

/// Whether the name of a host is a word of a text.
fn holds_host(text: &str, host: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && !"-._".contains(c)).any(|word| word.eq_ignore_ascii_case(host))
}

/// Whether a word is `someone@somewhere.top`. The ids of algorithms have no point behind the sign.
fn is_address(word: &str) -> bool {
    let word = word.trim_matches(|c: char| !c.is_ascii_alphanumeric());
    let Some((who, domain)) = word.split_once('@') else { return false };
    let Some((site, top)) = domain.rsplit_once('.') else { return false };
    !who.is_empty() && !site.is_empty() && top.len() >= 2 && top.bytes().all(|b| b.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_addresses_and_this_host_are_found_and_nothing_else() {
        let told = |text| reveals(text, Some("Build-Box7"));
        let folders =
            ["--out=/home/x/r.json", "C:\\Users\\x", "c:/users/x", "see '/Users/x'", "/root/r.json", "file:///home/x"];
        for text in folders {
            assert_eq!(told(text), Some("the folder of a user"), "{text}");
        }
        for text in ["ask x.y@example.org.", "<x@y.de>"] {
            assert_eq!(told(text), Some("an address of e-mail"), "{text}");
        }
        assert_eq!(told("made on build-box7, at night"), Some("the name of this host"));
        for text in [
            "brute@cpu1 timed out.",
            "grid-sap@gpu0+1: lost",
            "Intel(R) Core(TM) i7 CPU @ 3.70GHz",
            "/sys/devices/system/cpu/cpu0/cache",
            "build-box70",
            "https://example.org/home/x",
            "example.org/users/x",
            "/rootless",
            "",
        ] {
            assert_eq!(told(text), None, "{text}");
        }
    }

    #[test]
    fn a_host_that_is_called_like_its_cpu_or_a_scenario_reveals_nothing() {
        let report = serde_json::json!({"machine": {"cpu": "Intel(R) Core(TM) i7"}, "remarks": ["on intel"]});
        let mut found = Vec::new();
        walk(&report, "", Some("intel"), &mut found);
        assert!(found.len() == 1 && found[0].starts_with("remarks[0] holds the name of this host"), "{found:?}");
    }
}
