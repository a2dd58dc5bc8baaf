//! Reading and writing whole files. A file under its final name is always complete.

use std::fs::{self, File};
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use sha2::{Digest, Sha256};

use crate::Error;

/// The bytes of a file, or of standard input where the path is `-`.
///
/// # Errors
///
/// [`Error::File`] with what the system said.
pub fn read(path: &Path) -> Result<Vec<u8>, Error> {
    if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin()
            .read_to_end(&mut bytes)
            .map_err(|e| Error::file(path, e))?;
        return Ok(bytes);
    }
    fs::read(path).map_err(|e| unreadable(path, &e))
}

/// What the system said of a file or folder, in a person's words where the cause is common.
pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    match error.kind() {
        std::io::ErrorKind::NotFound => Error::file(path, "is not there; check the path"),
        std::io::ErrorKind::IsADirectory => Error::file(path, "is a folder; expected a file"),
        std::io::ErrorKind::NotADirectory => Error::file(path, "is a file; expected a folder"),
        _ => Error::file(path, error),
    }
}

/// The text of a file.
///
/// # Errors
///
/// [`Error::File`], also where the bytes are not UTF-8.
pub fn read_text(path: &Path) -> Result<String, Error> {
    String::from_utf8(read(path)?).map_err(|e| {
        Error::file(
            path,
            format!(
                "byte {} is not UTF-8 text; save the file as UTF-8",
                e.utf8_error().valid_up_to()
            ),
        )
    })
}

/// Writes a file so that a reader sees the old content or the new one, never a part: beside it, synced, then renamed.
///
/// # Errors
///
/// [`Error::File`]; the old file, if any, is then untouched.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let unfinished = Unfinished::create(path)?;
    let mut file = &unfinished.file;
    file.write_all(bytes).map_err(|e| Error::file(path, e))?;
    unfinished.finish()
}

/// Files begun by this process: two threads may write the same one.
static BEGUN: AtomicU64 = AtomicU64::new(0);

/// A file that is being written beside its final name; gone where it is dropped before [`Unfinished::finish`].
pub(crate) struct Unfinished {
    path: PathBuf,
    folder: PathBuf,
    beside: PathBuf,
    file: File,
}

impl Unfinished {
    pub(crate) fn create(path: &Path) -> Result<Self, Error> {
        let folder = path
            .parent()
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(|e| Error::file(folder, e))?;
        let name = path
            .file_name()
            .ok_or_else(|| Error::file(path, "is no file name; give a file to write"))?;
        let number = BEGUN.fetch_add(1, Ordering::Relaxed);
        let own = format!("{}.{number}", std::process::id());
        let beside = folder.join(format!(".{}.{own}.part", name.to_string_lossy()));
        Ok(Self {
            file: File::create(&beside).map_err(|e| Error::file(path, e))?,
            path: path.to_owned(),
            folder: folder.to_owned(),
            beside,
        })
    }

    /// The final name.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn writer(&self) -> Result<BufWriter<File>, Error> {
        let file = self.file.try_clone().map_err(|e| Error::file(&self.path, e))?;
        Ok(BufWriter::new(file))
    }

    /// Gives the file its name, once it is safely on the disk.
    pub(crate) fn finish(self) -> Result<(), Error> {
        let result = (|| {
            self.file.sync_all()?;
            fs::rename(&self.beside, &self.path)?;
            File::open(&self.folder)?.sync_all()
        })();
        result.map_err(|e| Error::file(&self.path, e))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // After a rename nothing is there any more.
        let _ = fs::remove_file(&self.beside);
    }
}

/// Every file below `folder` with one of the extensions (lower case), sorted by path; a file is its own answer, and so
/// is `-`, standard input.
///
/// # Errors
///
/// [`Error::File`] where a folder cannot be listed.
pub fn list(folder: &Path, extensions: &[&str]) -> Result<Vec<PathBuf>, Error> {
    fn visit(path: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) -> Result<(), Error> {
        let entries = fs::read_dir(path).map_err(|e| unreadable(path, &e))?;
        for entry in entries {
            let entry = entry.map_err(|e| Error::file(path, e))?.path();
            if entry.is_dir() {
                visit(&entry, extensions, found)?;
            } else if extension(&entry).is_some_and(|e| extensions.contains(&e.as_str())) {
                found.push(entry);
            }
        }
        Ok(())
    }
    if folder.is_file() || folder == Path::new("-") {
        return Ok(vec![folder.to_owned()]);
    }
    let mut found = Vec::new();
    visit(folder, extensions, &mut found)?;
    found.sort();
    Ok(found)
}

/// A path's extension in lower case.
pub fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// A name for what went into a result: equal inputs give equal fingerprints, so a finished stage is not run again.
#[derive(Clone)]
pub struct Fingerprint(Sha256);

impl Fingerprint {
    /// Starts a fingerprint for one stage; the program's version is part of it.
    pub fn of_stage(stage: &str) -> Self {
        Self(Sha256::new())
            .with(stage.as_bytes())
            .with(env!("CARGO_PKG_VERSION").as_bytes())
    }

    /// Adds one input.
    #[must_use]
    pub fn with(mut self, bytes: &[u8]) -> Self {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Sixteen hexadecimal digits.
    pub fn finish(self) -> String {
        self.0
            .finalize()
            .iter()
            .take(8)
            .map(|b| format!("{b:02x}"))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_part() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write(&path, b"old").unwrap();
        assert!(write(&path.join("below"), b"new").is_err());
        assert_eq!(read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn threads_that_write_the_same_file_do_not_take_each_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4_u8)
                .map(|t| {
                    let path = &path;
                    scope.spawn(move || (0..20).try_for_each(|_| write(path, &[t; 4096])))
                })
                .collect();
            for thread in threads {
                thread.join().unwrap().unwrap();
            }
        });
        let bytes = read(&path).unwrap();
        assert!(bytes.len() == 4096 && bytes.iter().all(|b| *b == bytes[0]));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_fingerprint_depends_on_where_one_input_ends() {
        let joined = |parts: [&str; 2]| {
            parts
                .iter()
                .fold(Fingerprint::of_stage("x"), |f, p| f.with(p.as_bytes()))
                .finish()
        };
        assert_ne!(joined(["ab", "c"]), joined(["a", "bc"]));
        assert_eq!(joined(["ab", "c"]), joined(["ab", "c"]));
    }
}
