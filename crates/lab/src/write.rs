//! Output files that are whole or absent.

use anyhow::{Context, Result, anyhow, bail};
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes what `write` produces to `path`, so that a reader never sees half of it.
///
/// The bytes go to a temporary file in the same folder, to the disk, and under their name by a rename. A link is
/// followed. What isn't a regular file, such as `/dev/stdout` or a pipe, is written as it is: a rename would put a
/// file in its place.
///
/// # Errors
/// Names `path`. The file that stood there, or its absence, is unchanged, and no temporary file is left.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let result = match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(anyhow!("it is a folder")),
        Ok(found) if !found.is_file() => write_through(path, write),
        // A link is resolved to its file. A file that does not exist yet is written to the path itself.
        _ => replace(&fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()), write),
    };
    result.with_context(|| format!("can't write {}", path.display()))
}

/// Writes a text, through [`write_atomically`].
///
/// # Errors
/// As there.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |out| Ok(out.write_all(text.as_bytes())?))
}

/// Prefix and suffix of temporary files.
const TEMPORARY: [&str; 2] = [".sapwise-", ".tmp"];

/// Returns whether a file name is that of a temporary file of [`write_atomically`].
pub(crate) fn is_temporary(name: &OsStr) -> bool {
    name.to_str().is_some_and(|name| name.starts_with(TEMPORARY[0]) && name.ends_with(TEMPORARY[1]))
}

/// Keeps the kind of the error only: its text names the temporary file, which the user does not know.
fn refused(folder: &Path, error: &io::Error) -> anyhow::Error {
    anyhow!("no file can be made in {}: {}", folder.display(), io::Error::from(error.kind()))
}

fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let folder = match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => PathBuf::from("."),
        Some(folder) => folder.to_owned(),
        None => bail!("it names no file"),
    };
    if !folder.is_dir() {
        bail!("there is no folder {}; make it or name another", folder.display());
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY[0]).suffix(TEMPORARY[1]);
    // By default the file would be private; files of other programs follow the umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut temporary = builder.tempfile_in(&folder).map_err(|e| refused(&folder, &e))?;
    buffered(temporary.as_file_mut(), write)?;
    // Without this a crash of the machine may leave the name with an empty file.
    temporary.as_file().sync_all()?;
    temporary.persist(path).map_err(|failed| failed.error)?;
    Ok(())
}

fn write_through(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    buffered(&mut OpenOptions::new().write(true).open(path)?, write)
}

fn buffered(file: &mut File, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let mut buffer = BufWriter::with_capacity(1 << 16, file);
    write(&mut buffer)?;
    // Dropping the buffer would write its rest too, and lose the error.
    buffer.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = entries.collect();
        names.sort();
        names
    }

    fn hello(out: &mut dyn Write) -> Result<()> {
        Ok(out.write_all(b"hello")?)
    }

    #[test]
    fn a_file_is_made_or_replaced_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        write_atomically(&path, |out| Ok(out.write_all(&[7; 200_000])?)).unwrap();
        assert_eq!(fs::read(&path).unwrap(), [7; 200_000]);
        write_atomically(&path, hello).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"hello");
        assert_eq!(names(folder.path()), ["out"]);
    }

    #[test]
    fn a_failure_half_way_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        fs::write(&path, "old").unwrap();
        let error = write_atomically(&path, |out| {
            out.write_all(&[7; 200_000])?;
            bail!("the disk is full")
        })
        .unwrap_err();
        let text = format!("{error:#}");
        assert!(text.contains("out") && text.contains("the disk is full"), "{text}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["out"]);
    }

    #[test]
    fn folders_and_missing_folders_are_errors_that_name_the_path() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("missing").join("out");
        for path in [folder.path(), inside.as_path(), Path::new(""), Path::new("/")] {
            let text = format!("{:#}", write_atomically(path, hello).unwrap_err());
            assert!(text.contains(&format!("can't write {}", path.display())), "{text}");
        }
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        fs::write(&target, "old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write_atomically(&link, hello).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"hello");
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_without_write_permission_stays_as_it_is() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o555)).unwrap();
        // A superuser may write anyway.
        if File::create(folder.path().join("try")).is_err() {
            assert!(write_atomically(&folder.path().join("out"), hello).is_err());
            assert!(names(folder.path()).is_empty());
        }
        fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_are_written_through_and_a_full_one_is_an_error() {
        write_atomically(Path::new("/dev/null"), hello).unwrap();
        let text = format!("{:#}", write_atomically(Path::new("/dev/full"), hello).unwrap_err());
        assert!(text.contains("can't write /dev/full"), "{text}");
        for device in ["/dev/null", "/dev/full"] {
            assert!(!fs::metadata(device).unwrap().is_file());
        }
    }
}
