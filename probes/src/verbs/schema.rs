//! `sapwise schema`: the JSON Schemas of our files.

use crate::args::Schema;
use crate::exit::Outcome;
use crate::{output, outputs};
use sapwise_lab::write::write_text;
use serde::Serialize;

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    /// The written files.
    files: Vec<String>,
}

pub(crate) fn run(arguments: &Schema) -> anyhow::Result<Outcome> {
    let folder = &arguments.out;
    outputs::make_folder(folder)?;
    let mut files = Vec::new();
    for (name, text) in sapwise_lab::schemas()?.into_iter().chain([sapwise::cache_schema()?]) {
        let path = folder.join(name);
        write_text(&path, &text)?;
        files.push(path.display().to_string());
    }
    if arguments.json {
        output::print_json(&Answer { files })?;
    } else {
        let wrote = files.iter().map(|f| format!("wrote {f}\n")).collect::<String>();
        output::print(&wrote)?;
    }
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    #[test]
    fn the_committed_schema_of_the_cache_is_that_of_its_type() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
        let (name, text) = sapwise::cache_schema().unwrap();
        let committed = std::fs::read_to_string(folder.join(&name)).unwrap_or_default();
        assert!(committed == text, "{name} is stale: run `cargo run -- schema --out schemas`");
    }
}
