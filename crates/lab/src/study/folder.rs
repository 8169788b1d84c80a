//! The files of a study: the page, and for each figure and table what a program or a paper takes of it.

use super::summary::{StudyFile, Summary, listed_files};
use crate::data_table::DataTable;
use crate::figures::{Figure, Picture};
use crate::page::Block;
use crate::progress::Progress;
use crate::write::{TemporaryFolder, is_temporary, write_text};
use anyhow::{Context, Result, bail};
use std::fs::{self, File};
use std::io::Write;
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
pub(super) struct Folder<'a> {
    /// What the rows of tables call each report.
    labels: Vec<String>,
    /// What stands below every figure: the command.
    command: String,
    files: Vec<(StudyFile, Vec<u8>)>,
    progress: &'a dyn Progress,
}

impl<'a> Folder<'a> {
    pub(super) fn new(labels: Vec<String>, command: String, progress: &'a dyn Progress) -> Self {
        Self { labels, command, files: Vec::new(), progress }
    }

    /// A figure as SVG and PNG with its data as CSV, and the block that shows it. `of` are the positions of the reports that it is from, and
    /// `told` what it shows in words. The first of the tables is what is drawn, the others belong to it.
    ///
    /// # Errors
    /// When it can't be drawn, and when the user asked to stop.
    pub(super) fn figure(
        &mut self,
        id: &str,
        figure: &impl Figure,
        told: &str,
        of: &[usize],
        tables: &[(&str, &DataTable)],
    ) -> Result<Block> {
        self.progress.check()?;
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
    /// All is written beside its place first and moved there then: until that is done an earlier study is as it was, whatever happens.
    ///
    /// # Errors
    /// Names the file.
    pub(super) fn write(self, folder: &Path, page: &str, summary: Summary) -> Result<Summary> {
        let mut before = earlier(folder)?.unwrap_or_default();
        before.retain(|name| is_ours(folder, name));
        let page_file = StudyFile { path: PAGE.to_owned(), holds: "The page to read".to_owned() };
        let files: Vec<_> = [page_file].into_iter().chain(self.files.iter().map(|(file, _)| file.clone())).collect();
        before.retain(|name| !files.iter().any(|file| file.path == *name));
        let summary = Summary { files, ..summary };

        let beside = TemporaryFolder::within(folder)?;
        let told = text(&summary)?;
        let pages = [(PAGE, page.as_bytes()), (SUMMARY, told.as_bytes())];
        let all = || self.files.iter().map(|(file, bytes)| (&*file.path, &**bytes)).chain(pages);
        for part in [FIGURES, TABLES] {
            make_folder(&beside.path().join(part))?;
        }
        for (name, bytes) in all() {
            self.progress.check()?;
            let written = File::create_new(beside.path().join(name)).and_then(|mut file| {
                file.write_all(bytes)?;
                // Else a crash of the machine may leave the name with an empty file.
                file.sync_all()
            });
            written.with_context(|| format!("can't write {}", folder.join(name).display()))?;
        }

        // First, with all that is there for a while: what is stopped half-way is taken for a study the next time, and no file is forgotten.
        let leaving =
            before.iter().map(|name| StudyFile { path: name.clone(), holds: "Of an earlier study".to_owned() });
        let both = Summary { files: summary.files.iter().cloned().chain(leaving).collect(), ..summary.clone() };
        write_text(&folder.join(SUMMARY), &text(&both)?)?;
        for part in [FIGURES, TABLES] {
            make_folder(&folder.join(part))?;
        }
        for (name, _) in all().filter(|(name, _)| *name != SUMMARY) {
            put_in_place(beside.path(), folder, name)?;
        }
        for name in before {
            // One that the user has removed already is no failure.
            let _ = fs::remove_file(folder.join(name));
        }
        put_in_place(beside.path(), folder, SUMMARY)?;
        Ok(summary)
    }
}

fn text(summary: &Summary) -> Result<String> {
    Ok(format!("{}\n", serde_json::to_string_pretty(summary)?))
}

fn make_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("the folder {} can't be made", folder.display()))
}

fn put_in_place(from: &Path, folder: &Path, name: &str) -> Result<()> {
    let place = folder.join(name);
    fs::rename(from.join(name), &place).with_context(|| format!("can't write {}", place.display()))
}

fn csv_path(id: &str) -> String {
    format!("{TABLES}/{id}.csv")
}

