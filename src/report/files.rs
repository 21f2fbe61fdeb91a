//! Directories for results, and files written whole or not at all.

use crate::optimize::atomic;
use std::fs;
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
            let path = self.file(name.as_ref())?;
            check_target(&path).map_err(|source| OutputError::Write { path: path.clone(), source })?;
            match atomic::stage(&path, |file| file.write_all(content.as_ref())) {
                Ok(file) => staged.push((file, path)),
                Err(source) => return Err(OutputError::Write { path, source }),
            }
        }
        for (file, path) in staged {
            atomic::commit(file, &path).map_err(|source| OutputError::Write { path, source })?;
        }
        Ok(())
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
