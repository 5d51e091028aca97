//! How a page tells that nobody has changed it, nor the figures beside it.

use std::fs;
use std::path::{Path, PathBuf};

use super::basis::{Basis, Digests};
use super::figure::DrawnFigure;
use super::{FIGURES, PAGE};
use asperity_tables::store::files::lock_to_read;

/// A page ends with a digest of all before it.
const OPENING: &str = "<!-- blake3 ";
const CLOSING: &str = " -->\n";

/// Of figures that are to be written.
pub fn digests(figures: &[DrawnFigure]) -> Digests {
    let files = figures.iter().flat_map(DrawnFigure::files);
    files.map(|(name, bytes)| (name, digest(bytes))).collect()
}

/// A page that tells whether it has been changed.
pub fn sealed(page: String) -> String {
    let digest = digest(page.as_bytes());
    page + OPENING + &digest + CLOSING
}

/// The page in a folder and the figures beside it, as far as they are there and not as they were
/// written together; waits for a report that is being written.
pub fn changed(folder: &Path) -> Vec<PathBuf> {
    let _unchanging = lock_to_read(folder);
    let page = folder.join(PAGE);
    let Ok(bytes) = fs::read(&page) else {
        return Vec::new();
    };
    let text = String::from_utf8_lossy(&bytes);
    let mut changed = Vec::new();
    if !is_sealed(&text) {
        changed.push(page);
    }
    let written = Basis::told(&text).map(|basis| basis.files);
    for (name, written) in written.unwrap_or_default() {
        let figure = folder.join(FIGURES).join(name);
        if fs::read(&figure).is_ok_and(|bytes| digest(&bytes) != written) {
            changed.push(figure);
        }
    }
    changed
}

fn is_sealed(page: &str) -> bool {
    let sealed = page.rsplit_once(OPENING);
    let sealed = sealed.and_then(|(page, end)| Some((page, end.strip_suffix(CLOSING)?)));
    sealed.is_some_and(|(page, written)| digest(page.as_bytes()) == written)
}

fn digest(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_string()
}

#[cfg(test)]
mod tests {
    use std::thread;
    use std::time::Duration;

    use super::*;
    use asperity_tables::store::files::lock_to_write;

    #[test]
    fn a_report_that_is_being_written_is_looked_at_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join(PAGE);
        let written = lock_to_write(folder.path()).expect("this disk can lock folders");
        fs::write(&page, "half a page").unwrap();
        let found = thread::scope(|scope| {
            let look = scope.spawn(|| changed(folder.path()));
            thread::sleep(Duration::from_millis(200));
            fs::write(&page, sealed("a page".to_owned())).unwrap();
            drop(written);
            look.join().unwrap()
        });
        assert_eq!(found, Vec::<PathBuf>::new());
        fs::write(&page, "half a page").unwrap();
        assert_eq!(changed(folder.path()), [page]);
    }

    #[test]
    fn a_page_is_sealed_until_a_byte_of_it_changes() {
        let page = sealed("<html></html>\n".to_owned());
        assert!(is_sealed(&page));
        for (position, _) in page.char_indices() {
            let mut other = page.clone();
            other.replace_range(position..=position, "#");
            assert!(!is_sealed(&other), "{position}");
        }
        assert!(!is_sealed("<html></html>\n"));
    }
}
