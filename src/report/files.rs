//! Directories for results, and files written whole or not at all.

use crate::optimize::atomic;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};
use tempfile::NamedTempFile;

/// A directory for results that exists and can be written to.
///
/// ```
/// use aeroform::report::OutputDirectory;
/// let folder = tempfile::tempdir().unwrap();
/// let output = OutputDirectory::prepare(folder.path().join("out/case")).unwrap();
/// output.write_all([("result.json", "{}"), ("history.csv", "evaluation\n")]).unwrap();
/// assert_eq!(std::fs::read_to_string(output.path().join("result.json")).unwrap(), "{}");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputDirectory {
    path: PathBuf,
}

/// The right to be the only run that writes to a directory; it ends when this is dropped, or with the process.
#[derive(Debug)]
pub struct DirectoryLock {
    _file: Option<File>,
}

/// Name of the file that a run locks. It stays: a file that is removed could be locked by two runs at a time.
const LOCK: &str = ".aeroform.lock";

/// Results that cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The directory cannot be created.
    #[error("cannot create the output directory {}: {source}", path.display())]
    Create {
        /// Path of the directory.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Something that is no directory stands in its place.
    #[error("{} is not a directory; choose another output directory", path.display())]
    NotADirectory {
        /// Path of the thing that stands there.
        path: PathBuf,
    },
    /// Files cannot be created in the directory.
    #[error("cannot write to the output directory {}: {source}", path.display())]
    NotWritable {
        /// Path of the directory.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Another process is writing its results to the directory.
    #[error("another run is writing to {}; wait for it or choose another output directory", path.display())]
    Busy {
        /// Path of the directory.
        path: PathBuf,
    },
    /// A file name that leads out of the directory, or nowhere.
    #[error("\"{name}\" is not the name of a file in the output directory")]
    Name {
        /// Name of the file.
        name: String,
    },
}

impl OutputDirectory {
    /// Creates the directory (and those above it) if need be and proves by writing a file, which is removed again,
    /// that results can be written; so a run does not end in an error about its directory.
    ///
    /// Where the proof fails, directories created for it are removed again.
    ///
    /// # Errors
    /// All but [`OutputError::Write`] and [`OutputError::Name`].
    pub fn prepare(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let path = path.into();
        // the topmost directory that is new
        let new = path.ancestors().take_while(|a| !a.as_os_str().is_empty() && !a.exists()).last().map(Path::to_owned);
        match Self::prove(&path) {
            Ok(()) => Ok(Self { path }),
            Err(error) => {
                if new.is_some() {
                    // only empty directories go, from the innermost outwards
                    for made in path.ancestors() {
                        let _ = fs::remove_dir(made);
                        if Some(made) == new.as_deref() {
                            break;
                        }
                    }
                }
                Err(error)
            }
        }
    }

    fn prove(path: &Path) -> Result<(), OutputError> {
        if path.exists() && !path.is_dir() {
            return Err(OutputError::NotADirectory { path: path.to_owned() });
        }
        fs::create_dir_all(path).map_err(|source| OutputError::Create { path: path.to_owned(), source })?;
        atomic::stage(&path.join("probe"), |file| file.write_all(b"aeroform"))
            .and_then(NamedTempFile::close)
            .map_err(|source| OutputError::NotWritable { path: path.to_owned(), source })
    }

    /// Takes the directory for one run, and removes temporary files that killed runs left there.
    ///
    /// The lock is one of the operating system on the file `.aeroform.lock`, so that a killed run leaves nothing that
    /// would have to be cleared away. On file systems without locks nothing is locked.
    ///
    /// # Errors
    /// [`OutputError::Busy`] where another run has it; [`OutputError::NotWritable`].
    pub fn lock(&self) -> Result<DirectoryLock, OutputError> {
        let failed = |source| OutputError::NotWritable { path: self.path.clone(), source };
        let file = File::options().create(true).append(true).open(self.path.join(LOCK)).map_err(failed)?;
        let file = match file.try_lock() {
            Ok(()) => Some(file),
            Err(TryLockError::WouldBlock) => return Err(OutputError::Busy { path: self.path.clone() }),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => None,
            Err(TryLockError::Error(source)) => return Err(failed(source)),
        };
        atomic::sweep(&self.path);
        Ok(DirectoryLock { _file: file })
    }

    /// Path of the directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a set of files, given by name and content, replacing those that exist.
    ///
    /// All contents are on the disk before the first file takes its name, and each takes it in one step: a full disk or
    /// a crash leaves no file half written, and no new file at all unless it strikes between the renames.
    ///
    /// # Errors
    /// [`OutputError::Write`], [`OutputError::Name`].
    pub fn write_all<N, C>(&self, files: impl IntoIterator<Item = (N, C)>) -> Result<(), OutputError>
    where
        N: AsRef<str>,
        C: AsRef<[u8]>,
    {
        let mut staged = Vec::new();
        for (name, content) in files {
            staged.push(self.stage(name.as_ref(), content.as_ref())?);
        }
        for (file, path) in staged {
            atomic::commit(file, &path).map_err(|source| OutputError::Write { path, source })?;
        }
        Ok(())
    }

    /// Writes files like [`write_all`](Self::write_all), but each for itself: one that cannot be written does not lose
    /// the others. The result says why, for each that is lost; it is empty where all have been written.
    pub fn write_each<N, C>(&self, files: impl IntoIterator<Item = (N, C)>) -> Vec<OutputError>
    where
        N: AsRef<str>,
        C: AsRef<[u8]>,
    {
        let write = |(name, content): (N, C)| {
            let (file, path) = self.stage(name.as_ref(), content.as_ref())?;
            atomic::commit(file, &path).map_err(|source| OutputError::Write { path, source })
        };
        files.into_iter().map(write).filter_map(Result::err).collect()
    }

    /// Puts a content on the disk, to be renamed to `name`.
    fn stage(&self, name: &str, content: &[u8]) -> Result<(NamedTempFile, PathBuf), OutputError> {
        let path = self.file(name)?;
        let staged = check_target(&path).and_then(|()| atomic::stage(&path, |file| file.write_all(content)));
        match staged {
            Ok(file) => Ok((file, path)),
            Err(source) => Err(OutputError::Write { path, source }),
        }
    }

    /// The path of the file called `name` in the directory.
    fn file(&self, name: &str) -> Result<PathBuf, OutputError> {
        let mut parts = Path::new(name).components();
        match (parts.next(), parts.next()) {
            (Some(Component::Normal(part)), None) if part == name => Ok(self.path.join(name)),
            _ => Err(OutputError::Name { name: name.to_owned() }),
        }
    }
}

/// Finds out before anything is written whether a file cannot be renamed to `path`.
fn check_target(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(path: &Path) -> Vec<String> {
        let entries = fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = entries.collect();
        names.sort();
        names
    }

    #[test]
    fn prepared_directories_are_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b/c");
        let output = OutputDirectory::prepare(&path).unwrap();
        assert!(names(output.path()).is_empty());
        fs::write(path.join("old"), "kept").unwrap();
        assert_eq!(OutputDirectory::prepare(&path).unwrap(), output);
        assert_eq!(names(&path), ["old"]);
    }

    #[test]
    fn bad_places_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let error = OutputDirectory::prepare(&file).unwrap_err();
        assert!(matches!(&error, OutputError::NotADirectory { path } if *path == file), "{error}");
        let error = OutputDirectory::prepare(file.join("below")).unwrap_err();
        assert!(matches!(error, OutputError::Create { .. }), "{error}");
        // where directories cannot be made, nothing is left
        let error = OutputDirectory::prepare("/proc/aeroform/out").unwrap_err();
        assert!(error.to_string().contains("/proc/aeroform/out"), "{error}");
        assert_eq!(names(folder.path()), ["file"]);
        let long = folder.path().join("new").join("x".repeat(300));
        assert!(OutputDirectory::prepare(long).is_err());
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn files_are_written_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let output = OutputDirectory::prepare(folder.path()).unwrap();
        output.write_all([("a.csv", "1"), ("b.json", "2")]).unwrap();
        fs::create_dir(folder.path().join("taken")).unwrap();
        for bad in ["taken", "../c", "", ".", "..", "d/e", "/f", "g/", &"h".repeat(300)] {
            let error = output.write_all([("a.csv", "new"), (bad, "x")]).unwrap_err();
            assert!(matches!(error, OutputError::Name { .. } | OutputError::Write { .. }), "{error}");
        }
        assert_eq!(names(folder.path()), ["a.csv", "b.json", "taken"]);
        assert_eq!(fs::read_to_string(folder.path().join("a.csv")).unwrap(), "1");
        output.write_all([("a.csv", "new")]).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("a.csv")).unwrap(), "new");
    }

    #[test]
    fn one_file_that_cannot_be_written_does_not_lose_the_others() {
        let folder = tempfile::tempdir().unwrap();
        let output = OutputDirectory::prepare(folder.path()).unwrap();
        fs::create_dir(folder.path().join("b.csv")).unwrap();
        let lost = output.write_each([("a.json", "1"), ("b.csv", "2"), ("c.svg", "3")]);
        assert!(matches!(&lost[..], [OutputError::Write { path, .. }] if path.ends_with("b.csv")), "{lost:?}");
        assert_eq!(fs::read_to_string(folder.path().join("a.json")).unwrap(), "1");
        assert_eq!(fs::read_to_string(folder.path().join("c.svg")).unwrap(), "3");
        assert!(output.write_each([("a.json", "4")]).is_empty());
    }

    #[test]
    fn a_directory_is_for_one_run_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let output = OutputDirectory::prepare(folder.path()).unwrap();
        let left = folder.path().join(".aeroform-aBc123");
        fs::write(&left, "").unwrap();
        let lock = output.lock().unwrap();
        assert!(!left.exists());
        let again = OutputDirectory::prepare(folder.path()).unwrap();
        assert!(matches!(again.lock(), Err(OutputError::Busy { .. })));
        drop(lock);
        assert!(again.lock().is_ok());
    }

    #[test]
    #[cfg(unix)]
    fn files_have_ordinary_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("plain"), "").unwrap();
        let output = OutputDirectory::prepare(folder.path()).unwrap();
        output.write_all([("ours", "")]).unwrap();
        let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        assert_eq!(mode("ours"), mode("plain"));
    }
}
