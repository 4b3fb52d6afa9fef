//! Files that are no picture of a kind that is read: what they are, and what to do.

use std::io::Read;
use std::path::Path;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Foreign {
    /// As people call it.
    pub(super) kind: &'static str,
    /// What to do with it.
    pub(super) remedy: &'static str,
}

const HEIC: Foreign = Foreign { kind: "HEIC", remedy: "save them as JPEG" };
const AVIF: Foreign = Foreign { kind: "AVIF", remedy: "save them as JPEG" };
const JPEG_XL: Foreign = Foreign { kind: "JPEG XL", remedy: "save them as JPEG" };
const RAW: Foreign = Foreign { kind: "raw", remedy: "develop them to TIFF or JPEG" };

/// What a picture is by its name, if it is none that is read.
pub(super) fn by_name(path: &Path) -> Option<Foreign> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "heic" | "heif" | "hif" => Some(HEIC),
        "avif" => Some(AVIF),
        "jxl" => Some(JPEG_XL),
        "cr2" | "cr3" | "nef" | "arw" | "dng" | "raf" | "orf" | "rw2" => Some(RAW),
        _ => None,
    }
}

/// What a file is by how it begins, as the reason why it cannot be read; `None` where that does not tell.
pub(super) fn by_content(path: &Path) -> Option<String> {
    let head = head(path).ok()?;
    if let Some(other) = brand(&head).or_else(|| by_name(path)) {
        return Some(format!("it is a picture of the kind {}, which is not read here: {}", other.kind, other.remedy))
            .map(|text| text.replace("save them", "save it").replace("develop them", "develop it"));
    }
    sentence(&head).map(str::to_owned)
}

/// Whether a file begins as one of the pictures that are read.
pub(super) fn begins_as_picture(path: &Path) -> bool {
    head(path).is_ok_and(|head| image::guess_format(&head).is_ok_and(|format| format.reading_enabled()))
}

fn head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    std::fs::File::open(path)?.take(512).read_to_end(&mut head)?;
    Ok(head)
}

/// The kind of picture that a file's first bytes tell.
fn brand(head: &[u8]) -> Option<Foreign> {
    if head.starts_with(b"\xff\x0a") || head.starts_with(b"\0\0\0\x0cJXL ") {
        return Some(JPEG_XL);
    }
    match head.get(4..12)?.split_at(4) {
        (b"ftyp", b"avif" | b"avis") => Some(AVIF),
        (b"ftyp", b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"mif1" | b"msf1") => Some(HEIC),
        (b"ftyp", b"crx ") => Some(RAW),
        _ => None,
    }
}

fn sentence(head: &[u8]) -> Option<&'static str> {
    let text = String::from_utf8_lossy(head).trim_start_matches('\u{feff}').trim_start().to_ascii_lowercase();
    if head.is_empty() {
        Some("it is empty: copy it again from where it comes from, or leave it out")
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        Some("it is a web page, not a picture: download the picture itself, or leave it out")
    } else if head.starts_with(b"GIF8") {
        Some("it is a GIF: give it a name that ends in .gif, and it is read as a video")
    } else if head.get(4..8) == Some(b"ftyp") {
        Some("it is a video: give it a name that ends in .mp4, and it is read as one")
    } else if head.starts_with(b"\x1a\x45\xdf\xa3") {
        Some("it is a video: give it a name that ends in .mkv, and it is read as one")
    } else if head.starts_with(b"RIFF") && head.get(8..12) == Some(b"AVI ") {
        Some("it is a video: give it a name that ends in .avi, and it is read as one")
    } else if head.starts_with(b"%PDF") {
        Some("it is a PDF, not a picture: save its picture as PNG")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_told_by_how_it_begins_whatever_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        for (bytes, words) in [
            (&b""[..], "it is empty"),
            (b"\xef\xbb\xbf\n<!DOCTYPE html><title>404</title>", "it is a web page"),
            (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "of the kind HEIC, which is not read here: save it as JPEG"),
            (b"\0\0\0\x18ftypavif\0\0\0\0", "AVIF"),
            (b"\0\0\0\x18ftypisom\0\0\0\0", "it is a video"),
            (b"\x1a\x45\xdf\xa3\x01\0\0\0", "it is a video: give it a name that ends in .mkv"),
            (b"RIFF\x24\0\0\0AVI LIST", "it is a video: give it a name that ends in .avi"),
            (b"GIF89a", "ends in .gif"),
        ] {
            std::fs::write(&path, bytes).unwrap();
            let said = by_content(&path).unwrap();
            assert!(said.contains(words), "{said}");
        }
        std::fs::write(&path, b"\xff\xd8\xff\xe0").unwrap();
        assert_eq!(by_content(&path), None);
    }
}