/// Sees that a study can be written to a folder before minutes of work: it is empty, not there, or holds an earlier study. Returns whether
/// the folder was made.
///
/// # Errors
/// When it holds something else, or takes no file.
pub fn prepare(folder: &Path) -> Result<bool> {
    let made = !folder.exists();
    make_folder(folder)?;
    tempfile::tempfile_in(folder)
        .with_context(|| format!("no file can be made in {}; name another folder with --out", folder.display()))?;
    let entries = fs::read_dir(folder).with_context(|| format!("the folder {} can't be read", folder.display()))?;
    // What a study that was killed has left beside its place does not count.
    let occupied = entries.flatten().any(|entry| !is_temporary(&entry.file_name()));
    if occupied && earlier(folder)?.is_none() {
        bail!("{} is not empty and holds no earlier study; name a new folder with --out", folder.display());
    }
    Ok(made)
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
    use crate::progress::{Interrupted, Silent};

    fn summary(files: &[&str]) -> String {
        let file = |path: &&str| StudyFile { path: (*path).to_owned(), ..StudyFile::default() };
        serde_json::to_string(&Summary { files: files.iter().map(file).collect(), ..Summary::default() }).unwrap()
    }

    #[test]
    fn a_folder_of_something_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let new = folder.path().join("a/b");
        assert!(prepare(&new).unwrap());
        // Nor is what a killed study has left anything of the user's.
        fs::create_dir(new.join(".sapwise-x.tmp")).unwrap();
        assert!(!prepare(&new).unwrap());
        fs::write(new.join("thesis.tex"), "").unwrap();
        let error = prepare(&new).unwrap_err().to_string();
        assert!(error.contains("not empty") && error.contains("--out"), "{error}");
        // Another program's study.json makes it no study.
        fs::write(new.join(SUMMARY), "{}").unwrap();
        assert!(prepare(&new).is_err());
        assert!(prepare(&new.join("thesis.tex")).is_err());
    }

    fn of_one_table(progress: &dyn Progress) -> Folder<'_> {
        let mut folder = Folder::new(vec!["R1".to_owned()], "sapwise study".to_owned(), progress);
        folder.table("machines", "", DataTable::new([("a", "a")])).unwrap();
        folder
    }

    /// Every file below a folder, with what it holds.
    fn held(folder: &Path) -> Vec<(std::path::PathBuf, String)> {
        let mut found = Vec::new();
        for entry in fs::read_dir(folder).unwrap().flatten() {
            if entry.path().is_dir() {
                found.extend(held(&entry.path()));
            } else {
                found.push((entry.path(), fs::read_to_string(entry.path()).unwrap()));
            }
        }
        found.sort();
        found
    }

    #[test]
    fn an_earlier_study_stays_as_it_was_until_the_new_one_is_written() {
        struct Stopped;
        impl Progress for Stopped {
            fn start(&self, _: u64) {}
            fn advance(&self, _: u64) {}
            fn message(&self, _: &str) {}
            fn warn(&self, _: &str) {}
            fn check(&self) -> Result<(), Interrupted> {
                Err(Interrupted)
            }
        }
        let folder = tempfile::tempdir().unwrap();
        of_one_table(&Silent).write(folder.path(), "old", Summary::default()).unwrap();
        let before = held(folder.path());
        assert!(
            of_one_table(&Stopped).write(folder.path(), "new", Summary::default()).unwrap_err().is::<Interrupted>()
        );
        assert_eq!(held(folder.path()), before);
        // A folder where a file is to be: found out when the others are in their places.
        fs::remove_file(folder.path().join(PAGE)).unwrap();
        fs::create_dir(folder.path().join(PAGE)).unwrap();
        let error = of_one_table(&Silent).write(folder.path(), "new", Summary::default()).unwrap_err();
        assert!(format!("{error:#}").contains(PAGE), "{error:#}");
        assert!(!prepare(folder.path()).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4, "something is left beside");
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
        let new = of_one_table(&Silent);
        new.write(&path(""), "<html>", Summary::default()).unwrap();
        assert!(!path("figures/old.svg").exists());
        for name in ["figures/mine.svg", "figures/mine.txt", "mine.csv", "../outside"] {
            assert!(path(name).exists(), "{name}");
        }
        assert_eq!(earlier(&path("")).unwrap().unwrap(), [PAGE, "tables/machines.csv"]);
        assert_eq!(fs::read_to_string(path("tables/machines.csv")).unwrap(), "a\n");
    }
}
