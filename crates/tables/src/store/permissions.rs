//! Explanations of denied access: who owns the file or folder, and which user runs the program.
//!
//! The explanation evaluates the permission bits only. Access control lists and file systems that
//! map users can deny more; the explanation then states the owner and the user without a reason.

use std::error::Error;
use std::fmt;
use std::fs::{self, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Operation that was denied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    /// Creating, renaming or deleting a file, which needs write permission for its folder.
    Write,
    /// Opening an existing file for writing.
    Open,
}

/// Number of the error of an operation that no permission would allow, unless a sticky bit forbids
/// it. Some file systems refuse links with it.
const EPERM: i32 = 1;

/// Adds an explanation to an error of the kind `PermissionDenied`. `paths` are the paths that the
/// operation used. Other errors are returned unchanged.
pub(crate) fn explained(error: io::Error, access: Access, paths: &[&Path]) -> io::Error {
    if error.kind() != io::ErrorKind::PermissionDenied {
        return error;
    }
    let user = User::current();
    let obstacles = paths.iter().map(|path| Obstacle::find(path, access, user.as_ref()));
    // Prefer a path whose permission bits deny the access.
    let is_unclear = |obstacle: &Obstacle| obstacle.needs.is_none() && !obstacle.is_sticky;
    let obstacle = obstacles.flatten().min_by_key(is_unclear);
    let is_of_operation = error.raw_os_error() == Some(EPERM);
    match obstacle.filter(|obstacle| !(is_of_operation && is_unclear(obstacle))) {
        Some(obstacle) => io::Error::new(error.kind(), Denied { obstacle, user }),
        None => error,
    }
}

/// Reason of a denied access.
#[derive(Debug)]
struct Denied {
    obstacle: Obstacle,
    user: Option<User>,
}

/// File or folder that prevents an access.
#[derive(Debug)]
struct Obstacle {
    path: PathBuf,
    is_folder: bool,
    owner: u32,
    group: u32,
    mode: u32,
    /// Permission that the user lacks, such as `w`, or `None` if the permission bits allow the
    /// access.
    needs: Option<&'static str>,
    /// True if the sticky bit of the folder protects the files of other users.
    is_sticky: bool,
}

const EXECUTE: u32 = 1;
const WRITE: u32 = 2;
const READ: u32 = 4;
const STICKY: u32 = 0o1000;

/// Returns the bits of permissions such as `rx`.
fn bits(permissions: &str) -> u32 {
    let bit = |letter| match letter {
        'r' => READ,
        'w' => WRITE,
        _ => EXECUTE,
    };
    permissions.chars().map(bit).sum()
}

impl Obstacle {
    /// Finds the first file or folder on the way to `path` whose permission bits deny the access.
    /// If all allow it, returns the last existing one. Returns `None` if nothing is known.
    fn find(path: &Path, access: Access, user: Option<&User>) -> Option<Obstacle> {
        let path = std::path::absolute(path).ok()?;
        let mut folders: Vec<&Path> = path.ancestors().skip(1).collect();
        folders.reverse();
        let mut last = None;
        for folder in folders {
            let Ok(metadata) = fs::metadata(folder) else { break };
            if user.is_some_and(|user| !user.may(&metadata, EXECUTE)) {
                return Some(Obstacle::new(folder, &metadata, Some("x")));
            }
            last = Some((folder, metadata));
        }
        let own = fs::symlink_metadata(&path).ok().map(|metadata| (path.as_path(), metadata));
        let of_folder = access == Access::Write && !own.as_ref().is_some_and(|(_, of)| of.is_dir());
        let (at, metadata) =
            if of_folder { last.as_ref()? } else { own.as_ref().or(last.as_ref())? };
        let (bits, needs) = match access {
            Access::Read if metadata.is_dir() => (READ | EXECUTE, "rx"),
            Access::Read => (READ, "r"),
            Access::Open => (WRITE, "w"),
            Access::Write => (WRITE | EXECUTE, "w"),
        };
        let lacks = user.is_some_and(|user| !user.may(metadata, bits));
        let is_sticky = !lacks && of_folder && metadata.mode() & STICKY != 0;
        let needs = lacks.then_some(needs);
        Some(Obstacle { is_sticky, ..Obstacle::new(at, metadata, needs) })
    }

