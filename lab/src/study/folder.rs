//! The files of a study: the page, and for each figure and table what a program or a paper takes of it.

use super::summary::{StudyFile, Summary, listed_files};
use crate::data_table::DataTable;
use crate::figures::{Figure, Picture};
use crate::page::Block;
use crate::write::{write_atomically, write_text};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Component, Path};

/// The page.
pub const PAGE: &str = "index.html";
/// What it says, for programs.
const SUMMARY: &str = "study.json";
/// Where what is beside them goes.
const FIGURES: &str = "figures";
const TABLES: &str = "tables";

/// Rows of a table on the page, at most: a page of a hundred thousand rows takes a browser minutes to open.
const MOST_ROWS: usize = 400;

/// Files that are to be written.
pub(super) struct Folder {
    /// What the rows of tables call each report.
    labels: Vec<String>,
    /// What stands below every figure: the command.
    command: String,
    files: Vec<(StudyFile, Vec<u8>)>,
}

impl Folder {
    pub(super) fn new(labels: Vec<String>, command: String) -> Self {
        Self { labels, command, files: Vec::new() }
    }

    /// A figure as SVG and PNG with its data as CSV, and the block that shows it. `of` are the positions of the reports that it is from, and
    /// `told` what it shows in words. The first of the tables is what is drawn, the others belong to it.
    ///
    /// # Errors
    /// When it can't be drawn.
    pub(super) fn figure(
        &mut self,
        id: &str,
        figure: &impl Figure,
        told: &str,
        of: &[usize],
        tables: &[(&str, &DataTable)],
    ) -> Result<Block> {
        let from = match of {
            [] => String::new(),
            _ => format!(" From {}.", self.named(of)),
        };
        let caption = [format!("{told}{from}"), format!("Made by: {}", self.command)];
        let svg = figure.draw(Picture::Svg, &caption).with_context(|| format!("the figure {id} can't be drawn"))?;
        let png = figure.draw(Picture::Png, &caption).with_context(|| format!("the figure {id} can't be drawn"))?;
        // On the page the caption stands below the figure, where a reader can take it.
        let text = String::from_utf8(figure.draw(Picture::Svg, &[])?)?;
        let mut links = Vec::new();
        for (name, ending, bytes) in [("SVG", "svg", svg), ("PNG", "png", png)] {
            let path = format!("{FIGURES}/{id}.{ending}");
            links.push((name.to_owned(), path.clone()));
            self.add(path, told, bytes);
        }
        for (k, (name, table)) in tables.iter().enumerate() {
            self.data(name, told, table)?;
            let text = if k == 0 { "CSV".to_owned() } else { format!("CSV of {}", name.replace('-', " ")) };
            links.push((text, csv_path(name)));
        }
        let alt = format!("{}. {told}", figure.title());
        Ok(Block::Figure { id: id.to_owned(), caption: caption[0].clone(), svg: text, links, alt })
    }

    /// A table as CSV, and the block that shows it, of many rows the first ones.
    ///
    /// # Errors
    /// When a row does not fit its columns.
    pub(super) fn table(&mut self, id: &str, caption: &str, mut table: DataTable) -> Result<Block> {
        self.data(id, caption, &table)?;
        let mut caption = caption.to_owned();
        if table.rows.len() > MOST_ROWS {
            caption += &format!(" The first {MOST_ROWS} of {} rows; the CSV has all.", table.rows.len());
            table.rows.truncate(MOST_ROWS);
        }
        Ok(Block::Table { id: format!("table-{id}"), caption, table, csv: csv_path(id) })
    }

    /// A table as CSV alone. One that was written already, as the data of a figure, is not written twice.
    ///
    /// # Errors
    /// When a row does not fit its columns.
    pub(super) fn data(&mut self, id: &str, holds: &str, table: &DataTable) -> Result<()> {
        let path = csv_path(id);
        if !self.files.iter().any(|(file, _)| file.path == path) {
            self.add(path, holds, table.csv(&self.labels)?.into_bytes());
        }
        Ok(())
    }

    fn add(&mut self, path: String, holds: &str, bytes: Vec<u8>) {
        self.files.push((StudyFile { path, holds: holds.to_owned() }, bytes));
    }

    /// Labels of reports, as many as can be read.
    fn named(&self, of: &[usize]) -> String {
        const MOST: usize = 12;
        let names: Vec<&str> = of.iter().take(MOST).map(|&k| self.labels[k].as_str()).collect();
        let more = of.len().saturating_sub(MOST);
        if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
    }

