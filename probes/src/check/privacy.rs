//! Texts of a report that tell of a person or a host.

use sapwise::Report;
use serde_json::Value;

/// The beginnings of folders that are named after whoever works in them.
const FOLDERS: [&str; 4] = ["/home/", "/root", "/users/", "\\users\\"];

/// Shorter names of hosts are words that stand anywhere.
const SHORTEST_HOST: usize = 4;

/// One sentence for each text that names a folder of a user, an address of e-mail or this host.
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
            found.extend(reveals(text, host).map(|what| format!("{field} holds {what}: {text:?}; take it out by hand")));
        }
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, v)| walk(v, &format!("{field}[{k}]"), host, found));
        }
        Value::Object(map) => {
            let dot = if field.is_empty() { "" } else { "." };
            map.iter().for_each(|(key, v)| walk(v, &format!("{field}{dot}{key}"), host, found));
        }
        _ => {}
    }
}

fn reveals(text: &str, host: Option<&str>) -> Option<&'static str> {
    let lower = text.to_ascii_lowercase();
    if FOLDERS.iter().any(|folder| lower.contains(folder)) {
        return Some("the folder of a user");
    }
    if lower.split_ascii_whitespace().any(is_address) {
        return Some("an address of e-mail");
    }
    let is_host = |word: &str| host.is_some_and(|host| word.eq_ignore_ascii_case(host));
    text.split(|c: char| !c.is_alphanumeric() && !"-._".contains(c)).any(is_host).then_some("the name of this host")
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
        for text in ["--out /home/x/r.json", "C:\\Users\\x", "/Users/x", "/root/r.json"] {
            assert_eq!(told(text), Some("the folder of a user"), "{text}");
        }
        for text in ["ask x.y@example.org.", "<x@y.de>"] {
            assert_eq!(told(text), Some("an address of e-mail"), "{text}");
        }
        assert_eq!(told("made on build-box7, at night"), Some("the name of this host"));
        for text in [
            "brute@cpu1 timed out.",
            "strips@gpu0+1: lost",
            "Intel(R) Core(TM) i7 CPU @ 3.70GHz",
            "/sys/devices/system/cpu/cpu0/cache",
            "build-box70",
            "",
        ] {
            assert_eq!(told(text), None, "{text}");
        }
    }
}
