//! Where a manifest and the files that it names lie in an archive: seen from each other, as they did.
//!
//! A manifest goes into an archive as it is, byte for byte, so that its paths must lead to the same
//! files. They are kept as far as they are relative: of `manifests/scan.toml`, which names
//! `../data/scan.x3p`, the archive holds `manifests/scan.toml` and `data/scan.x3p`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Where a manifest and the files that it names lie in an archive, `/` between folders.
#[derive(Debug, PartialEq, Eq)]
pub struct Places {
    /// The manifest.
    pub manifest: String,
    /// The files, by their paths as the manifest names them.
    pub files: BTreeMap<PathBuf, String>,
}

/// A file cannot be put where the manifest would find it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{}` cannot go into an archive: {why}; have the manifest name it by a path that begins in the \
     manifest's folder, as `surfaces/scan.x3p` or `../surfaces/scan.x3p`",
    path.display()
)]
pub struct Unplaceable {
    /// The file, as the manifest names it.
    pub path: PathBuf,
    /// What is wrong with that.
    pub why: &'static str,
}

impl Places {
    /// Of a manifest, and of the files that it names.
    ///
    /// # Errors
    /// When a path is absolute, leads out of the root of the file system, or goes up again after it
    /// has gone down.
    pub fn of<'a>(
        manifest: &Path,
        files: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<Places, Unplaceable> {
        let ways = files.into_iter().map(|path| Ok((path, Way::of(path)?)));
        let ways: Vec<(&PathBuf, Way)> = ways.collect::<Result<_, _>>()?;
        let above = folders_of(manifest);
        let highest = ways.iter().max_by_key(|(_, way)| way.up);
        let height = highest.map_or(0, |(_, way)| way.up);
        if let Some((path, way)) = highest
            && way.up > above.len()
        {
            return Err(unplaceable(path, "it leads out of the file system"));
        }
        let kept = &above[above.len() - height..];
        let place = |up: usize, rest: &[String]| {
            let parts = kept[..height - up].iter().chain(rest);
            parts.map(String::as_str).collect::<Vec<_>>().join("/")
        };
        let name = manifest.file_name().unwrap_or_default().to_string_lossy();
        let files = ways.iter();
        Ok(Places {
            manifest: place(0, &[name.into_owned()]),
            files: files.map(|(path, way)| ((*path).clone(), place(way.up, &way.down))).collect(),
        })
    }

    /// The way back to the manifest from a folder of the archive that is `depth` folders deep.
    pub fn manifest_from(&self, depth: usize) -> String {
        "../".repeat(depth) + &self.manifest
    }
}

/// A relative path: first up, then down.
struct Way {
    up: usize,
    down: Vec<String>,
}

impl Way {
    fn of(path: &Path) -> Result<Way, Unplaceable> {
        let (mut up, mut down) = (0, Vec::new());
        for part in path.components() {
            match part {
                Component::CurDir => {}
                Component::ParentDir if down.is_empty() => up += 1,
                Component::Normal(part) => down.push(part.to_string_lossy().into_owned()),
                Component::ParentDir => return Err(unplaceable(path, "it goes down and up again")),
                Component::RootDir | Component::Prefix(_) => {
                    return Err(unplaceable(path, "its path is absolute"));
                }
            }
        }
        Ok(Way { up, down })
    }
}

fn unplaceable(path: &Path, why: &'static str) -> Unplaceable {
    Unplaceable { path: path.to_owned(), why }
}

/// The names of the folders above a file, the root's first.
fn folders_of(file: &Path) -> Vec<String> {
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    let folder = folder.unwrap_or(Path::new("."));
    // A manifest that has been read has a folder; should it have gone since, its name will do.
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let names = folder.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The places of `a/b/study.toml` and the file that it names so.
    fn places(named: &str) -> Result<(String, String), &'static str> {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        fs::create_dir_all(&folder).unwrap();
        let named = PathBuf::from(named);
        match Places::of(&folder.join("study.toml"), [&named]) {
            Ok(places) => Ok((places.manifest.clone(), places.files[&named].clone())),
            Err(error) => Err(error.why),
        }
    }

    fn both(manifest: &str, file: &str) -> Result<(String, String), &'static str> {
        Ok((manifest.to_owned(), file.to_owned()))
    }

    #[test]
    fn a_manifest_without_files_lies_at_the_root() {
        let places = Places::of(Path::new("somewhere/study.toml"), []).unwrap();
        assert_eq!(places.manifest, "study.toml");
        assert_eq!(places.manifest_from(3), "../../../study.toml");
    }

    #[test]
    fn paths_lead_from_the_manifest_to_its_files_as_they_did() {
        assert_eq!(places("scan.x3p"), both("study.toml", "scan.x3p"));
        assert_eq!(places("./maps/s.x3p"), both("study.toml", "maps/s.x3p"));
        assert_eq!(places("../scan.x3p"), both("b/study.toml", "scan.x3p"));
        assert_eq!(places("../../m/s.x3p"), both("a/b/study.toml", "m/s.x3p"));
    }

    #[test]
    fn what_would_not_be_found_again_is_refused() {
        assert_eq!(places("/scan.x3p"), Err("its path is absolute"));
        assert_eq!(places("maps/../s.x3p"), Err("it goes down and up again"));
        let far = "../".repeat(60) + "scan.x3p";
        assert_eq!(places(&far), Err("it leads out of the file system"));
    }
}