    /// Writes everything into a folder that [`prepare`] has seen, in place of the files of an earlier study. Returns the summary with the
    /// list of the files.
    ///
    /// # Errors
    /// Names the file.
    pub(super) fn write(self, folder: &Path, page: &str, summary: Summary) -> Result<Summary> {
        for name in earlier(folder)?.unwrap_or_default().iter().filter(|name| is_ours(folder, name)) {
            // One that the user has removed already is no failure.
            let _ = fs::remove_file(folder.join(name));
        }
        for part in [FIGURES, TABLES] {
            let part = folder.join(part);
            fs::create_dir_all(&part).with_context(|| format!("the folder {} can't be made", part.display()))?;
        }
        let page_file = StudyFile { path: PAGE.to_owned(), holds: "The page to read".to_owned() };
        let files = [page_file].into_iter().chain(self.files.iter().map(|(file, _)| file.clone())).collect();
        // First, so that a study that was stopped half-way is taken for one the next time.
        let summary = Summary { files, ..summary };
        write_text(&folder.join(SUMMARY), &format!("{}\n", serde_json::to_string_pretty(&summary)?))?;
        for (file, bytes) in self.files {
            write_atomically(&folder.join(&file.path), |out| Ok(out.write_all(&bytes)?))?;
        }
        write_text(&folder.join(PAGE), page)?;
        Ok(summary)
    }
}

fn csv_path(id: &str) -> String {
    format!("{TABLES}/{id}.csv")
}

/// Sees that a study can be written to a folder before minutes of work: it is empty, not there, or holds an earlier study.
///
/// # Errors
/// When it holds something else, or takes no file.
pub fn prepare(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("the folder {} can't be made", folder.display()))?;
    tempfile::tempfile_in(folder)
        .with_context(|| format!("no file can be made in {}; name another folder with --out", folder.display()))?;
    let mut entries = fs::read_dir(folder).with_context(|| format!("the folder {} can't be read", folder.display()))?;
    if entries.next().is_some() && earlier(folder)?.is_none() {
        bail!("{} is not empty and holds no earlier study; name a new folder with --out", folder.display());
    }
    Ok(())
}

/// The files of the study that a folder holds, if it holds one.
fn earlier(folder: &Path) -> Result<Option<Vec<String>>> {
    let path = folder.join(SUMMARY);
    Ok(if path.exists() { listed_files(&crate::data::read_text(&path)?) } else { None })
}

/// Whether a file that `study.json` names is one that a study writes, in a folder and not behind a link. The file may come from anyone, and
/// what it names is removed.
fn is_ours(folder: &Path, name: &str) -> bool {
    if name == PAGE {
        return true;
    }
    let Some((part, file)) = name.split_once('/') else { return false };
    let ending = Path::new(file).extension().and_then(|e| e.to_str());
    let known =
        (part == FIGURES && matches!(ending, Some("svg" | "png" | "csv"))) || (part == TABLES && ending == Some("csv"));
    let plain = matches!(Path::new(file).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
    known && plain && fs::symlink_metadata(folder.join(part)).is_ok_and(|found| found.is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(files: &[&str]) -> String {
        let file = |path: &&str| StudyFile { path: (*path).to_owned(), ..StudyFile::default() };
        serde_json::to_string(&Summary { files: files.iter().map(file).collect(), ..Summary::default() }).unwrap()
    }

    #[test]
    fn a_folder_of_something_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let new = folder.path().join("a/b");
        prepare(&new).unwrap();
        fs::write(new.join("thesis.tex"), "").unwrap();
        let error = prepare(&new).unwrap_err().to_string();
        assert!(error.contains("not empty") && error.contains("--out"), "{error}");
        // Another program's study.json makes it no study.
        fs::write(new.join(SUMMARY), "{}").unwrap();
        assert!(prepare(&new).is_err());
        assert!(prepare(&new.join("thesis.tex")).is_err());
    }

    #[test]
    fn an_earlier_study_is_replaced_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join("study").join(name);
        fs::create_dir_all(path(FIGURES)).unwrap();
        for name in ["figures/old.svg", "figures/mine.svg", "figures/mine.txt", "mine.csv", "../outside"] {
            fs::write(path(name), name).unwrap();
        }
        fs::write(
            path(SUMMARY),
            summary(&[
                "figures/old.svg",
                "figures/mine.txt",
                "mine.csv",
                "figures/../mine.csv",
                "../outside",
                "figures/gone.svg",
            ]),
        )
        .unwrap();
        prepare(&path("")).unwrap();
        let mut new = Folder::new(vec!["R1".to_owned()], "sapwise study".to_owned());
        new.table("machines", "", DataTable::new([("a", "a")])).unwrap();
        new.write(&path(""), "<html>", Summary::default()).unwrap();
        assert!(!path("figures/old.svg").exists());
        for name in ["figures/mine.svg", "figures/mine.txt", "mine.csv", "../outside"] {
            assert!(path(name).exists(), "{name}");
        }
        assert_eq!(earlier(&path("")).unwrap().unwrap(), [PAGE, "tables/machines.csv"]);
        assert_eq!(fs::read_to_string(path("tables/machines.csv")).unwrap(), "a\n");
    }
}
