//! Which pictures a folder or a pattern gives.

use super::foreign;
use super::picture::unreadable;
use crate::FacewrightError;
use std::path::{Path, PathBuf};

const PICTURES: [&str; 7] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "webp"];
const VIDEOS: [&str; 16] =
    ["mp4", "mov", "avi", "mkv", "webm", "m4v", "mpg", "mpeg", "ogv", "mts", "m2ts", "ts", "wmv", "3gp", "flv", "gif"];

/// Whether a path is a video, by its name: a folder of such a name is a folder.
pub(crate) fn is_video(path: &Path) -> bool {
    is(path, &VIDEOS) && !path.is_dir()
}

fn is(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x)))
}

/// The pictures that an input stands for, which is no video.
pub(crate) fn pictures_of(input: &Path) -> Result<Vec<PathBuf>, FacewrightError> {
    let paths = if input.is_dir() {
        pictures_in(input)?
    } else if let Some(matching) = matching(input) {
        matching?
    } else {
        vec![input.to_owned()]
    };
    if !paths.is_empty() {
        return Ok(paths);
    }
    let there = if input.is_dir() { files_in(input)? } else { Vec::new() };
    let is_seen = |path: &&PathBuf| !is_hidden(path);
    let others = there.iter().filter(is_seen).find_map(|path| foreign::by_name(path));
    let videos = there.iter().filter(is_seen).find(|path| is_video(path));
    let input = input.display();
    Err(match (others, videos) {
        (Some(other), _) => {
            FacewrightError::ForeignPictures { input: input.to_string(), kind: other.kind, remedy: other.remedy }
        }
        (None, Some(video)) => FacewrightError::VideoInFolder { input: input.to_string(), video: video.clone() },
        (None, None) => FacewrightError::NoFrames { input: input.to_string() },
    })
}

/// The pictures of a folder in their natural order; hidden files are none.
///
/// # Errors
/// [`FacewrightError::Read`] for a folder that cannot be read.
pub fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, FacewrightError> {
    let mut paths = files_in(folder)?;
    paths.retain(|path| is_picture(path));
    paths.sort_by_cached_key(|path| natural(&path.file_name().unwrap_or_default().to_string_lossy()));
    Ok(paths)
}

fn files_in(folder: &Path) -> Result<Vec<PathBuf>, FacewrightError> {
    let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
    Ok(entries.filter_map(|e| e.ok().map(|e| e.path())).collect())
}

/// Of what a folder or a pattern gives; a file that is named itself is taken for what it is.
fn is_picture(path: &Path) -> bool {
    is(path, &PICTURES) && !is_hidden(path)
}

/// As systems hide what is not for people: macOS puts a `._frame.jpg` beside each picture on foreign volumes.
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// A key by which `frame9` comes before `frame10`: stretches of digits count as numbers, then the name itself decides.
fn natural(name: &str) -> (Vec<(String, u64)>, String) {
    let (mut parts, mut rest) = (Vec::new(), name);
    while !rest.is_empty() {
        let text = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let digits = rest[text..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - text);
        // A number too large to count is the largest.
        let number = rest[text..text + digits].parse().unwrap_or(if digits == 0 { 0 } else { u64::MAX });
        parts.push((rest[..text].to_owned(), number));
        rest = &rest[text + digits..];
    }
    (parts, name.to_owned())
}

/// Files whose names match a pattern with `*` or `?`, by name; `None` for an ordinary path.
fn matching(pattern: &Path) -> Option<Result<Vec<PathBuf>, FacewrightError>> {
    let text = pattern.to_str().filter(|text| text.contains(['*', '?']) && !pattern.exists())?;
    // What is there is meant: a folder's name is no pattern, and brackets in a file's name are brackets.
    let folder = pattern.parent().filter(|folder| folder.is_dir()).and_then(Path::to_str);
    let (folder, name) = match (folder, pattern.file_name().and_then(|name| name.to_str())) {
        (Some(folder), Some(name)) => (Path::new(&glob::Pattern::escape(folder)).to_owned(), name),
        _ => (PathBuf::new(), text),
    };
    let with_brackets = folder.join(name.replace('[', "[[]"));
    let found = files_matching(&with_brackets).and_then(|files| match files.is_empty() {
        true => files_matching(&folder.join(name)),
        false => Ok(files),
    });
    Some(found)
}

fn files_matching(pattern: &Path) -> Result<Vec<PathBuf>, FacewrightError> {
    let found = glob::glob(&pattern.to_string_lossy()).map_err(|e| unreadable(pattern, &e))?;
    let mut paths: Vec<PathBuf> = found.filter_map(Result::ok).filter(|path| is_picture(path)).collect();
    paths.sort_by_cached_key(|path| natural(&path.to_string_lossy()));
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(input: &Path) -> Vec<String> {
        let paths = pictures_of(input).unwrap();
        paths.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect()
    }

    fn folder_of(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, b"-").unwrap();
        }
        folder
    }

    #[test]
    fn a_folders_name_is_no_pattern_and_brackets_that_are_there_are_brackets() {
        let folder = folder_of(&["shots [1]/a.jpg", "shots [1]/b.jpg", "take[2]_1.png", "take2_1.png", "x3.png"]);
        let root = folder.path();
        assert_eq!(names(&root.join("shots [1]/*.jpg")), ["a.jpg", "b.jpg"]);
        assert_eq!(names(&root.join("take[2]_*.png")), ["take[2]_1.png"]);
        assert_eq!(names(&root.join("take[2]_1.png")), ["take[2]_1.png"]);
        assert_eq!(names(&root.join("[xy]?.png")), ["x3.png"], "as no file has the brackets in its name");
        assert_eq!(names(&root.join("shots*/*.jpg")), ["a.jpg", "b.jpg"]);
        let error = pictures_of(&root.join("z*.png")).unwrap_err();
        assert!(matches!(error, FacewrightError::NoFrames { .. }), "{error}");
    }

    #[test]
    fn what_systems_put_beside_pictures_is_left_out() {
        let others = ["._a.jpg", ".DS_Store", "Thumbs.db", "desktop.ini", ".hidden.png", "._b.jpg", "a.xmp"];
        let folder = folder_of(&[&["a.jpg", "b.JPG"][..], &others].concat());
        assert_eq!(names(folder.path()), ["a.jpg", "b.JPG"]);
        assert_eq!(names(&folder.path().join("*")), ["a.jpg", "b.JPG"]);
    }

    #[test]
    fn a_folder_of_foreign_files_is_named_for_what_it_holds() {
        for (files, words) in [
            (["IMG_1.HEIC", "IMG_2.HEIC"], "holds HEIC pictures, which are not read here: save them as JPEG"),
            (["a.avif", ".b.jpg"], "holds AVIF pictures"),
            (["a.NEF", "notes.txt"], "holds raw pictures"),
            (["clip.mov", "notes.txt"], "clip.mov, a video: give the video itself"),
            (["notes.txt", "._a.heic"], "no pictures in"),
        ] {
            let error = pictures_of(folder_of(&files).path()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
