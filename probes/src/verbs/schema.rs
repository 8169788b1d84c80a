//! `sapwise schema`: writes the JSON Schemas of our files.

use crate::args::Schema;
use crate::exit::Outcome;
use crate::{output, outputs};
use sapwise_lab::write::write_text;
use serde_json::json;

pub(crate) fn run(arguments: &Schema) -> anyhow::Result<Outcome> {
    let folder = &arguments.out;
    outputs::make_folder(folder)?;
    let mut files = Vec::new();
    for (name, text) in sapwise_lab::schemas()? {
        let path = folder.join(name);
        write_text(&path, &text)?;
        files.push(path.display().to_string());
    }
    output::answer(arguments.json, &json!({"files": files}), || files.iter().map(|f| format!("wrote {f}\n")).collect())
}
