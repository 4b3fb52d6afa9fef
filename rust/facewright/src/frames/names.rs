//! What the frames are called: each by its file, and no two the same.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Names of files: without their extension, or with as much more as tells them apart.
pub(super) fn distinct(paths: &[PathBuf]) -> Vec<String> {
    let mut names: Vec<String> = paths.iter().map(|path| text(path.file_stem())).collect();
    let mut alike: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    names.iter().enumerate().for_each(|(i, name)| alike.entry(name.clone()).or_default().push(i));
    let mut taken: BTreeSet<String> =
        alike.iter().filter(|(_, all)| all.len() == 1).map(|(name, _)| name.clone()).collect();
    for all in alike.into_values().filter(|all| all.len() > 1) {
        let longer = |of: fn(&Path) -> String| -> Vec<String> { all.iter().map(|&i| of(&paths[i])).collect() };
        let is_distinct = |names: &Vec<String>| {
            let different: BTreeSet<&String> = names.iter().collect();
            different.len() == names.len() && different.is_disjoint(&taken.iter().collect())
        };
        let fitting = [longer(with_folder), longer(with_extension), longer(with_both)].into_iter().find(is_distinct);
        let chosen = fitting.unwrap_or_else(|| numbered(&longer(|path| text(path.file_stem())), &taken));
        for (i, name) in all.into_iter().zip(chosen) {
            taken.insert(name.clone());
            names[i] = name;
        }
    }
    names
}

fn text(part: Option<&std::ffi::OsStr>) -> String {
    part.unwrap_or_default().to_string_lossy().into_owned()
}

fn with_folder(path: &Path) -> String {
    let folder = text(path.parent().and_then(Path::file_name));
    if folder.is_empty() { text(path.file_stem()) } else { format!("{folder}_{}", text(path.file_stem())) }
}

fn with_extension(path: &Path) -> String {
    format!("{}_{}", text(path.file_stem()), text(path.extension()))
}

fn with_both(path: &Path) -> String {
    format!("{}_{}", with_folder(path), text(path.extension()))
}

/// For a file that was given more than once.
fn numbered(names: &[String], taken: &BTreeSet<String>) -> Vec<String> {
    let mut taken = taken.clone();
    let number = |name: &String| {
        let free = |name: &String| !taken.contains(name);
        let next = std::iter::once(name.clone()).chain((2..).map(|k| format!("{name}_{k}"))).find(free);
        let next = next.unwrap_or_default();
        taken.insert(next.clone());
        next
    };
    names.iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart_by_folder_then_by_extension_then_by_number() {
        let names = |paths: &[&str]| distinct(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["a/1.jpg", "a/2.png"]), ["1", "2"]);
        assert_eq!(names(&["left/1.jpg", "right/1.jpg", "right/2.jpg"]), ["left_1", "right_1", "2"]);
        assert_eq!(names(&["in/1.jpg", "in/1.png"]), ["1_jpg", "1_png"]);
        assert_eq!(names(&["l/1.jpg", "l/1.png", "r/1.jpg"]), ["l_1_jpg", "l_1_png", "r_1_jpg"]);
        assert_eq!(names(&["1.jpg", "1.jpg", "1_2.jpg"]), ["1", "1_3", "1_2"]);
    }
}
