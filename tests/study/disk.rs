//! Small file systems in memory, for tests with full or read-only disks.

use std::io::{Write, stderr};
use std::path::{Path, PathBuf};
use std::process::Command;

/// File system in memory that is unmounted when dropped.
pub struct Disk {
    folder: PathBuf,
}

impl Disk {
    /// Mounts the file system; prints the reason and returns `None` if mounting is not permitted.
    pub fn mount(folder: &Path) -> Option<Disk> {
        std::fs::create_dir_all(folder).expect("the folder can be created");
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
        // `println` output is hidden for tests that pass.
        let line = format!("NOT TESTED, because no disk can be mounted: {}\n", why.trim());
        stderr().write_all(line.as_bytes()).expect("standard error is open");
        None
    }

    /// Sets the size to this number of blocks of 4096 bytes.
    pub fn resize(&self, blocks: u64) {
        self.remount(&format!("size={}k", 4 * blocks));
    }

    /// Makes the file system read-only.
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
        // After a failed assertion the disk may be in use; lazy unmounting waits for its end.
        let _ = Command::new("umount").arg("-l").arg(&self.folder).status();
    }
}
