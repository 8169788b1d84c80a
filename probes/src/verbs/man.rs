//! `sapwise man`: the manual.

use crate::args::{Arguments, Man as Wanted};
use crate::exit::Outcome;
use crate::files::write_text;
use crate::output;
use anyhow::Context;
use clap::{Command, CommandFactory};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use serde::Serialize;
use std::path::Path;

/// The page of the command itself.
const MAIN: &str = "sapwise.1";

/// The answer for machines.
#[derive(Serialize)]
struct Answer {
    /// What was written.
    files: Vec<String>,
}

pub(crate) fn run(arguments: &Wanted) -> anyhow::Result<Outcome> {
    let pages = pages()?;
    let Some(folder) = &arguments.out else {
        output::print(&pages[0].1)?;
        return Ok(Outcome::Done);
    };
    let files = write(folder, &pages)?;
    if arguments.json {
        output::print_json(&Answer { files })?;
        return Ok(Outcome::Done);
    }
    let wrote: String = files.iter().map(|f| format!("wrote {f}\n")).collect();
    output::print(&format!("{wrote}Next: man -l {}", files[0]))?;
    Ok(Outcome::Done)
}

fn write(folder: &Path, pages: &[(String, String)]) -> anyhow::Result<Vec<String>> {
    std::fs::create_dir_all(folder).with_context(|| format!("the folder {} can't be made", folder.display()))?;
    let write = |(name, text): &(String, String)| {
        let path = folder.join(name);
        write_text(&path, text)?;
        Ok(path.display().to_string())
    };
    pages.iter().map(write).collect()
}

/// The name and the text of each page: that of the command first, then one for each verb that is shown.
fn pages() -> anyhow::Result<Vec<(String, String)>> {
    let mut command = Arguments::command().disable_help_subcommand(true);
    // Without it a verb knows neither what precedes its name nor the version.
    command.build();
    let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set()).cloned().collect::<Vec<Command>>();
    std::iter::once(command).chain(shown).map(page).collect()
}

fn page(command: Command) -> anyhow::Result<(String, String)> {
    let after = command.get_after_help().map(ToString::to_string);
    let page = Man::new(command).source(concat!("sapwise ", env!("CARGO_PKG_VERSION"))).manual("Sapwise");
    let mut text = Vec::new();
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    page.render_options_section(&mut text)?;
    if page.get_filename() == MAIN {
        page.render_subcommands_section(&mut text)?;
    }
    after.map_or(Ok(()), |after| verbatim(&after).to_writer(&mut text))?;
    Ok((page.get_filename(), String::from_utf8(text).context("the manual is no text")?))
}

/// What stands below the help as a section, line by line as it is there: a paragraph would break examples in two.
fn verbatim(text: &str) -> Roff {
    let (heading, lines) = match text.split_once(":\n") {
        Some((heading, lines)) if !heading.contains('\n') => (heading.to_uppercase(), lines),
        _ => ("NOTES".to_owned(), text),
    };
    let mut roff = Roff::new();
    roff.control("SH", [&heading[..]]).control("nf", []);
    lines.lines().for_each(|line| {
        roff.text([roman(line)]);
    });
    roff.control("fi", []);
    roff
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command as Process;

    #[test]
    fn every_verb_that_is_shown_has_a_page_without_hidden_options() {
        let pages = pages().unwrap();
        let names: Vec<&str> = pages.iter().map(|p| &p.0[..]).collect();
        assert_eq!(names[0], MAIN);
        let command = Arguments::command();
        let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set());
        let expected: Vec<String> = shown.map(|verb| format!("sapwise-{}.1", verb.get_name())).collect();
        assert_eq!(names[1..], expected);
        for (name, text) in &pages {
            let text = text.replace("\\-", "-");
            assert!(text.contains(".SH NAME") && text.contains(".SH SYNOPSIS"), "{name}: {text}");
            for hidden in ["leashed", "unrestricted", "sapwise-part"] {
                assert!(!text.contains(hidden), "{name} names {hidden}");
            }
        }
        let run = &pages[names.iter().position(|n| *n == "sapwise-run.1").unwrap()].1;
        assert!(run.contains(".SH EXAMPLES\n.nf\n") && run.contains("fragmentation"), "{run}");
    }

    #[test]
    fn groff_takes_every_page_where_it_is_there() {
        let folder = tempfile::tempdir().unwrap();
        for file in write(&folder.path().join("man1"), &pages().unwrap()).unwrap() {
            match Process::new("groff").args(["-man", "-ww", "-z", &file]).output() {
                Ok(ended) => {
                    let told = String::from_utf8_lossy(&ended.stderr).into_owned();
                    assert!(ended.status.success() && told.is_empty(), "{file}: {told}");
                }
                Err(why) => return eprintln!("the pages are not looked at: groff: {why}"),
            }
        }
    }

    #[test]
    fn a_folder_that_can_not_be_made_is_an_error_that_names_it() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let folder = file.path().join("man1");
        let error = format!("{:#}", write(&folder, &pages().unwrap()).unwrap_err());
        assert!(error.contains("man1 can't be made"), "{error}");
    }
}