    fn new(path: &Path, metadata: &Metadata, needs: Option<&'static str>) -> Obstacle {
        Obstacle {
            path: path.to_owned(),
            is_folder: metadata.is_dir(),
            owner: metadata.uid(),
            group: metadata.gid(),
            mode: metadata.mode(),
            needs,
            is_sticky: false,
        }
    }
}

impl Error for Denied {}

impl fmt::Display for Denied {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Denied { obstacle, user } = self;
        let kind = if obstacle.is_folder { "folder" } else { "file" };
        let (owner, group) = (user_name(obstacle.owner), group_name(obstacle.group));
        let path = obstacle.path.display();
        // A path of NUL characters does not exist.
        let text = obstacle.path.to_string_lossy();
        let word = shlex::try_quote(&text).unwrap_or_default();
        write!(
            formatter,
            "Permission denied: the {kind} `{path}` belongs to user {owner} and group {group} \
             ({})",
            letters(obstacle.mode, obstacle.is_folder)
        )?;
        let Some(user) = user else { return Ok(()) };
        let groups: Vec<String> = user.groups.iter().map(|&group| group_name(group)).collect();
        let plural = if groups.len() == 1 { "group" } else { "groups" };
        let name = user_name(user.id);
        write!(formatter, ", and user {name} ({plural} {}) runs asperity", groups.join(", "))?;
        let Some(needs) = obstacle.needs else {
            if !obstacle.is_sticky {
                return Ok(());
            }
            return write!(
                formatter,
                "; the sticky bit (`t`) protects files of other users, so {owner} must run \
                 `chmod -t {word}`"
            );
        };
        if obstacle.owner == user.id {
            write!(formatter, "; run `chmod u+{needs} {word}`")
        } else if user.groups.contains(&obstacle.group) {
            write!(
                formatter,
                "; {owner} must run `chmod g+{needs} {word}`, and `umask 002` before \
                the next run"
            )
        } else {
            let is_shared = obstacle.mode >> 3 & bits(needs) == bits(needs);
            let of_group =
                if is_shared { format!(" and members of group {group}") } else { String::new() };
            write!(formatter, "; only user {owner}{of_group} can get access")
        }
    }
}

/// User that runs the program.
#[derive(Debug)]
struct User {
    id: u32,
    /// Effective group, followed by the other groups of the user.
    groups: Vec<u32>,
}

impl User {
    /// Returns the effective user of this process, or `None` on systems without `/proc`.
    fn current() -> Option<User> {
        User::from_status(&fs::read_to_string("/proc/self/status").ok()?)
    }

    /// Parses the file `/proc/PID/status`, whose lines `Uid` and `Gid` list the real, the effective
    /// and other identifiers.
    fn from_status(status: &str) -> Option<User> {
        let numbers = |name: &str| -> Option<Vec<u32>> {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().map(|word| word.parse().ok()).collect()
        };
        let effective = |name: &str| numbers(name)?.get(1).copied();
        let mut groups = vec![effective("Gid:")?];
        let others = numbers("Groups:").unwrap_or_default();
        groups.extend(others.into_iter().filter(|group| *group != groups[0]).collect::<Vec<_>>());
        Some(User { id: effective("Uid:")?, groups })
    }

    /// Returns whether the permission bits grant the user all of the permissions `bits`.
    fn may(&self, metadata: &Metadata, bits: u32) -> bool {
        let mode = metadata.mode();
        let granted = match metadata {
            _ if self.id == 0 => return true,
            of if of.uid() == self.id => mode >> 6,
            of if self.groups.contains(&of.gid()) => mode >> 3,
            _ => mode,
        };
        granted & bits == bits
    }
}

fn user_name(id: u32) -> String {
    name_in(&fs::read_to_string("/etc/passwd").unwrap_or_default(), id)
}

fn group_name(id: u32) -> String {
    name_in(&fs::read_to_string("/etc/group").unwrap_or_default(), id)
}

/// Returns the name of a user or group in the text of `/etc/passwd` or `/etc/group`, or its number
/// if the text does not list it.
fn name_in(database: &str, id: u32) -> String {
    let digits = id.to_string();
    let name = database.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)? == digits).then(|| name.to_owned())
    });
    name.unwrap_or(digits)
}

