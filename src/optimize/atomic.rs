//! Files that are there whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// How the names of temporary files begin.
const PREFIX: &str = ".aeroform-";

/// Removes temporary files from `directory` that processes left which were killed, and no others: the writer of a
/// temporary file holds a lock on it, which ends with the writer.
pub(crate) fn sweep(directory: &Path) {
    let Ok(entries) = std::fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let ours = name.to_str().and_then(|name| name.strip_prefix(PREFIX)).is_some_and(is_random);
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let abandoned = File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
        if abandoned {
            // one that cannot be removed is in nobody's way
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether this is the random part of the name of a temporary file.
fn is_random(text: &str) -> bool {
    text.len() == 6 && text.chars().all(|c| c.is_ascii_alphanumeric())
}

/// The directory a file stands in.
pub(crate) fn directory(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The error of the operating system alone: `tempfile` adds the name of the temporary file, which tells a user nothing.
/// It keeps the error itself private, so that only the text can be cut.
fn without_name(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path \"") {
        Some((reason, _)) => io::Error::new(error.kind(), reason),
        None => error,
    }
}

/// Writes a temporary file beside `path` and sees it onto the disk; it vanishes unless it is renamed to `path`.
pub(crate) fn stage(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX);
    // temporary files are private by default; what they become is an ordinary file
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(directory(path)).map_err(without_name)?;
    // tells that its writer lives; where the system cannot lock, nothing is swept either
    let _ = file.as_file().try_lock();
    let mut writer = BufWriter::new(file.as_file());
    content(&mut writer)?;
    writer.flush()?;
    drop(writer);
    file.as_file().sync_all()?;
    Ok(file)
}

/// Renames a staged file to `path`, replacing what is there.
pub(crate) fn commit(file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.persist(path).map_err(|error| error.error)?;
    // the rename is on the disk when the directory is; not every system can be asked for that
    if let Ok(directory) = File::open(directory(path)) {
        let _ = directory.sync_all();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_abandoned_files_of_ours_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let live = stage(&folder.path().join("result"), |file| file.write_all(b"half")).unwrap();
        let (_, left) = stage(&folder.path().join("result"), |file| file.write_all(b"half")).unwrap().keep().unwrap();
        let others = [".aeroform-note-1", ".aeroform-abc", "aeroform-abcdef", ".aeroform.lock"];
        others.iter().for_each(|name| std::fs::write(folder.path().join(name), "").unwrap());
        std::fs::create_dir(folder.path().join(".aeroform-folder")).unwrap();
        assert!(left.exists());
        sweep(folder.path());
        assert!(!left.exists() && live.path().exists());
        assert!(others.iter().all(|name| folder.path().join(name).exists()));
        assert!(folder.path().join(".aeroform-folder").exists());
        // what lives can still take its name
        commit(live, &folder.path().join("result")).unwrap();
        assert_eq!(std::fs::read(folder.path().join("result")).unwrap(), b"half");
    }
}
