//! Explanations of denied access.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Adds owner and permissions to an error of the kind `PermissionDenied`: those of the file or
/// folder at `path` or, if it cannot be seen, of the nearest folder above it. Other errors are
/// returned unchanged.
pub(crate) fn explained(error: io::Error, path: &Path) -> io::Error {
    if error.kind() != io::ErrorKind::PermissionDenied {
        return error;
    }
    let Ok(path) = std::path::absolute(path) else { return error };
    let mut seen = path.ancestors().filter_map(|path| Some((path, fs::metadata(path).ok()?)));
    let Some((path, metadata)) = seen.next() else { return error };
    let what = if metadata.is_dir() { "folder" } else { "file" };
    let message = format!(
        "{error}: the {what} `{}` belongs to user {} and group {}, with the permissions {:o}",
        path.display(),
        metadata.uid(),
        metadata.gid(),
        metadata.mode() & 0o7777
    );
    io::Error::new(io::ErrorKind::PermissionDenied, message)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn the_nearest_visible_folder_is_named_with_its_owner_and_permissions() {
        let folder = tempfile::tempdir().unwrap();
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o750)).unwrap();
        let denied = io::Error::from(io::ErrorKind::PermissionDenied);
        let text = explained(denied, &folder.path().join("store/table.parquet")).to_string();
        let owner = fs::metadata(folder.path()).unwrap().uid();
        assert!(text.contains(&format!("`{}`", folder.path().display())), "{text}");
        assert!(text.contains(&format!("belongs to user {owner} ")), "{text}");
        assert!(text.ends_with("with the permissions 750"), "{text}");
    }

    #[test]
    fn errors_of_other_kinds_are_not_explained() {
        let error = explained(io::ErrorKind::NotFound.into(), Path::new("/"));
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(error.into_inner().is_none());
    }
}
