//! An unlinked temporary file: the system frees it when no process has it open, however the process ends.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// File to which data is appended, and which is read at any offset.
#[derive(Debug)]
pub(crate) struct UnlinkedFile {
    /// Folder of the file.
    pub folder: PathBuf,
    file: File,
    /// Offset of the next bytes.
    end: Mutex<u64>,
}

/// Folders for large temporary files: the folder in `TMPDIR`, otherwise a folder on the disk (`/tmp` is often in
/// memory), otherwise the system's folder.
pub(crate) fn folders() -> Vec<PathBuf> {
    match std::env::var_os("TMPDIR") {
        Some(folder) if !folder.is_empty() => vec![folder.into()],
        _ if cfg!(unix) => vec!["/var/tmp".into(), std::env::temp_dir()],
        _ => vec![std::env::temp_dir()],
    }
}

impl UnlinkedFile {
    /// Creates a file in a folder.
    pub fn new(folder: &Path) -> io::Result<Self> {
        if !cfg!(any(unix, windows)) {
            return Err(io::ErrorKind::Unsupported.into());
        }
        let mut attempt = 0;
        let (file, path) = loop {
            let name = format!("raycam-textures-{}-{attempt}", std::process::id());
            let path = folder.join(name);
            match open(&path) {
                // The name is in use: by a file of this process that is about to be unlinked, or by a file left over
                // from another process.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
                opened => break (opened?, path),
            }
        };
        unlink(&path)?;
        Ok(Self { folder: folder.into(), file, end: Mutex::new(0) })
    }

    /// Writes bytes at the end and returns their offset.
    pub fn append(&self, bytes: &[u8]) -> io::Result<u64> {
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        let start = *end;
        write_all_at(&self.file, bytes, start)?;
        *end += bytes.len() as u64;
        Ok(start)
    }

    /// Size of the file in bytes.
    pub fn len(&self) -> u64 {
        *self.end.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Fills a buffer with the bytes from `start` on.
    pub fn read(&self, bytes: &mut [u8], start: u64) -> io::Result<()> {
        read_exact_at(&self.file, bytes, start)
    }
}

/// Creates a file that only this user can access.
fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    #[cfg(windows)]
    {
        const DELETE_ON_CLOSE: u32 = 0x0400_0000;
        std::os::windows::fs::OpenOptionsExt::custom_flags(&mut options, DELETE_ON_CLOSE);
    }
    options.open(path)
}

/// Unlinks the file, if the system allows that for open files.
fn unlink(path: &Path) -> io::Result<()> {
    if cfg!(unix) { fs::remove_file(path) } else { Ok(()) }
}

/// Never called, because this platform has no files.
#[cfg(not(any(unix, windows)))]
fn write_all_at(_: &File, _: &[u8], _: u64) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Never called, because this platform has no files.
#[cfg(not(any(unix, windows)))]
fn read_exact_at(_: &File, _: &mut [u8], _: u64) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], start: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, start)
}

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], start: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, start)
}

#[cfg(windows)]
fn write_all_at(file: &File, mut bytes: &[u8], mut start: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        let written = std::os::windows::fs::FileExt::seek_write(file, bytes, start)?;
        if written == 0 {
            return Err(io::ErrorKind::WriteZero.into());
        }
        (bytes, start) = (&bytes[written..], start + written as u64);
    }
    Ok(())
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut start: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        let read = std::os::windows::fs::FileExt::seek_read(file, bytes, start)?;
        if read == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        (bytes, start) = (&mut bytes[read..], start + read as u64);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unlinked_files_return_the_written_bytes() {
        let folder = std::env::temp_dir().join(format!("raycam-temporary-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let files = [(); 2].map(|()| UnlinkedFile::new(&folder).unwrap());
        if cfg!(unix) {
            assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        }
        for (i, file) in files.iter().enumerate() {
            assert_eq!(file.append(&[i as u8; 5]).unwrap(), 0);
            assert_eq!(file.append(&[10 + i as u8; 3]).unwrap(), 5);
            assert_eq!(file.len(), 8);
        }
        for (i, file) in files.iter().enumerate() {
            let mut bytes = [0; 4];
            file.read(&mut bytes, 3).unwrap();
            assert_eq!(bytes, [i as u8, i as u8, 10 + i as u8, 10 + i as u8]);
            let beyond = file.read(&mut bytes, 6).unwrap_err();
            assert_eq!(beyond.kind(), io::ErrorKind::UnexpectedEof);
        }
        drop(files);
        fs::remove_dir(&folder).unwrap();
        assert_eq!(UnlinkedFile::new(&folder).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
