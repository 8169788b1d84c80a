//! `sapwise schema`: the JSON Schemas of our files.

use crate::args::Schema;
use crate::exit::Outcome;
use crate::output;
use anyhow::Context;

pub(crate) fn run(arguments: &Schema) -> anyhow::Result<Outcome> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).with_context(|| format!("the folder {} can't be made", folder.display()))?;
    for (name, text) in sapwise::json::schemas()? {
        let path = folder.join(name);
        crate::files::write_atomically(&path, |w| Ok(w.write_all(text.as_bytes())?))?;
        output::print(&format!("wrote {}", path.display()))?;
    }
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    #[test]
    fn the_committed_schemas_are_those_of_the_types() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../schemas");
        for (name, text) in sapwise::json::schemas().unwrap() {
            let committed = std::fs::read_to_string(folder.join(name)).unwrap();
            assert_eq!(committed, text, "{name} is stale: run `cargo run -- schema --out schemas`");
        }
    }
}
