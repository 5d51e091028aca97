//! A small disk of one's own.

use std::io::{Write, stderr};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A file system in memory, mounted on a folder until it is dropped.
pub struct Disk {
    folder: PathBuf,
}

impl Disk {
    /// Mounts it; nothing, with a line that says why, where that is not allowed.
    pub fn mount(folder: &Path) -> Option<Disk> {
        std::fs::create_dir_all(folder).expect("the folder can be made");
        let mut command = Command::new("mount");
        command.args(["-t", "tmpfs", "-o", "size=1m,mode=755", "asperity-test"]);
        let why = match command.arg(folder).output() {
            Ok(output) if output.status.success() => {
                let folder = folder.to_owned();
                return Some(Disk { folder });
            }
            Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
            Err(error) => error.to_string(),
        };
        // Not by `println`, which tests that pass keep to themselves.
        let line = format!("NOT TESTED, because no disk can be mounted: {}\n", why.trim());
        stderr().write_all(line.as_bytes()).expect("somebody hears");
        None
    }

    /// Gives it this many blocks of 4096 bytes.
    pub fn resize(&self, blocks: u64) {
        self.remount(&format!("size={}k", 4 * blocks));
    }

    /// Lets nobody write to it.
    pub fn protect(&self) {
        self.remount("ro");
    }

    fn remount(&self, options: &str) {
        let mut command = Command::new("mount");
        command.args(["-o", &format!("remount,{options}")]);
        let status = command.arg(&self.folder).status();
        assert!(status.expect("it was there before").success());
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // A disk that is still in use, after a failed assertion, goes as soon as it is not.
        let _ = Command::new("umount").arg("-l").arg(&self.folder).status();
    }
}