/// Formats a mode as `ls -l` does: `drwxr-xr-x`.
fn letters(mode: u32, is_folder: bool) -> String {
    let bits = (0..9).rev().map(|bit| (mode >> bit & 1 == 1, b"xwr"[bit % 3] as char));
    let mut text: Vec<char> =
        bits.map(|(is_set, letter)| if is_set { letter } else { '-' }).collect();
    if mode & STICKY != 0 {
        text[8] = if mode & EXECUTE != 0 { 't' } else { 'T' };
    }
    text.insert(0, if is_folder { 'd' } else { '-' });
    text.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn modes_are_formatted_as_ls_does() {
        assert_eq!(letters(0o40755, true), "drwxr-xr-x");
        assert_eq!(letters(0o100640, false), "-rw-r-----");
        assert_eq!(letters(0o41777, true), "drwxrwxrwt");
    }

    #[test]
    fn names_are_found_and_unknown_users_are_numbers() {
        let database = "root:x:0:0:root:/root:/bin/bash\nalice:x:1001:1001::/home/alice:/bin/sh\n";
        assert_eq!(name_in(database, 1001), "alice");
        assert_eq!(name_in(database, 0), "root");
        assert_eq!(name_in(database, 7), "7");
        assert_eq!(name_in("rough:x:2000:alice,bob\n", 2000), "rough");
    }

    #[test]
    fn the_effective_user_and_all_groups_are_read() {
        let status =
            "Name:\tasperity\nUid:\t0\t1002\t0\t0\nGid:\t0\t1002\t0\t0\nGroups:\t1002 2000 \n";
        let user = User::from_status(status).unwrap();
        assert_eq!((user.id, &user.groups[..]), (1002, &[1002, 2000][..]));
    }

    /// Returns the explanation that a user gets for writing a file in a folder with this mode.
    fn explanation(mode: u32, id: u32, groups: &[u32]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        fs::create_dir(&data).unwrap();
        for (path, mode) in [(folder.path(), 0o755), (&data, mode)] {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
        }
        let user = User { id, groups: groups.to_vec() };
        let file = data.join("store/table.parquet");
        let obstacle = Obstacle::find(&file, Access::Write, Some(&user)).unwrap();
        assert_eq!(obstacle.path, data);
        Denied { obstacle, user: Some(user) }.to_string()
    }

    #[test]
    fn the_cure_depends_on_the_owner_and_the_group() {
        let own = fs::metadata("/proc/self").unwrap();
        let (owner, group) = (own.uid(), own.gid());
        let stranger = owner + 54321;
        let of_group = explanation(0o755, stranger, &[group]);
        assert!(of_group.contains("drwxr-xr-x"), "{of_group}");
        assert!(of_group.contains(&format!("user {stranger} (group")), "{of_group}");
        assert!(of_group.contains("chmod g+w "), "{of_group}");
        let other = explanation(0o775, stranger, &[group + 54321]);
        assert!(other.contains(" and members of group "), "{other}");
        let closed = explanation(0o755, stranger, &[group + 54321]);
        assert!(closed.ends_with(&format!("only user {} can get access", user_name(owner))));
        assert!(explanation(0o1777, stranger, &[group]).contains("chmod -t"));
        if owner != 0 {
            assert!(explanation(0o555, owner, &[group]).contains("chmod u+w"));
        }
    }

    #[test]
    fn a_folder_that_cannot_be_entered_is_found_before_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o700)).unwrap();
        let stranger = User { id: 54321, groups: vec![54321] };
        let obstacle = Obstacle::find(&inner.join("file"), Access::Read, Some(&stranger)).unwrap();
        assert_eq!((obstacle.path.as_path(), obstacle.needs), (folder.path(), Some("x")));
    }

    #[test]
    fn an_operation_that_the_file_system_refuses_has_no_owner_to_ask() {
        let folder = tempfile::tempdir().unwrap();
        let refused = io::Error::from_raw_os_error(EPERM);
        let error = explained(refused, Access::Write, &[&folder.path().join("link")]);
        assert_eq!(error.to_string(), io::Error::from_raw_os_error(EPERM).to_string());
    }

    #[test]
    fn errors_of_other_kinds_are_not_explained() {
        let error = explained(io::ErrorKind::NotFound.into(), Access::Read, &[Path::new("/")]);
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(error.into_inner().is_none());
    }
}
